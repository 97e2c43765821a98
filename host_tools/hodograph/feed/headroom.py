# SPDX-License-Identifier: MIT
"""What limits along a path leave for a changing rate of program time; docs/theory/numerics.md section 7.

With program time at the rate lambda an axis moves with

    velocity      lambda v
    acceleration  lambda' v + lambda^2 a
    jerk          lambda'' v + 3 lambda lambda' a + lambda^3 j

v, a, j its velocity, acceleration and jerk at the rate 1. The limits bound |lambda| <= f, |lambda'| <= R,
|lambda''| <= Q in each piece, from samples and not from peaks, since an axis is seldom fast, accelerated and
jerked at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .kinematics import PathBounds, Pieces, Samples, least_of_pieces, per_axis, raised, sample
from .plant import Plant

Real = NDArray[np.float64]

FACTOR_SHARE = 0.5
"""Part of the room under each limit that a factor above 1 may use up."""

RATE_SHARES = (0.5, 0.7, 0.85, 0.95)
"""Parts of what is left of a jerk that lambda' may use; lambda'' has the rest. The best one depends on the piece."""

_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis: raised magnitudes (C, K) and limits (inf: none); volts as velocities, v + T a signed."""

    v: Real
    a: Real
    j: Real
    velocity: float
    acceleration: float
    jerk: float
    signed_v: Real
    signed_a: Real
    plant: Plant | None


@dataclass(frozen=True, eq=False)
class Room:
    """The pieces `pieces` (M) beside the limits of a path."""

    bounds: PathBounds
    pieces: Pieces

    @cached_property
    def _samples(self) -> Samples:
        return sample(self.bounds, self.pieces, filled=True)

    @cached_property
    def axes(self) -> tuple[Axis, Axis]:
        """x and y."""
        samples, limits = self._samples, self.bounds.limits.axes
        free = (np.inf, np.inf)
        plants = self.bounds.plants or (None, None)
        out = [
            Axis(
                raised(v) + _TINY,
                raised(a) + _TINY,
                raised(j) + _TINY,
                (limits.velocity_mm_s or free)[k],
                (limits.acceleration_mm_s2 or free)[k],
                (limits.jerk_mm_s3 or free)[k],
                v,
                a,
                plants[k],
            )
            for k, (v, a, j) in enumerate(
                zip(
                    per_axis(samples.velocity),
                    per_axis(samples.acceleration),
                    per_axis(samples.jerk),
                    strict=True,
                )
            )
        ]
        return out[0], out[1]

    def factor(self) -> Real:
        """f (M,), below 1 where a limit is passed at the rate 1."""
        limits, samples = self.bounds.limits, self._samples
        feed = raised(samples.feed) + _TINY
        f = np.full_like(feed, np.inf)
        for cap in limits.caps:
            inside = (samples.arc_mm > cap.from_mm) & (samples.arc_mm < cap.to_mm)
            f = np.where(inside, np.minimum(f, cap.feed_mm_s / feed), f)
        if limits.centripetal_mm_s2 is not None:
            f = np.minimum(
                f, np.sqrt(limits.centripetal_mm_s2 / (raised(samples.centripetal) + _TINY))
            )
        for axis in self.axes:
            f = np.minimum(f, axis.velocity / axis.v)
            f = np.minimum(f, np.sqrt(_shared(axis.a, axis.acceleration)))
            f = np.minimum(f, np.cbrt(_shared(axis.j, axis.jerk)))
            if axis.plant is not None:
                f = np.minimum(f, _factor_of_volts(axis, axis.plant))
        return least_of_pieces(samples, f, self._count)

    def rate(self, factor: Real, share: float) -> Real:
        """R (M,) for factors (M,), with `share` of the jerks; below 0 where a limit leaves nothing."""
        f = factor[self._samples.piece, None]
        rate = np.full_like(self._samples.feed, np.inf)
        for axis in self.axes:
            rate = np.minimum(rate, (axis.acceleration - f**2 * axis.a) / axis.v)
            left = share * (axis.jerk - f**3 * axis.j)
            rate = np.minimum(rate, left / (3.0 * f * axis.a))
            if axis.plant is not None:
                left = axis.plant.reach_mm_s - _greatest_volts(axis, axis.plant, f)
                rate = np.minimum(rate, left / (axis.plant.time_constant_s * axis.v))
        return least_of_pieces(self._samples, rate, self._count)

    def second(self, factor: Real, rate: Real) -> Real:
        """Q (M,) for factors and rates (M,)."""
        piece = self._samples.piece
        f, r = factor[piece, None], rate[piece, None]
        second = np.full_like(self._samples.feed, np.inf)
        for axis in self.axes:
            left = axis.jerk - f**3 * axis.j - 3.0 * f * r * axis.a
            second = np.minimum(second, left / axis.v)
        return least_of_pieces(self._samples, second, self._count)

    @property
    def _count(self) -> int:
        return int(self.pieces.duration_q32_s.size)


def _shared(peak: Real, limit: float) -> Real:
    """Half of the room above a peak, over the peak; below 1 where there is none."""
    room = limit / peak - 1.0
    return np.asarray(1.0 + np.where(room > 0.0, FACTOR_SHARE, 1.0) * room)


def _factor_of_volts(axis: Axis, plant: Plant) -> Real:
    """The factor that raises |f v + f^2 T a| <= f^2 (g + |v|) - f |v|, g = |v + T a|, half the way to the reach."""
    g = raised(axis.signed_v + plant.time_constant_s * axis.signed_a) + _TINY
    goal = np.maximum(
        FACTOR_SHARE * (g + plant.reach_mm_s), plant.reach_mm_s * (g > plant.reach_mm_s)
    )
    whole = g + axis.v
    return np.asarray((axis.v + np.sqrt(axis.v**2 + 4.0 * whole * goal)) / (2.0 * whole))


def _greatest_volts(axis: Axis, plant: Plant, f: Real) -> Real:
    """Greatest |lambda v + lambda^2 T a| over 0 <= lambda <= f: at f, or v^2 / (4 T |a|) where the two pull apart."""
    pull = plant.time_constant_s * axis.signed_a
    at_f = raised(f * axis.signed_v + f**2 * pull)
    apart = (axis.signed_v * pull < 0.0) & (np.abs(axis.signed_v) < 2.0 * f * np.abs(pull))
    between = axis.v**2 / (4.0 * np.maximum(np.abs(pull), _TINY))
    return np.asarray(np.maximum(at_f, np.where(apart, between, 0.0)))
