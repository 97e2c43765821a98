# SPDX-License-Identifier: MIT
"""Evaluation: C2 joints, exact arc length and its inverse, greatest curvature, splitting. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from polygons import ALPHA, HEART, from_turns, smooth, uniform

from hodograph.errors import InputError, PlanError
from hodograph.spline import PHSpline, from_control_polygon, line
from hodograph.spline.bernstein import square_modulus

SEEDS = st.integers(0, 10**6)


def smooth_spline(seed):
    return from_control_polygon(*smooth(seed)).spline


def uniform_spline(seed):
    try:
        return from_control_polygon(*uniform(seed)).spline
    except PlanError:  # fewer than one in a thousand
        reject()


def second_derivative(spline, i, xi):
    w0, w1, w2 = spline.w[i].T
    w = w0 * (1 - xi) ** 2 + 2 * w1 * xi * (1 - xi) + w2 * xi**2
    return 2 * w * 2 * ((w1 - w0) * (1 - xi) + (w2 - w1) * xi)


@given(seed=SEEDS, build=st.sampled_from([smooth_spline, uniform_spline]))
def test_joints_are_c2_and_at_the_nodal_points(seed, build):
    spline = build(seed)
    n = spline.segment_count
    before = np.arange(n) if spline.closed else np.arange(n - 1)
    after = (before + 1) % n
    size = np.abs(spline.w).max() ** 2
    zero, one = np.zeros(before.size), np.ones(before.size)
    gap = np.abs(spline.position(before, one) - spline.origin[after])
    assert gap.max(initial=0) < 1e-13 * (size + np.abs(spline.origin).max())
    assert (
        np.abs(spline.hodograph(before, one) - spline.hodograph(after, zero)).max(initial=0)
        < 1e-13 * size
    )
    jump = second_derivative(spline, before, 1.0) - second_derivative(spline, after, 0.0)
    assert np.abs(jump).max(initial=0) < 1e-12 * size


@settings(max_examples=30)
@given(seed=SEEDS, build=st.sampled_from([smooth_spline, uniform_spline]))
def test_arc_length_is_the_integral_of_the_speed(seed, build):
    spline = build(seed)
    nodes, weights = np.polynomial.legendre.leggauss(5)  # exact for the quartic speed
    for end in (0.3, 1.0):
        xi = end * (nodes + 1) / 2
        speed = np.abs(spline.hodograph(np.arange(spline.segment_count)[:, None], xi[None]))
        quadrature = speed @ weights * end / 2
        exact = spline.arc_length(
            np.arange(spline.segment_count), np.full(spline.segment_count, end)
        )
        np.testing.assert_allclose(exact, quadrature, rtol=1e-12)


def test_arc_length_against_50_digits():
    spline = from_control_polygon(HEART, True).spline
    with mpmath.workdps(50):
        for i in (0, 3, 7):
            w = [mpmath.mpc(complex(c)) for c in spline.w[i]]

            def speed(x, w=w):
                value = w[0] * (1 - x) ** 2 + 2 * w[1] * x * (1 - x) + w[2] * x * x
                return abs(value) ** 2

            exact = mpmath.quad(speed, [0, 1])
            assert abs(spline.segment_lengths_mm[i] - exact) < 1e-14 * exact


@settings(max_examples=50)
@given(seed=SEEDS, build=st.sampled_from([smooth_spline, uniform_spline]))
def test_inverse_of_arc_length(seed, build):
    spline = build(seed)
    s = np.sort(np.random.default_rng(seed).uniform(0, spline.length_mm, 500))
    segment, xi = spline.locate(s)
    assert np.all((xi >= 0) & (xi <= 1))
    back = spline.segment_starts_mm[segment] + spline.arc_length(segment, xi)
    assert np.abs(back - s).max() < 1e-13 * spline.length_mm
    assert np.all(np.diff(segment + xi) >= 0)  # monotone


@given(seed=SEEDS)
def test_arc_length_grows_strictly(seed):
    spline = uniform_spline(seed)
    i = np.repeat(np.arange(spline.segment_count), 50)
    xi = np.tile(np.linspace(0, 1, 50), spline.segment_count)
    s = spline.arc_length(i, xi).reshape(-1, 50)
    assert np.all(np.diff(s, axis=1) > 0)


def test_points_by_arc_length_have_the_right_spacing_and_tangent():
    spline = from_control_polygon(ALPHA, False).spline
    s = np.linspace(0, spline.length_mm, 20_001)
    points, step = spline.point(s), s[1]
    chord = np.abs(np.diff(points))
    assert np.all(chord <= step * (1 + 1e-9))
    assert np.all(chord >= step * (1 - (0.13 * step) ** 2 / 23))  # sagitta at curvature 0.13 / mm
    tangent = spline.tangent(s)
    np.testing.assert_allclose(np.abs(tangent), 1, atol=1e-15)
    central = (points[2:] - points[:-2]) / (2 * step)
    assert np.abs(central - tangent[1:-1]).max() < 1e-6
    turn = np.diff(np.unwrap(np.angle(tangent))) / step
    assert np.abs(turn - spline.curvature((s[1:] + s[:-1]) / 2)).max() < 1e-6


def test_shapes_of_arguments_are_kept():
    spline = from_control_polygon(HEART, True).spline
    assert spline.point(3.0).shape == ()
    assert spline.point([1.0, 2.0]).shape == (2,)
    assert spline.curvature(np.ones((2, 3))).shape == (2, 3)
    assert spline.locate(np.zeros((0,)))[1].shape == (0,)


@pytest.mark.parametrize("s", [-1.0, 1e9, float("nan"), float("inf")])
def test_arc_lengths_outside_are_refused(s):
    spline = from_control_polygon(HEART, True).spline
    with pytest.raises(InputError, match="outside the path"):
        spline.point([1.0, s])


def test_the_ends_are_exact():
    spline = from_control_polygon(ALPHA, False).spline
    assert spline.point(0.0) == 0
    assert abs(spline.point(spline.length_mm) - 18j) < 1e-13
    closed = from_control_polygon(HEART, True).spline
    assert abs(closed.point(closed.length_mm) - closed.point(0.0)) < 1e-13


@settings(max_examples=20)
@given(seed=SEEDS, build=st.sampled_from([smooth_spline, uniform_spline]))
def test_greatest_curvature_is_not_below_any_sample_and_is_reached(seed, build):
    spline = build(seed)
    greatest = spline.max_curvature_per_mm()
    i = np.arange(spline.segment_count)[:, None]
    sampled = np.abs(spline.curvature_at(i, np.linspace(0, 1, 501)[None]))
    assert sampled.max() <= greatest * (1 + 1e-12)
    at = np.unravel_index(sampled.argmax(), sampled.shape)
    near = np.clip(at[1] / 500 + np.linspace(-1, 1, 20_001) / 500, 0, 1)
    assert np.abs(spline.curvature_at(at[0], near)).max() > greatest * (1 - 1e-3)


def test_greatest_curvature_of_a_line_and_of_a_cusp():
    assert line(0, 30 + 40j).max_curvature_per_mm() < 1e-15
    cusp = PHSpline(np.zeros(1, complex), np.array([[1, -1, 1 + 0.5j]], complex), False)
    assert np.isfinite(cusp.max_curvature_per_mm())
    cusp = PHSpline(np.zeros(1, complex), np.array([[1, 0, 1j]], complex), False)
    assert np.isfinite(cusp.max_curvature_per_mm())
    stop = PHSpline(np.zeros(1, complex), np.array([[-1, 0, 1]], complex), False)
    with pytest.raises(PlanError, match="span 0"):
        stop.split(32.0)


@settings(max_examples=40)
@given(
    seed=SEEDS, build=st.sampled_from([smooth_spline, uniform_spline]), limit=st.floats(0.5, 100)
)
def test_split_keeps_the_curve_and_its_limits(seed, build, limit):
    spline = build(seed)
    pieces = spline.split(limit)
    sigma = square_modulus(pieces.w)
    assert sigma.min() > 0
    assert np.all(sigma.max(axis=1) < 2 * sigma.min(axis=1))
    assert pieces.segment_lengths_mm.max() <= limit
    assert pieces.closed == spline.closed
    assert abs(pieces.length_mm - spline.length_mm) < 1e-12 * spline.length_mm
    s = np.linspace(0, spline.length_mm, 300)
    size = np.abs(spline.origin).max() + np.abs(spline.w).max() ** 2
    # near a near-cusp a difference of arc length moves the point by as much, no more
    assert np.abs(pieces.point(s) - spline.point(s)).max() < 1e-12 * (size + spline.length_mm)
    assert np.isin(spline.origin, pieces.origin).all()


def test_split_leaves_what_is_fine_and_refuses_nonsense():
    spline = line(0, 30)
    assert spline.split(32.0).segment_count == 1
    assert spline.split(29.0).segment_count == 2
    for arguments in ((0.0, 2.0), (-1.0, 2.0), (float("nan"), 2.0), (32.0, 1.0)):
        with pytest.raises(InputError):
            spline.split(*arguments)


def test_line():
    spline = line(1 + 1j, 4 + 5j)
    assert abs(spline.length_mm - 5) < 1e-15
    assert abs(spline.point(2.5) - (2.5 + 3j)) < 1e-15
    with pytest.raises(InputError):
        line(1j, 1j)
    with pytest.raises(InputError):
        line(0, complex("nan"))


@given(
    turns=st.lists(st.floats(-1.2, 1.2), min_size=2, max_size=30),
    size=st.floats(1e-3, 1e3),
    angle=st.floats(0, 6.28),
)
def test_scaling_rotation_and_translation(turns, size, angle):
    p = from_turns(10 + np.arange(len(turns) + 1) % 3, np.array(turns))
    one = from_control_polygon(p, False).spline
    motion = size * np.exp(1j * angle)
    other = from_control_polygon(motion * p + 3 - 4j, False).spline
    assert abs(other.length_mm - size * one.length_mm) < 1e-11 * size * one.length_mm + 1e-13
    s = np.linspace(0, 1, 57)
    moved = motion * one.point(s * one.length_mm) + 3 - 4j
    assert (
        np.abs(other.point(s * other.length_mm) - moved).max()
        < 1e-11 * size * one.length_mm + 1e-12
    )


@given(seed=SEEDS)
def test_reversal_gives_the_same_curve_backwards(seed):
    p, closed = smooth(seed)
    one = from_control_polygon(p, closed).spline
    other = from_control_polygon(p[::-1], closed).spline
    assert abs(one.length_mm - other.length_mm) < 1e-10 * one.length_mm
    forward, backward = one.nodal_points, other.nodal_points[::-1]
    if not closed:
        np.testing.assert_allclose(forward, backward, atol=1e-9)
        s = np.linspace(0, one.length_mm, 101)
        distance = np.abs(
            one.point(s) - other.point(np.clip(other.length_mm - s, 0, other.length_mm))
        )
        assert distance.max() < 1e-9 * one.length_mm
    else:
        a, b = np.sort(one.segment_lengths_mm), np.sort(other.segment_lengths_mm)
        np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9)


@given(seed=SEEDS)
def test_mirrored_polygons_give_mirrored_curves(seed):
    p, closed = smooth(seed)
    one, other = (from_control_polygon(q, closed).spline for q in (p, np.conj(p)))
    s = np.linspace(0, min(one.length_mm, other.length_mm), 101)
    assert np.abs(np.conj(one.point(s)) - other.point(s)).max() < 1e-9 * one.length_mm


@given(half=st.lists(st.floats(0.05, 1.2), min_size=2, max_size=12))
def test_symmetric_polygons_give_symmetric_curves(half):
    right = from_turns(np.full(len(half) + 1, 10.0), np.array(half)) * 1j + 30
    p = np.concatenate((right, -np.conj(right[::-1])))  # mirrored at the y axis
    spline = from_control_polygon(p, False).spline
    s = np.linspace(0, spline.length_mm, 101)
    points = spline.point(s)
    assert np.abs(points + np.conj(points[::-1])).max() < 1e-8 * spline.length_mm


def test_starting_a_closed_polygon_elsewhere_gives_the_same_loop():
    one = from_control_polygon(HEART, True).spline
    other = from_control_polygon(np.roll(HEART, -3), True).spline
    s = np.linspace(0, one.length_mm, 101)
    shifted = (s + one.segment_starts_mm[3]) % one.length_mm
    assert np.abs(other.point(s[:-1]) - one.point(shifted[:-1])).max() < 1e-10
