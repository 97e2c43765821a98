# SPDX-License-Identifier: MIT
"""A spline as the integer segments of a program, in exact integer arithmetic; docs/theory/numerics.md section 8.

Products of q44 numbers are q88 and need up to 104 bits: numpy object arrays of Python integers, about
1 us a segment and product.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spline import PHSpline

Int = NDArray[np.int64]
Big = NDArray[np.object_]

WAY_SCALE = 15
"""Ways of segments are exact multiples of 2^-88 / 15 mm."""


def segment_ways(u_q44: Int, v_q44: Int) -> tuple[Big, Big, Big]:
    """Integral over [0, 1] of Re w^2, Im w^2 and |w|^2 of each segment (N,), times 15 * 2^88.

    15 times the integral of a b is, for quadratics in Bernstein form,
    3 a0 b0 + 3 a2 b2 + 2 a1 b1 + 3/2 (a0 b1 + a1 b0 + a1 b2 + a2 b1) + 1/2 (a0 b2 + a2 b0).
    """
    u, v = u_q44.astype(object), v_q44.astype(object)
    uu, vv, uv2 = _double_inner(u, u), _double_inner(v, v), _double_inner(u, v)
    return (uu - vv) // 2, uv2, (uu + vv) // 2


def _double_inner(a: Big, b: Big) -> Big:
    """30 times the integral of the product; even when a is b."""
    cross = a[:, 0] * b[:, 1] + a[:, 1] * (b[:, 0] + b[:, 2]) + a[:, 2] * b[:, 1]
    ends = a[:, 0] * b[:, 2] + a[:, 2] * b[:, 0]
    return np.asarray(
        6 * (a[:, 0] * b[:, 0] + a[:, 2] * b[:, 2]) + 4 * a[:, 1] * b[:, 1] + 3 * cross + ends
    )


def way_to_q40(way: Big) -> Int:
    """Ways (integers over 15 * 2^88) rounded to 2^-40 mm."""
    unit = WAY_SCALE << 48
    return np.asarray((2 * way + unit) // (2 * unit), dtype=np.int64)


def cumulative(way: Big) -> Big:
    """Ways at the joints (N + 1,), 0 first, exactly."""
    out = np.zeros(way.size + 1, dtype=object)
    out[1:] = np.add.accumulate(way)
    return out


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
