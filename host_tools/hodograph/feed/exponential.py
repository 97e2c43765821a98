# SPDX-License-Identifier: MIT
"""What paper (18) adds to the quintic ramp: E(tau; n); docs/theory/numerics.md 5.2.

    E = (1 - e^(n tau)) A(tau) - (1 - e^(n (1 - tau))) A(1 - tau)
    A = tau (1 - tau)^4 + 4 tau^2 (1 - tau)^3

and the feed is V_f Q(tau) + T E(tau), Q the plain quintic.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from .series import DISPLACEMENT, FEED

Real = NDArray[np.float64]

_ORDERS = 5
_GAUSS_X, _GAUSS_W = (v / 2.0 for v in np.polynomial.legendre.leggauss(24))


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


def _derivatives(p: Real) -> Real:
    """Coefficients (_ORDERS, 6) of p and its derivatives."""
    out = np.zeros((_ORDERS, 6))
    for k in range(_ORDERS):
        out[k, : p.size] = p
        p = np.asarray(polynomial.polyder(p))
    return out


# A and A(1 - tau) in powers of tau.
_HUMP = _derivatives(np.array([0.0, 1.0, 0.0, -6.0, 8.0, -3.0]))
_MIRROR = _derivatives(np.array([0.0, 0.0, 0.0, 4.0, -7.0, 3.0]))
