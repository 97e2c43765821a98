# SPDX-License-Identifier: MIT
"""One ramp from rest to a feed, as a function of time; docs/theory/numerics.md section 5.

Every profile is antisymmetric about its middle, V(tau) + V(1 - tau) = V_f, so only the first half is
ever computed and the second follows: no rounding breaks the symmetry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .exponential import exponential_part
from .series import (
    ACCELERATION,
    DISPLACEMENT,
    FEED,
    JERK,
    SNAP,
    Series,
    minimax_series,
    quintic_series,
)

__all__ = [
    "ACCELERATION",
    "DISPLACEMENT",
    "FEED",
    "JERK",
    "SNAP",
    "Ramp",
    "exponential_ramp",
    "minimax_ramp",
    "quintic_ramp",
]

Real = NDArray[np.float64]

_PEAK_GRID = np.linspace(0.0, 0.5, 193)
_LOW_GRID = np.unique(np.concatenate((np.geomspace(1e-6, 0.5, 160), np.linspace(0.0, 0.5, 97))))


@dataclass(frozen=True, eq=False)
class Ramp:
    """Feed from 0 to `feed_mm_s` within `time_s`, zero acceleration at both ends.

    series  the polynomial part, over the end feed
    n_c     slope coefficient of the exponential part (18), None without
    """

    feed_mm_s: float
    time_s: float
    series: Series
    n_c: float | None = None

    def value(self, order: int, t_s: ArrayLike) -> Real:
        """Derivative `order` of the feed (DISPLACEMENT … SNAP) at times 0 … time_s; mm, s.

        Any shape. Times a rounding outside the ramp are good for the analytic continuation.
        """
        tau = np.asarray(t_s, dtype=np.float64) / self.time_s
        second = tau > 0.5
        half = self._first_half(order, np.where(second, 1.0 - tau, tau))
        if order == DISPLACEMENT:
            mirrored = half + self.feed_mm_s * self.time_s * (tau - 0.5)
        elif order == FEED:
            mirrored = self.feed_mm_s - half
        else:
            mirrored = half if order % 2 else -half
        return np.asarray(np.where(second, mirrored, half))

    def peak(self, order: int) -> float:
        """Greatest magnitude of ACCELERATION or JERK over the ramp, at its true extremum."""
        if self.n_c is None:
            return self.feed_mm_s / self.time_s**order * self.series.peak(order)
        values = np.abs(self._first_half(order, _PEAK_GRID))
        return float(max(values.max(), self._refined(order, values)))

    def lowest_feed(self) -> float:
        """Least feed of the ramp, mm/s: 0, or below where (18) makes it dip under 0 or, which by the
        symmetry is the same, rise over the end feed.
        """
        values = self._first_half(FEED, _LOW_GRID)
        lowest = 0.0
        for sign, base in ((1.0, 0.0), (-1.0, self.feed_mm_s)):
            worst = int((sign * values).argmin())
            ends = _LOW_GRID[max(worst - 1, 0)], _LOW_GRID[min(worst + 1, _LOW_GRID.size - 1)]
            near = sign * self._first_half(FEED, np.linspace(*ends, 33))
            lowest = min(lowest, base + float(near.min()))
        return lowest

    def _first_half(self, order: int, tau: Real) -> Real:
        out = self.feed_mm_s / self.time_s**order * self.series.value(order, tau)
        if self.n_c is None:
            return out
        return out + self.time_s ** (1 - order) * exponential_part(order, self.n_c, tau)

    def _refined(self, order: int, values: Real) -> float:
        """Value at the extremum nearest to the highest grid points, by Newton on the derivative."""
        inner = (values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:])
        tau = _PEAK_GRID[1:-1][inner & (values[1:-1] > 0.98 * values.max())]
        step = _PEAK_GRID[1]
        for _ in range(3):
            slope = self._first_half(order + 1, tau)
            bend = self._first_half(order + 2, tau)
            move = -slope / np.where(bend == 0.0, np.inf, bend) / self.time_s
            tau = np.clip(tau + np.clip(move, -step, step), 0.0, 0.5)
        return float(np.abs(self._first_half(order, tau)).max(initial=0.0))


def quintic_ramp(feed_mm_s: float, time_s: float) -> Ramp:
    """Paper (17) with all end derivatives zero."""
    return Ramp(feed_mm_s, time_s, quintic_series())


def exponential_ramp(feed_mm_s: float, time_s: float, n_c: float) -> Ramp:
    """Paper (17) with (18)."""
    return Ramp(feed_mm_s, time_s, quintic_series(), n_c)


def minimax_ramp(feed_mm_s: float, time_s: float, degree: int) -> Ramp:
    """The polynomial of `degree` with zero end acceleration and the least peak jerk."""
    return Ramp(feed_mm_s, time_s, minimax_series(degree))
