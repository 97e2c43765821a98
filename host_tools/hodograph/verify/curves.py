# SPDX-License-Identifier: MIT
"""The segments of a program in powers of their parameter xi, in the plane and in space; docs/reference/protocol.md 1.2.
Used by verify/cells and verify/instants. No I/O.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..program import Program
from .polynomials import values

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Int = NDArray[np.int64]

_NEWTON_STEPS = 6
"""Steps from an arc length to its curve parameter."""


@dataclass(frozen=True, eq=False)
class Curve(ABC):
    """N segments: `start_mm` (N,) arc length at the start of each, `arc` (N, 6) arc length within it as powers of xi;
    mm.
    """

    start_mm: Real
    arc: Real

    @abstractmethod
    def speed(self, segment: Int) -> Real:
        """Powers (K, 5) of sigma."""

    @abstractmethod
    def directions(self, segment: Int) -> list[Real]:
        """Powers (K, 5) of the derivative of each axis by xi."""

    @abstractmethod
    def turn(self, segment: Int) -> Real | Complex:
        """Powers (K, 3) of curvature * sigma^2: signed in the plane, in space a complex number of that magnitude."""

    def parameter(self, segment: Int, arc_mm: Real) -> Real:
        """xi at an arc length within the segment, both (K,). Newton's method; docs/theory/numerics.md 12 proves that it
        converges.
        """
        arc = self.arc[segment]
        xi = arc_mm / arc.sum(axis=1)
        for _ in range(_NEWTON_STEPS):
            xi = xi - (values(arc, xi) - arc_mm) / values(arc, xi, 1)
        return np.asarray(xi)

    def ends(self, segment: Int, distance: Real) -> Real:
        """xi at u = 0 and 1 of cells, (C, 2)."""
        first, last = (
            self.parameter(segment, end) for end in (distance[:, 0], distance.sum(axis=1))
        )
        return np.stack((first, last), axis=1)


@dataclass(frozen=True, eq=False)
class PlaneCurve(Curve):
    """w = u + iq (N, 3): r' = w^2."""

    w: Complex

    def speed(self, segment: Int) -> Real:
        """|w|^2."""
        w = self.w[segment]
        return np.stack([speed_power(w, k) for k in range(5)], axis=1)

    def directions(self, segment: Int) -> list[Real]:
        """Of x and y."""
        a0, a1, a2 = self.w[segment].T
        direction = np.stack((a0 * a0, 2 * a0 * a1, a1 * a1 + 2 * a0 * a2, 2 * a1 * a2, a2 * a2), 1)
        return [np.ascontiguousarray(part) for part in (direction.real, direction.imag)]

    def turn(self, segment: Int) -> Real:
        """2 Im(conj(w) w')."""
        a0, a1, a2 = self.w[segment].T
        products = (np.conj(a0) * a1, 2.0 * np.conj(a0) * a2, np.conj(a1) * a2)
        return np.stack([2.0 * one.imag for one in products], axis=1)


@dataclass(frozen=True, eq=False)
class SpaceCurve(Curve):
    """A = u + v i + p j + q k (4, N, 3): r' = A i A*; and the derivatives (E, N, 5) of the extra axes."""

    a: Real
    extra: Real

    def speed(self, segment: Int) -> Real:
        """|A|^2."""
        return np.asarray(sum(_product(one, one) for one in self.a[:, segment]))

    def directions(self, segment: Int) -> list[Real]:
        """Of x, y, z and the extra axes."""
        u, v, p, q = self.a[:, segment]
        along = _product(u, u) + _product(v, v) - _product(p, p) - _product(q, q)
        left = 2.0 * (_product(u, q) + _product(v, p))
        up = 2.0 * (_product(v, q) - _product(u, p))
        return [along, left, up, *self.extra[:, segment]]

    def turn(self, segment: Int) -> Complex:
        """2 (a b' - a' b) with a = u + i v, b = q + i p: |r' x r''| = sigma times its magnitude."""
        u, v, p, q = self.a[:, segment]
        (a0, a1, a2), (b0, b1, b2) = (u + 1j * v).T, (q + 1j * p).T
        products = (a0 * b1 - a1 * b0, 2.0 * (a0 * b2 - a2 * b0), a1 * b2 - a2 * b1)
        return np.stack([2.0 * one for one in products], axis=1)


def curve_of(program: Program) -> Curve:
    """The exact geometry of a program, in doubles."""
    start = np.ldexp(program.start_q40.astype(np.float64), -40)
    every = np.arange(program.segment_count)
    if program.axis_count == 2:
        u, q = program.a_q44
        w: Complex = _to_powers(2.0**-44 * (u + 1j * q))
        speed = PlaneCurve(start, np.zeros((len(w), 6)), w).speed(every)
        return PlaneCurve(start, _integral(speed), w)
    a = np.stack([_to_powers(np.ldexp(one.astype(np.float64), -44)) for one in program.a_q44])
    bezier = np.ldexp(program.extra_q40.astype(np.float64), -40)
    extra = (
        np.stack([_slope(one) for one in bezier]) if len(bezier) else np.zeros((0, len(start), 5))
    )
    speed = SpaceCurve(start, np.zeros((len(start), 6)), a, extra).speed(every)
    return SpaceCurve(start, _integral(speed), a, extra)


def speed_power(w: Complex, power: int) -> Real:
    """Coefficient of xi^power of sigma = |w|^2, (N,)."""
    pairs = [(j, power - j) for j in range(3) if 0 <= power - j <= 2]
    return np.asarray(sum((w[:, j] * np.conj(w[:, k])).real for j, k in pairs))


def _integral(speed: Real) -> Real:
    return np.concatenate((np.zeros((len(speed), 1)), speed / np.arange(1.0, 6.0)), axis=1)


def _to_powers(bernstein: Any) -> Any:
    b0, b1, b2 = bernstein.T
    return np.stack((b0, 2.0 * (b1 - b0), b0 - 2.0 * b1 + b2), axis=1)


def _slope(bezier: Real) -> Real:
    """Powers (N, 5) of the derivative of quintics with Bezier coefficients 0 and these (N, 5)."""
    d0, d1, d2, d3, d4 = 5.0 * np.diff(bezier, axis=1, prepend=0.0).T
    return np.stack(
        (
            d0,
            4.0 * (d1 - d0),
            6.0 * (d2 - 2.0 * d1 + d0),
            4.0 * (d3 - 3.0 * d2 + 3.0 * d1 - d0),
            d4 - 4.0 * d3 + 6.0 * d2 - 4.0 * d1 + d0,
        ),
        axis=1,
    )


def _product(a: Real, b: Real) -> Real:
    """Powers (K, 5) of the product of quadratics (K, 3)."""
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.stack(
        (a0 * b0, a0 * b1 + a1 * b0, a0 * b2 + a1 * b1 + a2 * b0, a1 * b2 + a2 * b1, a2 * b2),
        axis=1,
    )
