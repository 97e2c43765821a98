# SPDX-License-Identifier: MIT
"""Quality of a solution: turning of the tangent and bending energy; docs/theory/numerics.md 3.2. Used by
loops.py, solve.py and verdict.py.

The spline has the hodograph w^2 with a quadratic w; the guide curve has a plain quadratic hodograph. `Shape` handles
both: it takes the quadratic and its power.

No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .bernstein import Complex, Real, basis, factor_angles, restricted, rotation
from .extremum import curvature_numerator


def _rule(points: int, panels: int) -> tuple[Real, Real]:
    """Composite Gauss-Legendre quadrature on [0, 1]: quadratic Bernstein values (3, n), weights."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    xi = (np.arange(panels)[:, None] + (nodes + 1.0) / 2.0) / panels
    return basis(2, xi.ravel()).T, np.tile(weights / (2.0 * panels), panels)


_SMOOTH = _rule(6, 1)
"""Quadrature of usual spans."""
_SHARPER = ((0.5 * np.pi, _rule(12, 2)), (0.75 * np.pi, _rule(16, 8)))
"""Finer quadratures, each for spans in which one root turns its factor by more than an angle, rad."""


@dataclass(frozen=True)
class Shape:
    """Spans with hodograph quadratic^power, power 1 or 2, from coefficients (N, 3)."""

    quadratic: Complex
    power: int

    @cached_property
    def _angles(self) -> tuple[Real, Real]:
        return factor_angles(self.quadratic)

    @property
    def turning(self) -> Real:
        """Net turning of the tangent over each span; rad, not modulo 2 pi, left positive."""
        return np.asarray(self.power * (self._angles[0] + self._angles[1]))

    @property
    def sharpest(self) -> Real:
        """Greatest turning (rad) that one root causes; near power * pi close to a cusp."""
        return np.asarray(self.power * np.maximum(np.abs(self._angles[0]), np.abs(self._angles[1])))

    @property
    def most_turning(self) -> Real:
        """Quick upper bound (rad) of total_turning: a root turns the tangent one way only."""
        return np.asarray(self.power * (np.abs(self._angles[0]) + np.abs(self._angles[1])))

    @cached_property
    def _numerator(self) -> Real:
        return curvature_numerator(self.quadratic)

    @cached_property
    def total_turning(self) -> Real:
        """Integral of |curvature| over arc length (rad): left and right both count."""
        out = np.abs(self.turning)
        numerator = self._numerator
        bends = np.flatnonzero(numerator.min(axis=1) * numerator.max(axis=1) < 0.0)
        if bends.size:
            out[bends] = self.power * _piecewise_turning(self.quadratic[bends], numerator[bends])
        return np.asarray(out)

    @cached_property
    def bending(self) -> Real:
        """Integral of curvature^2 over arc length (1/mm).

        Gauss quadrature of 6 points; of 2 panels of 12, or 8 of 16, where a root is so close that its factor turns by
        more than 90, or 135, degrees. The result has two correct digits or more, except next to a cusp, where it is
        very large anyway.
        """
        out = self._quadrature(slice(None), _SMOOTH)
        for angle, rule in _SHARPER:
            sharp = np.flatnonzero(self.sharpest > self.power * angle)
            if sharp.size:
                out[sharp] = self._quadrature(sharp, rule)
        return out

    def _quadrature(self, spans: Any, rule: tuple[Real, Real]) -> Real:
        """Curvature^2 * speed is c^2 / |w|^6 for PH spans and (c / 2)^2 / |h|^5 for others."""
        values, weights = rule
        quadratic, numerator = self.quadratic[spans, :, None], self._numerator[spans, :, None]
        at = quadratic[:, 0] * values[0] + quadratic[:, 1] * values[1] + quadratic[:, 2] * values[2]
        top = (
            numerator[:, 0] * values[0] + numerator[:, 1] * values[1] + numerator[:, 2] * values[2]
        )
        square_modulus = at.real * at.real + at.imag * at.imag
        below = square_modulus * square_modulus * square_modulus
        if self.power == 1:
            below = 4.0 * below / np.sqrt(square_modulus)
        with np.errstate(all="ignore"):
            return np.asarray(np.sum(top * top / below * weights, axis=-1))


def _piecewise_turning(quadratic: Complex, numerator: Real) -> Real:
    """Total rotation (rad) of quadratics whose direction of turning changes at zeros of `numerator`."""
    first, middle, last = np.moveaxis(numerator, -1, 0)
    b, a = 2.0 * (middle - first), last - 2.0 * middle + first
    root = np.sqrt(np.maximum(b * b - 4.0 * a * first, 0.0))
    plus = np.where(b >= 0.0, b + root, b - root)
    with np.errstate(all="ignore"):
        zeros = np.stack((-plus / (2.0 * a), -2.0 * first / plus))
    zeros = np.sort(np.clip(np.where(np.isfinite(zeros), zeros, 0.0), 0.0, 1.0), axis=0)
    bounds = np.concatenate((np.zeros((1, first.size)), zeros, np.ones((1, first.size))))
    parts = restricted(quadratic[None], bounds[:-1], bounds[1:])
    return np.asarray(np.abs(rotation(parts)).sum(axis=0))
