# SPDX-License-Identifier: MIT
"""q = feed^2 over arc length, a C1 piecewise cubic, graded next to rest; docs/theory/feed.md 5.6. Used by
optimal/constraints and optimal/window. No I/O.

On interval i, q(s) = sigma'(x)^2 p(x), s = sigma(x), p a cubic. Inside the path sigma is the identity. Next to rest at
s = a it is a + x^3 (or its mirror), since q is proportional to s^(4/3) there: in x, p is smooth and F''' = 6 p^(3/2).
The unknowns at a knot are q and dq/ds; at rest, where both vanish, p and dp/dx.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_GRADED_RATIO = 2.5
"""An interval is graded if its distance from rest is less than this multiple of its length."""
_LEAST_GRADED = 3
"""Intervals next to a rest that are graded whatever their length."""

GAUSS_X, GAUSS_W = (v / 2.0 for v in np.polynomial.legendre.leggauss(8))
"""Abscissas, later shifted to 0 ... 1, and weights of Gauss-Legendre quadrature on an interval of length 1."""
GAUSS_X = GAUSS_X + 0.5


@dataclass(frozen=True, eq=False)
class Grid:
    """Knots (n + 1,) in arc length; grade (n,): 1 graded from rest at the first knot, -1 to rest at the last, 0 plain.

    x0, h  (n,) start of each interval in x, and its length in x
    """

    s: Real
    grade: NDArray[np.int8]
    x0: Real
    h: Real
    maps: Real  # (2, 4, n): (p, dp/dx) at both ends from (q, dq/ds) there

    @property
    def size(self) -> int:
        """Number of intervals."""
        return int(self.h.size)

    def sigma(self, interval: Index, u: Real) -> tuple[Real, Real, Real, Real]:
        """sigma and its three derivatives by x at u in [0, 1] of intervals."""
        return _sigma(self.grade[interval], self.x0[interval] + u * self.h[interval], self.s)

    def basis(self, interval: Index, u: Real) -> tuple[Real, Real, Real]:
        """p, p', p'' (by x) as rows (m, 4) on the unknowns at both knots of an interval."""
        h = self.h[interval]
        maps = self.maps[:, :, interval]
        return tuple(  # type: ignore[return-value]
            np.stack(
                (
                    b[0] * maps[0, 0] + b[1] * maps[0, 2],
                    b[0] * maps[0, 1] + b[1] * maps[0, 3],
                    b[2] * maps[1, 0] + b[3] * maps[1, 2],
                    b[2] * maps[1, 1] + b[3] * maps[1, 3],
                ),
                axis=-1,
            )
            for b in _hermite(u, h)
        )


def make_grid(s: Real, from_rest: bool) -> Grid:
    """The grid over knots `s`, which ends at rest, and begins at rest or in motion."""
    n = s.size - 1
    step = np.diff(s)
    grade = np.zeros(n, dtype=np.int8)
    index = np.arange(n)
    down = (s[-1] - s[1:] < _GRADED_RATIO * step) | (index >= n - _LEAST_GRADED)
    up = (s[:-1] - s[0] < _GRADED_RATIO * step) | (index < _LEAST_GRADED)
    half = n // 2
    up[half:] = False
    down[:half] = False
    # Graded intervals are those next to the end, without gaps.
    up = np.logical_and.accumulate(up)
    down = np.logical_and.accumulate(down[::-1])[::-1]
    if from_rest:
        grade[up] = 1
    grade[down] = -1
    x = s.copy()
    x0 = np.where(
        grade > 0, np.cbrt(s[:-1] - s[0]), np.where(grade < 0, -np.cbrt(s[-1] - s[:-1]), x[:-1])
    )
    x1 = np.where(
        grade > 0, np.cbrt(s[1:] - s[0]), np.where(grade < 0, -np.cbrt(s[-1] - s[1:]), x[1:])
    )
    maps = np.empty((2, 4, n))
    for end, at in enumerate((x0, x1)):
        _, s1, s2, _ = _sigma(grade, at, s)
        moving = s1 > 0.0
        safe = np.where(moving, s1, 1.0)
        maps[end, 0] = 1.0 / safe**2
        maps[end, 1] = 0.0
        maps[end, 2] = np.where(moving, -2.0 * s2 / safe**3, 0.0)
        maps[end, 3] = 1.0 / safe
    return Grid(s, grade, x0, x1 - x0, maps)


def _sigma(grade: NDArray[np.int8], x: Real, s: Real) -> tuple[Real, Real, Real, Real]:
    """Graded intervals: a + x^3 from the start, b + x^3 with x < 0 to the end."""
    graded = grade != 0
    origin = np.where(grade > 0, s[0], s[-1])
    return (
        np.where(graded, origin + x**3, x),
        np.where(graded, 3.0 * x * x, 1.0),
        np.where(graded, 6.0 * x, 0.0),
        np.where(graded, 6.0, 0.0),
    )


def _hermite(u: Real, h: Real) -> tuple[tuple[Real, ...], ...]:
    """Cubic Hermite basis for (p0, p0', p1, p1') on [0, h] and two derivatives."""
    one = np.ones_like(h)
    return (
        (
            (1 + 2 * u) * (1 - u) ** 2 * one,
            u * (1 - u) ** 2 * h,
            u * u * (3 - 2 * u) * one,
            u * u * (u - 1) * h,
        ),
        (
            (6 * u * u - 6 * u) / h,
            (1 - 4 * u + 3 * u * u) * one,
            (6 * u - 6 * u * u) / h,
            (3 * u * u - 2 * u) * one,
        ),
        ((12 * u - 6) / h**2, (6 * u - 4) / h, (6 - 12 * u) / h**2, (6 * u - 2) / h),
    )


def corners(grid: Grid, interval: Index, q: Real, slope: Real) -> Real:
    """The four unknowns (m, 4) of intervals."""
    return np.stack((q[interval], slope[interval], q[interval + 1], slope[interval + 1]), axis=-1)


def durations(grid: Grid, q: Real, slope: Real) -> Real:
    """Time (n,) that each interval takes; s."""
    interval = np.arange(grid.size)
    values = corners(grid, interval, q, slope)
    total = np.zeros(grid.size)
    for x, weight in zip(GAUSS_X, GAUSS_W, strict=True):
        p = np.sum(grid.basis(interval, np.full(grid.size, x))[0] * values, axis=-1)
        total += weight / np.sqrt(np.maximum(p, 1e-300))
    return total * grid.h


def squared_feed(grid: Grid, q: Real, slope: Real, s: Real) -> Real:
    """q at arc lengths within the grid."""
    interval = np.clip(np.searchsorted(grid.s, s, side="right") - 1, 0, grid.size - 1)
    grade = grid.grade[interval]
    x = np.where(
        grade > 0,
        np.cbrt(s - grid.s[0]),
        np.where(grade < 0, -np.cbrt(grid.s[-1] - s), s),
    )
    u = (x - grid.x0[interval]) / grid.h[interval]
    p = np.sum(grid.basis(interval, u)[0] * corners(grid, interval, q, slope), axis=-1)
    _, s1, _, _ = grid.sigma(interval, u)
    return np.asarray(p * s1 * s1)
