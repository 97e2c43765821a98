# SPDX-License-Identifier: MIT
"""Arc length of a chain of PH segments, and its inverse; docs/theory/numerics.md 4.1, 4.3. Used by curve, frames and
spatial/curve. No I/O.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..native.ph_chain import PhChain
from .bernstein import Real, basis

Index = NDArray[np.intp]

EXACT = 2.0**-52
"""Tolerance of `locate`, relative: the spacing of doubles."""


class ArcLengthChain(ABC):
    """Segments whose parametric speed is a polynomial of degree 4; base of PHSpline and SpatialPHSpline with all that
    depends on arc length only.

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

    @property
    @abstractmethod
    def chain(self) -> PhChain:
        """The coefficients of sigma for the native module."""

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
        segment, xi = self.chain.locate(np.clip(s, 0.0, length).ravel(), tolerance)
        return segment.reshape(s.shape), xi.reshape(s.shape)


def evaluate(coefficients: Any, segment: ArrayLike, xi: ArrayLike) -> Any:
    """Polynomials with Bernstein coefficients (N, k), or (N, dimensions, k), at `xi` of `segment`."""
    x = np.asarray(xi, dtype=np.float64)
    values = basis(coefficients.shape[-1] - 1, x)
    i = np.asarray(segment, dtype=np.intp)
    if coefficients.ndim == 3:
        values = values[..., None, :]
    return np.asarray(np.sum(coefficients[i] * values, axis=-1))
