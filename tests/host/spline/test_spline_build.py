# SPDX-License-Identifier: MIT
"""Public functions: the paper's curves, random polygons, through points, refusals, linear time. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polygons import ALPHA, HEART, smooth, uniform

from hodograph.errors import InputError, PlanError
from hodograph.spline import from_control_polygon, through_points
from hodograph.spline.bernstein import rotation
from hodograph.spline.newton import newton
from hodograph.spline.nodal import control_polygon_guide
from hodograph.spline.quality import Shape
from hodograph.spline.start import followed_branch, starting_values
from hodograph.spline.system import System, clamped_end
from hodograph.spline.verdict import EXTRA_TURNING_RAD
from marks import long


def turning_number(spline):
    return 2 * rotation(spline.w).sum() / (2 * np.pi)


def crosses_itself(spline, count=2000):
    """Any two sampled chords that are not neighbours cross."""
    p = spline.point(np.linspace(0, spline.length_mm, count))
    a, b = p[:-1], p[1:]
    side = lambda u, v, w: ((v - u) * np.conj(w - u)).imag  # noqa: E731
    one = side(a[:, None], b[:, None], a[None]) * side(a[:, None], b[:, None], b[None]) < 0
    both = one & one.T
    i, j = np.nonzero(both)
    return bool(np.any((np.abs(i - j) > 1) & (np.abs(i - j) < count - 2)))


def attempted(polygons):
    """Results, and the messages of those that were refused."""
    results, refusals = [], []
    for p, closed in polygons:
        try:
            results.append(from_control_polygon(p, closed))
        except PlanError as error:
            refusals.append(str(error))
    return results, refusals


def test_alpha_of_the_paper():
    result = from_control_polygon(ALPHA, False)
    spline = result.spline
    assert spline.segment_count == 4
    np.testing.assert_allclose(
        spline.nodal_points, [0, 23 + 21.75j, 32 + 9j, 23 - 3.75j, 18j], atol=1e-13
    )
    assert result.newton_iterations <= 5
    assert abs(spline.length_mm - 99.9415515) < 1e-6
    # w(0)^2 = 3 (P1 - P0): tangents of the B-spline
    np.testing.assert_allclose(spline.hodograph(0, 0.0), 3 * (ALPHA[1] - ALPHA[0]), atol=1e-12)
    np.testing.assert_allclose(spline.hodograph(3, 1.0), 3 * (ALPHA[6] - ALPHA[5]), atol=1e-12)
    assert crosses_itself(spline)  # as an alpha does


def test_heart_of_the_paper_is_a_simple_loop():
    result = from_control_polygon(HEART, True)
    assert result.spline.segment_count == 8
    assert abs(abs(turning_number(result.spline)) - 1) < 1e-12
    assert not crosses_itself(result.spline)
    assert result.newton_iterations <= 5
    assert abs(result.spline.nodal_points[0] - (-20 - 35j) / 6) < 1e-14
    # symmetric about the x axis, which span 0 crosses at its middle
    length, middle = result.spline.length_mm, result.spline.segment_lengths_mm[0] / 2
    way = np.linspace(0, length / 2, 101)
    there, back = (result.spline.point((middle + d) % length) for d in (way, -way))
    assert np.abs(there - np.conj(back)).max() < 1e-11


def test_a_thousand_smooth_polygons():
    results = [from_control_polygon(*smooth(seed)) for seed in range(1000)]
    iterations = np.array([r.newton_iterations for r in results])
    assert np.median(iterations) <= 5
    assert iterations.max() <= 10
    assert max(r.extra_turning_rad for r in results) < np.pi
    assert max(r.bending_ratio for r in results) < 1.05
    assert all(r.changed_sides == 0 for r in results)


@pytest.mark.parametrize("seeds", [range(300), long(range(300, 1300))])
def test_uniformly_random_polygons(seeds):
    results, refusals = attempted(uniform(seed) for seed in seeds)
    assert len(refusals) <= 1
    assert all("span " in text for text in refusals)
    assert all(np.isfinite(r.spline.w).all() for r in results)
    assert max(r.extra_turning_rad for r in results) <= EXTRA_TURNING_RAD
    assert max(r.newton_iterations for r in results) <= 60


def test_turning_numbers_of_closed_curves_are_whole():
    for seed in range(200):
        p, closed = uniform(seed)
        if closed:
            turns = turning_number(from_control_polygon(p, True).spline)
            assert abs(turns - round(turns)) < 1e-9


@pytest.mark.parametrize("count", [3, 4, 5, 6, 12, 100])
def test_regular_polygons_give_round_loops(count):
    p = 100 * np.exp(2j * np.pi * np.arange(count) / count)
    result = from_control_polygon(p, True)
    assert abs(turning_number(result.spline) - 1) < 1e-12
    radius = np.abs(result.spline.point(np.linspace(0, result.spline.length_mm, 500)))
    assert np.ptp(radius) < {3: 2.5}.get(count, 0.7)


def test_pentagram_keeps_its_two_turns():
    p = 100 * np.exp(4j * np.pi * np.arange(5) / 5)
    assert abs(turning_number(from_control_polygon(p, True).spline) - 2) < 1e-12


def test_figure_of_eight_has_turning_number_zero():
    t = 2 * np.pi * np.arange(16) / 16
    spline = from_control_polygon(100 * np.sin(t) + 50j * np.sin(2 * t), True).spline
    assert abs(turning_number(spline)) < 1e-12


def test_straight_and_evenly_spaced_is_a_line():
    result = from_control_polygon(np.arange(10.0) * 7, False)
    assert result.spline.max_curvature_per_mm() < 1e-14
    assert abs(result.spline.length_mm - 63) < 1e-12


@pytest.mark.parametrize("count", range(4, 12))
def test_a_path_that_retraces_itself_is_solved(count):
    p = np.where(np.arange(count) % 2 == 0, 0.0, 10.0)
    result = from_control_polygon(p, False)
    spline = result.spline
    guide = control_polygon_guide(p, False).nodal_points
    np.testing.assert_allclose(spline.nodal_points, guide, atol=1e-12)
    every = np.arange(count - 3)
    np.testing.assert_allclose(spline.position(every, np.ones(count - 3)), guide[1:], atol=1e-12)
    assert result.newton_iterations <= 6
    assert result.extra_turning_rad <= EXTRA_TURNING_RAD


def test_wildly_uneven_legs_are_solved_decently_or_refused_naming_the_span():
    def wild(seed):
        rng = np.random.default_rng(seed)
        return np.cumsum(np.exp(3 * rng.normal(size=20) + 2j * np.pi * rng.uniform(size=20))), False

    results, refusals = attempted(wild(seed) for seed in range(40))
    assert results
    assert refusals
    assert all("span " in text for text in refusals)
    assert max(r.extra_turning_rad for r in results) <= EXTRA_TURNING_RAD


# Through points

POINTS = np.array([0, 10 + 5j, 20, 30 + 8j, 42 - 3j])


def second(spline, i, xi):
    w0, w1, w2 = spline.w[i]
    w = w0 * (1 - xi) ** 2 + 2 * w1 * xi * (1 - xi) + w2 * xi * xi
    return 4 * w * ((w1 - w0) * (1 - xi) + (w2 - w1) * xi)


@pytest.mark.parametrize("ends", ["cubic", "natural"])
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_open_paths_go_through_their_points(ends, count):
    spline = through_points(POINTS[:count], False, ends).spline
    np.testing.assert_allclose(spline.nodal_points, POINTS[:count], atol=1e-12)
    if ends == "natural" or count == 2:
        assert abs(spline.curvature_at(0, 0.0)) < 1e-14
        assert abs(spline.curvature_at(count - 2, 1.0)) < 1e-14
    else:
        for i in (0, count - 2):
            assert abs(spline.w[i, 0] - 2 * spline.w[i, 1] + spline.w[i, 2]) < 1e-13


def test_end_tangents_give_the_direction_whatever_their_length():
    for size in (1e-6, 1.0, 1e6):
        spline = through_points(POINTS, False, start_tangent=size * 1j, end_tangent=-size).spline
        np.testing.assert_allclose(spline.tangent([0, spline.length_mm]), [1j, -1], atol=1e-12)
    one = through_points(POINTS, False, "natural", start_tangent=1 + 1j).spline
    np.testing.assert_allclose(one.tangent(0.0), (1 + 1j) / np.sqrt(2), atol=1e-12)
    assert abs(one.curvature_at(3, 1.0)) < 1e-14


def test_a_tangent_is_kept_where_the_free_end_would_stand_still():
    spline = through_points([0, 1, 4], False, start_tangent=1j).spline  # free: r'(0) = 0
    np.testing.assert_allclose(spline.tangent(0.0), 1j, atol=1e-12)
    assert spline.max_curvature_per_mm() < 100


def test_closed_paths_go_through_their_points():
    p = 50 * np.exp(2j * np.pi * np.arange(7) / 7)
    spline = through_points(p, True).spline
    np.testing.assert_allclose(spline.nodal_points, np.append(p, p[0]), atol=1e-12)
    assert abs(turning_number(spline) - 1) < 1e-12
    assert abs(spline.max_curvature_per_mm() - 0.02) < 5e-4
    assert abs(second(spline, 6, 1.0) - second(spline, 0, 0.0)) < 1e-11


@given(seed=st.integers(0, 10**6), ends=st.sampled_from(["cubic", "natural"]))
def test_through_the_nodal_points_of_a_smooth_polygon(seed, ends):
    p, closed = smooth(seed)
    polygon = from_control_polygon(p, closed).spline
    given_points = polygon.nodal_points[:-1] if closed else polygon.nodal_points
    spline = through_points(given_points, closed, ends, knots="uniform").spline
    if closed:
        np.testing.assert_allclose(np.abs(spline.w), np.abs(polygon.w), rtol=1e-8, atol=1e-10)
    else:
        np.testing.assert_allclose(spline.nodal_points, given_points, atol=1e-10)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([0], False), "1 through points"),
        (([0, 5], True), "at least 3"),
        (([0, 0, 5], False), "repeats"),
        ((POINTS, False, "clamped"), "ends"),
        ((POINTS, False, "cubic", 0j), "start_tangent"),
        ((POINTS, False, "cubic", None, complex("nan")), "end_tangent"),
        ((POINTS, True, "cubic", 1j), "open"),
    ],
)
def test_bad_through_points_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        through_points(*arguments)


@pytest.mark.serial
def test_a_hundred_thousand_points_take_linear_time():
    def best(count):
        t = np.arange(count) / count
        p = count * (1 + 0.3 * np.cos(14 * np.pi * t)) * np.exp(2j * np.pi * t)
        times = []
        for closed in (False, True, False, True):
            begin = time.process_time()
            from_control_polygon(p, closed)
            times.append(time.process_time() - begin)
        return min(times) / count

    small, large = best(1000), best(100_000)
    assert large < 3 * small


def other_solutions(p, closed):
    """Bending energies of what Newton finds from every choice of signs of the starting values."""
    guide = control_polygon_guide(p, closed)
    branch = followed_branch(guide.hodograph)
    z = starting_values(guide.hodograph, branch)
    chords = np.diff(guide.nodal_points)
    ends = guide.hodograph[0, 0], guide.hodograph[-1, 2]
    for signs in itertools.product((1, -1), repeat=z.size):
        if closed:
            systems = [System(chords, cyclic_sign=e) for e in (1, -1)]
        else:
            a, b = (complex(np.sqrt(end)) for end in ends)
            systems = [System(chords, clamped_end(a), clamped_end(e * b)) for e in (1, -1)]
        for system in systems:
            found = newton(system, z * signs)
            if found.converged:
                yield float(Shape(system.coefficients(found.z), 2).bending.sum())


def test_no_other_choice_of_signs_bends_less():
    tried = 0
    for seed in range(400):
        p, closed = smooth(seed)
        if not 4 <= p.size <= 9 or (p.size > 7 and closed):
            continue
        own = float(Shape(from_control_polygon(p, closed).spline.w, 2).bending.sum())
        energies = list(other_solutions(p, closed))
        assert len(energies) > 4
        assert min(energies) > own * (1 - 1e-9), seed
        tried += 1
    assert tried >= 8


def test_through_points_of_random_polygons():
    iterations = []
    for seed in range(150):
        for polygon, ends in ((smooth, "cubic"), (smooth, "natural"), (uniform, "cubic")):
            result = through_points(*polygon(seed), ends)
            assert result.extra_turning_rad <= EXTRA_TURNING_RAD
            if polygon is smooth:
                iterations.append(result.newton_iterations)
    assert np.median(iterations) <= 5
    assert max(iterations) <= 10
