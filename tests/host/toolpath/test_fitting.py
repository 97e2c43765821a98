# SPDX-License-Identifier: MIT
"""Curves of toolpaths: continuity, the certificate beside sampled distances, times, and what noise does."""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.feed import AxisLimits, FeedRequest, Limits
from hodograph.feed.optimal import plan_optimal
from hodograph.spline.spatial import SpatialPHSpline
from hodograph.toolpath.fit.certificate import certify
from hodograph.toolpath.fit.chain import Segments, with_lines
from hodograph.toolpath.fit.corners import SHAPES, SHARPEST_RAD, corners, extent
from hodograph.toolpath.fit.fitting import FittedPath, Tolerance, fit
from hodograph.toolpath.fit.reference import (
    Reference,
    arc_points,
    distance_to_chord,
    spline_points,
)
from hodograph.toolpath.fit.speeds import MotionLimits
from hodograph.toolpath.moves import ArcMove, Feed, FeedMode, Plane, SplineMove

LIMITS = MotionLimits(200.0, 2000.0, 50000.0)
FEED = Feed(FeedMode.PER_MINUTE, 100.0)
TOLERANCE_MM = 0.01


def reference(points: np.ndarray, sag_mm: float = 0.0) -> Reference:
    count = len(points) - 1
    full = np.zeros((len(points), 3))
    full[:, : points.shape[1]] = points
    return Reference(full, np.arange(1, count + 1), np.full(count, np.inf), np.full(count, sag_mm))


def fitted(points: np.ndarray, tolerance_mm: float = TOLERANCE_MM) -> FittedPath:
    found = fit(reference(points), Tolerance(tolerance_mm, LIMITS))
    assert isinstance(found, FittedPath)
    return found


def staircase(legs: int, length_mm: float) -> np.ndarray:
    steps = np.zeros((legs, 2))
    steps[::2, 0] = steps[1::2, 1] = length_mm
    return np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def wave(count: int) -> np.ndarray:
    t = np.linspace(0.0, 2.0 * np.pi, count)
    return np.stack((20.0 * np.cos(t), 14.0 * np.sin(t), 2.0 * np.sin(3.0 * t)), axis=1)


def random_walk(seed: int, space: bool) -> np.ndarray:
    rng = np.random.default_rng(seed)
    axes = 3 if space else 2
    turn = rng.normal(size=(40, axes))
    direction = np.cumsum(turn * rng.choice([0.05, 0.4, 1.5], size=(40, 1)), axis=0) + 1.0
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    steps = direction * 10.0 ** rng.uniform(-1.5, 1.0, size=(40, 1))
    return np.vstack((np.zeros((1, axes)), np.cumsum(steps, axis=0)))


def is_smooth(curve: SpatialPHSpline) -> bool:
    """Whether points, tangents and curvature vectors meet at all joints."""
    count = curve.segment_count
    ends = []
    for xi, segments in ((1.0, np.arange(count - 1)), (0.0, np.arange(1, count))):
        at = np.full(count - 1, xi)
        hodograph = curve.hodograph(segments, at)
        bends = 4.0 * np.diff(curve.hodograph_coefficients, axis=2)
        second = bends[segments, :, 3 if xi else 0]
        speed = np.linalg.norm(hodograph, axis=1)[:, None]
        ends.append(
            (
                curve.position(segments, at),
                hodograph / speed,
                np.cross(hodograph, second) / speed**3,
            )
        )
    (p, t, k), (q, u, j) = ends
    bend = np.abs(k).max(initial=1e-9)
    return bool(
        np.abs(p - q).max(initial=0.0) < 2.0**-36
        and np.abs(t - u).max(initial=0.0) < 1e-8
        and np.abs(k - j).max(initial=0.0) < 1e-6 * bend
    )


def sampled_distance(path: FittedPath) -> float:
    """Greatest distance between dense samples of one path and the other, both ways."""
    curve, points = path.curve, path.reference.point
    xi = np.linspace(0.0, 1.0, 17)
    samples = curve.position(np.arange(curve.segment_count)[:, None], xi[None, :]).reshape(-1, 3)
    there = distance_to_chord(samples[:, None], points[None, :-1], points[None, 1:]).min(axis=1)
    share = np.linspace(0.0, 1.0, 9)[:, None, None]
    own = (points[:-1] + share * np.diff(points, axis=0)).reshape(-1, 3)
    back = distance_to_chord(own[:, None], samples[None, :-1], samples[None, 1:]).min(axis=1)
    return float(max(there.max(), back.max()))


def least_time_s(path: FittedPath, feed_mm_s: float = 200.0) -> float:
    axes = AxisLimits((200.0,) * 3, (2000.0,) * 3, (50000.0,) * 3)
    limits = Limits(machine=axes, names=("x", "y", "z"))
    return plan_optimal(path.curve, FeedRequest("optimal", feed_mm_s), limits).duration_s


@pytest.mark.parametrize("shape", range(len(SHAPES)))
def test_corner_curves_use_their_tolerance_and_are_straight_at_their_ends(shape: int) -> None:
    turn = np.linspace(0.05, SHARPEST_RAD, 23)
    found = corners(SHAPES[shape], turn)
    assert np.allclose(found.reach, extent(turn, shape), rtol=2e-2)
    for k, angle in enumerate(turn.tolist()):
        legs = np.array([[-10.0, 0.0], [0.0, 0.0], [10.0 * np.cos(angle), 10.0 * np.sin(angle)]])
        scale = 10.0 / found.reach[k] * 0.9
        joint = found.joint[k] * scale
        flat = np.stack((joint.real, joint.imag, np.zeros(joint.size)), axis=1)
        w = found.w[k] * np.sqrt(scale)
        zero = np.zeros_like(w.real)
        curve = SpatialPHSpline(
            flat[:-1], np.stack((w.real, zero, zero, w.imag), axis=1), closed=False
        )
        assert np.abs(curve.nodal_points[-1] - flat[-1]).max() < 1e-9
        assert float(curve.curvature_at(0, 0.0)) < 1e-9
        assert float(curve.curvature_at(curve.segment_count - 1, 1.0)) < 1e-9
        begin, end = flat[0], flat[-1]
        points = np.vstack((begin[:2], legs[1], end[:2]))
        legs_only = reference(points)
        place = np.linspace(0.0, float(legs_only.place_mm[-1]), curve.segment_count + 1)
        certificate = certify(curve, place, legs_only, 1.01 * scale)
        path = FittedPath(legs_only, curve, place, certificate)
        assert 0.99 * scale <= sampled_distance(path) <= 1.001 * scale


@pytest.mark.parametrize("space", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_random_paths_are_smooth_and_certified(seed: int, space: bool) -> None:
    points = random_walk(seed, space)
    found = fit(reference(points), Tolerance(TOLERANCE_MM, LIMITS))
    if not isinstance(found, FittedPath):
        pytest.fail(f"no curve around chords {found.chord}")
    assert is_smooth(found.curve)
    assert sampled_distance(found) <= found.deviation_mm <= TOLERANCE_MM
    assert (
        np.abs(found.curve.nodal_points[[0, -1], : points.shape[1]] - points[[0, -1]]).max() < 1e-9
    )
    assert np.all(np.diff(found.place_mm) > 0.0)


def test_a_single_line_is_kept_exactly() -> None:
    found = fitted(np.array([[0.0, 0.0, 1.0], [3.0, 4.0, 13.0]]))
    assert found.curve.segment_count == 1
    assert found.deviation_mm < 1e-7
    assert found.curve.length_mm == pytest.approx(13.0, rel=1e-14)


def test_points_on_a_line_are_one_segment() -> None:
    points = np.outer(np.linspace(0.0, 1.0, 501), [30.0, 40.0])
    assert fitted(points).curve.segment_count == 1


def test_the_certificate_is_the_distance_of_a_shifted_line() -> None:
    programmed = reference(np.array([[0.0, 0.0], [40.0, 0.0], [100.0, 0.0]]))
    shifted = np.array([0.0, 0.007, 0.0])
    none = Segments(*(np.zeros(s) for s in ((0, 3), (0, 3), (0, 4, 3), (0,), (0,))))
    line = with_lines(none, shifted, shifted + np.array([100.0, 0.0, 0.0]), 100.0)
    curve = SpatialPHSpline(line.origin, line.preimage, closed=False)
    place = np.array([0.0, 100.0])
    for tolerance, most in ((0.1, 0.1), (0.01, 0.01), (0.00701, 0.00701), (0.005, np.inf)):
        assert 0.007 <= certify(curve, place, programmed, tolerance).worst_mm <= most
    beyond = certify(curve, place, reference(np.array([[0.0, 0.0], [100.0, 0.02]])), 0.01)
    assert 0.013 <= beyond.worst_mm <= 0.015


def test_corners_take_less_time_than_stops() -> None:
    stairs = fitted(staircase(5, 10.0))
    leg = fitted(np.array([[0.0, 0.0], [10.0, 0.0]]))
    saved_s = 5.0 * least_time_s(leg) - least_time_s(stairs)
    assert saved_s > 4 * 0.023  # 25 ms a corner is what limited jerk allows at 10 um


def test_chords_of_a_smooth_curve_are_passed_at_full_feed() -> None:
    found = fitted(wave(300))
    assert is_smooth(found.curve)
    assert found.curve.segment_count < 300
    assert least_time_s(found, 60.0) < found.curve.length_mm / 60.0 + 0.12


@pytest.mark.parametrize("points", [wave(240), np.pad(staircase(6, 4.0), ((0, 0), (0, 1)))])
def test_noise_of_a_micrometre_changes_the_time_by_less_than_a_percent(points: np.ndarray) -> None:
    plain = least_time_s(fitted(points), 100.0)
    for seed in (1, 2):
        noise = np.random.default_rng(seed).uniform(-0.001, 0.001, size=(len(points), 2))
        noisy = points.copy()
        noisy[:, :2] += noise
        assert least_time_s(fitted(noisy), 100.0) == pytest.approx(plain, rel=0.01)


@pytest.mark.parametrize("turns", [1, -1, 3])
def test_arc_points_are_within_their_sag(turns: int) -> None:
    start = (12.0, 5.0, 0.0, 0.0, 0.0, 0.0)
    move = ArcMove(1, (5.0, 12.0, 3.0, 0.0, 0.0, 0.0), Plane.XY, (0.0, 0.0), turns, FEED)
    points, sag = arc_points(start, move, 1e-4)
    assert sag <= 1e-4
    middle = 0.5 * (points[1:] + points[:-1])
    assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 13.0, atol=1e-12)
    assert (13.0 - np.hypot(middle[:, 0], middle[:, 1])).max() <= sag
    angle = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert np.sign(angle[-1] - angle[0]) == np.sign(turns)
    assert int(np.ceil(abs(angle[-1] - angle[0]) / (2.0 * np.pi))) == abs(turns)


def test_spline_points_lie_on_a_rational_circle() -> None:
    corner = np.sqrt(0.5)
    points = tuple(
        (x, y, 0.0, 0.0, 0.0, 0.0)
        for x, y in ((7.0, 0.0), (7.0, 7.0), (0.0, 7.0), (-7.0, 7.0), (-7.0, 0.0))
    )
    knots = (0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0)
    move = SplineMove(1, points, (1.0, corner, 1.0, corner, 1.0), knots, 2, FEED)
    found, sag = spline_points(move, 1e-4)
    assert sag <= 1e-4
    assert np.allclose(np.hypot(found[:, 0], found[:, 1]), 7.0, atol=1e-12)
    middle = 0.5 * (found[1:] + found[:-1])
    assert (7.0 - np.hypot(middle[:, 0], middle[:, 1])).max() <= sag
