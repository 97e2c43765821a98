# SPDX-License-Identifier: MIT
"""The greatest curvature of PH quintic segments, found by bounds and not by samples; docs/theory/numerics.md 4.4. Used
by spline/. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .bernstein import Complex, Real, halves, square_modulus

_RELATIVE_GAP = 1e-13
"""Relative difference of bound and value at which the search ends."""
_MOST_ROUNDS = 60
"""How often intervals are halved."""


def curvature_numerator(w: Complex) -> Real:
    """Bernstein coefficients (…, 3) of 2 Im(conj(w) w'), whose cubic term cancels."""
    first, second, third = w[..., 0], w[..., 1], w[..., 2]
    out = np.stack(
        (2.0 * np.conj(first) * second, np.conj(first) * third, 2.0 * np.conj(second) * third),
        axis=-1,
    )
    return np.asarray(2.0 * out.imag)


def greatest_curvature(
    w: Any,
    numerator_of: Callable[[Any], Any] = curvature_numerator,
    speed_of: Callable[[Any], Real] = square_modulus,
) -> float:
    """Greatest |curvature| (1/mm) over segments with w (N, 3), to 1e-13 relative.

    In space, with preimages (N, 4, 3) and their image, curvature is |numerator| / speed^2.

    Branch and bound: |kappa| = |A| / sigma^2 lies below max |A_k| / min(sigma_k)^2 of the
    Bernstein coefficients, a bound whose gap shrinks with the square of the interval. Infinite
    for a cusp.
    """
    best = 0.0
    for _ in range(_MOST_ROUNDS):
        numerator, speed = np.abs(numerator_of(w)), speed_of(w)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = numerator[:, ::2] / speed[:, ::4] ** 2
            bound = numerator.max(axis=1) / np.maximum(speed.min(axis=1), 0.0) ** 2
        ends[np.isnan(ends)] = np.inf
        bound[np.isnan(bound)] = np.inf
        best = max(best, float(ends.max()))
        w = w[bound > best * (1.0 + _RELATIVE_GAP)]
        if w.size == 0:
            break
        w = np.concatenate(halves(w)) * np.sqrt(0.5)
    return best
