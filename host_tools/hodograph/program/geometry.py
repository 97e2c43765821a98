# SPDX-License-Identifier: MIT
"""A spline as the integer segments of a program, in exact integer arithmetic; docs/theory/numerics.md section 8. Used
by program/, stream/geometry and section_pipeline. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..fixed_point import MM_PER_Q40, nearest_q40, to_q40
from ..spline import PHSpline
from ..spline.spatial import SpatialPHSpline
from .wide import Wide, product

Int = NDArray[np.int64]
Real = NDArray[np.float64]

ARC_SCALE = 15
"""Arc lengths of segments are exact multiples of 2^-88 / 15 mm."""

# 15 times the integral of a b is, for quadratics in Bernstein form,
# 3 a0 b0 + 3 a2 b2 + 2 a1 b1 + 3/2 (a0 b1 + a1 b0 + a1 b2 + a2 b1) + 1/2 (a0 b2 + a2 b0).
_TWICE = np.array([[6, 3, 1], [3, 4, 3], [1, 3, 6]], dtype=np.int64)
_SQUARE = np.array([[3, 3, 1], [0, 2, 3], [0, 0, 3]], dtype=np.int64)
"""Weights of 30 times the integral of a b, and of 15 times that of a^2."""


def segment_arcs(a_q44: Int) -> tuple[Wide, ...]:
    """Integral over [0, 1] of r' by axis, and of sigma last, of each segment (N,), times 15 * 2^88.

    a_q44  (2, N, 3): w = u + iq, r' = w^2; or (4, N, 3): A = u + v i + p j + q k, r' = A i A*
    """
    squares = [product(one, one, _SQUARE) for one in a_q44]
    if len(a_q44) == 2:
        u, q = a_q44
        return squares[0] - squares[1], product(u, q, _TWICE), squares[0] + squares[1]
    u, v, p, q = a_q44
    first, second = squares[0] + squares[1], squares[2] + squares[3]
    return (
        first - second,
        product(u, q, _TWICE) + product(v, p, _TWICE),
        product(v, q, _TWICE) - product(u, p, _TWICE),
        first + second,
    )


def arc_to_q40(distance: Wide) -> Int:
    """Arc lengths (integers over 15 * 2^88) rounded to 2^-40 mm."""
    low = distance.low + (ARC_SCALE << 47)
    return np.asarray(distance.high + (distance.high + (low >> 48)) // ARC_SCALE)


LONGEST_SEGMENT_MM = 31.875
"""Below the 32 mm of the format."""
PREIMAGE_LIMIT = {2: 64, 4: 8}
"""Components of the preimage are below this, by their number."""
_ANCHOR_Q40 = 16
"""Points may be moved to those of the ideal curve by this much per joint, 2^-36 mm."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """Integer segments, and the greatest distance of a start point from the ideal curve."""

    start_q40: Int  # (N + 1,), the last is the length
    point_q40: Int  # (A, N)
    a_q44: Int  # (2, N, 3) or (4, N, 3)
    extra_q40: Int  # (A - 3, N, 5), (0, 0, 5) in the plane
    drift_mm: float


def quantise(path: PHSpline | SpatialPHSpline, offset_mm: Sequence[float] = ()) -> Geometry:
    """Segments of a path: its preimage is rounded, and all other numbers are exact sums of the rounded one.

    offset_mm  work offset of each axis; (): none. Raises InputError.
    """
    spline = path.split(LONGEST_SEGMENT_MM, 2.0)
    origin, preimage = _real(spline)
    offset = np.asarray(offset_mm if len(offset_mm) else np.zeros(spline.axes), dtype=np.float64)
    far = np.linalg.norm(np.column_stack((origin, offset[: len(origin)])), axis=0)
    if not (np.all(far < 8192.0) and np.all(np.abs(offset) < 8192.0)):
        raise InputError("path or work offset: a coordinate is beyond the 4096 mm of the format")
    if np.abs(preimage).max(initial=0.0) >= 2.0**6:
        raise InputError("path: a segment is too long for the format")
    a_q44 = np.rint(preimage * 2.0**44).astype(np.int64)
    *distances, along = (arc_to_q40(distance.sums()) for distance in segment_arcs(a_q44))
    columns = [
        _anchored(distance[:-1], ideal, by)
        for distance, ideal, by in zip(
            distances, origin, offset[: len(distances)].tolist(), strict=True
        )
    ]
    drift = np.linalg.norm([apart for _, apart in columns], axis=0)
    points = np.stack([point for point, _ in columns])
    extra = np.zeros((0, 0, 5), dtype=np.int64)
    if isinstance(spline, SpatialPHSpline):
        start, extra = _extra(spline, offset[len(columns) :])
        points = np.concatenate((points, start))
    return Geometry(along, points, a_q44, extra, float(drift.max()))


def first_point_q40(spline: PHSpline | SpatialPHSpline, offset_mm: Sequence[float]) -> Int:
    """The first point (axes,) of the program that `quantise` makes of a spline, with the work offset of each axis.

    Only as many axes count as `offset_mm` has: a spline in space whose z stays the same may be for two axes. Further
    axes stay at 0.
    """
    first = np.asarray(spline.axes_nodes[0])
    point = np.zeros(len(offset_mm))
    point[: first.size] = first[: point.size]
    return to_q40(point) + to_q40(offset_mm)


def _real(spline: PHSpline | SpatialPHSpline) -> tuple[Real, Real]:
    """Origins (A, N) and components of the preimage (2, N, 3) or (4, N, 3)."""
    if isinstance(spline, PHSpline):
        origin, w = spline.origin, spline.w
        return np.stack((origin.real, origin.imag)), np.stack((w.real, w.imag))
    return spline.origin.T, np.moveaxis(spline.preimage, 1, 0)


def _extra(spline: SpatialPHSpline, offset: Real) -> tuple[Int, Int]:
    """Start points (E, N) of the extra axes, and their Bezier coefficients 1 … 5 (E, N, 5) from there.

    A segment ends exactly where the next one starts. Raises InputError: an axis is beyond the format.
    """
    count = spline.extra_axes
    if not count:
        return np.zeros((0, spline.segment_count), dtype=np.int64), np.zeros(
            (0, spline.segment_count, 5), dtype=np.int64
        )
    bezier = np.moveaxis(spline.extra, 1, 0)
    if not np.all(np.abs(bezier) < 8192.0):
        raise InputError("path: an extra axis is beyond the 4096 mm or degrees of the format")
    b_q40 = to_q40(bezier)
    b_q40[:, :-1, 5] = b_q40[:, 1:, 0]
    if spline.closed:
        b_q40[:, -1, 5] = b_q40[:, 0, 0]
    shift = to_q40(offset)
    return b_q40[:, :, 0] + shift[:, None], b_q40[:, :, 1:] - b_q40[:, :, :1]


def _anchored(distance_q40: Int, ideal_mm: Real, offset_mm: float) -> tuple[Int, Real]:
    """Start points from exact distances, moved to the ideal ones if joints stay within 2^-36 mm; and their errors in
    mm.
    """
    offset = nearest_q40(offset_mm)
    ideal = to_q40(ideal_mm)
    chained = ideal[0] + distance_q40
    pull = ideal - chained
    if np.abs(np.diff(pull)).max(initial=0) > _ANCHOR_Q40:
        pull = np.zeros_like(pull)
    points = chained + pull
    return points + offset, (points - ideal) * MM_PER_Q40
