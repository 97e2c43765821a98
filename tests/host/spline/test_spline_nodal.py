# SPDX-License-Identifier: MIT
"""Nodal points and the guide's hodograph against scipy's B-splines; what input is refused. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from hodograph.errors import InputError
from hodograph.spline import from_control_polygon, through_points
from hodograph.spline.nodal import checked_points, control_polygon_guide


def random_points(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=n) * 50 + 1j * rng.normal(size=n) * 50


def value(coefficients, xi):
    a, b, c = coefficients.T
    return a * (1 - xi) ** 2 + 2 * b * xi * (1 - xi) + c * xi**2


@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 9, 30, 1000])
def test_open_nodal_points_and_hodograph_are_the_clamped_b_splines(count):
    p = random_points(count)
    spans = count - 3
    knots = np.clip(np.arange(-3.0, spans + 4.0), 0, spans)
    reference = BSpline(knots, p, 3)
    guide = control_polygon_guide(p, False)
    assert guide.nodal_points.size == spans + 1
    np.testing.assert_allclose(guide.nodal_points, reference(np.arange(spans + 1.0)), atol=1e-12)
    slope = reference.derivative()
    for xi in (0.0, 0.3, 0.5, 0.9):
        got = value(guide.hodograph, xi)
        np.testing.assert_allclose(got, slope(np.arange(spans) + xi), atol=1e-11)


@pytest.mark.parametrize("count", [3, 4, 5, 8, 100])
def test_closed_nodal_points_and_hodograph_are_the_periodic_b_splines(count):
    p = random_points(count)
    wrapped = np.concatenate((p, p[:3]))
    reference = BSpline(np.arange(-3.0, count + 4.0), wrapped, 3)
    guide = control_polygon_guide(p, True)
    assert guide.nodal_points[0] == guide.nodal_points[-1]
    np.testing.assert_allclose(guide.nodal_points, reference(np.arange(count + 1.0)), atol=1e-12)
    slope = reference.derivative()
    got = value(guide.hodograph, 0.4)
    np.testing.assert_allclose(got, slope(np.arange(count) + 0.4), atol=1e-11)


def test_paper_formulas_5_for_the_heart_start():
    heart = [-20 - 50j, 5j, -5j, -20 + 50j, 40 + 50j, 75 - 5j, 75 + 5j, 40 - 50j]
    assert (
        abs(control_polygon_guide(np.array(heart), True).nodal_points[0] - (-20 - 35j) / 6) < 1e-14
    )


def test_a_hundred_thousand_points():
    t = np.arange(100_000) / 100_000
    p = 1e5 * np.exp(2j * np.pi * t)
    guide = control_polygon_guide(p, False)
    assert guide.nodal_points.size == 99_998
    np.testing.assert_allclose(guide.nodal_points[2:-2], p[3:-3], atol=1e-4)


@pytest.mark.parametrize(
    ("points", "closed", "words"),
    [
        ([[0, 0], [1, 0], [2, 1]], False, ["3 control points", "an open", "at least 4"]),
        ([[0, 0], [1, 0]], True, ["2 control points", "at least 3"]),
        ([[0, 0], [1, 0], [1, 0], [2, 1], [5, 5]], False, ["control point 2", "repeats", "1"]),
        ([[0, 0], [1e-13, 0], [2, 1], [5, 5]], False, ["control point 1", "repeats", "0"]),
        ([[0, 0], [1, 0], [2, 1], [0, 0]], True, ["last control point", "first"]),
        ([[0, 0], [1, 0], [2, 1], [0, 0], [1, 0]], True, ["last two control points", "first two"]),
        ([[0, 0], [1, 0], [float("nan"), 1], [3, 3]], False, ["control point 2", "finite"]),
        ([[0, 0], [1, 0], [1, float("inf")], [3, 3]], True, ["control point 2", "finite"]),
        ([[0, 0], [1, 0, 3], [1, 1], [3, 3]], False, ["[x, y]"]),
        ([[0, 0], ["a", 0], [1, 1], [3, 3]], False, ["[x, y]"]),
        ([["0", "0"], ["1", "0"], ["1", "1"], ["3", "3"]], False, ["[x, y]"]),
        ([[False, True], [True, True], [True, False], [False, False]], True, ["[x, y]"]),
        ([[0, 0], [10**400, 0], [1, 1], [3, 3]], False, ["[x, y]"]),
        ([[0, 0], [1, 0], [1, 1e10], [3, 3]], False, ["control point 2", "units"]),
        ([[0, 0], [1e-10, 0], [0, 1e-10], [1e-10, 1e-10]], True, ["repeats"]),
        ([], False, ["0 control points"]),
        (7.0, False, ["[x, y]"]),
    ],
)
def test_bad_polygons_are_refused_naming_the_place(points, closed, words):
    with pytest.raises(InputError) as caught:
        from_control_polygon(points, closed)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@given(count=st.integers(3, 20), seed=st.integers(0, 10**6))
def test_a_repeated_tail_is_dropped_with_a_note(count, seed):
    p = random_points(count, seed)
    again, notes = checked_points(np.concatenate((p, p[:3])), True, 3, "control point")
    np.testing.assert_array_equal(again, p)
    assert len(notes) == 1
    assert "3 control points" in notes[0]
    again, notes = checked_points(np.append(p, p[0]), True, 3, "through point")
    np.testing.assert_array_equal(again, p)
    assert len(notes) == 1
    rounded = np.concatenate((p, p[:3] + 1e-14))
    again, notes = checked_points(rounded, True, 3, "control point")
    assert (again.size, len(notes)) == (count, 1)
    untouched, notes = checked_points(p, True, 3, "control point")
    assert (untouched.size, notes) == (count, ())


def test_the_note_reaches_the_result():
    square = [0, 100, 100 + 100j, 100j]
    assert from_control_polygon([*square, *square[:3]], True).notes
    assert from_control_polygon(square, True).notes == ()
    assert through_points([*square, square[0]], True).notes


def test_points_may_be_complex_or_pairs():
    pairs = from_control_polygon([[0, 0], [10, 0], [20, 10], [20, 30]], False).spline
    numbers = from_control_polygon([0, 10, 20 + 10j, 20 + 30j], False).spline
    np.testing.assert_array_equal(pairs.w, numbers.w)
