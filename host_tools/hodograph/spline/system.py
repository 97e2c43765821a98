# SPDX-License-Identifier: MIT
"""The interpolation system (13) of the paper with its end conditions; docs/theory/numerics.md section 2.

Unknowns z_1 … z_M (complex, mm^(1/2)), one per span. The two values beyond the ends follow
linearly:

    open    z_0 = a z_1 + b z_2 + c     and the same, mirrored, at the end
    closed  z_0 = e z_M,  z_(M+1) = e z_1,  e = +1 or -1

Spans have parameter length 1, as in the paper, or lengths of their own (`knots`): docs/theory/spatial-splines.md 1.

Used by spline/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .banded import solve_cyclic, solve_tridiagonal
from .bernstein import Complex, Real
from .knots import KnotSpans


@dataclass(frozen=True)
class EndRule:
    """Outer value = `first` * nearest z + `second` * next z + `constant`."""

    first: float
    second: float
    constant: complex


def clamped_end(w: complex) -> EndRule:
    """w at the end is given: (z_0 + z_1) / 2 = w, so the end derivative is w^2."""
    return EndRule(-1.0, 0.0, 2.0 * w)


NATURAL_END = EndRule(1.0, 0.0, 0.0j)
"""w' = 0 at the end: the curvature vanishes there."""


def cubic_end(share: float) -> EndRule:
    """w linear in the end span, which is a PH cubic then. Needs two spans.

    `share`: KnotSpans.after of the first span, or before of the last; 1/2 for uniform knots.
    """
    return EndRule(1.0 + 2.0 * share, -2.0 * share, 0.0j)


CUBIC_END = cubic_end(0.5)


def coefficients_between(extended: Complex, knots: KnotSpans | None = None) -> Complex:
    """Bernstein coefficients (M, 3) of w from z_0 … z_(M+1), for xi from 0 to 1 on each span; paper (11)."""
    if knots is None:
        joints = (extended[1:] + extended[:-1]) / 2.0
        return np.stack((joints[:-1], extended[1:-1], joints[1:]), axis=-1)
    parts = np.stack(_mixed(extended, knots), axis=-1)
    return np.asarray(np.sqrt(knots.length)[:, None] * parts)


def _mixed(x: Complex, knots: KnotSpans) -> tuple[Complex, Complex, Complex]:
    """Bernstein coefficients (M,) of dr/dt = w^2, t the spline's parameter."""
    first = knots.before * x[:-2] + (1.0 - knots.before) * x[1:-1]
    last = (1.0 - knots.after) * x[1:-1] + knots.after * x[2:]
    return first, x[1:-1], last


@dataclass(frozen=True)
class System:
    """Chords q_i - q_(i-1) (M,) with end rules, or `cyclic_sign` e for a closed curve (0: open).

    Without `knots`, spans have parameter length 1, and z is exactly that of the paper.
    """

    chords: Complex
    start: EndRule = NATURAL_END
    end: EndRule = NATURAL_END
    cyclic_sign: int = 0
    knots: KnotSpans | None = None

    def with_chords(self, chords: Complex) -> System:
        """This system for other chords (M,)."""
        return replace(self, chords=chords)

    def sizes(self, residual: Complex) -> Real:
        """Magnitude (M,) of the residual of each span."""
        return np.asarray(np.abs(residual))

    def largest_term(self, z: Complex) -> float:
        """Magnitude of the largest term of (13)."""
        return 60.0 * float(np.abs(z).max()) ** 2

    def outer(self, z: Complex) -> tuple[complex, complex]:
        """z_0 and z_(M+1)."""
        if self.cyclic_sign:
            return complex(self.cyclic_sign * z[-1]), complex(self.cyclic_sign * z[0])
        second = min(1, z.size - 1)
        before = self.start.first * z[0] + self.start.second * z[second] + self.start.constant
        after = self.end.first * z[-1] + self.end.second * z[-1 - second] + self.end.constant
        return complex(before), complex(after)

    def extended(self, z: Complex) -> Complex:
        """z_0 … z_(M+1)."""
        out = np.empty(z.size + 2, dtype=np.complex128)
        out[1:-1] = z
        out[0], out[-1] = self.outer(z)
        return out

    def coefficients(self, z: Complex) -> Complex:
        """Bernstein coefficients (M, 3) of w per span."""
        return coefficients_between(self.extended(z), self.knots)

    def part(self, low: int, high: int, start: EndRule, end: EndRule) -> System:
        """The equations of spans low … high - 1 with other ends."""
        knots = None if self.knots is None else self.knots.part(low, high)
        return System(self.chords[low:high], start, end, knots=knots)

    def residual_mm(self, z: Complex) -> Complex:
        """The error of each span's chord, mm."""
        share = 60.0 if self.knots is None else 60.0 / self.knots.length
        return np.asarray(self.residual(z) / share)

    def residual(self, z: Complex) -> Complex:
        """Left side of (13): 60 times the integral of w^2 over each span, less 60 chords; with knots, by length."""
        x = self.extended(z)
        if self.knots is not None:
            a, b, c = _mixed(x, self.knots)
            means = 12.0 * (a * (a + b) + c * (b + c)) + 8.0 * b * b + 4.0 * a * c
            return np.asarray(means - 60.0 * self.chords / self.knots.length)
        before, after = x[:-2], x[2:]
        out: Complex = (
            3.0 * (before * before + after * after)
            + before * after
            + z * (27.0 * z + 13.0 * (before + after))
            - 60.0 * self.chords
        )
        return out

    def newton_step(self, z: Complex, residual: Complex) -> Complex:
        """-J(z)^-1 residual. Raises SingularSystem."""
        lower, diagonal, upper = self._derivatives(self.extended(z))
        if self.cyclic_sign:
            lower[0] *= self.cyclic_sign
            upper[-1] *= self.cyclic_sign
            return solve_cyclic(lower, diagonal, upper, -residual)
        diagonal[0] += self.start.first * lower[0]
        diagonal[-1] += self.end.first * upper[-1]
        if z.size > 1:
            upper[0] += self.start.second * lower[0]
            lower[-1] += self.end.second * upper[-1]
        return solve_tridiagonal(lower, diagonal, upper, -residual)

    def _derivatives(self, x: Complex) -> tuple[Complex, Complex, Complex]:
        """Of each row by the value before, its own and the one after."""
        before, z, after = x[:-2], x[1:-1], x[2:]
        if self.knots is None:
            lower = 6.0 * before + after + 13.0 * z
            upper = 6.0 * after + before + 13.0 * z
            return lower, 54.0 * z + 13.0 * (before + after), upper
        a, b, c = _mixed(x, self.knots)
        by_a, by_c = 24.0 * a + 12.0 * b + 4.0 * c, 24.0 * c + 12.0 * b + 4.0 * a
        by_b = 12.0 * a + 16.0 * b + 12.0 * c
        share, other = self.knots.before, self.knots.after
        return share * by_a, (1.0 - share) * by_a + by_b + (1.0 - other) * by_c, other * by_c
