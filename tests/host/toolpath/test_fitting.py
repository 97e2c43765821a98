# SPDX-License-Identifier: MIT
"""Curves of toolpaths: continuity, the certificate compared with sampled distances, times, and effects of noise. Run by
pytest; reads programs of LinuxCNC, which the first use downloads to build/linuxcnc.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from hodograph.feed import AxisLimits, FeedRequest, Limits
from hodograph.feed.optimal import plan_optimal
from hodograph.spline.spatial import SpatialPHSpline
from hodograph.toolpath.fit import fitting
from hodograph.toolpath.fit.certificate import ROUNDING_MM, certify
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
from hodograph.toolpath.fit.stations import Outline, outline, turns
from hodograph.toolpath.gcode import read_gcode
from hodograph.toolpath.moves import ArcMove, Feed, FeedMode, Plane, SplineMove, StraightMove
from linuxcnc import programs
from marks import long

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
    assert found.deviation_mm < 1.001 * ROUNDING_MM
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


def rounded_rectangle(chord_mm: float) -> np.ndarray:
    """100 x 60 mm with arcs of 5 mm, from the middle of a side."""
    turn = np.linspace(-0.5, 0.0, round(2.5 * np.pi / chord_mm) + 1) * np.pi
    corner = 5.0 * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    centres = np.array([[45.0, 5.0], [45.0, 55.0], [-45.0, 55.0], [-45.0, 5.0]])
    points = [[[0.0, 0.0]]]
    for k, centre in enumerate(centres):
        points.append(corner @ np.linalg.matrix_power(quarter, k).T + centre)
    points.append([[0.0, 0.0]])
    outline = np.vstack(points)
    place = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1)))
    even = np.union1d(np.arange(0.0, place[-1], chord_mm), place)
    even = even[np.append(True, np.diff(even) > 0.1 * chord_mm)]
    return np.stack([np.interp(even, place, column) for column in outline.T], axis=1)


def walls() -> np.ndarray:
    """Rows over a surface with steep walls; some points are 8 um apart, also on straight lines."""
    rows = [(0.0, 0.0), (2.9, 0.0), (3.16, -0.24), (3.32, -0.5), (3.392, -0.9), (3.4, -1.03)]
    rows += [(3.4, -14.0), (9.5, -14.0), (9.65, -14.0), (10.025, -14.0), (10.267, -14.0)]
    rows += [(10.275, -14.0), (10.603, -14.0), (10.611, -1.9), (10.619, -1.8), (10.66, -1.53)]
    rows += [(10.71, -1.26), (10.9, -0.35), (11.4, 0.4), (12.5, 1.1), (20.0, 1.1), (20.008, 1.1)]
    rows += [(20.016, -14.0), (20.3, -14.0), (23.3, -14.0), (40.0, -14.0)]
    y, z = np.array(rows).T
    return np.stack((np.zeros_like(y), y, z), axis=1)


NOISY = {
    "wave": (wave(240), 0.01),
    "staircase": (np.pad(staircase(6, 4.0), ((0, 0), (0, 1))), 0.01),
    "rectangle": (np.pad(rounded_rectangle(0.06), ((0, 0), (0, 1))), 0.02),
    "walls": (walls(), 0.01),
}
"""Points, and by how much noise may change the time. Chords of 0.06 mm turn by more than the arc does: the goal of 1 %
is missed there, by half a percent.
"""


@pytest.mark.parametrize("feed_mm_s", [100.0, long(200.0)])
@pytest.mark.parametrize("name", NOISY)
def test_noise_of_a_micrometre_hardly_changes_the_time(name: str, feed_mm_s: float) -> None:
    points, share = NOISY[name]
    plain = least_time_s(fitted(points), feed_mm_s)
    moving = np.ptp(points, axis=0) > 0.0
    for seed in (1, 2, 3):
        noise = np.random.default_rng(seed).uniform(-0.001, 0.001, size=points.shape)
        noisy = least_time_s(fitted(points + moving * noise), feed_mm_s)
        assert noisy == pytest.approx(plain, rel=share), seed


@pytest.mark.parametrize(
    ("chord_mm", "noise_mm", "share"),
    [(0.005, 0.003, 0.01), (0.01, 0.003, 0.01), (0.002, 0.002, 0.07)],
)
def test_noise_larger_than_the_chords_changes_the_time_a_little(
    chord_mm: float, noise_mm: float, share: float
) -> None:
    """Without care it would be several times as long."""
    turn = np.linspace(0.0, 0.5 * np.pi, round(1.5 * np.pi / chord_mm) + 1)
    points = 3.0 * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    noise = np.random.default_rng(4).uniform(-noise_mm, noise_mm, size=points.shape)
    found = fitted(points + noise)
    assert sampled_distance(found) <= found.deviation_mm <= TOLERANCE_MM
    assert least_time_s(found) == pytest.approx(least_time_s(fitted(points)), rel=share)


def test_hooks_within_the_tolerance_take_no_time() -> None:
    """The path goes back by 3 um every half a mm."""
    places = np.arange(0.5, 10.0, 0.5)
    way = np.append(np.stack((places, places - 0.003), axis=1).ravel(), 10.0)
    found = fitted(np.stack((np.append(0.0, way), np.zeros(way.size + 1)), axis=1))
    assert found.curve.segment_count == 1
    assert 0.0015 <= found.deviation_mm <= TOLERANCE_MM


def test_a_dense_zigzag_beside_a_straight_line_is_passed_like_one() -> None:
    """Its chords are longer than the leg that replaces them: places of both do not count alike."""
    steps = np.arange(1200)
    first = np.stack((0.001 * steps, 0.001 * (steps % 2)), axis=1)
    last = first[-1] + [[0.0, 2.0], [3.0, 2.0]]
    points = np.vstack((first, last))
    found = fitted(points)
    assert found.curve.segment_count < 20
    assert sampled_distance(found) <= found.deviation_mm <= TOLERANCE_MM


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["3D_Chips.ngc", "spiral.ngc"])
def test_noise_on_programs_of_linuxcnc(name: str, seed: int) -> None:
    program = next(path for path in programs() if path.name == name)
    lines = program.read_text(encoding="utf-8", errors="surrogateescape").splitlines()[:2000]
    moves = [move for move in read_gcode([*lines, "M2"], name) if isinstance(move, StraightMove)]
    points = np.array([move.end[:3] for move in moves])
    points = points[np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))]
    noise = np.random.default_rng(seed).uniform(-0.001, 0.001, size=points.shape)
    moving = np.ptp(points, axis=0) > 0.0
    plain, noisy = (
        sum(least_time_s(one, 100.0) for one in fitted_sections(each))
        for each in (points, points + moving * noise)
    )
    assert noisy == pytest.approx(plain, rel=0.01)


def fitted_sections(points: np.ndarray) -> list[FittedPath]:
    """The curves between the turns that are stops."""
    stop = np.flatnonzero(turns(points) > SHARPEST_RAD)
    ends = [0, *stop.tolist(), len(points) - 1]
    return [fitted(points[a : b + 1]) for a, b in itertools.pairwise(ends)]


def test_stretches_beside_a_vertex_without_room_do_not_overlap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A point on a straight line, at the end of an arc: the leg after it belongs to the next stretch too."""

    def without_room(*given: object) -> Outline:
        found = outline(*given)  # type: ignore[arg-type]
        last = np.flatnonzero(~found.anchored[:-1] & found.anchored[1:]) + 1
        reach = found.coarse_reach_mm.copy()
        reach[last] = 0.0
        return replace(found, coarse_reach_mm=reach)

    plain = fitted(rounded_rectangle(0.5))
    monkeypatch.setattr(fitting, "outline", without_room)
    found = fitted(rounded_rectangle(0.5))
    assert np.all(np.diff(found.place_mm) > 0.0)
    assert least_time_s(found, 100.0) < 1.2 * least_time_s(plain, 100.0)


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
