# SPDX-License-Identifier: MIT
"""The programmed path of moves as chords, with a bound of the error of each chord. Used by toolpath/fit, stream/reading
and equal_sections. No I/O.

docs/theory/toolpath-fitting.md section 2.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, ceil, inf, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from ..moves import ArcMove, Feed, FeedMode, Move, Position, SplineMove, StraightMove

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_MOST_ARC_CHORDS = 2_000_000
"""Greatest number of chords of an arc, to bound the memory."""
_MOST_HALVINGS = 16
"""Greatest number of halvings of the chords of a spline."""
_LEAST_CHORD_RAD = 1e-4
"""Least angle of a chord of an arc."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A chain of chords.

    point      (n + 1, 3) mm
    line       (n,) source line of each chord
    feed_mm_s  (n,) programmed feed along it; inf: as fast as the machine can
    sag_mm     (n,) bound of the distance between a chord and the programmed path between its ends
    turn_deg   (n + 1, 3) a, b and c at the points, linear between them; None: they stay at 0
    """

    point: Real
    line: Int
    feed_mm_s: Real
    sag_mm: Real
    turn_deg: Real | None = None

    @property
    def count(self) -> int:
        """Number of chords."""
        return int(self.line.size)

    @cached_property
    def length_mm(self) -> Real:
        """Length (n,) of each chord."""
        return np.asarray(np.linalg.norm(np.diff(self.point, axis=0), axis=1))

    @cached_property
    def place_mm(self) -> Real:
        """Length (n + 1,) of the chords up to each point."""
        return np.concatenate((np.zeros(1), np.cumsum(self.length_mm)))

    def part(self, first: int, last: int) -> Reference:
        """Chords first … last - 1."""
        chords = slice(first, last)
        return Reference(
            self.point[first : last + 1],
            self.line[chords],
            self.feed_mm_s[chords],
            self.sag_mm[chords],
            None if self.turn_deg is None else self.turn_deg[first : last + 1],
        )


class ReferenceBuilder:
    """Takes moves, one after the other, and keeps their chords."""

    def __init__(self, start: Position, sag_mm: float) -> None:
        """`sag_mm`: greatest error of a chord of an arc or a spline. `length_mm` grows with the chords."""
        self.start = start
        self.length_mm = 0.0
        self._at = start
        self._sag = sag_mm
        self._points: list[tuple[float, float, float]] = [start[:3]]
        self._turns: dict[int, tuple[float, float, float]] = {0: start[3:]}
        self._rows: list[tuple[int, float, float]] = []

    @property
    def position(self) -> Position:
        """The end of the last move."""
        return self._at

    def add(self, move: Move) -> None:
        """Adds the next move. A move of a, b or c has to change x, y or z too."""
        first = len(self._points) - 1
        if isinstance(move, StraightMove):
            end = move.end[:3]
            before = self._points[-1]
            if end != before:
                (x, y, z), (x0, y0, z0) = end, before
                length = sqrt((x - x0) ** 2 + (y - y0) ** 2 + (z - z0) ** 2)
                self.length_mm += length
                self._points.append(end)
                self._rows.append((move.line, feed_of(move.feed, length), 0.0))
        else:
            points, sag = (
                arc_points(self._at, move, self._sag)
                if isinstance(move, ArcMove)
                else spline_points(move, self._sag)
            )
            length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
            self.length_mm += length
            feed = feed_of(move.feed, length)
            self._points.extend(tuple(row) for row in points[1:].tolist())
            self._rows.extend([(move.line, feed, sag)] * (points.shape[0] - 1))
        if move.end[3:] != self._at[3:]:
            # The angles are linear between these points, and constant between the points of two such moves.
            self._turns[first] = self._at[3:]
            self._turns[len(self._points) - 1] = move.end[3:]
        self._at = move.end

    @property
    def count(self) -> int:
        """Chords of all moves so far."""
        return len(self._rows)

    def points(self, first: int, end: int) -> Real:
        """Points (n, 3) first … end - 1, or fewer at the end of the path."""
        return np.array(self._points[max(first, 0) : end], dtype=np.float64)

    @property
    def turns(self) -> bool:
        """Whether a, b or c has moved."""
        return len(self._turns) > 1

    def angles(self, first: int, end: int) -> Real:
        """a, b and c (n, 3) at points first … end - 1, or fewer at the end of the path."""
        known = list(self._turns)
        first, end = max(first, 0), min(end, len(self._points))
        low = max(bisect_right(known, first) - 1, 0)
        high = bisect_right(known, end - 1) + 1
        known = known[low:high]
        step = np.linalg.norm(
            np.diff(self.points(known[0], max(known[-1] + 1, end)), axis=0), axis=1
        )
        place = np.concatenate((np.zeros(1), np.cumsum(step)))
        own = place[first - known[0] : end - known[0]]
        at = place[np.subtract(known, known[0])]
        value = np.array([self._turns[k] for k in known])
        return np.stack([np.interp(own, at, column) for column in value.T], axis=1)

    def cut(self, chord: int) -> Reference:
        """Cuts off and returns all chords up to the middle of this one; the other half and later chords stay."""
        middle = _middle(*self._points[chord : chord + 2])
        turned = _middle(*self.angles(chord, chord + 2).tolist())
        points, rows, turns = self._points, self._rows, self._turns
        self._points, self._rows = [*points[: chord + 1], middle], rows[: chord + 1]
        self._turns = {k: one for k, one in turns.items() if k <= chord} | {chord + 1: turned}
        part = self.reference()
        self._points, self._rows = [middle, *points[chord + 1 :]], rows[chord:]
        self._turns = {0: turned} | {k - chord: one for k, one in turns.items() if k > chord}
        self.start = (*middle, *turned)
        self.length_mm -= float(part.place_mm[-1])
        return part

    def reference(self) -> Reference:
        """The chords of all moves so far, without those of length 0."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 3)
        point = np.array(self._points, dtype=np.float64)
        kept = (np.diff(point, axis=0) != 0.0).any(axis=1)
        return Reference(
            point[np.append(True, kept)],
            rows[kept, 0].astype(np.int64),
            rows[kept, 1].copy(),
            rows[kept, 2].copy(),
            self._angles(point, np.append(True, kept)),
        )

    def _angles(self, point: Real, kept: NDArray[np.bool_]) -> Real | None:
        """a, b and c at the kept points; None: they stay at 0."""
        angle = np.array(list(self._turns.values()))
        if not angle.any():
            return None
        step = np.linalg.norm(np.diff(point, axis=0), axis=1)
        place = np.concatenate((np.zeros(1), np.cumsum(step)))
        at = place[list(self._turns)]
        return np.stack([np.interp(place[kept], at, column) for column in angle.T], axis=1)


def _middle(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    """The middle of two points."""
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


def feed_of(feed: Feed | None, length_mm: float) -> float:
    """The speed in mm/s along a move; inf for a rapid move."""
    if feed is None:
        return inf
    if feed.mode is FeedMode.INVERSE_TIME:
        return length_mm / feed.duration_s if feed.duration_s > 0.0 else inf
    return feed.feed_mm_s


def arc_points(start: Position, move: ArcMove, sag_mm: float) -> tuple[Real, float]:
    """Points (n + 1, 3) of an arc from `start`, and the greatest error of its chords."""
    first, second, normal = move.plane.value
    centre = np.array(move.centre)
    begin = np.array([start[first], start[second]]) - centre
    end = np.array([move.end[first], move.end[second]]) - centre
    radius = float(np.hypot(*begin)), float(np.hypot(*end))
    angle = atan2(begin[1], begin[0])
    swept = _swept(angle, atan2(end[1], end[0]), move.turns)
    # |r''| by the angle is at most the radius plus twice its rate of change; the error of a chord is an eighth of that.
    bend = max(radius) + 2.0 * abs(radius[1] - radius[0]) / max(abs(swept), _LEAST_CHORD_RAD)
    step = min(max(sqrt(8.0 * sag_mm / bend), _LEAST_CHORD_RAD), 0.5)
    count = min(max(ceil(abs(swept) / step), 2), _MOST_ARC_CHORDS)
    share = np.linspace(0.0, 1.0, count + 1)
    at = angle + swept * share
    size = radius[0] + (radius[1] - radius[0]) * share
    points = np.empty((count + 1, 3))
    points[:, first] = centre[0] + size * np.cos(at)
    points[:, second] = centre[1] + size * np.sin(at)
    points[:, normal] = start[normal] + (move.end[normal] - start[normal]) * share
    points[0], points[-1] = start[:3], move.end[:3]
    return points, bend * (swept / count) ** 2 / 8.0


def _swept(begin: float, end: float, turns: int) -> float:
    """The angle of an arc, counterclockwise positive."""
    around = (end - begin) % (2.0 * pi) if turns > 0 else -((begin - end) % (2.0 * pi))
    full = 2.0 * pi * (abs(turns) - 1)
    if abs(around) < 1e-9:
        around = 2.0 * pi if turns > 0 else -2.0 * pi
    return around + (full if turns > 0 else -full)


def spline_points(move: SplineMove, sag_mm: float) -> tuple[Real, float]:
    """Points (n + 1, 3) of a NURBS, and the greatest error of its chords.

    Bézier pieces in homogeneous coordinates are halved until each lies near its chord: weights are positive, so a piece
    is inside the hull of its control points.
    """
    pieces = _bezier_pieces(move)
    for _ in range(_MOST_HALVINGS):
        off = _off_chord(pieces)
        far = off > sag_mm
        if not far.any():
            break
        pieces = _halved(pieces, far)
    flat = pieces[:, :, :3] / pieces[:, :, 3:]
    points = np.concatenate((flat[:1, 0], flat[:, -1]))
    points[0], points[-1] = move.points[0][:3], move.points[-1][:3]
    return points, float(_off_chord(pieces).max())


def _bezier_pieces(move: SplineMove) -> Real:
    """Homogeneous control points (pieces, degree + 1, 4), by knot insertion."""
    degree = move.degree
    weight = np.array(move.weights)[:, None]
    control = np.hstack((np.array([p[:3] for p in move.points]) * weight, weight))
    knots = np.array(move.knots)
    for value in np.unique(knots[(knots > knots[0]) & (knots < knots[-1])]).tolist():
        for _ in range(degree - int(np.count_nonzero(knots == value))):
            span = int(np.searchsorted(knots, value, side="right")) - 1
            low = np.arange(span - degree + 1, span + 1)
            share = ((value - knots[low]) / (knots[low + degree] - knots[low]))[:, None]
            mixed = share * control[low] + (1.0 - share) * control[low - 1]
            control = np.vstack((control[: span - degree + 1], mixed, control[span:]))
            knots = np.insert(knots, span + 1, value)
    count = (control.shape[0] - 1) // degree
    index = degree * np.arange(count)[:, None] + np.arange(degree + 1)
    return np.asarray(control[index])


def _off_chord(pieces: Real) -> Real:
    """Greatest distance (pieces,) of a control point from the chord between the ends."""
    flat = pieces[:, :, :3] / pieces[:, :, 3:]
    return np.asarray(distance_to_chord(flat, flat[:, :1], flat[:, -1:]).max(axis=1))


def _halved(pieces: Real, which: NDArray[np.bool_]) -> Real:
    """The marked pieces halved by de Casteljau, the others as they are, in order."""
    level = pieces[which]
    left, right = [level[:, 0]], [level[:, -1]]
    while level.shape[1] > 1:
        level = 0.5 * (level[:, 1:] + level[:, :-1])
        left.append(level[:, 0])
        right.append(level[:, -1])
    count = np.where(which, 2, 1)
    out = np.repeat(pieces, count, axis=0)
    at = (np.cumsum(count) - count)[which]
    out[at] = np.stack(left, axis=1)
    out[at + 1] = np.stack(right[::-1], axis=1)
    return np.asarray(out)


def distance_to_chord(point: Real, start: Real, end: Real) -> Real:
    """Distance (…) of points (…, 3) from chords between (…, 3); arrays broadcast."""
    along, offset = end - start, point - start
    square = _dot(along, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(square > 0.0, _dot(offset, along) / square, 0.0)
    nearest = offset - np.clip(share, 0.0, 1.0)[..., None] * along
    return np.sqrt(_dot(nearest, nearest))


def _dot(a: Real, b: Real) -> Real:
    return np.asarray(np.einsum("...k,...k->...", a, b))
