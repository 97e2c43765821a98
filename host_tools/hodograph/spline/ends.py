# SPDX-License-Identifier: MIT
"""Paths through given points: end conditions and guiding cubic spline; docs/theory/numerics.md 2.2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .banded import solve_cyclic, solve_tridiagonal
from .bernstein import Complex
from .nodal import Guide, hodograph_from_derivatives
from .system import CUBIC_END, NATURAL_END, EndRule

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

    def rule(self, spans: int) -> EndRule:
        """The rule for a free end; for a single span both names mean natural."""
        return CUBIC_END if self.name == "cubic" and spans > 1 else NATURAL_END


def through_guide(q: Complex, closed: bool, start: EndCondition, end: EndCondition) -> Guide:
    """Uniform C2 cubic spline through `q` with matching ends, as a guide."""
    if closed:
        loop = np.append(q, q[0])
        ones = np.ones(q.size, dtype=np.complex128)
        rhs = 3.0 * (np.roll(q, -1) - np.roll(q, 1))
        derivative = solve_cyclic(ones, 4.0 * ones, ones, rhs)
        derivative = np.append(derivative, derivative[0])
        return Guide(loop, hodograph_from_derivatives(loop, derivative), True)
    free = _derivatives(q, start, end, 0j, 0j)
    derivative = free
    if start.tangent or end.tangent:
        first = _directed(start.tangent, free[0], q[1] - q[0])
        last = _directed(end.tangent, free[-1], q[-1] - q[-2])
        derivative = _derivatives(q, start, end, first, last)
    return Guide(q, hodograph_from_derivatives(q, derivative), False)


def _directed(tangent: complex, free: complex, chord: complex) -> complex:
    """Derivative in the given direction, as fast as the free end, but 1/4 to 1 times the chord."""
    if not tangent:
        return 0j
    speed = min(max(abs(free), abs(chord) / 4.0), abs(chord))
    return tangent / abs(tangent) * speed


def _derivatives(
    q: Complex, start: EndCondition, end: EndCondition, first: complex, last: complex
) -> Complex:
    """Derivatives at the points; `first`, `last` are clamped values where not 0."""
    lower = np.ones(q.size, dtype=np.complex128)
    diagonal, upper, rhs = 4.0 * lower, lower.copy(), np.zeros_like(q)
    rhs[1:-1] = 3.0 * (q[2:] - q[:-2])
    diagonal[0], upper[0], rhs[0] = _end_row(start, first, q[1] - q[0], q.size)
    diagonal[-1], lower[-1], rhs[-1] = _end_row(end, last, q[-1] - q[-2], q.size)
    return solve_tridiagonal(lower, diagonal, upper, rhs)


def _end_row(
    condition: EndCondition, clamped: complex, chord: complex, points: int
) -> tuple[float, float, complex]:
    if clamped:
        return 1.0, 0.0, clamped
    if condition.name == "natural" or points == 2:
        return 2.0, 1.0, 3.0 * chord
    return 1.0, 1.0, 2.0 * chord
