# SPDX-License-Identifier: MIT
"""Extra axes of a path in space: C2 by arc length, exact at the points, without wild overshoot. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from hodograph.errors import InputError
from hodograph.feed import FeedRequest, Limits, plan_feed
from hodograph.native import NativeProgram
from hodograph.program import check, compile_program, encode
from hodograph.program.check import segment_faults
from hodograph.program.geometry import segment_arcs
from hodograph.spline.frames import LEFT, RIGHT, frames
from hodograph.spline.spatial import (
    SpatialPHSpline,
    spatial_from_control_polygon,
    spatial_through_points,
)

Real = NDArray[np.float64]


def helix(count: int) -> tuple[Real, Real]:
    """Points of one turn, and the angle there."""
    t = np.linspace(0.0, 2.0 * np.pi, count)
    return np.stack((20.0 * np.cos(t), 20.0 * np.sin(t), 2.0 * t), axis=1), t


def walk(seed: int, count: int, sigma: float) -> tuple[Real, Real]:
    """A random walk with legs of log-normal length, and three axes that jump at random."""
    rng = np.random.default_rng(seed)
    legs = np.exp(sigma * rng.standard_normal(count))[:, None]
    way = rng.standard_normal((count, 3)) + np.array([2.0, 0.0, 0.0])
    points = np.cumsum(legs * way / np.linalg.norm(way, axis=1)[:, None], axis=0)
    return points, np.cumsum(rng.uniform(-15.0, 15.0, (count, 3)), axis=0)


def joints(curve: SpatialPHSpline) -> tuple[Real, Real]:
    """First and second derivatives of the extra axes on both sides of the joints, (2, E, N - 1) each."""
    s = curve.segment_starts_mm[1:-1]
    sides = [frames(curve, s, np.full(s.size, side, dtype=np.int8)) for side in (LEFT, RIGHT)]
    return np.stack([one.r1[3:] for one in sides]), np.stack([one.r2[3:] for one in sides])


@pytest.mark.parametrize("sigma", [0.0, 1.0, 3.0])
def test_joints_are_c2_and_points_are_exact(sigma: float) -> None:
    points, values = walk(3, 40, sigma)
    curve = spatial_through_points(points, False, extra=values).spline
    assert np.array_equal(curve.axes_nodes[:, 3:], values)
    slope, bend = joints(curve)
    for left, right in (slope, bend):
        assert np.abs(left - right).max() < 1e-8 * max(1.0, np.abs(left).max())


def test_an_axis_that_follows_the_arc_length_is_exactly_linear() -> None:
    points, _ = walk(5, 12, 1.0)
    s = spatial_through_points(points, False).spline.segment_starts_mm
    curve = spatial_through_points(points, False, extra=np.stack((3.0 * s, 7.0 + 0 * s), 1)).spline
    at = np.linspace(0.0, curve.length_mm, 500)
    assert np.allclose(curve.extra_point(at), np.stack((3.0 * at, 7.0 + 0 * at), 1), atol=1e-10)


def test_a_smooth_axis_is_of_fourth_order() -> None:
    errors = []
    for count in (17, 33):
        points, t = helix(count)
        curve = spatial_through_points(points, False, extra=30.0 * np.sin(t)[:, None]).spline
        at = np.linspace(0.0, curve.length_mm, 999)
        exact = 30.0 * np.sin(2.0 * np.pi * at / curve.length_mm)
        errors.append(np.abs(curve.extra_point(at)[:, 0] - exact).max())
    assert errors[1] < min(errors[0] / 12.0, 1e-3)


def test_a_jump_beside_long_spans_does_not_overshoot() -> None:
    """The tool turns by 10 degrees within a micrometre, between spans of 10 mm."""
    points = np.array([[0, 0, 0], [10, 0, 0], [10.001, 0, 0], [20, 1, 0], [30, 0, 0.0]])
    values = np.array([[0], [0], [10], [10], [10.0]])
    curve = spatial_through_points(points, False, extra=values).spline
    a = curve.extra_point(np.linspace(0.0, curve.length_mm, 4001))
    assert -4.0 < a.min() < a.max() < 14.0


def test_a_standing_axis_stands() -> None:
    points, values = walk(2, 9, 0.5)
    values[:, 0] = -5.0
    values[3:7, 1] = 2.5
    curve = spatial_through_points(points, False, extra=values).spline
    assert np.all(curve.extra[:, 0] == -5.0)
    assert np.all(curve.extra[4, 1] == 2.5)


def test_closed_paths_and_polygons() -> None:
    points, t = helix(13)
    loop = points[:-1] * [1, 1, 0] + [0, 0, 1.0] * np.sin(2 * t[:-1])[:, None]
    value = 20.0 * np.cos(t[:-1])[:, None]
    for build in (spatial_through_points, spatial_from_control_polygon):
        curve = build(loop, True, extra=value).spline
        assert curve.extra.shape == (12, 1, 6)
        ends = curve.extra_point([0.0, curve.length_mm])[:, 0]
        assert ends[0] == pytest.approx(ends[1], abs=1e-12)
    opened = spatial_from_control_polygon(points, False, extra=np.stack((t, 2 * t), 1)).spline
    assert opened.extra_point([0.0, opened.length_mm])[:, 1] == pytest.approx([0, 4 * np.pi])


def test_an_axis_that_does_not_come_back_on_a_closed_path_is_refused() -> None:
    square = np.array([[0, 0, 0], [9, 0, 1], [9, 9, 0], [0, 9, 1], [0, 0, 0.0]])
    with pytest.raises(
        InputError, match=r"through point 4 repeats through point 0 .* number 4 is 360, not 0"
    ):
        spatial_through_points(square, True, extra=np.array([[0], [90], [180], [270], [360.0]]))


@pytest.mark.parametrize(("seed", "sigma"), [(1, 0.0), (2, 1.0), (4, 2.0)])
def test_both_checks_accept_the_joints(seed: int, sigma: float) -> None:
    points, values = walk(seed, 25, sigma)
    spline = spatial_through_points(points, False, extra=values).spline
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 2.0, 0.3), Limits())
    program = compile_program(spline, plan)
    assert program.axis_count == 6
    assert check(program) is None
    assert NativeProgram(encode(program)).check() is None


def test_both_checks_refuse_another_slope_and_a_gap() -> None:
    points, values = walk(1, 6, 0.0)
    spline = spatial_through_points(points, False, extra=values).spline
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 2.0, 0.3), Limits())
    for coefficient, change, code in ((0, 1 << 24, "JOIN_DIRECTION"), (4, 1 << 12, "JOIN_POINT")):
        program = compile_program(spline, plan)
        program.extra_q40[1, 2, coefficient] += change
        masks = segment_faults(program, segment_arcs(program.a_q44), None)
        assert {found.name for mask, _, found in masks if mask.any()} == {code}
        native = NativeProgram(encode(program)).check()
        found = check(program)
        assert native is not None
        assert found is not None
        assert found.code.name == code
        assert (native.code, native.index) == (found.code, found.index)


def test_a_segment_turns_by_what_the_format_holds() -> None:
    spline = spatial_through_points(
        [[0, 0, 0], [20, 1, 0], [40, 0, 1]], False, extra=np.array([[0], [2000], [4000.0]])
    ).spline
    assert np.abs(spline.split(31.0).extra[..., 5] - spline.split(31.0).extra[..., 0]).max() < 128
