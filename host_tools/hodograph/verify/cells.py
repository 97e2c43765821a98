# SPDX-License-Identifier: MIT
"""The motion of a program cut into cells: stretches of time within one feed piece and one segment.

Within a cell the arc length is one polynomial in time, and the curve one polynomial in its parameter.

Used by verify/. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..fixed_point import MM_PER_Q40, to_q40
from ..program import Program
from .curves import Curve, curve_of
from .polynomials import shifted, values

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_BISECTIONS = 56
"""Halvings of the time at which a piece passes a joint; they exhaust double precision."""
_BRIEF_S = 1e-12
"""Shorter cells are left out."""


@dataclass(frozen=True, eq=False)
class Cells:
    """C cells in the order of time.

    segment, start_s, duration_s   (C,) index; program time of its start; its length in time
    distance      (C, 8) arc length within the segment, mm, in powers of u = (t - start_s) / duration_s
    xi       (C, 2) the curve's parameter at both ends
    """

    program: Program
    curve: Curve
    segment: Int
    start_s: Real
    duration_s: Real
    distance: Real
    xi: Real

    def __len__(self) -> int:
        return int(self.segment.size)

    def arc_length_mm(self, cell: Int, u: Real) -> Real:
        """Arc length on the path."""
        return self.curve.start_mm[self.segment[cell]] + values(self.distance[cell], u)

    def time_s(self, cell: Int, u: Real) -> Real:
        """Program time."""
        return np.asarray(self.start_s[cell] + u * self.duration_s[cell])

    def taken(self, which: Int | NDArray[np.bool_]) -> Cells:
        """A selection of the cells."""
        return replace(
            self,
            segment=self.segment[which],
            start_s=self.start_s[which],
            duration_s=self.duration_s[which],
            distance=self.distance[which],
            xi=self.xi[which],
        )

    def divided(self, parts: Int) -> Cells:
        """The cells, each cut into `parts` (C,) equal parts."""
        cell = np.repeat(np.arange(len(self)), parts)
        width = 1.0 / parts[cell]
        first = np.arange(cell.size) - np.repeat(np.cumsum(parts) - parts, parts)
        part = replace(
            self.taken(cell),
            start_s=self.start_s[cell] + first * width * self.duration_s[cell],
            duration_s=width * self.duration_s[cell],
            distance=shifted(self.distance[cell], first * width, width),
        )
        return replace(part, xi=part.curve.ends(part.segment, part.distance))


def cut(program: Program, more_mm: Sequence[float] = ()) -> Cells:
    """The cells of a program, also cut at the arc lengths `more_mm`."""
    pieces = program.pieces
    exponent = np.array([piece.exponent for piece in pieces], dtype=np.float64)
    duration = pieces.duration_q32_s * 2.0**-32
    scale = np.concatenate((np.zeros((len(pieces), 1)), pieces.c_q40 * MM_PER_Q40), axis=1)
    distance = scale * (duration * 2.0**-exponent)[:, None] ** np.arange(8.0)
    piece, u = _joints(program, distance, more_mm)
    cell_piece, low, high = _stretches(len(pieces), piece, u)
    brief = (high - low) * duration[cell_piece] < _BRIEF_S
    cell_piece, low, high = cell_piece[~brief], low[~brief], high[~brief]
    middle = values(distance[cell_piece], 0.5 * (low + high))
    start = pieces.start_q40[cell_piece]
    at_q40 = start + to_q40(middle)
    segment = np.searchsorted(program.start_q40, at_q40, side="right") - 1
    segment = np.clip(segment, 0, program.segment_count - 1)
    own = shifted(distance[cell_piece], low, high - low)
    own[:, 0] += (start - program.start_q40[segment]) * MM_PER_Q40
    curve = curve_of(program)
    begun = np.concatenate(([0.0], np.cumsum(duration)[:-1]))
    return Cells(
        program,
        curve,
        segment,
        begun[cell_piece] + low * duration[cell_piece],
        (high - low) * duration[cell_piece],
        own,
        curve.ends(segment, own),
    )


def _joints(program: Program, distance: Real, more_mm: Sequence[float]) -> tuple[Int, Real]:
    """Piece and u where the motion passes a joint of segments, or one of `more_mm`."""
    more = to_q40(np.asarray(more_mm, dtype=np.float64))
    joints = np.unique(np.concatenate((program.start_q40[1:], more)))
    joints = joints[(joints > 0) & (joints < program.length_q40)]
    starts = program.pieces.start_q40
    piece = np.clip(np.searchsorted(starts, joints, side="right") - 1, 0, None)
    target = (joints - starts[piece]) * MM_PER_Q40
    low, high = np.zeros(joints.size), np.ones(joints.size)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        below = values(distance[piece], middle) < target
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return piece, 0.5 * (low + high)


def _stretches(count: int, piece: Int, u: Real) -> tuple[Int, Real, Real]:
    """Piece, begin and end of each interval between consecutive cuts; ends of pieces are cuts too."""
    whole = np.arange(count)
    pieces = np.concatenate((whole, piece))
    lows = np.concatenate((np.zeros(count), u))
    order = np.lexsort((lows, pieces))
    pieces, lows = pieces[order], lows[order]
    highs = np.append(lows[1:], 1.0)
    highs[np.append(pieces[1:] != pieces[:-1], True)] = 1.0
    return pieces, lows, highs
