# SPDX-License-Identifier: MIT
"""A polynomial ramp of unit feed and unit time with its derivatives; docs/theory/numerics.md section 5."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from .minimax import minimax_feed

Real = NDArray[np.float64]

DISPLACEMENT, FEED, ACCELERATION, JERK, SNAP = -1, 0, 1, 2, 3
"""Orders of time derivative of the feed."""


@dataclass(frozen=True, eq=False)
class Series:
    """Chebyshev coefficients in x = 2 tau - 1 of the integral (first), the feed and its derivatives."""

    coefficients: tuple[Real, ...]

    def value(self, order: int, tau: ArrayLike) -> Real:
        """Derivative `order` (DISPLACEMENT … SNAP + 1) with respect to tau."""
        x = 2.0 * np.asarray(tau, dtype=np.float64) - 1.0
        return np.asarray(chebyshev.chebval(x, self.coefficients[order + 1]), dtype=np.float64)

    def peak(self, order: int) -> float:
        """Greatest magnitude of a derivative over tau in [0, 1], at its true extremum."""
        roots = chebyshev.chebroots(self.coefficients[order + 2])
        real = roots[np.abs(roots.imag) < 1e-7].real
        places = np.concatenate((real[np.abs(real) <= 1.0], np.array([-1.0, 0.0, 1.0])))
        return float(np.abs(chebyshev.chebval(places, self.coefficients[order + 1])).max())


def _series(feed: Real) -> Series:
    out = [chebyshev.chebint(feed, lbnd=-1.0, scl=0.5), feed]
    for _ in range(ACCELERATION, SNAP + 2):
        out.append(chebyshev.chebder(out[-1], scl=2.0))
    return Series(tuple(np.asarray(c, dtype=np.float64) for c in out))


@lru_cache(maxsize=1)
def quintic_series() -> Series:
    """10 tau^3 - 15 tau^4 + 6 tau^5: paper (17) with all end derivatives zero."""
    powers_of_x = np.array([8.0, 15.0, 0.0, -10.0, 0.0, 3.0]) / 16.0
    return _series(np.asarray(chebyshev.poly2cheb(powers_of_x), dtype=np.float64))


@lru_cache(maxsize=32)
def minimax_series(degree: int) -> Series:
    """The polynomial of least peak jerk."""
    return _series(minimax_feed(degree))
