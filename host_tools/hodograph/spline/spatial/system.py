# SPDX-License-Identifier: MIT
"""Sets up and solves the equations of a spline in space: three equations and three unknowns for each span
(docs/theory/spatial-splines.md section 3). Used by spatial/build. No I/O.

The curve's preimage A has one quaternion coefficient Z_i (mm^(1/2)) for each of the M spans. A frame R_i is given:
Z_i = R_i (a + b j + c k) with the real unknowns a, b, c. The coefficients beyond the ends follow linearly from the two
nearest ones (`SpaceEndRule`):

    open    Z_0 = first Z_1 + second Z_2 + constant     and the same, mirrored, at the end
    closed  Z_0 = Z_M e^(-i phase),  Z_(M+1) = Z_1 e^(i phase)     phase: turn of the frame around the closed path
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bernstein import Real
from ..knots import KnotSpans
from .banded import solve_blocks, solve_ring
from .quaternion import across_fibre, left, polar, turned


@dataclass(frozen=True, eq=False)
class SpaceEndRule:
    """Outer value = `first` * nearest Z + `second` * next Z + `constant` (4,)."""

    first: float
    second: float
    constant: Real


def tangent_end(value: Real) -> SpaceEndRule:
    """A at the end is given: (Z_0 + Z_1) / 2 = `value` (4,)."""
    return SpaceEndRule(-1.0, 0.0, 2.0 * value)


NATURAL_END = SpaceEndRule(1.0, 0.0, np.zeros(4))
"""A' = 0 at the end: the curvature vanishes there."""


def cubic_end(share: float) -> SpaceEndRule:
    """A linear in the end span, which is a PH cubic then. Needs two spans.

    `share`: KnotSpans.after of the first span, or before of the last.
    """
    return SpaceEndRule(1.0 + 2.0 * share, -2.0 * share, np.zeros(4))


@dataclass(frozen=True, eq=False)
class SpaceSystem:
    """Chords (M, 3) in mm, knots, the frame R (M, 4) and ends; `phase` (rad) of a closed path, else None."""

    chords: Real
    knots: KnotSpans
    frame: Real
    start: SpaceEndRule = NATURAL_END
    end: SpaceEndRule = NATURAL_END
    phase: float | None = None

    def with_chords(self, chords: Real) -> SpaceSystem:
        """This system for other chords (M, 3)."""
        return replace(self, chords=chords)

    def sizes(self, residual: Real) -> Real:
        """Greatest component (M,) of the residual of each span."""
        return np.asarray(np.abs(residual).max(axis=1))

    def largest_term(self, unknown: Real) -> float:
        """Magnitude of the largest term that is summed in the residual."""
        return 60.0 * float(np.sum(self.values(unknown) ** 2, axis=1).max())

    @property
    def first_guess(self) -> Real:
        """Unknowns (M, 3) for which Z is the frame."""
        return np.tile([1.0, 0.0, 0.0], (self.frame.shape[0], 1))

    def values(self, unknown: Real) -> Real:
        """Z_1 … Z_M (M, 4) from the unknowns (M, 3)."""
        return np.asarray((across_fibre(self.frame) @ unknown[:, :, None])[:, :, 0])

    def extended(self, unknown: Real) -> Real:
        """Z_0 … Z_(M+1) (M + 2, 4)."""
        z = self.values(unknown)
        out = np.empty((z.shape[0] + 2, 4))
        out[1:-1] = z
        if self.phase is not None:
            out[0], out[-1] = turned(z[-1], -self.phase), turned(z[0], self.phase)
            return out
        second = min(1, z.shape[0] - 1)
        out[0] = self.start.first * z[0] + self.start.second * z[second] + self.start.constant
        out[-1] = self.end.first * z[-1] + self.end.second * z[-1 - second] + self.end.constant
        return out

    def coefficients(self, unknown: Real) -> Real:
        """Bernstein coefficients (M, 4, 3) of A on each span, for a parameter that runs from 0 to 1 on it."""
        parts = np.stack(self._mixed(self.extended(unknown)), axis=-1)
        return np.asarray(parts * np.sqrt(self.knots.length)[:, None, None])

    def residual(self, unknown: Real) -> Real:
        """(M, 3): 60 times the mean of A i A* over each span, less 60 chords by the length of the span."""
        a, b, c = self._mixed(self.extended(unknown))
        means = 12.0 * (polar(a, a + b) + polar(c, b + c)) + 8.0 * polar(b, b) + 4.0 * polar(a, c)
        return np.asarray(means - 60.0 * self.chords / self.knots.length[:, None])

    def residual_mm(self, unknown: Real) -> Real:
        """The error of each span's chord, mm."""
        return np.asarray(self.residual(unknown) * (self.knots.length[:, None] / 60.0))

    def newton_step(self, unknown: Real, residual: Real) -> Real:
        """-J^-1 residual. Raises SingularSystem."""
        lower, diagonal, upper = self._derivatives(self.extended(unknown))
        basis = across_fibre(self.frame)
        rhs = -residual
        if self.phase is not None:
            last, first = turned(basis[-1].T, -self.phase).T, turned(basis[0].T, self.phase).T
            around = np.concatenate((last[None], basis, first[None]))
            return solve_ring(lower @ around[:-2], diagonal @ basis, upper @ around[2:], rhs)
        diagonal[0] += self.start.first * lower[0]
        diagonal[-1] += self.end.first * upper[-1]
        if unknown.shape[0] > 1:
            upper[0] += self.start.second * lower[0]
            lower[-1] += self.end.second * upper[-1]
        before, after = np.roll(basis, 1, axis=0), np.roll(basis, -1, axis=0)
        return solve_blocks(lower @ before, diagonal @ basis, upper @ after, rhs)

    def _mixed(self, x: Real) -> tuple[Real, Real, Real]:
        """Bernstein coefficients (M, 4) of dr/dt = A i A* by the spline's parameter."""
        before, after = self.knots.before[:, None], self.knots.after[:, None]
        z = x[1:-1]
        return before * x[:-2] + (1.0 - before) * z, z, (1.0 - after) * z + after * x[2:]

    def _derivatives(self, x: Real) -> tuple[Real, Real, Real]:
        """(M, 3, 4), of each row by Z_(i-1), Z_i and Z_(i+1)."""
        a, b, c = self._mixed(x)
        before, after = self.knots.before[:, None, None], self.knots.after[:, None, None]
        by_a = left(24.0 * a + 12.0 * b + 4.0 * c)
        by_b = left(12.0 * a + 16.0 * b + 12.0 * c)
        by_c = left(24.0 * c + 12.0 * b + 4.0 * a)
        own = (1.0 - before) * by_a + by_b + (1.0 - after) * by_c
        return before * by_a, own, after * by_c
