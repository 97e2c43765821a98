# SPDX-License-Identifier: MIT
"""Knots of a path through points: parameter lengths of its spans; docs/theory/spatial-splines.md 1.

With uniform knots, as in the paper, each span has parameter length 1. A short span next to a long one is then passed
slowly, and the curve overshoots. Parameter lengths equal to the chords keep the parametric speed even.

Used by spline/, config/path_file and schemas/path_file. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .bernstein import Real

KNOT_NAMES = ("chord", "centripetal", "uniform")
"""Parameter length of a span: its chord, the square root of its chord, or 1."""

_POWER = {"chord": 1.0, "centripetal": 0.5, "uniform": 0.0}


@dataclass(frozen=True, eq=False)
class KnotSpans:
    """Parameter lengths h_i of M spans, and how the spline's coefficients mix at their ends.

    length  (M,) h_i, mean 1
    before  (M,) h_i / (h_(i-1) + h_i): share of the coefficient before, in the value at the start of the span
    after   (M,) h_i / (h_i + h_(i+1)): share of the coefficient after, in the value at its end

    Beyond the ends of an open path, the end span is repeated.
    """

    length: Real
    before: Real
    after: Real

    @staticmethod
    def of(length: Real, closed: bool) -> KnotSpans:
        """Spans of these parameter lengths (M,)."""
        if closed:
            around = np.concatenate((length[-1:], length, length[:1]))
        else:
            around = np.concatenate((length[:1], length, length[-1:]))
        before, after = around[:-2], around[2:]
        return KnotSpans(length, length / (before + length), length / (length + after))

    def part(self, low: int, high: int) -> KnotSpans:
        """Spans low … high - 1, with the shares at their ends that they have here."""
        return KnotSpans(self.length[low:high], self.before[low:high], self.after[low:high])


def checked_knots(name: str) -> str:
    """`name` when it is one of KNOT_NAMES; raises InputError."""
    if name not in KNOT_NAMES:
        raise InputError(f'knots = "{name}" is unknown: use {", ".join(KNOT_NAMES)}')
    return name


def knot_spans(chord_mm: Real, name: str, closed: bool) -> KnotSpans:
    """Knots `name` of KNOT_NAMES for chords of lengths `chord_mm` (M,), all above 0."""
    length = chord_mm ** _POWER[name]
    return KnotSpans.of(length / length.mean(), closed)
