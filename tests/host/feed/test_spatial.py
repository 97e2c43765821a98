# SPDX-License-Identifier: MIT
"""Feeds along curves in space: the frames, and that plans keep the limits of three axes. Run by pytest; starts and
writes nothing.
"""

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.feed import AxisLimits, FeedRequest, FeedZone, Limits, Plant, plan_path
from hodograph.feed.optimal import plan_optimal, plan_peaks
from hodograph.spline import PHSpline, through_points
from hodograph.spline.frames import LEFT, RIGHT, frames
from hodograph.spline.spatial import spatial_through_points
from hodograph.spline.spatial.curve import embedded
from spatial_curve import walk

XYZ = ("x", "y", "z")
SPACE = Limits(
    axis=AxisLimits((200.0, 200.0, 150.0), (2000.0,) * 3, (50000.0, 50000.0, 30000.0)), names=XYZ
)
PLANE = Limits(axis=AxisLimits((200.0,) * 2, (2000.0,) * 2, (50000.0,) * 2))


def planar(seed: int) -> PHSpline:
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.uniform(-0.8, 0.8, 12))
    return through_points(np.cumsum(rng.uniform(2, 9, 12) * np.exp(1j * turn)), False).spline


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_curve_has_the_same_frames_in_space(seed: int) -> None:
    flat = planar(seed)
    lifted = embedded(flat, 5.0)
    s = np.linspace(0.0, flat.length_mm, 400)
    one, other = frames(flat, s), frames(lifted, s)
    for name in ("r1", "r2", "r3"):
        own, same = getattr(one, name), getattr(other, name)
        assert np.abs(same[:2] - own).max() < 1e-13 * np.abs(own).max()
        assert not same[2].any()
    assert np.allclose(np.abs(one.curvature), other.curvature, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_frames_are_derivatives_by_arc_length(seed: int) -> None:
    curve = walk(seed)
    joints = curve.segment_starts_mm
    s = (0.5 * (joints[:-1] + joints[1:]))[:, None] + np.linspace(-0.2, 0.2, 5)
    h = 1e-3
    before, at, after = (frames(curve, s + step) for step in (-h, 0.0, h))
    slope = np.moveaxis(curve.point(s + h) - curve.point(s - h), -1, 0) / (2.0 * h)
    assert at.r1 == pytest.approx(slope, abs=1e-6)
    assert at.r2 == pytest.approx((after.r1 - before.r1) / (2.0 * h), abs=1e-5)
    assert at.r3 == pytest.approx((after.r2 - before.r2) / (2.0 * h), abs=1e-4)
    assert np.linalg.norm(at.r1, axis=0) == pytest.approx(1.0)
    assert at.curvature == pytest.approx(curve.curvature(s))


def test_frames_at_joints_are_of_the_side_asked_for() -> None:
    curve = walk(5)
    joints = curve.segment_starts_mm[1:-1]
    sides = [frames(curve, joints, np.full(joints.size, s, np.int8)) for s in (LEFT, RIGHT)]
    beside = [frames(curve, joints + step) for step in (-1e-6, 1e-6)]
    for own, near in zip(sides, beside, strict=True):
        assert own.r3 == pytest.approx(near.r3, abs=1e-4)
    assert np.abs(sides[0].r3 - sides[1].r3).max() > 1e-3
    assert sides[0].r2 == pytest.approx(sides[1].r2, abs=1e-9)


def test_a_plane_curve_takes_the_same_time_in_space() -> None:
    flat = planar(4)
    plan = plan_optimal(flat, FeedRequest("optimal"), PLANE)
    three = Limits(axis=AxisLimits((200.0,) * 3, (2000.0,) * 3, (50000.0,) * 3), names=XYZ)
    lifted = plan_optimal(embedded(flat, -3.0), FeedRequest("optimal"), three)
    assert lifted.duration_s == pytest.approx(plan.duration_s, rel=1e-6)


@pytest.mark.parametrize("axis", range(3))
def test_no_axis_is_special(axis: int) -> None:
    """A curve with its axes exchanged in turn takes the same time."""
    order = np.roll(np.arange(3), axis)
    curve = walk(7)
    turned = spatial_through_points(curve.nodal_points[:, order], False).spline
    one = plan_optimal(curve, FeedRequest("optimal"), SPACE)
    given = (
        tuple(np.array(own)[order])
        for own in (SPACE.axis.velocity_mm_s, SPACE.axis.acceleration_mm_s2, SPACE.axis.jerk_mm_s3)
    )
    other = plan_optimal(turned, FeedRequest("optimal"), Limits(axis=AxisLimits(*given), names=XYZ))
    assert other.duration_s == pytest.approx(one.duration_s, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("profile", ["optimal", "exponential", "minimax"])
def test_plans_keep_the_limits_of_every_axis(seed: int, profile: str) -> None:
    curve = walk(seed)
    plants = (Plant(130.0, 0.05, 5.0, 0.3), Plant(80.0, 0.04, 5.0), Plant(60.0, 0.06, 6.0))
    given = Limits(
        axis=SPACE.axis, names=("X1", "Y1", "Z1"), volts=5.0, zones=(FeedZone(10.0, 20.0, 25.0),)
    )
    request = FeedRequest(profile, 300.0, 0.2)
    plan = (plan_optimal if request.optimal else plan_path)(curve, request, given, None, plants)
    t = np.linspace(0.0, plan.duration_s, 20001)
    point = curve.point(np.clip(plan.arc_length(t), 0.0, curve.length_mm))
    step = t[1]
    assert given.axis.velocity_mm_s is not None
    assert given.axis.acceleration_mm_s2 is not None
    assert given.axis.jerk_mm_s3 is not None
    velocity, acceleration = np.diff(point, 1, axis=0) / step, np.diff(point, 2, axis=0) / step**2
    jerk = np.diff(point, 3, axis=0) / step**3
    assert (np.abs(velocity).max(axis=0) <= np.array(given.axis.velocity_mm_s) * 1.001).all()
    assert (np.abs(acceleration).max(axis=0) <= np.array(given.axis.acceleration_mm_s2)).all()
    assert (np.abs(jerk).max(axis=0) <= np.array(given.axis.jerk_mm_s3) * 1.01).all()
    peaks = plan_peaks(plan, curve, given, None, plants)
    names = {
        "axis.velocity_mm_s.Z1",
        "axis.acceleration_mm_s2.X1",
        "axis.jerk_mm_s3.Y1",
        "volts.Z1",
    }
    assert names <= set(peaks)
    assert max(peak.usage for peak in peaks.values()) <= 1.0005
    used = peaks["axis.velocity_mm_s.Z1"].value
    assert used == pytest.approx(np.abs(velocity[:, 2]).max(), rel=1e-2)


def test_a_free_axis_has_no_limit() -> None:
    limits = Limits(axis=AxisLimits(acceleration_mm_s2=(1000.0, 1000.0, np.inf)), names=XYZ)
    curve = walk(2)
    plan = plan_optimal(curve, FeedRequest("optimal", 80.0), limits)
    peaks = plan_peaks(plan, curve, limits, None, None)
    assert "axis.acceleration_mm_s2.z" not in peaks
    assert peaks["axis.acceleration_mm_s2.x"].usage <= 1.0005


def test_limits_are_for_as_many_axes_as_follow_the_path() -> None:
    curve = walk(1)
    with pytest.raises(InputError, match=r"has 2 values, the path has the axes x, y, z"):
        Limits(axis=PLANE.axis, names=XYZ)
    for make in (plan_optimal, plan_path):
        with pytest.raises(InputError, match=r"for the axes x, y, the path has 3 axes"):
            make(curve, FeedRequest("optimal"), PLANE)
    assert Limits(acceleration_mm_s2=5.0).of_axes(4).names == ("x", "y", "z", "a")
