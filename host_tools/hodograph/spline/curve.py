# SPDX-License-Identifier: MIT
"""The curve: a chain of PH quintic segments, evaluated exactly; docs/theory/numerics.md section 4. Used by most modules
of host_tools. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..native.ph_chain import PhChain
from .arclength import ArcLengthChain, Index, evaluate
from .bernstein import Complex, Real, basis, square, square_modulus
from .extremum import greatest_curvature
from .frames import Frames, frames_of
from .splitting import split_segments


@dataclass(frozen=True, eq=False)
class PHSpline(ArcLengthChain):
    """Segments r(xi) = origin + integral of w^2 from 0 to xi, xi in [0, 1]; mm.

    origin  (N,) complex, start point of each segment
    w       (N, 3) complex, Bernstein coefficients of w in mm^(1/2)
    closed  the end is the start

    Built by `from_control_polygon`, `through_points` or `line`, not by hand. All methods take
    arrays of any one shape (or scalars) and give arrays of that shape. Arc lengths outside 0 …
    length_mm, beyond rounding, raise InputError.
    """

    origin: Complex
    w: Complex
    closed: bool

    @property
    def axes(self) -> int:
        """2: x and y follow it."""
        return 2

    @property
    def segment_count(self) -> int:
        """N."""
        return int(self.origin.size)

    @cached_property
    def hodograph_coefficients(self) -> Complex:
        """Bernstein coefficients (N, 5) of r' = w^2."""
        return square(self.w)

    @cached_property
    def speed_coefficients(self) -> Real:
        """Bernstein coefficients (N, 5) of sigma = |w|^2."""
        return square_modulus(self.w)

    @cached_property
    def position_coefficients(self) -> Complex:
        """Bezier points (N, 6) of the segments."""
        steps = np.concatenate((self.origin[:, None], self.hodograph_coefficients / 5.0), axis=1)
        return np.asarray(np.cumsum(steps, axis=1))

    @cached_property
    def nodal_points(self) -> Complex:
        """Joints (N + 1,), from start to end (closed: the first again at the end)."""
        end = self.origin[:1] if self.closed else self.position_coefficients[-1:, 5]
        return np.concatenate((self.origin, end))

    @property
    def axes_nodes(self) -> Real:
        """The joints as rows of coordinates (N + 1, 2)."""
        return coordinates(self.nodal_points)

    # By segment and parameter

    def position(self, segment: ArrayLike, xi: ArrayLike) -> Complex:
        """Points of segments `segment` at `xi` in [0, 1]; mm."""
        return np.asarray(evaluate(self.position_coefficients, segment, xi))

    def hodograph(self, segment: ArrayLike, xi: ArrayLike) -> Complex:
        """r' = w^2 (8)."""
        w = self._w(segment, xi)
        return w * w

    def speed(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """sigma = |w|^2 (9), mm per unit of xi."""
        w = self._w(segment, xi)
        return np.asarray(w.real * w.real + w.imag * w.imag)

    def curvature_at(self, segment: ArrayLike, xi: ArrayLike) -> Real:
        """Signed curvature 2 Im(conj(w) w') / |w|^4, positive to the left; 1/mm."""
        i = np.asarray(segment, dtype=np.intp)
        slope = 2.0 * (self.w[i, 1:] - self.w[i, :-1])
        w = self._w(i, xi)
        derivative = np.sum(slope * basis(1, np.asarray(xi, dtype=np.float64)), axis=-1)
        speed = w.real * w.real + w.imag * w.imag
        return np.asarray(2.0 * (np.conj(w) * derivative).imag / (speed * speed))

    def frames_at(self, segment: Index, xi: Real) -> Frames:
        """Derivatives by arc length of segments `segment` at `xi`."""
        return frames_of(self.chain, segment, xi)

    @property
    def chain(self) -> PhChain:
        """The coefficients of sigma for the native module."""
        return PhChain(
            self.segment_starts_mm, self._arc_coefficients, self.speed_coefficients, self.w
        )

    def _w(self, segment: ArrayLike, xi: ArrayLike) -> Complex:
        return np.asarray(evaluate(self.w, segment, xi))

    # By arc length

    def point(self, s_mm: ArrayLike) -> Complex:
        """Points at arc lengths `s_mm`; mm."""
        return self.position(*self.locate(s_mm))

    def axes_point(self, s_mm: ArrayLike) -> Real:
        """Points at arc lengths `s_mm` as rows of coordinates (…, 2); mm."""
        return coordinates(self.point(s_mm))

    def tangent(self, s_mm: ArrayLike) -> Complex:
        """Unit tangents at arc lengths `s_mm`."""
        h = self.hodograph(*self.locate(s_mm))
        return np.asarray(h / np.abs(h))

    def curvature(self, s_mm: ArrayLike) -> Real:
        """Signed curvature at arc lengths `s_mm`; 1/mm."""
        return self.curvature_at(*self.locate(s_mm))

    # The whole

    def max_curvature_per_mm(self) -> float:
        """Greatest |curvature| of the path, at its true extremum."""
        return greatest_curvature(self.w)

    def split(self, max_length_mm: float, max_speed_ratio: float = 2.0) -> PHSpline:
        """This curve in shorter segments, as a program needs them (docs/reference/protocol.md 1.2).

        Segments are halved, exactly (de Casteljau on w), until each is at most `max_length_mm` long and the largest
        Bernstein coefficient of its speed is (1e-9 less than) at most `max_speed_ratio` times the smallest, which is
        positive. Raises PlanError naming the segment where the curve nearly stops.
        """
        origin, w, _ = split_segments(self.origin, self.w, max_length_mm, max_speed_ratio)
        return PHSpline(origin, w, self.closed)


def coordinates(points: Complex | Real) -> Real:
    """Points as rows of coordinates: x + iy becomes [x, y]; rows of points in space stay as they are."""
    if np.iscomplexobj(points):
        return np.stack((points.real, points.imag), axis=-1)
    return np.asarray(points, dtype=np.float64)
