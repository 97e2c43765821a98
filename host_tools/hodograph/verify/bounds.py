# SPDX-License-Identifier: MIT
"""How fast the motion's quantities can bend within a cell: certain bounds of their second derivatives in time.

Between two samples h apart, a function with |q''| <= M is nowhere more than M h^2 / 8 above the greater of
the two, so such bounds turn samples into statements about every instant; docs/theory/numerics.md 16. They come from
Taylor series with majorants: coefficients that bound those of the true series at every instant of the cell. Sums and
products of majorants are majorants, and so is 1 / sigma with the recursion of the quotient taken in absolute values.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cells import Cells, speed_power
from .instants import Motion
from .polynomials import bernstein, shifted, taylor_bounds

Real = NDArray[np.float64]
Series = list[Real]
"""Coefficients of ascending powers of time, (C,) each."""

_ORDERS = 5
_LEAST_WIDTH = 1e-6


def bends(cells: Cells) -> Motion:
    """Bounds (C,) of the second derivative in time of each quantity of the motion, over each cell."""
    way = list(taylor_bounds(cells.way, cells.duration_s, _ORDERS))
    geometry = _Geometry(cells)
    xi = _parameter(way, geometry)
    slope = [(k + 1) * xi[k + 1] for k in range(_ORDERS)]
    turn = _times(_composed(geometry.turn, xi, 2), _times(slope, slope, 2), 2)
    axes = [_times(_composed(one, xi, 4), slope, 4) for one in geometry.direction]
    return Motion(
        feed=6.0 * way[3],
        acceleration=24.0 * way[4],
        jerk=120.0 * way[5],
        centripetal=2.0 * turn[2],
        axis_velocity=(2.0 * axes[0][2], 2.0 * axes[1][2]),
        axis_acceleration=(6.0 * axes[0][3], 6.0 * axes[1][3]),
        axis_jerk=(24.0 * axes[0][4], 24.0 * axes[1][4]),
    )


class _Geometry:
    """Over the stretch of curve in each cell: bounds of |derivative k| / k! in xi, and 1 / sigma."""

    def __init__(self, cells: Cells) -> None:
        w = cells.curve.w[cells.segment]
        low = cells.xi.min(axis=1)
        width = np.maximum(cells.xi.max(axis=1) - low, _LEAST_WIDTH)
        sigma = shifted(np.stack([speed_power(w, k) for k in range(5)], axis=1), low, width)
        self.inverse = 1.0 / bernstein(sigma).min(axis=1)
        self.speed = taylor_bounds(sigma, width, 4)
        a0, a1, a2 = w.T
        direction = np.stack((a0 * a0, 2 * a0 * a1, a1 * a1 + 2 * a0 * a2, 2 * a1 * a2, a2 * a2), 1)
        self.direction = [
            taylor_bounds(shifted(np.ascontiguousarray(part), low, width), width, 4)
            for part in (direction.real, direction.imag)
        ]
        products = (np.conj(a0) * a1, 2.0 * np.conj(a0) * a2, np.conj(a1) * a2)
        turn = np.stack([2.0 * one.imag for one in products], axis=1)
        self.turn = taylor_bounds(shifted(turn, low, width), width, 2)


def _parameter(way: Series, geometry: _Geometry) -> Series:
    """Majorants of xi(t), from sigma(xi) xi' = F'; the constant term is 0, xi counts from the instant."""
    xi = [np.zeros_like(way[0])]
    inverse: Series = []
    for order in range(_ORDERS):
        if order == 0:
            inverse.append(geometry.inverse)
        else:
            speed = _composed(geometry.speed, xi, order)
            terms = sum(speed[k] * inverse[order - k] for k in range(1, order + 1))
            inverse.append(geometry.inverse * np.asarray(terms))
        feed = [(k + 1) * way[k + 1] for k in range(order + 1)]
        terms = sum(feed[k] * inverse[order - k] for k in range(order + 1))
        xi.append(np.asarray(terms) / (order + 1))
    return xi


def _composed(polynomial: Real, inner: Series, orders: int) -> Series:
    """Sum of polynomial[k] inner^k, inner without constant term, up to time^orders."""
    zero = np.zeros_like(inner[0])
    own = [zero, *inner[1 : orders + 1]]
    out = [polynomial[-1]] + [zero] * orders
    for k in range(len(polynomial) - 2, -1, -1):
        out = _times(out, own, orders)
        out[0] = out[0] + polynomial[k]
    return out


def _times(a: Series, b: Series, orders: int) -> Series:
    return [np.asarray(sum(a[k] * b[n - k] for k in range(n + 1))) for n in range(orders + 1)]
