# SPDX-License-Identifier: MIT
"""Divides a path at long straight lines into corners and stretches, and a stretch into stations that smoothing may
move. Used by toolpath/fit and stream/reading. No I/O.

docs/theory/toolpath-fitting.md section 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .corners import SHARPEST_RAD, extent
from .reference import Reference, distance_to_chord

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]

SHORTEST_MM = 2.0**-9
"""Shorter moves are no section of their own."""

_THIN_SHARE = 0.04
"""Share of the tolerance: greatest distance of a dropped point from its leg."""

_LINE_SHARE = 0.25
"""The same for points on a leg that no corner or stretch uses as a whole: noise on a straight line does not reduce the
usable leg length of corners.
"""

_ROUGH_SHARE, _ROUGH_LEG = 0.7, 8.0
"""The same for points of noise, and the greatest length of their legs in tolerances."""

_WINDOW = 7
"""Number of consecutive points that are noise if most of them turn to another side than a point next to them."""

_NEAREST = 11.0
"""Least distance, in tolerances, of vertices of smoothed stretches that are not needed to keep `_LINE_SHARE`."""

_THIN_ROUNDS = 12
"""How often stations are left out."""
_GRADES = np.array([0.25, 0.5, 0.8, 1.2, 1.8, 2.7, 4.0, 6.0, 9.0, 15.0])
"""Distances of stations from a vertex, in multiples of the usable leg length that its corner curve would need."""

_MIDDLE = 0.2
"""A leg longer than this share of the usable leg length at its ends has a station in its middle."""

_STRAIGHT = np.array([0.0, 0.2])
"""Fixed stations at the ends of long legs, as shares of the used part of the leg: the curve leaves a leg in its
direction with curvature 0.
"""

_LONG = 4.0
"""If a leg is this many times as long as the least usable leg length of the corners at its ends, its middle stays
straight.
"""

_MOST_TIMES = 8.0
"""Greatest reach of a station as a multiple of its leg."""
_LESS_ELSEWHERE = 0.99
"""Share of their bound that stations keep where the tolerance is not exceeded."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The vertices of a section that are kept.

    point            (n + 1, 3) mm
    place_mm         (n + 1,) their places on the reference
    off_mm           (n,) greatest distance of dropped points from each leg
    turn_rad         (n + 1,) change of direction; 0 at the ends
    reach_mm         (n + 1,) usable leg length that a corner curve would need; 0 at the ends and where the direction
                     does not change
    coarse_reach_mm  (n + 1,) the same, where smaller turns between long legs are left out
    anchored         (n,) whether a leg is so long that a part of it between the corners stays straight
    reference        the path of which this is the outline
    """

    point: Real
    place_mm: Real
    off_mm: Real
    turn_rad: Real
    reach_mm: Real
    coarse_reach_mm: Real
    anchored: Flags
    reference: Reference

    def feed_at(self, place_mm: Real) -> Real:
        """Programmed feed (n,) at places of the reference."""
        own = self.reference
        chord = np.searchsorted(own.place_mm, place_mm, side="right") - 1
        return np.asarray(own.feed_mm_s[np.clip(chord, 0, own.count - 1)])

    @property
    def leg_mm(self) -> Real:
        """Length (n,) of the legs."""
        return np.asarray(np.linalg.norm(np.diff(self.point, axis=0), axis=1))

    @property
    def direction(self) -> Real:
        """Unit vectors (n, 3) along the legs."""
        return np.asarray(np.diff(self.point, axis=0) / self.leg_mm[:, None])


def turns(point: Real) -> Real:
    """Change of direction (n,) at points (n, 3), 0 at the ends; rad. NaN next to a leg of length 0."""
    leg = np.diff(point, axis=0)
    with np.errstate(invalid="ignore"):
        leg = leg / np.linalg.norm(leg, axis=1)[:, None]
    out = np.zeros(point.shape[0])
    before, after = leg[:-1], leg[1:]
    cross = np.linalg.norm(np.cross(before, after), axis=1)
    out[1:-1] = np.arctan2(cross, np.sum(before * after, axis=1))
    return out


def outline(
    reference: Reference, tolerance_mm: float, tied: tuple[bool, bool] = (False, False)
) -> Outline:
    """The vertices of a reference, without those that lie nearly on the line between the vertices next to them.

    tied  whether the first and the last leg have to be the first and the last chord
    """
    every = np.arange(reference.count + 1)
    fine = _thinned(reference, every, _THIN_SHARE * tolerance_mm, tied)
    coarse = _thinned(reference, fine, _LINE_SHARE * tolerance_mm, tied)
    coarse = _thinned(
        reference, coarse, _ROUGH_SHARE * tolerance_mm, tied, _ROUGH_LEG * tolerance_mm
    )
    coarse = _with_farthest(reference, coarse)
    fine = np.union1d(fine, coarse)
    coarse_reach = _reach(reference.point[coarse], tolerance_mm)
    long = _is_long(reference.point[coarse], coarse_reach)
    kept = _between(reference, fine, coarse, long, _NEAREST * tolerance_mm)
    point = reference.point[kept]
    reach = _reach(point, tolerance_mm)
    widest = reach.copy()
    widest[np.isin(kept, coarse)] = coarse_reach
    own = _is_long(point, reach) | long[np.searchsorted(coarse, kept[:-1], side="right") - 1]
    off = _off(reference, kept)
    return Outline(
        point, reference.place_mm[kept], off, turns(point), reach, widest, own, reference
    )


def _with_farthest(reference: Reference, kept: Index) -> Index:
    """The kept points (n,). A path that returns to its start within the tolerance also keeps its farthest point: the
    line from its start to its end is shorter than any section.
    """
    away_mm = np.linalg.norm(reference.point - reference.point[0], axis=1)
    if kept.size > 2 or away_mm[-1] >= SHORTEST_MM:
        return kept
    return np.union1d(kept, np.argmax(away_mm))


def _between(
    reference: Reference, fine: Index, coarse: Index, long: Flags, nearest_mm: float
) -> Index:
    """The coarse vertices, and the fine ones that smoothing needs between them. Long legs (n,) get no fine ones.
    Elsewhere their distance is at least about `nearest_mm`; more of them would only follow the noise.
    """
    leg = np.clip(np.searchsorted(coarse, fine, side="right") - 1, 0, long.size - 1)
    begin, end = reference.place_mm[coarse[leg]], reference.place_mm[coarse[leg + 1]]
    parts = np.maximum(np.floor((end - begin) / nearest_mm), 1.0)
    part = np.floor((reference.place_mm[fine] - begin) / (end - begin) * parts)
    first = np.append(True, part[1:] != part[:-1]) & (part > 0.0)
    few = np.bincount(leg, minlength=long.size)[leg] <= parts
    return fine[(~long[leg] & (first | few)) | np.isin(fine, coarse)]


def _reach(point: Real, tolerance_mm: float) -> Real:
    """Usable leg length (n,) that corner curves at points (n, 3) would need."""
    turn = turns(point)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = tolerance_mm * extent(np.minimum(turn, SHARPEST_RAD))
    return np.where(turn > 0.0, reach, 0.0)


def _is_long(point: Real, reach: Real) -> Flags:
    """Whether the legs (n,) between points (n + 1, 3) are so long that a part between the corners stays straight."""
    leg = np.linalg.norm(np.diff(point, axis=0), axis=1)
    return np.asarray(leg >= _LONG * (reach[1:] + reach[:-1]))


def _thinned(
    reference: Reference,
    kept: Index,
    off_mm: float,
    tied: tuple[bool, bool],
    rough_mm: float | None = None,
) -> Index:
    """The kept points (n,) without those that can be dropped: no point of the reference is then farther than this from
    its leg.

    rough_mm  leave out only points of noise, with a leg of at most this length
    """
    for _ in range(_THIN_ROUNDS):
        point = reference.point[kept]
        drop = np.zeros(kept.size, dtype=np.bool_)
        drop[1:-1] = distance_to_chord(point[1:-1], point[:-2], point[2:]) <= off_mm
        if rough_mm is not None:
            drop[1:-1] &= _is_rough(point, rough_mm)
        drop[1] &= not tied[0]
        drop[-2] &= not tied[1]
        # No two consecutive points in one round: of each run every second one.
        run = np.arange(drop.size) - np.maximum.accumulate(np.where(drop, 0, np.arange(drop.size)))
        drop &= run % 2 == 1
        at = np.flatnonzero(drop)
        wide = _off(reference, kept[~drop]) > off_mm
        drop[at] = ~wide[np.searchsorted(kept[~drop], kept[at]) - 1]
        if not drop.any():
            break
        kept = kept[~drop]
    return kept


def _is_rough(point: Real, longest_mm: float) -> Flags:
    """Inner points (n - 2,) of a chain (n, 3) that are noise: a leg there is at most this long, and the chain reverses,
    or turns to another side than at a point next to it, as it does at most points around.
    """
    leg = np.diff(point, axis=0)
    length = np.linalg.norm(leg, axis=1)
    side = np.cross(leg[:-1], leg[1:])
    other = np.sum(side[:-1] * side[1:], axis=1) < 0.0
    wavers = np.append(False, other) | np.append(other, False)
    around = np.convolve(wavers, np.ones(_WINDOW))[_WINDOW // 2 :][: wavers.size]
    wavers &= around > _WINDOW // 2
    near = np.minimum(length[:-1], length[1:]) <= longest_mm
    straight = turns(point)[1:-1] <= SHARPEST_RAD  # not next to a leg of length 0
    return np.asarray(near & (wavers | ~straight))


def _off(reference: Reference, kept: Index) -> Real:
    """Greatest distance (n,) of the points between the kept ones (n + 1,) from the legs."""
    point = reference.point
    leg = np.repeat(np.arange(kept.size - 1), np.diff(kept))
    aside = distance_to_chord(point[:-1], point[kept[leg]], point[kept[leg + 1]])
    return np.asarray(np.maximum.reduceat(aside, kept[:-1]))


@dataclass(frozen=True, eq=False)
class Places:
    """Stations of a stretch: points (n, 3), directions (n, 3), places (n,) on the reference, greatest shifts (n,) in
    mm.
    """

    point: Real
    direction: Real
    place_mm: Real
    bound_mm: Real


def stations(
    path: Outline, first: int, last: int, ends: tuple[float, float], bound_mm: float
) -> Places:
    """Stations from leg `first` to leg `last`.

    ends      length in mm of the first and of the last leg that the stretch uses; 0: it begins, or ends, at the vertex
    bound_mm  greatest shift of a station; the distance of dropped points is subtracted
    """
    before, after = ends
    vertex = np.arange(first + (before > 0.0), last + 1 + (after == 0.0))
    legs = np.arange(first, last + 1)
    length, direction = path.leg_mm[legs], path.direction[legs]
    low = np.zeros(legs.size)
    high = length.copy()
    if before > 0.0:
        low[0] = length[0] - before
    if after > 0.0:
        high[-1] = after
    reach = np.minimum(
        path.reach_mm, np.concatenate((path.leg_mm, [np.inf]))[: path.reach_mm.size] * _MOST_TIMES
    )
    reach = np.where(path.reach_mm > 0.0, reach, np.inf)
    near = reach[legs, None] * _GRADES
    far = length[:, None] - reach[legs + 1, None] * _GRADES[::-1]
    half = 0.5 * length[:, None]
    use_near, use_far = near < 0.9 * half, far > 1.1 * half
    bulging = length > _MIDDLE * np.minimum(reach[legs], reach[legs + 1])
    middle = (use_near.any(axis=1) | use_far.any(axis=1) | bulging)[:, None]
    along = np.concatenate((near, half, far), axis=1)
    use = np.concatenate((use_near, middle, use_far), axis=1)
    use &= (along > low[:, None]) & (along < high[:, None])
    leg, _ = np.nonzero(use)
    own = along[use]
    unit = np.concatenate((direction[:1], direction, direction[-1:]))
    tangent = unit[:-1] + unit[1:]
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    base, scale = path.place_mm[legs], np.diff(path.place_mm)[legs] / length
    parts_point = [path.point[vertex], path.point[legs[leg]] + own[:, None] * direction[leg]]
    parts_direction = [tangent[vertex - first], direction[leg]]
    parts_place = [path.place_mm[vertex], base[leg] + own * scale[leg]]
    off = np.concatenate((path.off_mm[legs][:1], path.off_mm[legs], path.off_mm[legs][-1:]))
    parts_bound = [
        bound_mm - np.maximum(off[:-1], off[1:])[vertex - first],
        bound_mm - path.off_mm[legs[leg]],
    ]
    for leg_at, at, inward in ((0, low[0], before), (legs.size - 1, high[-1], -after)):
        if inward != 0.0:
            fixed = at + inward * _STRAIGHT
            parts_point.append(path.point[legs[leg_at]] + fixed[:, None] * direction[leg_at])
            parts_direction.append(np.repeat(direction[leg_at][None], fixed.size, axis=0))
            parts_place.append(base[leg_at] + fixed * scale[leg_at])
            parts_bound.append(np.zeros(fixed.size))
    place = np.concatenate(parts_place)
    order = np.argsort(place, kind="stable")
    bound = np.concatenate(parts_bound)[order]
    bound[[0, -1]] = 0.0
    return Places(
        np.concatenate(parts_point)[order],
        np.concatenate(parts_direction)[order],
        place[order],
        bound,
    )


def tightened(one: Places, low: Real, high: Real, share: float, least_mm: float) -> Places:
    """The stations with bounds times `share`, and more of them at least `least_mm` apart, from places low (n,) to high
    (n,). All other bounds shrink a little too; otherwise the violation may only move along the path.
    """
    place = one.place_mm
    first = np.clip(np.searchsorted(place, low, side="right") - 1, 0, place.size - 1)
    last = np.clip(np.searchsorted(place, high, side="left"), 0, place.size - 1)
    inside = (high >= place[0]) & (low <= place[-1])
    between = _covered(first[inside], last[inside], place.size)[:-1]
    if not between.any():
        return one
    hit = np.append(between, False) | np.append(False, between)
    hit[1:] |= hit[:-1].copy()
    hit[:-1] |= hit[1:].copy()
    bound = np.where(hit, share, _LESS_ELSEWHERE) * one.bound_mm
    at = np.flatnonzero(between & (np.diff(place) > 2.0 * least_mm))
    leg = one.point[at + 1] - one.point[at]
    most = np.maximum(bound[at], bound[at + 1])
    return Places(
        np.insert(one.point, at + 1, one.point[at] + 0.5 * leg, axis=0),
        np.insert(one.direction, at + 1, leg / np.linalg.norm(leg, axis=1)[:, None], axis=0),
        np.insert(place, at + 1, 0.5 * (place[at] + place[at + 1])),
        np.insert(bound, at + 1, most),
    )


def _covered(first: NDArray[np.intp], last: NDArray[np.intp], count: int) -> Flags:
    """Which of `count` places lie in first … last - 1 of one of the spans."""
    change = np.zeros(count + 1, dtype=np.intp)
    np.add.at(change, first, 1)
    np.add.at(change, np.maximum(last, first), -1)
    return np.asarray(np.cumsum(change)[:-1] > 0)
