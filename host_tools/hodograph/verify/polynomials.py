# SPDX-License-Identifier: MIT
"""Many polynomials at once: values, shifted intervals, and bounds from Bernstein coefficients.

Arrays of coefficients are (C, n + 1): ascending powers, one polynomial in each row; real, or complex where only
magnitudes count. A polynomial lies between its least and its greatest Bernstein coefficient (Farouki 2012, section 3),
so the bounds here are certain up to rounding.

Used by verify/. No I/O.
"""

from __future__ import annotations

from functools import cache
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def values(coefficients: Real, x: Real, order: int = 0) -> Real:
    """The derivative `order` of row i at x[i], (C,)."""
    out = np.zeros_like(x)
    for power in range(coefficients.shape[1] - 1, order - 1, -1):
        out = out * x + _falling(power, order) * coefficients[:, power]
    return out


def shifted(coefficients: Any, start: Real, width: Real) -> Any:
    """These polynomials in u, x = start + width u, (C, n + 1)."""
    degree = coefficients.shape[1] - 1
    out = np.empty_like(coefficients)
    for power in range(degree + 1):
        terms = np.zeros_like(start)
        for upper in range(degree, power - 1, -1):
            terms = terms * start + comb(upper, power) * coefficients[:, upper]
        out[:, power] = terms * width**power
    return out


def bernstein(coefficients: Any, order: int = 0) -> Any:
    """Bernstein coefficients over [0, 1] of the derivative `order` divided by order!, (C, n + 1 - order)."""
    degree = coefficients.shape[1] - 1
    if order > degree:
        return np.zeros((coefficients.shape[0], 1))
    scale = np.array([comb(power, order) for power in range(order, degree + 1)], dtype=np.float64)
    return np.asarray((coefficients[:, order:] * scale) @ _to_bernstein(degree - order))


def taylor_bounds(coefficients: Any, width: Real, orders: int) -> Real:
    """Bounds (orders + 1, C) over u in [0, 1] of |derivative k| / k!, per x where u = x / width."""
    return np.stack(
        [np.abs(bernstein(coefficients, k)).max(axis=1) / width**k for k in range(orders + 1)]
    )


@cache
def _to_bernstein(degree: int) -> Real:
    rows = range(degree + 1)
    return np.array([[comb(i, j) / comb(degree, j) if j <= i else 0.0 for i in rows] for j in rows])


def _falling(power: int, order: int) -> float:
    out = 1.0
    for k in range(order):
        out *= power - k
    return out
