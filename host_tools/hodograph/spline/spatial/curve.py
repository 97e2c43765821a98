# SPDX-License-Identifier: MIT
"""The curve in space: a chain of PH quintic segments, evaluated exactly; docs/theory/spatial-splines.md 2. Used by most
modules of host_tools. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...native.ph_chain import PhChain
from ..arclength import ArcLengthChain, Index, evaluate
from ..bernstein import Real
from ..curve import PHSpline
from ..extremum import greatest_curvature
from ..frames import Frames, frames_of
from ..splitting import Image, split_segments
from .quaternion import polar

_GREATEST_COMPONENT = 8.0 - 2.0**-40
"""Greatest component of A in a program, which has 48 bits for one, 44 of them after the point
(docs/reference/protocol.md 1.2).
"""

_STRAIGHT = 1e-12
"""Curvature times the length of its segment below which a segment counts as straight: it has no torsion there."""

_Curve = TypeVar("_Curve", PHSpline, "SpatialPHSpline", "PHSpline | SpatialPHSpline")


@dataclass(frozen=True, eq=False)
class SpatialPHSpline(ArcLengthChain):
    """Segments r(xi) = origin + integral of A i A* from 0 to xi, xi in [0, 1]; mm.

    origin    (N, 3), start point of each segment
    preimage  (N, 4, 3), Bernstein coefficients of A = u + v i + p j + q k in mm^(1/2), the three of a component last
    closed    the end is the start
    extra     (N, E, 6), Bezier coefficients of the extra axes; mm, degrees (`with_extra_axes`)

    Built by `spatial_from_control_polygon` or `spatial_through_points`, not by hand. All methods take arrays of any one
    shape (or scalars) and give arrays of that shape, of vectors with three components more. Arc lengths outside 0 …
    length_mm, beyond rounding, raise InputError.
    """

    origin: Real
    preimage: Real
    closed: bool
    extra: Real = field(default_factory=lambda: np.zeros((0, 0, 6)))

    @property
    def axes(self) -> int:
        """3: x, y and z follow it; one more for each extra axis."""
        return 3 + self.extra_axes

    @property
    def extra_axes(self) -> int:
        """E."""
        return int(self.extra.shape[1])

    @property
    def segment_count(self) -> int:
        """N."""
        return int(self.origin.shape[0])

    @cached_property
    def hodograph_coefficients(self) -> Real:
        """Bernstein coefficients (N, 3, 5) of r' = A i A*."""
        return hodograph_of(self.preimage)

    @cached_property
    def speed_coefficients(self) -> Real:
        """Bernstein coefficients (N, 5) of sigma = |A|^2."""
        return speed_of(self.preimage)

    @cached_property
    def position_coefficients(self) -> Real:
        """Bezier points (N, 3, 6) of the segments."""
        steps = np.concatenate((self.origin[:, :, None], self.hodograph_coefficients / 5.0), axis=2)
        return np.asarray(np.cumsum(steps, axis=2))

    @cached_property
    def nodal_points(self) -> Real:
        """Joints (N + 1, 3), from start to end (closed: the first again at the end)."""
        end = self.origin[:1] if self.closed else self.position_coefficients[-1:, :, 5]
        return np.concatenate((self.origin, end))

    @cached_property
    def axes_nodes(self) -> Real:
        """The joints of all axes (N + 1, 3 + E)."""
        if not self.extra_axes:
            return self.nodal_points
        return np.column_stack(
            (self.nodal_points, np.vstack((self.extra[:, :, 0], self.extra[-1:, :, 5])))
        )

    # By segment and parameter

    def position(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """Points (…, 3) of segments `segment` at `xi` in [0, 1]; mm."""
        return np.asarray(evaluate(self.position_coefficients, segment, xi))

    def extra_position(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """The extra axes (…, E) of segments `segment` at `xi`; mm, degrees."""
        if not self.extra_axes:
            return np.zeros((*np.shape(xi), 0))
        return np.asarray(evaluate(self.extra, segment, xi))

    def hodograph(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """r' = A i A* (…, 3)."""
        a = evaluate(self.preimage, segment, xi)
        return polar(a, a)

    def speed(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """sigma = |A|^2, mm per unit of xi."""
        return np.asarray(evaluate(self.speed_coefficients, segment, xi))

    def curvature_at(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """Curvature |r' x r''| / sigma^3, never negative; 1/mm."""
        numerator = evaluate(curvature_numerator(self.preimage), segment, xi)
        return np.asarray(np.abs(numerator) / self.speed(segment, xi) ** 2)

    def torsion_at(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """Torsion det(r', r'', r''') / |r' x r''|^2, positive for right-handed curves; 0 where straight; 1/mm."""
        first = self.hodograph(segment, xi)
        bends = 4.0 * np.diff(self.hodograph_coefficients, axis=-1)
        second = evaluate(bends, segment, xi)
        third = evaluate(3.0 * np.diff(bends, axis=-1), segment, xi)
        cross = np.cross(first, second)
        area = np.sum(cross * cross, axis=-1)
        straight = self._is_straight(segment, xi)
        with np.errstate(divide="ignore", invalid="ignore"):
            torsion = np.sum(cross * third, axis=-1) / area
        return np.asarray(np.where(straight, 0.0, torsion))

    def frames_at(self, segment: Index, xi: Real) -> Frames:
        """Derivatives by arc length of segments `segment` at `xi`; the curvature is a magnitude."""
        return frames_of(self.chain, segment, xi)

    @property
    def chain(self) -> PhChain:
        """The coefficients of sigma for the native module."""
        return PhChain(
            self.segment_starts_mm,
            self._arc_coefficients,
            self.speed_coefficients,
            self.preimage,
            self.extra,
        )

    def _is_straight(self, segment: ArrayLike, xi: ArrayLike) -> NDArray[np.bool_]:
        length = self.segment_lengths_mm[np.asarray(segment, dtype=np.intp)]
        return np.asarray(self.curvature_at(segment, xi) * length <= _STRAIGHT)

    # By arc length

    def point(self, s_mm: ArrayLike) -> Real:
        """Points (…, 3) at arc lengths `s_mm`; mm."""
        return self.position(*self.locate(s_mm))

    def extra_point(self, s_mm: ArrayLike) -> Real:
        """The extra axes (…, E) at arc lengths `s_mm`; mm, degrees."""
        return self.extra_position(*self.locate(s_mm))

    def axes_point(self, s_mm: ArrayLike) -> Real:
        """All axes (…, 3 + E) at arc lengths `s_mm`: x, y, z and the extra axes."""
        place = self.locate(s_mm)
        return np.concatenate((self.position(*place), self.extra_position(*place)), axis=-1)

    def tangent(self, s_mm: ArrayLike) -> Real:
        """Unit tangents (…, 3) at arc lengths `s_mm`."""
        h = self.hodograph(*self.locate(s_mm))
        return np.asarray(h / np.linalg.norm(h, axis=-1, keepdims=True))

    def curvature(self, s_mm: ArrayLike) -> Real:
        """Curvature at arc lengths `s_mm`; 1/mm."""
        return self.curvature_at(*self.locate(s_mm))

    def torsion(self, s_mm: ArrayLike) -> Real:
        """Torsion at arc lengths `s_mm`; it may jump at joints; 1/mm."""
        return self.torsion_at(*self.locate(s_mm))

    # The whole

    def max_curvature_per_mm(self) -> float:
        """Greatest curvature of the path, at its true extremum."""
        return greatest_curvature(self.preimage, curvature_numerator, speed_of)

    def split(self, max_length_mm: float, max_speed_ratio: float = 2.0) -> SpatialPHSpline:
        """This curve in shorter segments, as PHSpline.split. In addition components of A are below 8, and no extra
        axis moves by more within a segment than the format allows.
        """
        origin, preimage, extra = split_segments(
            self.origin,
            self.preimage,
            max_length_mm,
            max_speed_ratio,
            _IMAGE,
            _GREATEST_COMPONENT,
            self.extra if self.extra_axes else None,
        )
        return SpatialPHSpline(
            origin, preimage, self.closed, self.extra if extra is None else extra
        )


def hodograph_of(preimage: Real) -> Real:
    """Bernstein coefficients (…, 3, 5) of A i A* for quadratics A (…, 4, 3)."""
    a, b, c = preimage[..., 0], preimage[..., 1], preimage[..., 2]
    middle = (2.0 * polar(b, b) + polar(a, c)) / 3.0
    parts = (polar(a, a), polar(a, b), middle, polar(b, c), polar(c, c))
    return np.stack(parts, axis=-1)


def speed_of(preimage: Real) -> Real:
    """Bernstein coefficients (…, 5) of |A|^2 for quadratics A (…, 4, 3)."""
    a, b, c = preimage[..., 0], preimage[..., 1], preimage[..., 2]
    pairs = ((a, a), (a, b), (b, b), (a, c), (b, c), (c, c))
    aa, ab, bb, ac, bc, cc = (np.sum(one * other, axis=-1) for one, other in pairs)
    return np.stack((aa, ab, (2.0 * bb + ac) / 3.0, bc, cc), axis=-1)


def curvature_numerator(preimage: Real) -> NDArray[np.complex128]:
    """Bernstein coefficients (…, 3) of a complex quadratic with curvature |numerator| / sigma^2.

    With a = u + i v and b = q + i p it is 2 (a b' - a' b), whose cubic term cancels.
    """
    first = preimage[..., 0, :] + 1j * preimage[..., 1, :]
    second = preimage[..., 3, :] + 1j * preimage[..., 2, :]

    def area(j: int, k: int) -> NDArray[np.complex128]:
        return np.asarray(first[..., j] * second[..., k] - first[..., k] * second[..., j])

    return np.stack((4.0 * area(0, 1), 2.0 * area(0, 2), 4.0 * area(1, 2)), axis=-1)


_IMAGE = Image(hodograph_of, speed_of)


def embedded(planar: PHSpline, height_mm: float) -> SpatialPHSpline:
    """A planar spline as one in space, at z = `height_mm`: u and q are the parts of w, v and p are 0."""
    origin = np.stack(
        (planar.origin.real, planar.origin.imag, np.full(planar.origin.size, height_mm)), axis=-1
    )
    zero = np.zeros_like(planar.w.real)
    preimage = np.stack((planar.w.real, zero, zero, planar.w.imag), axis=1)
    return SpatialPHSpline(origin, preimage, planar.closed)


def sliced(curve: _Curve, first: int, last: int | None = None) -> _Curve:
    """Segments first … last - 1 of a curve in the plane or in space, as an open one. They are copied, so that the bits
    of sums do not depend on where the segments come from.
    """
    part = slice(first, last)
    if isinstance(curve, PHSpline):
        return PHSpline(curve.origin[part].copy(), curve.w[part].copy(), False)
    return SpatialPHSpline(
        curve.origin[part].copy(), curve.preimage[part].copy(), False, curve.extra[part].copy()
    )
