# SPDX-License-Identifier: MIT
"""Certain bounds of the second derivatives in time of the motion's quantities within a cell.

Between two samples at a distance h, a function with |q''| <= M is at most M h^2 / 8 above the greater of the two. So
such bounds turn samples into statements about every instant; docs/theory/proofs.md 16. They come from Taylor series
with majorants: coefficients that bound those of the true series at every instant of the cell. Sums and products of
majorants are majorants, and so is 1 / sigma with the recursion of the quotient taken in absolute values.

Used by verify/peaks. No I/O.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cells import Cells
from .instants import Motion
from .polynomials import bernstein, shifted, taylor_bounds

Real = NDArray[np.float64]
Series = list[Real]
"""Coefficients of ascending powers of time, (C,) each."""

_ORDERS = 5
"""Terms of the Taylor expansions in time."""
_LEAST_WIDTH = 1e-6
"""Least width of a cell in the curve parameter, to avoid a division by 0."""


def bends(cells: Cells) -> Motion:
    """Bounds (C,) of the second derivative in time of each quantity of the motion, over each cell."""
    distance = list(taylor_bounds(cells.distance, cells.duration_s, _ORDERS))
    geometry = _Geometry(cells)
    xi = _parameter(distance, geometry)
    slope = [(k + 1) * xi[k + 1] for k in range(_ORDERS)]
    turn = _times(_composed(geometry.turn, xi, 2), _times(slope, slope, 2), 2)
    axes = [_times(_composed(one, xi, 4), slope, 4) for one in geometry.direction]
    return Motion(
        feed=6.0 * distance[3],
        acceleration=24.0 * distance[4],
        jerk=120.0 * distance[5],
        centripetal=2.0 * turn[2],
        axis_velocity=tuple(2.0 * one[2] for one in axes),
        axis_acceleration=tuple(6.0 * one[3] for one in axes),
        axis_jerk=tuple(24.0 * one[4] for one in axes),
    )


class _Geometry:
    """Over the stretch of curve in each cell: bounds of |derivative k| / k! in xi, and 1 / sigma."""

    def __init__(self, cells: Cells) -> None:
        curve, segment = cells.curve, cells.segment
        low = cells.xi.min(axis=1)
        width = np.maximum(cells.xi.max(axis=1) - low, _LEAST_WIDTH)
        sigma = shifted(curve.speed(segment), low, width)
        self.inverse = 1.0 / bernstein(sigma).min(axis=1)
        self.speed = taylor_bounds(sigma, width, 4)
        self.direction = [
            taylor_bounds(shifted(one, low, width), width, 4) for one in curve.directions(segment)
        ]
        self.turn = taylor_bounds(shifted(curve.turn(segment), low, width), width, 2)


def _parameter(distance: Series, geometry: _Geometry) -> Series:
    """Majorants of xi(t), from sigma(xi) xi' = F'; the constant term is 0, xi counts from the instant."""
    xi = [np.zeros_like(distance[0])]
    inverse: Series = []
    for order in range(_ORDERS):
        if order == 0:
            inverse.append(geometry.inverse)
        else:
            speed = _composed(geometry.speed, xi, order)
            terms = sum(speed[k] * inverse[order - k] for k in range(1, order + 1))
            inverse.append(geometry.inverse * np.asarray(terms))
        feed = [(k + 1) * distance[k + 1] for k in range(order + 1)]
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
