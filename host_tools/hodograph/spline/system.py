# SPDX-License-Identifier: MIT
"""The interpolation system (13) of the paper with its end conditions; docs/theory/numerics.md section 2.

Unknowns z_1 … z_M (complex, mm^(1/2)), one per span. The two values beyond the ends follow
linearly:

    open    z_0 = a z_1 + b z_2 + c     and the same, mirrored, at the end
    closed  z_0 = e z_M,  z_(M+1) = e z_1,  e = +1 or -1
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .banded import solve_cyclic, solve_tridiagonal
from .bernstein import Complex


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

CUBIC_END = EndRule(2.0, -1.0, 0.0j)
"""w linear in the end span, which is a PH cubic then. Needs two spans."""


def coefficients_between(extended: Complex) -> Complex:
    """Bernstein coefficients (M, 3) of w from z_0 … z_(M+1); paper (11)."""
    joints = (extended[1:] + extended[:-1]) / 2.0
    return np.stack((joints[:-1], extended[1:-1], joints[1:]), axis=-1)


@dataclass(frozen=True)
class System:
    """Chords q_i - q_(i-1) (M,) with end rules, or `cyclic_sign` e for a closed curve (0: open)."""

    chords: Complex
    start: EndRule = NATURAL_END
    end: EndRule = NATURAL_END
    cyclic_sign: int = 0

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
        return coefficients_between(self.extended(z))

    def residual(self, z: Complex) -> Complex:
        """Left side of (13): 60 times the integral of w^2 over each span, less 60 chords."""
        x = self.extended(z)
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
        x = self.extended(z)
        before, after = x[:-2], x[2:]
        lower = 6.0 * before + after + 13.0 * z
        upper = 6.0 * after + before + 13.0 * z
        diagonal = 54.0 * z + 13.0 * (before + after)
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
