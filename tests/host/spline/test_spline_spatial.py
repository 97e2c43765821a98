# SPDX-License-Identifier: MIT
"""Splines in space: C2, interpolation, rotations, planar and straight data, degenerate input, accuracy, linear time.
Run by pytest; starts and writes nothing.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polygons import ALPHA, HEART, helix, smooth, torus_knot, walk
from scipy.interpolate import BSpline, CubicSpline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from hodograph.errors import InputError, PlanError
from hodograph.spline import KNOT_NAMES, from_control_polygon, through_points
from hodograph.spline.knots import KnotSpans, knot_spans
from hodograph.spline.newton import continued, newton
from hodograph.spline.spatial import spatial_from_control_polygon, spatial_through_points
from hodograph.spline.spatial.banded import solve_blocks, solve_ring
from hodograph.spline.spatial.frame import guide_frame
from hodograph.spline.spatial.guide import SpaceEnd, points_guide, polygon_guide
from hodograph.spline.spatial.quality import guide_shape, spline_shape
from hodograph.spline.spatial.quaternion import (
    across_fibre,
    along_fibre,
    left,
    phase_between,
    polar,
    root,
    turned,
)
from hodograph.spline.spatial.system import SpaceSystem, cubic_end, tangent_end
from marks import long


def lengths(p, closed):
    return np.linalg.norm(np.diff(np.vstack((p, p[:1])) if closed else p, axis=0), axis=1)


def joint_jumps(spline, knots):
    """Jumps of r' and r'' by the spline's parameter at the joints, relative to their sizes."""
    length = knots.length[:, None]
    hodograph = np.moveaxis(spline.hodograph_coefficients, -1, 0) / length
    bends = 4 * np.diff(hodograph, axis=0) / length
    out = []
    for start, end in ((hodograph[0], hodograph[-1]), (bends[0], bends[-1])):
        jump = np.roll(start, -1, axis=0) - end
        out.append(np.abs(jump if spline.closed else jump[:-1]).max(initial=0) / np.abs(end).max())
    return out


# Quaternions and their systems


@given(seed=st.integers(0, 10**6))
def test_a_root_has_its_vector_and_the_polar_form_its_matrix(seed):
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(20, 3))
    vectors[:6] = [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1], [-3, 1e-12, 0], [0, 0, 0]]
    a = root(vectors)
    np.testing.assert_allclose(polar(a, a), vectors, atol=1e-14)
    np.testing.assert_allclose(np.sum(a * a, axis=1), np.linalg.norm(vectors, axis=1), atol=1e-14)
    b = rng.normal(size=(20, 4))
    np.testing.assert_allclose((left(a) @ b[:, :, None])[..., 0], polar(a, b), atol=1e-14)
    phi = rng.uniform(-3, 3, 20)
    np.testing.assert_allclose(polar(turned(b, phi), turned(b, phi)), polar(b, b), atol=1e-13)
    np.testing.assert_allclose(phase_between(b, turned(b, phi)), phi, atol=1e-13)
    gram = np.concatenate((across_fibre(b), along_fibre(b)[..., None]), axis=-1)
    size = np.sum(b * b, axis=1)[:, None, None]
    np.testing.assert_allclose(np.moveaxis(gram, 1, 2) @ gram, size * np.eye(4), atol=1e-13)


@pytest.mark.parametrize("count", [3, 4, 9])
def test_block_systems_are_solved(count):
    rng = np.random.default_rng(count)
    lower, diagonal, upper = rng.normal(size=(3, count, 3, 3))
    diagonal += 6 * np.eye(3)
    x = rng.normal(size=(count, 3))
    times = lambda blocks, y: (blocks @ y[:, :, None])[..., 0]  # noqa: E731
    ring = (
        times(lower, np.roll(x, 1, axis=0))
        + times(diagonal, x)
        + times(upper, np.roll(x, -1, axis=0))
    )
    np.testing.assert_allclose(solve_ring(lower, diagonal, upper, ring), x, atol=1e-12)
    ring[0] -= lower[0] @ x[-1]
    ring[-1] -= upper[-1] @ x[0]
    np.testing.assert_allclose(solve_blocks(lower, diagonal, upper, ring), x, atol=1e-12)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [3, 8])
def test_newton_steps_solve_the_linear_part(closed, count):
    rng = np.random.default_rng(count)
    knots = KnotSpans.of(rng.uniform(0.4, 2, count), closed)
    system = SpaceSystem(
        rng.normal(size=(count, 3)),
        knots,
        rng.normal(size=(count, 4)),
        tangent_end(rng.normal(size=4)),
        cubic_end(float(knots.before[-1])),
        0.7 if closed else None,
    )
    unknown, direction = system.first_guess, rng.normal(size=(count, 3))
    change = (system.residual(unknown + direction) - system.residual(unknown - direction)) / 2
    np.testing.assert_allclose(
        system.newton_step(unknown, -change), direction, rtol=1e-6, atol=1e-6
    )


def test_continuation_finds_what_newton_finds():
    p = walk(3, 2.0)
    knots = knot_spans(lengths(p, False), "chord", False)
    free = SpaceEnd.chosen("cubic", None, "start_tangent", False)
    guide = points_guide(p, False, free, free, knots)
    chords, length = np.diff(p, axis=0), knots.length[:, None]
    frame = guide_frame(guide.hodograph / length[:, :, None], chords / length)
    system = SpaceSystem(chords, knots, frame.middle)
    one = newton(system, system.first_guess)
    other = continued(system, system.first_guess)
    assert one.converged
    assert other.converged
    np.testing.assert_allclose(other.z, one.z, atol=1e-11)


# Guides


def test_guides_are_scipys_splines():
    p = walk(1, 2.0)
    knots = np.clip(np.arange(-3.0, len(p) + 1.0), 0, len(p) - 3)
    reference = BSpline(knots, p, 3)
    guide = polygon_guide(p, False)
    spans = np.arange(len(p) - 3)
    np.testing.assert_allclose(guide.nodal_points[:-1], reference(spans), atol=1e-12)
    np.testing.assert_allclose(
        guide.hodograph[..., 0][1:], reference.derivative()(spans[1:]), atol=1e-11
    )
    closed = np.vstack((torus_knot(14), torus_knot(14)[:1]))
    spans = knot_spans(lengths(torus_knot(14), True), "chord", True)
    at = np.concatenate(([0], np.cumsum(spans.length)))
    periodic = CubicSpline(at, closed, bc_type="periodic").derivative()
    free = SpaceEnd.chosen("cubic", None, "start_tangent", True)
    found = points_guide(torus_knot(14), True, free, free, spans).hodograph[..., 0]
    np.testing.assert_allclose(found, periodic(at[:-1]) * spans.length[:, None], atol=1e-10)


# The curve


@given(seed=st.integers(0, 10**6), name=st.sampled_from(KNOT_NAMES), closed=st.booleans())
def test_paths_through_points_are_c2_and_pass_them(seed, name, closed):
    """Uniform knots may be refused: the leg that closes a walk is long beside its neighbours."""
    p = walk(seed, 1.3)
    try:
        spline = spatial_through_points(p, closed, knots=name).spline
    except PlanError:
        assert (name, closed) == ("uniform", True)
        return
    first, second = joint_jumps(spline, knot_spans(lengths(p, closed), name, closed))
    assert first < 1e-9
    assert second < 1e-9
    np.testing.assert_allclose(spline.nodal_points[: len(p)], p, atol=1e-10)
    every = np.arange(spline.segment_count)
    ends = spline.position(every, np.ones(every.size))
    np.testing.assert_allclose(ends, spline.nodal_points[1:], atol=1e-10)
    speed = np.linalg.norm(spline.hodograph(every, 0.3 + 0 * every), axis=-1)
    np.testing.assert_allclose(speed, spline.speed(every, 0.3 + 0 * every), rtol=1e-12)


@given(seed=st.integers(0, 10**6), closed=st.booleans())
def test_control_polygons_give_c2_curves_near_their_b_spline(seed, closed):
    p = walk(seed, 1.3)
    result = spatial_from_control_polygon(p, closed)
    spans = result.spline.segment_count
    assert max(joint_jumps(result.spline, KnotSpans.of(np.ones(spans), closed))) < 1e-9
    assert result.newton_iterations <= 6
    assert result.bending_ratio < 1.05
    if not closed:
        legs = 3 * np.diff(p, axis=0)[[0, -1]]
        ends = result.spline.hodograph([0, spans - 1], [0.0, 1.0])
        np.testing.assert_allclose(ends, legs, atol=1e-10)


@given(seed=st.integers(0, 10**6), closed=st.booleans())
def test_turning_the_points_turns_the_curve(seed, closed):
    p = walk(seed, 1.3)
    turn = Rotation.random(random_state=seed)
    one = spatial_through_points(p, closed).spline
    other = spatial_through_points(turn.apply(p), closed).spline
    s = np.linspace(0, 1, 60)
    np.testing.assert_allclose(
        other.point(s * other.length_mm), turn.apply(one.point(s * one.length_mm)), atol=1e-8
    )


def test_a_closed_curve_does_not_depend_on_where_it_starts_or_which_way_it_goes():
    p = torus_knot(20)
    one = spatial_through_points(p, True).spline
    rolled = spatial_through_points(np.roll(p, -7, axis=0), True).spline
    back = spatial_through_points(p[::-1], True).spline
    np.testing.assert_allclose(
        np.roll(one.position_coefficients, -7, axis=0), rolled.position_coefficients, atol=1e-10
    )
    np.testing.assert_allclose(back.length_mm, one.length_mm, rtol=1e-12)
    np.testing.assert_allclose(
        back.position_coefficients[0, :, ::-1], one.position_coefficients[-2], atol=1e-10
    )


@pytest.mark.parametrize("ends", ["cubic", "natural"])
@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_ends(ends, count):
    p = helix(8)[:count]
    spline = spatial_through_points(p, False, ends).spline
    a = spline.preimage[[0, -1]]
    if ends == "natural" or count == 2:
        assert spline.curvature_at([0, count - 2], [0.0, 1.0]).max() < 1e-14
    else:
        assert np.abs(a[..., 0] - 2 * a[..., 1] + a[..., 2]).max() < 1e-12


def test_end_tangents_are_kept():
    directions = [[0, 0, 2.0], [-1.0, 0, 0]]
    spline = spatial_through_points(helix(8), False, "cubic", *directions).spline
    tangents = spline.tangent([0, spline.length_mm])
    np.testing.assert_allclose(tangents, [[0, 0, 1], [-1, 0, 0]], atol=1e-12)
    two = spatial_through_points(
        [[0, 0, 0], [10, 0, 0]], False, "cubic", [0, 0, 1], [0, 0, -1]
    ).spline
    np.testing.assert_allclose(two.tangent([0, two.length_mm]), [[0, 0, 1], [0, 0, -1]], atol=1e-12)
    assert two.max_curvature_per_mm() < 1


# Planar data


def test_points_of_one_height_give_the_planar_spline_bit_for_bit():
    for polygon, closed in ((ALPHA, False), (HEART, True), smooth(3), smooth(4)):
        flat = np.stack((polygon.real, polygon.imag, np.full(polygon.size, 2.5)), axis=-1)
        for planar, space in (
            (from_control_polygon(polygon, closed), spatial_from_control_polygon(flat, closed)),
            (through_points(polygon, closed), spatial_through_points(flat, closed)),
        ):
            u, v, p, q = np.moveaxis(space.spline.preimage, 1, 0)
            np.testing.assert_array_equal(u + 1j * q, planar.spline.w)
            assert not np.stack((v, p)).any()
            np.testing.assert_array_equal(space.spline.origin[:, 2], 2.5)
            assert space.newton_iterations == planar.newton_iterations


@given(seed=st.integers(0, 10**6))
def test_a_tilted_plane_gives_the_planar_curve_in_it(seed):
    polygon, closed = smooth(seed)
    planar = from_control_polygon(polygon, closed).spline
    turn = Rotation.random(random_state=seed)
    flat = np.stack((polygon.real, polygon.imag, 0 * polygon.real), axis=-1)
    found = spatial_from_control_polygon(turn.apply(flat), closed).spline
    s = np.linspace(0, 1, 50)
    expected = planar.point(s * planar.length_mm)
    back = turn.inv().apply(found.point(s * found.length_mm))
    size = np.abs(polygon).max()
    np.testing.assert_allclose(back[:, 0] + 1j * back[:, 1], expected, atol=1e-9 * size)
    assert np.abs(back[:, 2]).max() < 1e-9 * size


# Degenerate input


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -1], [-1, 0, 0], [1, 2, 3], [-2, 1, -5]])
def test_points_on_a_line_give_the_line(direction):
    along = np.array([0, 1, 1.5, 7, 7.25, 30])
    p = along[:, None] * np.array(direction, dtype=float)
    for name, bend in (("centripetal", 1e-12), ("chord", 1e-15)):
        spline = spatial_through_points(p, False, knots=name).spline
        assert spline.max_curvature_per_mm() < bend
        np.testing.assert_allclose(spline.length_mm, np.linalg.norm(p[-1]), rtol=1e-14)
        assert not spline.torsion(np.linspace(0, spline.length_mm, 9)).any()
    if not direction[0] or not direction[2]:
        assert not spline.position_coefficients[:, np.array(direction) == 0].any()  # exactly


@pytest.mark.parametrize("knots", KNOT_NAMES)
@pytest.mark.parametrize("along", [[0, 10, 0], [0, 10, 0, 10], [0, 10, 20, 10, 0], [0, 10, 3, 8]])
@pytest.mark.parametrize("direction", [[2, 1, 1], [0, 0, 1]])
def test_paths_that_turn_back_on_themselves_are_solved(knots, along, direction):
    p = np.array(along)[:, None] * np.array(direction, dtype=float)
    result = spatial_through_points(p, False, knots=knots)
    np.testing.assert_allclose(result.spline.nodal_points, p, atol=1e-12)
    assert result.spline.max_curvature_per_mm() < 10
    assert result.newton_iterations <= 6


@pytest.mark.parametrize("knots", KNOT_NAMES)
def test_vertical_turns(knots):
    """Tangents that pass the directions +x and -x, where a root changes its form."""
    t = np.linspace(0, 2 * np.pi, 17)[:-1]
    loop = np.stack((10 * np.cos(t), 0 * t, 10 * np.sin(t)), axis=-1)
    result = spatial_through_points(loop, True, knots=knots)
    radius = np.linalg.norm(
        result.spline.point(np.linspace(0, result.spline.length_mm, 99)), axis=1
    )
    assert np.ptp(radius) < 0.01
    assert result.newton_iterations <= 4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([[0, 0, 0]], False), "1 through points"),
        (([[0, 0, 0], [5, 0, 1]], True), "at least 3"),
        (([[0, 0, 0], [0, 0, 0], [5, 5, 5]], False), r"repeats through point 0 at \(0, 0, 0\)"),
        (([[0, 0, 0], [5, 5, float("inf")]], False), "not finite"),
        (([[0, 0, 0], [5, 5, 2e9]], False), "beyond 1e"),
        (([[0, 0], [5, 5]], False), r"\[x, y, z\]"),
        ((helix(8), False, "clamped"), "ends"),
        ((helix(8), False, "cubic", [0, 0, 0]), "start_tangent must be three finite"),
        ((helix(8), False, "cubic", None, [0, 1]), "end_tangent must be three finite"),
        ((helix(8), True, "cubic", [0, 1, 0]), "open paths"),
        ((helix(8), False, "cubic", None, None, "even"), "knots"),
    ],
)
def test_bad_points_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        spatial_through_points(*arguments)


@pytest.mark.parametrize("seeds", [range(25), long(range(25, 85))])
def test_wild_points_are_solved_or_refused_naming_the_span(seeds):
    refusals, results = [], []
    for seed in seeds:
        try:
            results.append(spatial_through_points(walk(seed, np.pi, 3.0), False, knots="uniform"))
        except PlanError as error:
            refusals.append(str(error))
    assert results
    assert refusals
    assert all("span " in text for text in refusals)


# Quality


@pytest.mark.parametrize("sigma", [None, 1.0, 2.0, 3.0])
def test_random_walks_with_any_turns_converge_within_six_steps(sigma):
    results = [spatial_through_points(walk(seed, np.pi, sigma), False) for seed in range(80)]
    assert max(result.newton_iterations for result in results) <= 6
    assert np.median([result.bending_ratio for result in results]) < 0.8
    assert max(result.bending_ratio for result in results) < 1.1


def test_order_of_approximation_of_a_helix():
    errors = []
    for per_turn in (16, 32, 64):
        spline = spatial_through_points(helix(per_turn), False).spline
        s = np.linspace(0.25, 0.75, 1001) * spline.length_mm
        p = spline.point(s)
        errors.append(
            (
                np.abs(np.hypot(p[:, 0], p[:, 1]) - 20).max(),
                np.abs(spline.curvature(s) - 20 / 404).max(),
                np.abs(spline.torsion(s) - 2 / 404).max(),
            )
        )
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[:, 0].min() > 3.8
    assert orders[:, 1:].min() > 1.9


def test_order_of_approximation_of_a_torus_knot():
    exact = torus_knot(400_000)
    along = np.roll(exact, -1, axis=0) - exact
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    nearest, errors = cKDTree(exact), []
    for count in (48, 96, 192):
        spline = spatial_through_points(torus_knot(count), True).spline
        p = spline.point(np.linspace(0, spline.length_mm, 4001)[:-1])
        at = nearest.query(p)[1]
        errors.append(np.linalg.norm(np.cross(p - exact[at], along[at]), axis=1).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 3.5


def test_figures_of_shape_are_those_of_a_fine_sum():
    spline = spatial_through_points(walk(5, 2.0), False).spline
    shape = spline_shape(spline.preimage)
    xi = (np.arange(4000) + 0.5) / 4000
    for k in range(spline.segment_count):
        curvature, speed = (f(np.full(xi.size, k), xi) for f in (spline.curvature_at, spline.speed))
        np.testing.assert_allclose(shape.bending[k], np.mean(curvature**2 * speed), rtol=1e-2)
        np.testing.assert_allclose(shape.turning[k], np.mean(curvature * speed), rtol=3e-2)
    back = np.array([[[1.0, 0.1, -1.0], [0, 0, 0], [0, 0, 0]]])
    np.testing.assert_allclose(guide_shape(back).turning, np.pi)


def test_torsion_and_greatest_curvature():
    spline = spatial_through_points(helix(24), False).spline
    s = np.linspace(0, spline.length_mm, 20_001)
    assert spline.max_curvature_per_mm() >= spline.curvature(s).max() * (1 - 1e-12)
    np.testing.assert_allclose(spline.max_curvature_per_mm(), spline.curvature(s).max(), rtol=1e-3)
    mirrored = spatial_through_points(helix(24) * [1, 1, -1], False).spline
    np.testing.assert_allclose(mirrored.torsion(s), -spline.torsion(s), atol=1e-9)


def test_splitting_keeps_the_curve():
    spline = spatial_through_points(torus_knot(12), True).spline
    parts = spline.split(5.0, 1.5)
    s = np.linspace(0, spline.length_mm, 300)
    assert parts.segment_count > spline.segment_count
    np.testing.assert_allclose(parts.point(s), spline.point(s), atol=1e-11)
    sigma = parts.speed_coefficients
    assert (sigma.max(axis=1) <= 1.5 * sigma.min(axis=1)).all()
    assert parts.segment_lengths_mm.max() <= 5.0


@pytest.mark.serial
def test_many_points_take_linear_time():
    def best(count):
        times = []
        for closed in (False, True, False, True):
            begin = time.process_time()
            spatial_through_points(count / 24 * torus_knot(count, 2, 9), closed)
            times.append(time.process_time() - begin)
        return min(times) / count

    small, large = best(1000), best(40_000)
    assert large < 3 * small
