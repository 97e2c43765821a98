# SPDX-License-Identifier: MIT
"""Paths through given points: end conditions and guiding cubic spline; docs/theory/numerics.md 2.2. Used by spline/,
config/path_file and schemas/path_file. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .banded import solve_cyclic, solve_tridiagonal
from .bernstein import Complex
from .knots import KnotSpans
from .nodal import Guide, hodograph_from_derivatives
from .system import NATURAL_END, EndRule, cubic_end

END_NAMES = ("cubic", "natural")


@dataclass(frozen=True)
class EndCondition:
    """One end of an open path: its direction `tangent` (0: none given) or a name of END_NAMES."""

    name: str
    tangent: complex

    @staticmethod
    def chosen(name: str, tangent: complex | None, key: str, closed: bool) -> EndCondition:
        """Checked condition; `key` names the tangent in messages. Raises InputError."""
        if name not in END_NAMES:
            raise InputError(f'ends = "{name}" is unknown: use {" or ".join(END_NAMES)}')
        if tangent is None:
            return EndCondition(name, 0j)
        if closed:
            raise InputError(f"{key} is for open paths: remove it or set closed = false")
        if not np.isfinite(tangent) or tangent == 0:
            raise InputError(f"{key} must be two finite numbers, not both 0")
        return EndCondition(name, complex(tangent))

    def rule(self, spans: int, share: float = 0.5) -> EndRule:
        """The rule for a free end; for a single span both names mean natural. `share` as of `cubic_end`."""
        return cubic_end(share) if self.name == "cubic" and spans > 1 else NATURAL_END


def through_guide(
    q: Complex,
    closed: bool,
    start: EndCondition,
    end: EndCondition,
    knots: KnotSpans | None = None,
) -> Guide:
    """C2 cubic spline through `q` with matching ends, as a guide; uniform without `knots`."""
    if closed:
        return _guide(np.append(q, q[0]), closed_derivatives(q, knots), knots, True)
    free = open_derivatives(q, start.name, end.name, None, None, knots)
    derivative = free
    if start.tangent or end.tangent:
        first_span, last_span = end_spans(knots)
        first = _directed(start.tangent, free[0], (q[1] - q[0]) / first_span)
        last = _directed(end.tangent, free[-1], (q[-1] - q[-2]) / last_span)
        derivative = open_derivatives(q, start.name, end.name, first, last, knots)
    return _guide(q, derivative, knots, False)


def end_spans(knots: KnotSpans | None) -> tuple[float, float]:
    """Parameter lengths of the first and of the last span."""
    return (1.0, 1.0) if knots is None else (float(knots.length[0]), float(knots.length[-1]))


def end_shares(knots: KnotSpans | None) -> tuple[float, float]:
    """The argument `share` of `cubic_end` at the start and at the end."""
    return (0.5, 0.5) if knots is None else (float(knots.after[0]), float(knots.before[-1]))


def end_speed(free: float, chord: float) -> float:
    """Speed at an end with a given direction: that of the free end, limited to 1/4 to 1 times the chord's."""
    return min(max(free, chord / 4.0), chord)


def _guide(q: Complex, derivative: Complex, knots: KnotSpans | None, closed: bool) -> Guide:
    """From derivatives by the parameter; a Guide has those by the share of the span."""
    return Guide(q, hodograph_from_derivatives(q, derivative, knots), closed)


def _directed(tangent: complex, free: complex, chord: complex) -> complex | None:
    """Derivative in the given direction."""
    if not tangent:
        return None
    return tangent / abs(tangent) * end_speed(abs(free), abs(chord))


def closed_derivatives(q: Complex, knots: KnotSpans | None) -> Complex:
    """Derivatives (M + 1,) by the parameter of the periodic cubic spline, that at the seam twice."""
    if knots is None:
        ones = np.ones(q.size, dtype=np.complex128)
        rhs = 3.0 * (np.roll(q, -1) - np.roll(q, 1))
        derivative = solve_cyclic(ones, 4.0 * ones, ones, rhs)
    else:
        length = knots.length.astype(np.complex128)
        before = np.roll(length, 1)
        slope = (np.roll(q, -1) - q) / length
        rhs = 3.0 * (length * np.roll(slope, 1) + before * slope)
        derivative = solve_cyclic(length, 2.0 * (before + length), before, rhs)
    return np.append(derivative, derivative[0])


def open_derivatives(
    q: Complex,
    start: str,
    end: str,
    first: complex | None,
    last: complex | None,
    knots: KnotSpans | None,
) -> Complex:
    """Derivatives (M + 1,) by the parameter of the cubic spline: `first`, `last`, or ends of names in END_NAMES."""
    lower = np.ones(q.size, dtype=np.complex128)
    diagonal, upper, rhs = 4.0 * lower, lower.copy(), np.zeros_like(q)
    slopes = np.diff(q)
    if knots is None:
        rhs[1:-1] = 3.0 * (q[2:] - q[:-2])
    else:
        length = knots.length
        slopes = slopes / length
        lower[1:-1], upper[1:-1] = length[1:], length[:-1]
        diagonal[1:-1] = 2.0 * (length[1:] + length[:-1])
        rhs[1:-1] = 3.0 * (length[1:] * slopes[:-1] + length[:-1] * slopes[1:])
    diagonal[0], upper[0], rhs[0] = _end_row(start, first, slopes[0], q.size)
    diagonal[-1], lower[-1], rhs[-1] = _end_row(end, last, slopes[-1], q.size)
    return solve_tridiagonal(lower, diagonal, upper, rhs)


def _end_row(
    name: str, clamped: complex | None, slope: complex, points: int
) -> tuple[float, float, complex]:
    if clamped is not None:
        return 1.0, 0.0, clamped
    if name == "natural" or points == 2:
        return 2.0, 1.0, 3.0 * slope
    return 1.0, 1.0, 2.0 * slope
