# SPDX-License-Identifier: MIT
"""Path kinematics: velocity, acceleration and jerk of the axes that follow from a curve and a motion along it. Used by
api/path, feed/ and stream/windows. No I/O.

`spline.frames` has the derivatives of a curve by arc length, `axis_motion` the chain rule; docs/theory/feed.md 5.6.
Arrays of all A axes have the axis as first index. `sample` applies them to feed pieces, in cells (one piece on one
segment of the path). Second differences estimate the rise of a quantity between samples; docs/theory/feed.md
section 7.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import perm
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..spline.frames import Curve, Frames, frames
from .limits import Limits, Plants
from .pieces import exponents

Real = NDArray[np.float64]
Int = NDArray[np.int64]

INTERVALS = 12
"""Intervals between the samples of a cell."""
_BISECTIONS = 50
"""Halvings of a piece's time to find where it passes a joint or zone end; they exhaust double precision."""
_BESIDE = 1e-6
"""Distance of the outermost samples from the ends of a cell, as a share of it: the curve is one-sided there."""
_BRIEF = 1e-9
"""Shortest cell, as a share of its piece; shorter ones are left out."""
_ROUGH = 0.1
"""A cell is divided if a value may rise between samples by more than this share of the reserve."""
_PARTS = 4
"""Parts into which a cell is divided."""
_ROUNDS = 3
"""How often cells are divided."""


def axis_motion(frame: Frames, d1: Real, d2: Real, d3: Real) -> tuple[Real, Real, Real]:
    """The first three derivatives (A, …) of the axes, from those of the arc length (…,) by the same variable."""
    return (
        frame.r1 * d1,
        frame.r1 * d2 + frame.r2 * d1**2,
        frame.r1 * d3 + 3.0 * frame.r2 * d1 * d2 + frame.r3 * d1**3,
    )


class Pieces(Protocol):
    """Feed pieces with or without override bounds: `RawPieces` or `FeedPieces`."""

    @property
    def duration_q32_s(self) -> Int:
        """As `FeedPieces`."""

    @property
    def start_q40(self) -> Int:
        """As `FeedPieces`."""

    @property
    def c_q40(self) -> Int:
        """As `FeedPieces`."""


@dataclass(frozen=True, eq=False)
class PathBounds:
    """A path, and its limits that depend on the place on the path.

    kept  whether the plan keeps them; False: they only bound overrides above 100 %
    """

    spline: Curve
    limits: Limits
    plants: Plants | None = None
    kept: bool = True

    @property
    def bind(self) -> bool:
        """Whether there are any such limits."""
        limits = self.limits
        some = limits.centripetal_mm_s2 is not None or bool(limits.zones)
        return some or limits.axes.any or self.plants is not None


@dataclass(frozen=True, eq=False)
class PathKinematics:
    """The motion of feed pieces along a path, in C cells with K samples each: `piece` (C,); velocity, acceleration and
    jerk of the axes (A, C, K); the others (C, K); mm, s.
    """

    piece: Int
    arc_mm: Real
    feed: Real
    centripetal: Real
    velocity: Real
    acceleration: Real
    jerk: Real


def sample(bounds: PathBounds, pieces: Pieces, *, filled: bool = False) -> PathKinematics:
    """The motion of `pieces` along the path. A cell is cut into parts where an axis' acceleration or jerk is near its
    limit and may rise between samples by more than a share of its reserve.

    filled  cut also where it is not near its limit, since the override uses what the plan leaves of a limit
    """
    track = _track(pieces)
    ends = [end for zone in bounds.limits.zones for end in (zone.from_mm, zone.to_mm)]
    cuts = np.unique(np.concatenate((bounds.spline.segment_starts_mm[1:-1], ends)))
    first, end = track.start[0], track.start[-1] + track.distance[-1].sum()
    cells = _cells(track, cuts[(cuts > first) & (cuts < end)])
    found = []
    for _ in range(_ROUNDS):
        samples = _evaluate(bounds.spline, track, cells)
        rough = _rough(bounds.limits, samples, filled)
        found.append(_taken(samples, ~rough))
        cells = _divided(_Cells(cells.piece[rough], cells.low[rough], cells.high[rough]))
        if not rough.any():
            break
    else:
        found.append(_evaluate(bounds.spline, track, cells))
    return _joined(found)


@dataclass(frozen=True, eq=False)
class _ArcLength:
    """Arc length of M pieces: `start` mm, and powers (M, 8) of u = t / seconds."""

    start: Real
    distance: Real
    seconds: Real


@dataclass(frozen=True, eq=False)
class _Cells:
    """Piece, begin and end (u) of each cell."""

    piece: Int
    low: Real
    high: Real


def _track(pieces: Pieces) -> _ArcLength:
    seconds = np.ldexp(pieces.duration_q32_s.astype(np.float64), -32)
    stretch = np.ldexp(seconds, -exponents(pieces.duration_q32_s))
    distance = np.zeros((seconds.size, 8))
    distance[:, 1:] = np.ldexp(pieces.c_q40.astype(np.float64), -40)
    distance[:, 1:] *= stretch[:, None] ** np.arange(1, 8)
    return _ArcLength(np.ldexp(pieces.start_q40.astype(np.float64), -40), distance, seconds)


def _evaluate(spline: Curve, track: _ArcLength, cells: _Cells) -> PathKinematics:
    piece = cells.piece
    share = np.linspace(_BESIDE, 1.0 - _BESIDE, INTERVALS + 1)
    u = cells.low[:, None] + (cells.high - cells.low)[:, None] * share
    s = np.clip(
        track.start[piece, None] + _value(track.distance[piece], u, 0), 0.0, spline.length_mm
    )
    per_s = 1.0 / track.seconds[piece, None]
    f1, f2, f3 = (_value(track.distance[piece], u, n) * per_s**n for n in (1, 2, 3))
    frame = frames(spline, s)
    return PathKinematics(piece, s, f1, frame.curvature * f1 * f1, *axis_motion(frame, f1, f2, f3))


def _rough(limits: Limits, samples: PathKinematics, filled: bool) -> NDArray[np.bool_]:
    """Cells that have to be cut."""
    rough = np.zeros(samples.piece.size, dtype=np.bool_)
    for values, both in (
        (samples.acceleration, limits.axes.acceleration_mm_s2),
        (samples.jerk, limits.axes.jerk_mm_s3),
    ):
        for one, limit in zip(values, both or (), strict=False):
            rise = np.abs(np.diff(one, 2, axis=1)).max(axis=1) / 8.0
            near = np.abs(one).max(axis=1) + rise > (1.0 - 2.0 * limits.reserve) * limit
            rough |= (near | filled) & (rise > _ROUGH * limits.reserve * limit)
    return rough


def _divided(cells: _Cells) -> _Cells:
    part = np.arange(_PARTS) / _PARTS
    width = (cells.high - cells.low)[:, None]
    low = cells.low[:, None] + width * part
    return _Cells(np.repeat(cells.piece, _PARTS), low.ravel(), (low + width / _PARTS).ravel())


def _sampled(samples: PathKinematics) -> tuple[Real, ...]:
    """The fields of PathKinematics other than `piece`."""
    along = samples.arc_mm, samples.feed, samples.centripetal
    return (*along, samples.velocity, samples.acceleration, samples.jerk)


def _joined(parts: list[PathKinematics]) -> PathKinematics:
    piece = np.concatenate([part.piece for part in parts])
    columns = zip(*map(_sampled, parts), strict=True)
    return PathKinematics(piece, *(np.concatenate(column, axis=-2) for column in columns))


def _taken(samples: PathKinematics, which: NDArray[np.bool_]) -> PathKinematics:
    taken = (values[..., which, :] for values in _sampled(samples))
    return PathKinematics(samples.piece[which], *taken)


def raised(values: Real) -> Real:
    """Magnitudes of samples (…, K), raised by their possible rise between samples, from second differences."""
    step = values[..., 1:] - values[..., :-1]
    bend = np.abs(step[..., 1:] - step[..., :-1]) / 8.0
    out = np.abs(values)
    out[..., 1:-1] += bend
    out[..., 0] += bend[..., 0]
    out[..., -1] += bend[..., -1]
    return out


def _cells(track: _ArcLength, cuts: Real) -> _Cells:
    """Pieces, cut at arc lengths `cuts`."""
    at = np.clip(np.searchsorted(track.start, cuts, side="right") - 1, 0, None)
    low, high = np.zeros(cuts.size), np.ones(cuts.size)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        below = track.start[at] + _value(track.distance[at], middle[:, None], 0)[:, 0] < cuts
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    piece = np.concatenate((np.arange(track.start.size), at))
    begin = np.concatenate((np.zeros(track.start.size), high))
    order = np.lexsort((begin, piece))
    piece, begin = piece[order], begin[order]
    end = np.append(begin[1:], 1.0)
    end[np.append(piece[1:] != piece[:-1], True)] = 1.0
    keep = end - begin > _BRIEF
    return _Cells(piece[keep], begin[keep], end[keep])


def _value(distance: Real, u: Real, order: int) -> Real:
    """Derivative `order` of rows of powers (C, 8) at u (C, K)."""
    out = np.zeros_like(u)
    for power in range(7, order - 1, -1):
        out = out * u + float(perm(power, order)) * distance[:, power, None]
    return out


def least_of_pieces(samples: PathKinematics, values: Real, count: int) -> Real:
    """The least value (M,) over all samples of each piece."""
    out = np.full(count, np.inf)
    np.minimum.at(out, samples.piece, values.min(axis=1))
    return out
