# SPDX-License-Identifier: MIT
"""Feed ramps from rest to a feed, as functions of time; docs/theory/feed.md section 5. Used by feed/, paper/compare and
report/feed_figures. No I/O.

A `Ramp` is a polynomial (quintic: paper (17); minimax: least peak jerk) and, for profile "exponential", the part that
paper (18) adds:

    E = (1 - e^(n tau)) A(tau) - (1 - e^(n (1 - tau))) A(1 - tau)
    A = tau (1 - tau)^4 + 4 tau^2 (1 - tau)^3

with the feed V_f Q(tau) + T E(tau), Q the plain quintic. Its slope coefficient n_c is given or found by a pattern
search. Each profile is antisymmetric about its middle, V(tau) + V(1 - tau) = V_f. Only the first half is computed and
the second follows from it, so that rounding does not break the symmetry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import comb

import numpy as np
from numpy.polynomial import chebyshev, legendre, polynomial
from numpy.typing import ArrayLike, NDArray

from ..errors import PlanError
from .request import FeedRequest

Real = NDArray[np.float64]

DISPLACEMENT, FEED, ACCELERATION, JERK, SNAP = -1, 0, 1, 2, 3
"""Orders of time derivative of the feed."""

INITIAL_MESH = 1.0
"""Mesh of the first step of the pattern search for n_c."""
MESH_TOLERANCE = 1e-6
"""The search ends when its mesh is at most this."""
MOST_ITERATIONS = 1000
"""The search ends after this number of steps."""

N_C_START, N_C_LOW, N_C_HIGH = 5.0, 2.0, 12.0
REVERSE_MM_S = -(2.0**-14)
"""A feed below this counts as reverse motion. (18) always goes a little below 0; the format refuses -2^-10 mm/s."""

_ORDERS = 5
"""Derivatives of the polynomials below, from the feed on."""
_GAUSS_X, _GAUSS_W = (v / 2.0 for v in np.polynomial.legendre.leggauss(24))

_PEAK_GRID = np.linspace(0.0, 0.5, 193)
"""Times of the first half of a ramp, as shares of it, at which peaks are searched; exact by Newton afterwards."""
_LOW_GRID = np.unique(np.concatenate((np.geomspace(1e-6, 0.5, 160), np.linspace(0.0, 0.5, 97))))
"""As _PEAK_GRID, with places near the start, where the feed may be negative."""


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

        Any shape. Times outside the ramp by rounding give the analytic continuation.
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
        """Least feed of the ramp, mm/s; below 0 if (18) makes it negative or, which is the same by symmetry, greater
        than the end feed.
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


@dataclass(frozen=True, eq=False)
class Shape:
    """A ramp, the steps of the search for it (empty without one), and notes for the user."""

    ramp: Ramp
    history: tuple[SearchStep, ...] = ()
    note: str | None = None


def make_shape(request: FeedRequest, feed_mm_s: float) -> Shape:
    """The ramp of `request` at another feed. Raises PlanError: the given n_c causes reverse motion."""
    time_s = request.ramp_time_s
    if request.profile == "quintic":
        return Shape(quintic_ramp(feed_mm_s, time_s))
    if request.profile == "minimax":
        return Shape(minimax_ramp(feed_mm_s, time_s, request.degree))
    if isinstance(request.n_c, str):
        return optimise_n_c(feed_mm_s, time_s)
    ramp = exponential_ramp(feed_mm_s, time_s, request.n_c)
    lowest = ramp.lowest_feed()
    if lowest < REVERSE_MM_S:
        raise PlanError(
            f"feed: n_c = {request.n_c:g} asks for reverse motion at {feed_mm_s:.6g} mm/s within "
            f'{time_s:g} s (the feed falls to {lowest:.3g} mm/s): give n_c = "optimise"'
        )
    return Shape(ramp)


@lru_cache(maxsize=64)
def optimise_n_c(feed_mm_s: float, time_s: float) -> Shape:
    """The exponential ramp of least peak jerk, by the paper's search; the plain quintic if none is better."""

    def objective(n_c: float) -> float:
        ramp = exponential_ramp(feed_mm_s, time_s, n_c)
        return ramp.peak(JERK) if ramp.lowest_feed() >= REVERSE_MM_S else float("inf")

    history = pattern_search(objective, N_C_START, N_C_LOW, N_C_HIGH)
    best = history[-1]
    plain = exponential_ramp(feed_mm_s, time_s, 0.0)
    if not best.value < plain.peak(JERK):
        note = (
            f"n_c = 0 (the plain quintic ramp): at {feed_mm_s:.6g} mm/s within {time_s:g} s no n_c in "
            f"{N_C_LOW:g} … {N_C_HIGH:g} lowers the peak jerk"
        )
        return Shape(plain, history, note)
    ramp = exponential_ramp(feed_mm_s, time_s, best.best)
    if min(best.best - N_C_LOW, N_C_HIGH - best.best) < 1e-5:
        return Shape(ramp, history, f"n_c = {best.best:g} is at a bound of the search")
    return Shape(ramp, history)


@dataclass(frozen=True)
class SearchStep:
    """State after one iteration: evaluations so far, best point and value, mesh size for the next."""

    iteration: int
    evaluations: int
    best: float
    value: float
    mesh: float


def pattern_search(
    objective: Callable[[float], float], start: float, low: float, high: float
) -> tuple[SearchStep, ...]:
    """Minimises `objective` over low … high from `start`; the last step holds the result.

    Points outside the bounds are not polled. Step 0 is the start. The rules are the documented defaults of MATLAB's
    `patternsearch`, which the paper used: poll +1 then -1, take the first better point, double the mesh after success
    and halve it after failure, end when the mesh is below its tolerance.
    """
    best, value, mesh = start, objective(start), INITIAL_MESH
    evaluations = 1
    steps = [SearchStep(0, evaluations, best, value, mesh)]
    while mesh > MESH_TOLERANCE and len(steps) <= MOST_ITERATIONS:
        better = False
        for candidate in (best + mesh, best - mesh):
            if not low <= candidate <= high:
                continue
            evaluations += 1
            found = objective(candidate)
            if found < value:
                best, value, better = candidate, found, True
                break
        mesh = mesh * 2.0 if better else mesh / 2.0
        steps.append(SearchStep(len(steps), evaluations, best, value, mesh))
    return tuple(steps)


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


def minimax_nodes(degree: int) -> tuple[Real, Real]:
    """Positive nodes and weights, on [-1, 1], of the rule that is the dual solution for `degree`.

    Gauss-Legendre for m even, Gauss-Lobatto (last node 1) for m odd, m = (degree - 1) // 2.
    """
    m = (degree - 1) // 2
    x: Real
    w: Real
    if m % 2 == 0:
        x, w = legendre.leggauss(m + 1)
        return np.asarray(x[x > 1e-9]), np.asarray(w[x > 1e-9])
    count = m + 2
    p = np.zeros(count)
    p[-1] = 1.0
    inner = np.sort(legendre.legroots(legendre.legder(p)).real)
    x = np.concatenate((inner[inner > 1e-9], (1.0,)))
    w = np.asarray(2.0 / (count * (count - 1) * legendre.legval(x, p) ** 2), dtype=np.float64)
    return x, w


def minimax_peak(degree: int) -> float:
    """Least peak jerk of `degree`, in units of V_f / T^2; 6, 4.648, 4.382 … towards 4 (bang-bang)."""
    x, w = minimax_nodes(degree)
    return float(2.0 / (w @ x))


@lru_cache(maxsize=32)
def minimax_feed(degree: int) -> Real:
    """Chebyshev coefficients, in x = 2 tau - 1, of the feed of least peak jerk over the end feed (V(-1) = 0, V(1) = 1).

    The linear program "least peak of an odd polynomial g (the jerk) with a given first moment" has a Gauss quadrature
    as its dual solution, so its solution is known in closed form: g has its peak at the positive nodes of the rule,
    with slope 0 at inner nodes. The tests compare with the solution of the linear program. An even degree has the same
    optimum as the odd one below it.
    """
    x, _ = minimax_nodes(degree)
    m = (degree - 1) // 2
    peak = minimax_peak(degree)
    basis = np.eye(2 * m)[:, 1::2]  # columns T_1, T_3 … T_(2m-1)
    inner = x[x < 1.0]
    rows = [chebyshev.chebval(x, basis).T]
    rows.append(chebyshev.chebval(inner, chebyshev.chebder(basis)).T)
    right = np.concatenate((np.full(x.size, -peak), np.zeros(inner.size)))
    jerk = basis @ np.linalg.solve(np.vstack(rows), right)
    acceleration = chebyshev.chebint(jerk, lbnd=-1.0, scl=0.5)
    feed = chebyshev.chebint(acceleration, lbnd=-1.0, scl=0.5)
    feed[0] = 0.5
    feed[2::2] = 0.0
    out: Real = np.asarray(feed / (2.0 * feed[1::2].sum()), dtype=np.float64)
    out[0] = 0.5
    out.flags.writeable = False
    return out


def exponential_part(order: int, n_c: float, tau: Real) -> Real:
    """Derivative `order` (DISPLACEMENT … SNAP + 1) of E with respect to tau, any shape."""
    if order == DISPLACEMENT:
        inner = exponential_part(FEED, n_c, tau[..., None] * (_GAUSS_X + 0.5))
        return np.asarray(tau * (inner @ _GAUSS_W))
    # Leibniz: the k-th derivative of e^(a tau) P is e^(a tau) sum of C(k, j) a^(k - j) P^(j).
    binomial = np.array([comb(order, j) for j in range(order + 1)], dtype=np.float64)
    powers = n_c ** np.arange(order, -1, -1.0)
    signs = (-1.0) ** np.arange(order, -1, -1)
    rise = (binomial * powers) @ _HUMP[: order + 1]
    fall = (binomial * powers * signs) @ _MIRROR[: order + 1]
    rest = _HUMP[order] - _MIRROR[order]
    monomials = tau[..., None] ** np.arange(6)
    plain, rising, falling = np.moveaxis(monomials @ np.stack((rest, rise, fall)).T, -1, 0)
    growth = np.exp(n_c * tau)
    return np.asarray(plain - growth * rising + np.exp(n_c) / growth * falling)


def _polynomial_derivatives(p: Real) -> Real:
    """Coefficients (_ORDERS, 6) of p and its derivatives."""
    out = np.zeros((_ORDERS, 6))
    for k in range(_ORDERS):
        out[k, : p.size] = p
        p = np.asarray(polynomial.polyder(p))
    return out


# A and A(1 - tau) in powers of tau.
_HUMP = _polynomial_derivatives(np.array([0.0, 1.0, 0.0, -6.0, 8.0, -3.0]))
_MIRROR = _polynomial_derivatives(np.array([0.0, 0.0, 0.0, 4.0, -7.0, 3.0]))
