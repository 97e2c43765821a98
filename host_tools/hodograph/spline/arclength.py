# SPDX-License-Identifier: MIT
"""Inverse of the arc length polynomial: safeguarded Newton, vectorised; docs/theory/numerics.md 4.3."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bernstein import Complex, Real, basis

_MOST_STEPS = 200


EXACT = 2.0**-52


def invert(
    arc: Real, w: Complex, segment: NDArray[np.intp], s_mm: Real, tolerance: float = EXACT
) -> Real:
    """xi (n,) in [0, 1] with arc length `s_mm` (n,) from the start of `segment` (n,).

    `arc` (N, 6) are the Bernstein coefficients of the arc length of each segment, `w` (N, 3)
    those of w. The error in arc length is about 1e-15 of the segment's length, or `tolerance`. The bracket
    shrinks every step, so this ends also where the speed all but vanishes.
    """
    length = arc[segment, 5]
    xi = np.clip(s_mm / length, 0.0, 1.0)
    active = np.flatnonzero((xi > 0.0) & (xi < 1.0))
    low, high = np.zeros(xi.size), np.ones(xi.size)
    for _ in range(_MOST_STEPS):
        if active.size == 0:
            break
        i, x = segment[active], xi[active]
        excess = np.sum(arc[i] * basis(5, x), axis=-1) - s_mm[active]
        high[active] = np.where(excess > 0.0, x, high[active])
        low[active] = np.where(excess < 0.0, x, low[active])
        value = np.sum(w[i] * basis(2, x), axis=-1)
        speed = value.real * value.real + value.imag * value.imag
        with np.errstate(divide="ignore", invalid="ignore"):
            step = excess / speed
        lo, hi = low[active], high[active]
        newton = x - step
        inside = (newton > lo) & (newton < hi)
        moved = np.where(inside, newton, (lo + hi) / 2.0)
        done = np.abs(excess) <= tolerance * length[active]
        xi[active] = np.where(done, x, moved)
        active = active[~done & (np.abs(moved - x) > 2.0**-53)]
    return np.asarray(xi)
