# SPDX-License-Identifier: MIT
"""A spline as the integer segments of a program; docs/theory/numerics.md section 8."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spline import PHSpline
from .exactmath import cumulative, segment_ways, way_to_q40

Int = NDArray[np.int64]

LONGEST_SEGMENT_MM = 31.875
_ANCHOR_Q40 = 16
"""Points may be moved to those of the ideal curve by this much per joint, 2^-36 mm."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """Integer segments, and the greatest distance of a start point from the ideal curve."""

    start_q40: Int  # (N + 1,), the last is the length
    x_q40: Int
    y_q40: Int
    u_q44: Int
    v_q44: Int
    drift_mm: float


def quantise(path: PHSpline, offset_mm: complex) -> Geometry:
    """Segments of a path: w rounded, then everything else from exact sums of the rounded w. Raises InputError."""
    spline = path.split(LONGEST_SEGMENT_MM, 2.0)
    far = np.abs(np.concatenate((spline.origin, [offset_mm])))
    if not np.all(far < 8192.0):
        raise InputError("path or work offset: a coordinate is beyond the 4096 mm of the format")
    if np.abs(spline.w.view(np.float64)).max(initial=0.0) >= 2.0**18:
        raise InputError("path: a segment is too long for the format")
    u = np.rint(spline.w.real * 2.0**44).astype(np.int64)
    v = np.rint(spline.w.imag * 2.0**44).astype(np.int64)
    dx, dy, ds = (cumulative(way) for way in segment_ways(u, v))
    x, x_drift = _anchored(way_to_q40(dx)[:-1], spline.origin.real, offset_mm.real)
    y, y_drift = _anchored(way_to_q40(dy)[:-1], spline.origin.imag, offset_mm.imag)
    return Geometry(way_to_q40(ds), x, y, u, v, float(np.hypot(x_drift, y_drift).max()))


def _anchored(
    way_q40: Int, ideal_mm: NDArray[np.float64], offset_mm: float
) -> tuple[Int, NDArray[np.float64]]:
    """Start points from exact ways, drawn to the ideal ones as far as joints stay within 2^-36 mm."""
    offset = round(offset_mm * 2**40)
    ideal = np.rint(ideal_mm * 2.0**40).astype(np.int64)
    chained = ideal[0] + way_q40
    pull = ideal - chained
    if np.abs(np.diff(pull)).max(initial=0) > _ANCHOR_Q40:
        pull = np.zeros_like(pull)
    points = chained + pull
    return points + offset, (points - ideal) * 2.0**-40
