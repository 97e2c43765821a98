# SPDX-License-Identifier: MIT
"""From a programmed path to a curve of continuous curvature within a certified tolerance. Used by many modules of
host_tools: jobs, the Python API and the pipeline of sections. No I/O.

Theory: docs/theory/toolpath-fitting.md.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import HodographError
from ...spline.spatial import SpatialPHSpline, spatial_through_points
from ...spline.spatial.curve import hodograph_of
from .certificate import ROUNDING_MM, Certificate, certify
from .chain import Segments, corner_segments, straightened, with_lines
from .corners import SHAPES, extent
from .reference import Reference
from .smoothing import Stations, smoothed
from .speeds import MotionLimits, speeds
from .stations import Outline, Places, outline, stations, tightened

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_CORNER_SHARE, _ROOM_SHARE = 0.985, 0.985
"""Shares of the tolerance for corner curves, and for stations of smoothed stretches."""

_LEG_SHARE = 0.98
"""Share of a leg that the corners at its two ends may use together."""
_STRAIGHT_ROOM = 10.0
"""Usable leg length, in tolerances, of a vertex without change of direction, where a stretch may end."""

_ENDS = 8.0
"""Length of a long leg that a stretch uses, in multiples of the usable leg length of the vertex there."""

_BARRIER = 3e-7
"""Barrier of the last minimum of the smoothing."""
_POWER = 5
"""Power of the speed in the weights of the smoothing."""
_ROUNDS = 8
"""Rounds of smoothing, each with the speeds of the last one."""
_REPAIRS = 12
"""How often the fit is made again with less deviation at places that exceed the tolerance."""
_MOST_FOR_CHOICE = 20_000
"""Greatest number of chords of a section for which alternatives are compared."""
_SLOW_SHARES = (0.5, 0.25)
"""Greatest speeds of further estimates, as shares of the speed above which acceleration and not jerk limits the
motion.
"""

_LESS_ROOM = (0.95, 0.95, 0.95, 0.75)
"""Factors on the bounds of stations where a curve was outside the tolerance: in the first rounds of repair, and in
later ones. In the first rounds the new stations help; lower bounds cost time.
"""
_THIN_SHARE = 0.01
"""Points nearer than this share of the tolerance to the chord of the adjacent points are omitted."""
_THIN_ROUNDS = 4
"""How often points are left out."""


@dataclass(frozen=True, eq=False)
class FittedPath:
    """A curve from rest to rest, and how it belongs to the programmed path.

    curve         at most `certificate.worst_mm` from the reference, and vice versa
    place_mm      (segments + 1,) places of the reference at the joints of the curve
    turning_deg   bound of the deviation of the rotary axes from the programmed angles at corresponding places; None:
                  none moves
    """

    reference: Reference
    curve: SpatialPHSpline
    place_mm: Real
    certificate: Certificate
    turning_deg: float | None = None

    @property
    def deviation_mm(self) -> float:
        """Bound of the distance between both paths."""
        return self.certificate.worst_mm

    def arc_length_at(self, place_mm: Real) -> Real:
        """Arc lengths (n,) of the curve that belong to places of the reference."""
        return np.asarray(np.interp(place_mm, self.place_mm, self.curve.segment_starts_mm))


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of a curve, and the motion limits for which it should be fast."""

    tolerance_mm: float
    limits: MotionLimits


@dataclass(frozen=True, eq=False)
class Unfit:
    """Chords (n,) of a reference around which no curve was found."""

    chord: Index


def fit(
    reference: Reference, how: Tolerance, tied: tuple[bool, bool] = (False, False)
) -> FittedPath | Unfit:
    """The curve of a reference that has no turns beyond SHARPEST_RAD; NotFitted: the chords around which none was
    found.

    The path begins and ends at rest. If an end is `tied`, it is in the middle of a chord of a longer path: the curve is
    straight there, so that the curves of both halves of the chord join with continuous curvature.

    Smoothing weighs its cost with estimated speeds. Each stretch of a path that is not very long is smoothed for
    estimates with the programmed feeds and with lower ones. The result with the least estimated time is taken.
    """
    path = outline(reference, how.tolerance_mm, tied)
    plan = _Plan.of(path, how, tied).with_stretches(_ROOM_SHARE).with_choice(_caps(reference, how))
    bad = np.zeros(0, dtype=np.intp)
    for less in _LESS_ROOM + _LESS_ROOM[-1:] * (_REPAIRS - len(_LESS_ROOM)):
        segments, failed = plan.segments()
        if failed.size:
            plan = plan.tightened(failed[:, 0], failed[:, 1], less)
            bad = _chords(reference, failed)
            continue
        own = with_lines(segments, path.point[0], path.point[-1], float(reference.place_mm[-1]))
        curve = SpatialPHSpline(own.origin, own.preimage, False)
        place = np.append(own.low, own.high[-1])
        found = certify(curve, place, reference, how.tolerance_mm - ROUNDING_MM)
        limit = how.tolerance_mm - ROUNDING_MM
        wide, missed = ~(found.curve <= limit), ~(found.reference <= limit)  # also NaN
        if not (wide.any() or missed.any()):
            return FittedPath(reference, curve, place, found)
        low = np.concatenate((own.low[wide], reference.place_mm[:-1][missed]))
        high = np.concatenate((own.high[wide], reference.place_mm[1:][missed]))
        bad = _chords(reference, np.stack((low, high), axis=1))
        plan = plan.tightened(low, high, less)
    return Unfit(bad)


def _caps(reference: Reference, how: Tolerance) -> list[float]:
    """Greatest speeds for which the stretches are smoothed."""
    limits = how.limits
    caps = [limits.feed_mm_s]
    if reference.count <= _MOST_FOR_CHOICE:
        slow = limits.acceleration_mm_s2**2 / limits.jerk_mm_s3
        fastest = min(caps[0], float(reference.feed_mm_s.max()))
        caps += [share * slow for share in _SLOW_SHARES if share * slow < fastest]
    return caps


def _chords(reference: Reference, spans: Real) -> Index:
    """The chords that lie in one of the spans (n, 2) of places."""
    low = np.searchsorted(reference.place_mm, spans[:, 0], side="right") - 1
    high = np.searchsorted(reference.place_mm, spans[:, 1], side="left")
    count = np.zeros(reference.count + 1)
    np.add.at(count, np.clip(low, 0, reference.count - 1), 1)
    np.add.at(count, np.clip(high, 1, reference.count), -1)
    return np.flatnonzero(np.cumsum(count)[:-1] > 0)


@dataclass(frozen=True, eq=False)
class _Smoothed:
    """Points (n, 3) on the curve of a stretch, their places (n,), and its estimated time."""

    point: Real
    place_mm: Real
    time_s: float


@dataclass(frozen=True, eq=False)
class _Plan:
    """The parts of a section: corners at single vertices, and stretches of stations between long legs."""

    path: Outline
    how: Tolerance
    tied: tuple[bool, bool]
    corner: Index
    shape: Index
    size: Real
    spans: tuple[tuple[int, int, float, float], ...]
    stretches: list[Places] = field(default_factory=list)
    cap_mm_s: tuple[float, ...] = ()
    shaped: list[_Smoothed | None] = field(default_factory=list)
    known: list[Segments | None] = field(default_factory=list)

    @classmethod
    def of(cls, path: Outline, how: Tolerance, tied: tuple[bool, bool]) -> _Plan:
        long, reach = path.anchored, path.coarse_reach_mm.copy()
        inner = reach[1:-1]
        inner[inner == 0.0] = _STRAIGHT_ROOM * how.tolerance_mm
        leg, count = path.leg_mm, path.leg_mm.size
        both = reach[:-1] + reach[1:]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(both > 0.0, _LEG_SHARE * leg / both, 0.0)
            near, far = share * reach[:-1], share * reach[1:]
        vertex = np.arange(1, count)
        alone = vertex[long[:-1] & long[1:] & (path.turn_rad[1:-1] > 0.0)]
        usable_mm = np.minimum(far[alone - 1], near[alone])
        off = np.maximum(path.off_mm[alone - 1], path.off_mm[alone])
        size = _CORNER_SHARE * how.tolerance_mm - off
        shape = np.full(alone.size, len(SHAPES) - 1, dtype=np.intp)
        for k in range(len(SHAPES) - 2, -1, -1):
            shape[extent(path.turn_rad[alone], k) * size <= usable_mm] = k
        spans = []
        short = np.flatnonzero(~long)
        runs = np.split(short, np.flatnonzero(np.diff(short) > 1) + 1) if short.size else []
        for run in runs:
            first, last = int(run[0]), int(run[-1])
            before = after = 0.0
            if first > 0:
                before = min(far[first - 1], _ENDS * reach[first])
                first -= 1
            if last < count - 1:
                after = min(near[last + 1], _ENDS * reach[last + 1])
                last += 1
            spans.append((first, last, float(before), float(after)))
        return cls(path, how, tied, alone, shape, size, tuple(spans))

    def with_stretches(self, share: float) -> _Plan:
        """The layout with stations on its stretches; their bounds are `share` of the tolerance."""
        bound_mm = share * self.how.tolerance_mm
        made = [
            stations(self.path, first, last, (before, after), bound_mm)
            for first, last, before, after in self.spans
        ]
        return replace(self, stretches=made, shaped=[None] * len(made), known=[None] * len(made))

    def with_choice(self, caps: list[float]) -> _Plan:
        """The layout with each stretch smoothed for the greatest speed, of these, with the least estimated time."""
        which = list(range(len(self.stretches)))
        if not which:
            return self
        found = [replace(self, cap_mm_s=(cap,) * len(which))._smoothed(which) for cap in caps]
        best = [min(range(len(caps)), key=lambda k: found[k][index].time_s) for index in which]
        return replace(
            self,
            cap_mm_s=tuple(caps[k] for k in best),
            shaped=[found[k][index] for index, k in enumerate(best)],
        )

    def tightened(self, low: Real, high: Real, less: float) -> _Plan:
        """The layout with bounds times `less`, and more stations, in stretches between places low (n,) and high
        (n,).
        """
        made = [tightened(one, low, high, less, self.how.tolerance_mm) for one in self.stretches]
        kept = [one is old for one, old in zip(made, self.stretches, strict=True)]
        known = [own if keep else None for own, keep in zip(self.known, kept, strict=True)]
        shaped = [own if keep else None for own, keep in zip(self.shaped, kept, strict=True)]
        return replace(self, stretches=made, shaped=shaped, known=known)

    def segments(self) -> tuple[Segments, Real]:
        """The curves between the straight lines, and the places (n, 2) of stretches for which none was found."""
        parts = [self._corners(k) for k in range(len(SHAPES)) if (self.shape == k).any()]
        new = [index for index, known in enumerate(self.known) if known is None]
        moved = [index for index in new if self.shaped[index] is None]
        for index, shape in zip(moved, self._smoothed(moved) if moved else (), strict=True):
            self.shaped[index] = shape
        failed = []
        for index in new:
            one = self.shaped[index]
            assert one is not None, "smoothed above"
            try:
                self.known[index] = self._stretch(index, one.point, one.place_mm)
            except HodographError:
                failed.append((float(one.place_mm[0]), float(one.place_mm[-1])))
        none = Segments(
            *(np.zeros(shape) for shape in ((0, 3), (0, 3), (0, 4, 3), (0,), (0,))),
        )
        found = [known for known in self.known if known is not None]
        return Segments.joined((none, *parts, *found)), np.array(failed).reshape(-1, 2)

    def _corners(self, shape: int) -> Segments:
        own = self.shape == shape
        at = self.corner[own]
        direction, path = self.path.direction, self.path
        rate = np.diff(path.place_mm) / path.leg_mm
        return corner_segments(
            path.point[at],
            direction[at - 1],
            direction[at],
            path.place_mm[at],
            (rate[at - 1], rate[at]),
            shape,
            self.size[own],
        )

    def _smoothed(self, which: list[int]) -> list[_Smoothed]:
        """Smoothed points of these stretches, each for its greatest speed."""
        stretches = [self.stretches[index] for index in which]
        place = np.concatenate([one.place_mm for one in stretches])
        count = [one.place_mm.size for one in stretches]
        group = np.repeat(np.arange(len(count)), count)
        own = Stations(
            np.concatenate([one.point for one in stretches]),
            _normals(np.concatenate([one.direction for one in stretches])),
            np.concatenate([one.bound_mm for one in stretches]),
        )
        limits = self.how.limits
        programmed = np.minimum(self.path.feed_at(place), limits.feed_mm_s)
        feed = np.minimum(programmed, np.repeat([self.cap_mm_s[index] for index in which], count))
        shift = np.zeros((place.size, own.normal.shape[2]))
        moved, at = own.point, place
        speed = speeds(moved, at, feed, limits)
        for _ in range(_ROUNDS):
            weight = speed**_POWER / limits.jerk_mm_s3**2
            shift = smoothed(own, at, weight, group, _BARRIER, 0.9 * shift)
            moved = own.moved(shift)
            at = _arc_places(moved, place, group)
            speed = speeds(moved, at, feed, limits)
        speed = speeds(moved, at, programmed, limits)
        passed_s = 2.0 * np.diff(at) / (speed[1:] + speed[:-1])
        edges = np.cumsum([0, *count])
        return [
            _Smoothed(moved[a:b], place[a:b], float(passed_s[a : b - 1].sum()))
            for a, b in itertools.pairwise(edges)
        ]

    def _stretch(self, index: int, points: Real, place: Real) -> Segments:
        first, last, before, after = self.spans[index]
        starts = before > 0.0 or (first == 0 and self.tied[0])
        ends = after > 0.0 or (last == self.path.leg_mm.size - 1 and self.tied[1])
        points, place = _thinned(points, place, _THIN_SHARE * self.how.tolerance_mm)
        direction = self.path.direction
        found = spatial_through_points(
            points,
            False,
            ends="natural",
            start_tangent=direction[first] if starts else None,
            end_tangent=direction[last] if ends else None,
        ).spline
        preimage, spans = found.preimage.copy(), np.linalg.norm(np.diff(points, axis=0), axis=1)
        if starts:
            preimage[:3] = straightened(preimage[:3], spans[:3], direction[first])
        if ends:
            reverse = straightened(preimage[:-4:-1, :, ::-1], spans[:-4:-1], direction[last])
            preimage[-3:] = reverse[::-1, :, ::-1]
        joint = points[0] + np.concatenate(
            (np.zeros((1, 3)), np.cumsum(hodograph_of(preimage).mean(axis=2), axis=0))
        )
        joint[3:-3] = points[3:-3]
        joint[-1] = points[-1]
        return Segments(joint[:-1], joint[1:], preimage, place[:-1], place[1:])


def _arc_places(moved: Real, place: Real, group: Index) -> Real:
    """Arc lengths (n,) of the moved stations; the distance between groups stays the same."""
    step = np.linalg.norm(np.diff(moved, axis=0), axis=1)
    step = np.where(np.diff(group) > 0, np.maximum(np.diff(place), 1e-6), step)
    return np.concatenate((place[:1], place[0] + np.cumsum(step)))


def _normals(direction: Real) -> Real:
    """Unit normals (n, 3, m) of directions (n, 3): one in the plane if all keep z, else two."""
    flat = np.stack((-direction[:, 1], direction[:, 0], np.zeros(direction.shape[0])), axis=1)
    if not direction[:, 2].any():
        return np.asarray(flat[:, :, None])
    axis = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    first = np.cross(direction, axis)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack((first, np.cross(direction, first)), axis=2)


def _thinned(points: Real, place: Real, off_mm: float) -> tuple[Real, Real]:
    """The stations without those that a cubic through the stations around them meets."""
    for _ in range(_THIN_ROUNDS):
        count = place.size
        if count < 9:
            break
        at = np.arange(3, count - 3, 2)
        s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
        around = np.stack([at - 3, at - 1, at + 1, at + 3])
        x = s[around] - s[at]
        guess = np.zeros((at.size, 3))
        for j in range(4):
            others = [k for k in range(4) if k != j]
            weight = np.prod([x[k] / (x[k] - x[j]) for k in others], axis=0)
            guess += weight[:, None] * points[around[j]]
        error = np.linalg.norm(guess - points[at], axis=1)
        gap = s[at + 1] - s[at - 1]
        beside = np.minimum(
            s[at - 1] - s[np.maximum(at - 3, 0)], s[np.minimum(at + 3, count - 1)] - s[at + 1]
        )
        drop = at[(error <= off_mm) & (gap <= 2.5 * beside)]
        if not drop.size:
            break
        points, place = np.delete(points, drop, axis=0), np.delete(place, drop)
    return points, place
