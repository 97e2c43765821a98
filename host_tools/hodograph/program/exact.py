# SPDX-License-Identifier: MIT
"""Reference evaluation of a program in 50 digits; needs mpmath (a development dependency).

The curve and the feed exactly as docs/reference/protocol.md 1.2 and 1.3 define them. For tests of the kernels; slow
on purpose (about 1 ms a point).

Used by tests only. No I/O.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import mpmath

from .image import Program

DIGITS = 50
"""Decimal digits of the arithmetic."""


@dataclass(frozen=True)
class ExactPoint:
    """Arc length, point (by axis), feed and its derivatives as mpmath numbers; mm, s."""

    arc_length_mm: Any
    point_mm: tuple[Any, ...]
    feed_mm_s: Any
    acceleration_mm_s2: Any
    jerk_mm_s3: Any


class ExactProgram:
    """A program to be evaluated at any time."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._starts = [int(s) for s in program.start_q40]
        self._times = [0]
        for duration in program.pieces.duration_q32_s:
            self._times.append(self._times[-1] + int(duration))

    def at(self, time_q32_s: int) -> ExactPoint:
        """The point at a time in 2^-32 s, clipped to the program."""
        return self.at_q42(time_q32_s << 10)

    def at_q42(self, time_q42_s: int) -> ExactPoint:
        """The point at a time in 2^-42 s, as ticks have it, clipped to the program."""
        with mpmath.workdps(DIGITS):
            s, feed, acceleration, jerk = self._arc_length(time_q42_s)
            return ExactPoint(s, self._point(s), feed, acceleration, jerk)

    def _arc_length(self, time_q42_s: int) -> tuple[Any, Any, Any, Any]:
        time = min(max(int(time_q42_s), 0), self._times[-1] << 10)
        i = min(bisect_right(self._times, time >> 10) - 1, len(self._times) - 2)
        piece = self._program.pieces[i]
        scale = mpmath.mpf(2) ** piece.exponent
        tau = mpmath.ldexp(time - (self._times[i] << 10), -42) / scale
        c = [mpmath.ldexp(v, -40) for v in (piece.start_q40, *piece.c_q40)]
        values = []
        for order in range(4):
            values.append(_horner(c, tau) / scale**order)
            c = [k * v for k, v in enumerate(c)][1:]
        return values[0], values[1], values[2], values[3]

    def _point(self, s: Any) -> tuple[Any, ...]:
        p = self._program
        key = int(mpmath.floor(mpmath.ldexp(s, 40)))
        i = min(max(bisect_right(self._starts, key) - 1, 0), len(self._starts) - 1)
        a = [[mpmath.ldexp(int(b), -44) for b in one[i]] for one in p.a_q44]
        distance = s - mpmath.ldexp(self._starts[i], -40)
        direction, sigma = _direction(a), _sum(*(_product(one, one) for one in a))
        xi = distance / (sum(sigma) / 5)
        for _ in range(12):
            move = (_integral(sigma, xi) - distance) / _bernstein(sigma, xi)
            xi -= move
            if abs(move) < mpmath.mpf(10) ** (5 - DIGITS):
                break
        distances = [_integral(one, xi) for one in direction]
        for extra in p.extra_q40:
            own = [mpmath.mpf(0), *(mpmath.ldexp(int(b), -40) for b in extra[i])]
            distances.append(_bernstein(own, xi))
        return tuple(
            mpmath.ldexp(int(start), -40) + one
            for start, one in zip(p.point_q40[:, i], distances, strict=True)
        )


def _horner(c: list[Any], tau: Any) -> Any:
    """Value at a place of the polynomial with coefficients c, lowest power first."""
    value = mpmath.mpf(0)
    for v in reversed(c):
        value = value * tau + v
    return value


def _direction(a: list[Any]) -> list[Any]:
    """Bernstein coefficients of r' by axis: w^2 of u, q, or A i A* of u, v, p, q."""
    if len(a) == 2:
        u, q = a
        return [_sum(_product(u, u), _product(q, q), sign=-1), _sum(_product(u, q), _product(u, q))]
    u, v, p, q = a
    across = _sum(_product(u, q), _product(v, p)), _sum(_product(v, q), _product(u, p), sign=-1)
    along = _sum(_product(u, u), _product(v, v)), _sum(_product(p, p), _product(q, q))
    return [_sum(*along, sign=-1), *(_sum(one, one) for one in across)]


def _sum(*terms: list[Any], sign: int = 1) -> list[Any]:
    """The first plus the others times `sign`."""
    first, *others = terms
    return [c + sign * sum(more) for c, *more in zip(first, *others, strict=True)]


def _product(a: list[Any], b: list[Any]) -> list[Any]:
    """Bernstein coefficients of the product of two quadratics."""
    return [
        a[0] * b[0],
        (a[0] * b[1] + a[1] * b[0]) / 2,
        (4 * a[1] * b[1] + a[0] * b[2] + a[2] * b[0]) / 6,
        (a[1] * b[2] + a[2] * b[1]) / 2,
        a[2] * b[2],
    ]


def _bernstein(c: list[Any], xi: Any) -> Any:
    degree = len(c) - 1
    return sum(
        mpmath.binomial(degree, k) * v * xi**k * (1 - xi) ** (degree - k) for k, v in enumerate(c)
    )


def _integral(c: list[Any], xi: Any) -> Any:
    sums = [mpmath.mpf(0)]
    for v in c:
        sums.append(sums[-1] + v / len(c))
    return _bernstein(sums, xi)
