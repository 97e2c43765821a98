# SPDX-License-Identifier: MIT
"""One ramp from rest to a feed, as a function of time; docs/numerics.md section 5.

Every profile is antisymmetric about its middle, V(tau) + V(1 - tau) = V_f, so only the first half is
ever computed and the second follows: no rounding breaks the symmetry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import ArrayLike, NDArray

from .minimax import minimax_feed

Real = NDArray[np.float64]

DISPLACEMENT, FEED, ACCELERATION, JERK, SNAP = -1, 0, 1, 2, 3
"""Orders of time derivative of the feed."""

_PEAK_GRID = np.linspace(0.0, 0.5, 193)
_GAUSS_X, _GAUSS_W = (v / 2.0 for v in np.polynomial.legendre.leggauss(24))
_QUINTIC = chebyshev.poly2cheb(np.array([8.0, 15.0, 0.0, -10.0, 0.0, 3.0]) / 16.0)
_HUMP = polynomial.polyadd(
    polynomial.polymul([0, 1], polynomial.polypow([1, -1], 4)),
    polynomial.polymul([0, 0, 4], polynomial.polypow([1, -1], 3)),
)
"""A(tau) = tau (1 - tau)^4 + 4 tau^2 (1 - tau)^3 of docs/numerics.md 5.2."""


@dataclass(frozen=True, eq=False)
class Ramp:
    """Feed from 0 to `feed_mm_s` within `time_s`, zero acceleration at both ends.

    series  Chebyshev coefficients, in 2 tau - 1, of the polynomial part over the end feed
    n_c     slope coefficient of the exponential part (18), None without
    """

    feed_mm_s: float
    time_s: float
    series: Real
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
        """Greatest magnitude of derivative `order` >= 1 over the ramp, at its true extremum."""
        if order == JERK and self.n_c is None:
            return self._scale(order) * self._polynomial_peak(order)
        values = np.abs(self._first_half(order, _PEAK_GRID))
        return float(max(values.max(), self._refined(order, values)))

    def lowest_feed(self) -> float:
        """Least feed of the ramp, mm/s: 0, or a hair below where (18) dips under it."""
        grid = np.concatenate((np.geomspace(1e-6, 0.5, 256), _PEAK_GRID))
        grid.sort()
        values = self._first_half(FEED, grid)
        worst = int(values.argmin())
        near = np.linspace(grid[max(worst - 1, 0)], grid[min(worst + 1, grid.size - 1)], 65)
        return min(0.0, float(self._first_half(FEED, near).min()))

    @property
    def length_mm(self) -> float:
        """Way of the ramp: half of feed times time, by symmetry."""
        return 0.5 * self.feed_mm_s * self.time_s

    def _scale(self, order: int) -> float:
        return self.feed_mm_s / self.time_s**order

    @cached_property
    def _derivatives(self) -> dict[int, Real]:
        antiderivative = chebyshev.chebint(self.series, lbnd=-1.0, scl=0.5)
        table = {DISPLACEMENT: antiderivative, FEED: self.series}
        for order in range(ACCELERATION, SNAP + 2):
            table[order] = chebyshev.chebder(table[order - 1], scl=2.0)
        return table

    @cached_property
    def _humps(self) -> tuple[list[Real], list[Real], list[Real]]:
        """Polynomials p_k, q_k, r_k with E^(k) = p_k + e^(n tau) q_k + e^(n (1 - tau)) r_k."""
        n = float(self.n_c or 0.0)
        mirror = _mirrored(_HUMP)
        p, q, r = [polynomial.polysub(_HUMP, mirror)], [-_HUMP], [mirror]
        for _ in range(SNAP + 1):
            p.append(polynomial.polyder(p[-1]))
            q.append(polynomial.polyadd(polynomial.polyder(q[-1]), n * q[-1]))
            r.append(polynomial.polysub(polynomial.polyder(r[-1]), n * r[-1]))
        return p, q, r

    def _first_half(self, order: int, tau: Real) -> Real:
        x = 2.0 * tau - 1.0
        out = np.asarray(self._scale(order) * chebyshev.chebval(x, self._derivatives[order]))
        if self.n_c is not None:
            out = out + self.time_s ** (1 - order) * self._exponential(order, tau)
        return out

    def _exponential(self, order: int, tau: Real) -> Real:
        if order == DISPLACEMENT:
            inner = self._exponential(FEED, tau[..., None] * (_GAUSS_X + 0.5))
            return np.asarray(tau * (inner @ _GAUSS_W))
        p, q, r = (polynomials[order] for polynomials in self._humps)
        n = float(self.n_c or 0.0)
        rising = np.exp(n * tau) * polynomial.polyval(tau, q)
        falling = np.exp(n * (1.0 - tau)) * polynomial.polyval(tau, r)
        return np.asarray(polynomial.polyval(tau, p) + rising + falling)

    def _polynomial_peak(self, order: int) -> float:
        curve = self._derivatives[order]
        roots = chebyshev.chebroots(self._derivatives[order + 1])
        real = roots[np.abs(roots.imag) < 1e-7].real
        places = np.concatenate((real[np.abs(real) <= 1.0], (-1.0, 0.0, 1.0)))
        return float(np.abs(chebyshev.chebval(places, curve)).max())

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
    return Ramp(feed_mm_s, time_s, _QUINTIC)


def exponential_ramp(feed_mm_s: float, time_s: float, n_c: float) -> Ramp:
    """Paper (17) with (18)."""
    return Ramp(feed_mm_s, time_s, _QUINTIC, n_c)


def minimax_ramp(feed_mm_s: float, time_s: float, degree: int) -> Ramp:
    """The polynomial of `degree` with zero end acceleration and the least peak jerk."""
    return Ramp(feed_mm_s, time_s, minimax_feed(degree))


def _mirrored(p: Real) -> Real:
    """The polynomial p(1 - tau)."""
    out = np.zeros(1)
    for c in p[::-1]:
        out = polynomial.polyadd(polynomial.polymul(out, [1.0, -1.0]), [c])
    return np.asarray(out)
