# SPDX-License-Identifier: MIT
"""A peer's motion: commanded positions at 1 kHz, and its measured figures. Used by peers/. No I/O."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

RATE_HZ = 1000.0
_STANDS_MM = 1e-6
"""Steps below this are standstill: positions are known to a nanometre."""
_BLOCK = 256
"""Points whose distance is computed at once, to bound the memory."""
_FINE_MM = 0.01
"""Longest step between samples of a path."""


@dataclass(frozen=True)
class AxisLimits:
    """Limits of each axis alike; `jerk_mm_s3` None: the peer has none."""

    velocity_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float | None


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions (n, 3) in mm, one a millisecond, from the last sample at rest to the first at rest again."""

    position_mm: Real

    @staticmethod
    def trimmed(position_mm: Real) -> Motion:
        """Without the standstill before and after."""
        moves = np.flatnonzero(np.abs(np.diff(position_mm, axis=0)).max(axis=1) > _STANDS_MM)
        if not moves.size:
            raise ValueError("nothing moves in these samples")
        return Motion(position_mm[moves[0] : moves[-1] + 2])

    @property
    def duration_s(self) -> float:
        """Cycle time."""
        return (len(self.position_mm) - 1) / RATE_HZ

    def derivative(self, order: int) -> Real:
        """Differences (n, 3) of an order over the period, at rest before and after."""
        rest = np.pad(self.position_mm, ((order, order), (0, 0)), mode="edge")
        return np.asarray(np.diff(rest, order, axis=0) * RATE_HZ**order)

    def peak(self, order: int) -> float:
        """The greatest of any axis."""
        return float(np.abs(self.derivative(order)).max())

    def ticks_beyond(self, order: int, limit: float, share: float = 1.01) -> int:
        """Ticks in which an axis is beyond `share` of a limit."""
        return int(np.count_nonzero(np.abs(self.derivative(order)).max(axis=1) > share * limit))


def deviation_um(motion: Motion, path_mm: Real) -> float:
    """The greatest distance between a motion and the programmed path (chords, (m, 3)), both ways, in um.

    Samples of the motion against the chords, and places of the chords, 10 um apart, against the motion's own chords.
    """
    there = _farthest(motion.position_mm, path_mm)
    back = _farthest(_fine(path_mm), motion.position_mm)
    return 1000.0 * max(there, back)


def _fine(path_mm: Real) -> Real:
    """The corners of a path and places between them."""
    steps = np.diff(path_mm, axis=0)
    parts = np.maximum(1, np.ceil(np.linalg.norm(steps, axis=1) / _FINE_MM)).astype(np.intp)
    chord = np.repeat(np.arange(len(steps)), parts)
    first = np.concatenate(([0], np.cumsum(parts)[:-1]))
    share = (np.arange(chord.size) - first[chord]) / parts[chord]
    return np.concatenate((path_mm[chord] + share[:, None] * steps[chord], path_mm[-1:]))


def _farthest(points: Real, chords: Real) -> float:
    """The greatest distance of points, in the order of a path, from a chain of chords along the same path.

    Each block of points is compared with the chords whose boxes come near it.
    """
    start, step = chords[:-1], np.diff(chords, axis=0)
    length2 = np.maximum(np.einsum("ij,ij->i", step, step), 1e-30)
    low, high = np.minimum(start, chords[1:]), np.maximum(start, chords[1:])
    most = 0.0
    for begin in range(0, len(points), _BLOCK):
        block = points[begin : begin + _BLOCK]
        box = block.min(axis=0), block.max(axis=0)
        reach = 1.0
        while True:
            near = np.flatnonzero(
                np.all((low <= box[1] + reach) & (high >= box[0] - reach), axis=1)
            )
            if near.size:
                found = _distances(block, start[near], step[near], length2[near]).min(axis=1)
                if found.max() <= reach:
                    break
            reach *= 4.0
        most = max(most, float(found.max()))
    return most


def _distances(points: Real, start: Real, step: Real, length2: Real) -> Real:
    """Of each point (p, 3) from each chord (c): (p, c)."""
    away = points[:, None, :] - start
    share = np.clip(np.einsum("pcj,cj->pc", away, step) / length2, 0.0, 1.0)
    return np.asarray(np.linalg.norm(away - share[:, :, None] * step, axis=2))
