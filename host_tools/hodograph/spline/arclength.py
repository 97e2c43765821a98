# SPDX-License-Identifier: MIT
"""Arc length of a chain of PH segments, and its inverse by safeguarded Newton; docs/theory/numerics.md 4.1, 4.3."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .bernstein import Real, basis

Index = NDArray[np.intp]
SpeedAt = Callable[[Index, Real], Real]

_MOST_STEPS = 200


EXACT = 2.0**-52


class ArcLengthChain(ABC):
    """Segments whose parametric speed is a polynomial of degree 4: what their arc length alone decides.

    All methods take arrays of any one shape (or scalars) and give arrays of that shape. Arc lengths outside 0 …
    length_mm, beyond rounding, raise InputError.
    """

    @property
    @abstractmethod
    def speed_coefficients(self) -> Real:
        """Bernstein coefficients (N, 5) of sigma."""

    @abstractmethod
    def speed(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """sigma, mm per unit of xi."""

    @cached_property
    def _arc_coefficients(self) -> Real:
        steps = np.zeros((self.speed_coefficients.shape[0], 6))
        steps[:, 1:] = self.speed_coefficients / 5.0
        return np.asarray(np.cumsum(steps, axis=1))

    @property
    def segment_lengths_mm(self) -> Real:
        """Exact arc length (N,) of each segment."""
        return self._arc_coefficients[:, 5]

    @cached_property
    def segment_starts_mm(self) -> Real:
        """Arc length (N + 1,) at the joints, 0 first, `length_mm` last."""
        total = np.cumsum(self.segment_lengths_mm.astype(np.longdouble))
        return np.concatenate((np.zeros(1), total.astype(np.float64)))

    @property
    def length_mm(self) -> float:
        """Arc length of the whole path."""
        return float(self.segment_starts_mm[-1])

    def arc_length(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """Arc length (10) from the start of the segment; mm."""
        return np.asarray(evaluate(self._arc_coefficients, segment, xi))

    def locate(self, s_mm: ArrayLike, tolerance: float = EXACT) -> tuple[Index, Real]:
        """Segment and xi of the points at arc lengths `s_mm`, to about 1e-13 of the segment, or `tolerance`."""
        s = np.asarray(s_mm, dtype=np.float64)
        length = self.length_mm
        slack = 1e-9 * length
        if not np.all((s >= -slack) & (s <= length + slack)):
            worst = s[~((s >= -slack) & (s <= length + slack))].flat[0]
            raise InputError(f"arc length {worst:g} mm is outside the path, 0 … {length:g} mm")
        s = np.clip(s, 0.0, length)
        starts = self.segment_starts_mm
        segment = np.searchsorted(starts[1:-1], s, side="right")
        own = (s - starts[segment]).ravel()
        xi = invert(self._arc_coefficients, self.speed, segment.ravel(), own, tolerance)
        return segment, xi.reshape(s.shape)


def evaluate(coefficients: Any, segment: ArrayLike, xi: ArrayLike) -> Any:
    """Polynomials with Bernstein coefficients (N, k), or (N, dimensions, k), at `xi` of `segment`."""
    x = np.asarray(xi, dtype=np.float64)
    values = basis(coefficients.shape[-1] - 1, x)
    i = np.asarray(segment, dtype=np.intp)
    if coefficients.ndim == 3:
        values = values[..., None, :]
    return np.asarray(np.sum(coefficients[i] * values, axis=-1))


def invert(
    arc: Real, speed_at: SpeedAt, segment: Index, s_mm: Real, tolerance: float = EXACT
) -> Real:
    """xi (n,) in [0, 1] with arc length `s_mm` (n,) from the start of `segment` (n,).

    `arc` (N, 6) are the Bernstein coefficients of the arc length of each segment, `speed_at` is its derivative. The
    error in arc length is about 1e-15 of the segment's length, or `tolerance`. The bracket shrinks every step, so this
    ends also where the speed all but vanishes.
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
        speed = speed_at(i, x)
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
