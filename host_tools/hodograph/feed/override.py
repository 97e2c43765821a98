# SPDX-License-Identifier: MIT
"""Override headroom: what limits leave for a changing feed override, and the override bounds of each feed piece by
override level; docs/theory/numerics.md section 7.

With program time at the override lambda an axis moves with

    velocity      lambda v
    acceleration  lambda' v + lambda^2 a
    jerk          lambda'' v + 3 lambda lambda' a + lambda^3 j

v, a, j its velocity, acceleration and jerk at an override of 1. The limits bound |lambda| <= f, |lambda'| <= R,
|lambda''| <= Q in each piece, from samples and not from peaks, since an axis is seldom fast, accelerated and
jerked at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .kinematics import (
    PathBounds,
    PathKinematics,
    Pieces,
    least_of_pieces,
    raised,
    sample,
)
from .limits import ControllerLimits, Limits, Plant
from .override_levels import (
    FACTOR_ONE_Q14,
    FULL,
    LEVEL_OVERRIDES,
    LEVELS,
    Codes,
    rate_codes,
    rates_per_s,
    second_codes,
    seconds_per_s2,
)
from .pieces import FeedPieces, derivative_peaks

Real = NDArray[np.float64]
Unsigned = NDArray[np.uint32]

GREATEST_FACTOR = 2.0

_LEAST_FACTOR = 1.05
"""Along a path a factor below is 1: it would take half of the headroom of a changing override, and gain less than 5
%."""

_MARGIN = 1.0 - 1e-9
_TINY = 1e-12

FACTOR_SHARE = 0.5
"""Part of the headroom under each limit that a factor above 1 may use up."""

RATE_SHARES = (0.5, 0.7, 0.85, 0.95)
"""Parts of the jerk's headroom that lambda' may use; lambda'' has the rest. The best one depends on the piece."""


def with_override(
    raw: Pieces, controller: ControllerLimits, limits: Limits, paths: Sequence[PathBounds] = ()
) -> FeedPieces:
    """Pieces with bounds of the override: from the controller's limits, and from those along a path."""
    peaks = derivative_peaks(raw.duration_q32_s, raw.c_q40)
    headrooms = [Headroom(path, raw) for path in paths if path.bind]
    override = override_bounds(*peaks, controller, limits, headrooms)
    return FeedPieces(
        raw.duration_q32_s,
        raw.start_q40,
        raw.c_q40,
        override.factor_q14,
        override.rate_codes,
        override.second_codes,
    )


@dataclass(frozen=True, eq=False)
class OverrideBounds:
    """As the format has them, rounded down: the factor (M,), and codes of slope and second derivative (M, LEVELS)."""

    factor_q14: Unsigned
    rate_codes: Codes
    second_codes: Codes


@dataclass(frozen=True, eq=False)
class _Piece:
    """Peaks (M,) of the pieces along the path, beside the limits."""

    v: Real
    a: Real
    j: Real
    controller: ControllerLimits
    headrooms: Sequence[Headroom]

    def rate(self, at: Real, share: float) -> Real:
        """Override rate R (M,) for overrides up to `at`, with `share` of the headroom of the jerks."""
        left_a = self.controller.acceleration_mm_s2 - at**2 * self.a
        left_j = self.controller.jerk_mm_s3 - at**3 * self.j
        rate = np.minimum(left_a / self.v, share * left_j / (3.0 * at * self.a))
        for headroom in self.headrooms:
            rate = np.minimum(rate, headroom.rate(at, share))
        return rate

    def second(self, at: Real, rate: Real) -> Real:
        """Override acceleration Q (M,) for these overrides and override rates."""
        left_j = self.controller.jerk_mm_s3 - at**3 * self.j
        second: Real = (left_j - 3.0 * at * rate * self.a) / self.v
        for headroom in self.headrooms:
            second = np.minimum(second, headroom.second(at, rate))
        return second

    def codes(self, at: Real, share: float) -> tuple[Codes, Codes]:
        rate = rate_codes(self.rate(at, share) * _MARGIN)
        return rate, second_codes(self.second(at, rates_per_s(rate)) * _MARGIN)


def override_bounds(
    feed_mm_s: Real,
    acceleration_mm_s2: Real,
    jerk_mm_s3: Real,
    controller: ControllerLimits,
    program: Limits,
    headrooms: Sequence[Headroom] = (),
) -> OverrideBounds:
    """Bounds from the peaks of each piece (M,), such that in each level, for every override lambda of the level,
    |lambda'| <= rate and |lambda''| <= second, the controller's limits hold, and at constant
    lambda <= factor the program's too. `headrooms` are those along the path; where the plan keeps the limits of one,
    they hold for every motion of lambda as the controller's do.
    """
    v, a, j = (np.maximum(p, _TINY) for p in (feed_mm_s, acceleration_mm_s2, jerk_mm_s3))
    factor = np.minimum.reduce(
        (
            controller.feed_mm_s / v,
            np.sqrt(_shared(a, controller.acceleration_mm_s2)),
            np.cbrt(_shared(j, controller.jerk_mm_s3)),
            _ratio(program.feed_mm_s, v),
            np.sqrt(_ratio(program.acceleration_mm_s2, a)),
            np.cbrt(_ratio(program.jerk_mm_s3, j)),
        )
    )
    for headroom in headrooms:
        factor = np.minimum(factor, headroom.factor())
    binding = [headroom for headroom in headrooms if headroom.bounds.kept]
    if binding:
        factor = np.where(factor < _LEAST_FACTOR, 1.0, factor)
    # Rounded first: the override rates then use the headroom that the stored factor really leaves.
    factor_q14 = np.floor(np.clip(factor * _MARGIN, 1.0, GREATEST_FACTOR) * FACTOR_ONE_Q14)
    factor = factor_q14 / FACTOR_ONE_Q14
    piece = _Piece(v, a, j, controller, binding)
    rates = np.zeros((v.size, LEVELS), dtype=np.uint8)
    seconds = np.zeros_like(rates)
    below = 0.0
    for level in range(LEVELS):
        at = factor if level == FULL else np.full_like(v, LEVEL_OVERRIDES[level])
        change = np.maximum(at - 1.0, 1.0 - below) if level == FULL else at - below
        rates[:, level], seconds[:, level] = _best(piece, at, change)
        below = LEVEL_OVERRIDES[min(level, FULL - 1)]
    return OverrideBounds(factor_q14.astype(np.uint32), rates, seconds)


def _best(piece: _Piece, at: Real, change: Real) -> tuple[Codes, Codes]:
    """Codes for overrides up to `at`, of the share of the jerks with which they change by `change` soonest."""
    rate, second = piece.codes(at, RATE_SHARES[0])
    for share in RATE_SHARES[1:] if piece.headrooms else ():
        other = piece.codes(at, share)
        better = _move_s(change, *other) < _move_s(change, rate, second)
        rate, second = np.where(better, other[0], rate), np.where(better, other[1], second)
    return rate, second


def _move_s(change: Real, rate: Codes, second: Codes) -> Real:
    """Time of an override ramp by this change; inf where a bound is 0."""
    r, q = np.maximum(rates_per_s(rate), 1e-9), np.maximum(seconds_per_s2(second), 1e-9)
    time_s = np.where(change * q < r**2, 2.0 * np.sqrt(change / q), change / r + r / q)
    return np.asarray(np.where((rate > 0) & (second > 0), time_s, np.inf))


def _shared(peak: Real, limit: float) -> Real:
    return np.asarray(1.0 + FACTOR_SHARE * np.maximum(limit - peak, 0.0) / peak)


def _ratio(limit: float | None, peak: Real) -> Real:
    return np.full_like(peak, np.inf) if limit is None else np.asarray(limit / peak)


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
class Headroom:
    """What the limits along a path leave the override in each of M feed pieces."""

    bounds: PathBounds
    pieces: Pieces

    @cached_property
    def _samples(self) -> PathKinematics:
        return sample(self.bounds, self.pieces, filled=True)

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """Those that follow the path."""
        samples, limits = self._samples, self.bounds.limits.axes
        count = len(samples.velocity)
        free = (np.inf,) * count
        plants = self.bounds.plants or (None,) * count
        return tuple(
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
                zip(samples.velocity, samples.acceleration, samples.jerk, strict=True)
            )
        )

    def factor(self) -> Real:
        """f (M,), below 1 where a limit is exceeded at an override of 1."""
        limits, samples = self.bounds.limits, self._samples
        feed = raised(samples.feed) + _TINY
        f = np.full_like(feed, np.inf)
        for zone in limits.zones:
            inside = (samples.arc_mm > zone.from_mm) & (samples.arc_mm < zone.to_mm)
            f = np.where(inside, np.minimum(f, zone.feed_mm_s / feed), f)
        if limits.centripetal_mm_s2 is not None:
            f = np.minimum(
                f, np.sqrt(limits.centripetal_mm_s2 / (raised(samples.centripetal) + _TINY))
            )
        for axis in self.axes:
            f = np.minimum(f, axis.velocity / axis.v)
            f = np.minimum(f, np.sqrt(_shared_headroom(axis.a, axis.acceleration)))
            f = np.minimum(f, np.cbrt(_shared_headroom(axis.j, axis.jerk)))
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


def _shared_headroom(peak: Real, limit: float) -> Real:
    """1 plus half of the headroom above a peak, over the peak; below 1 where there is none."""
    headroom = limit / peak - 1.0
    return np.asarray(1.0 + np.where(headroom > 0.0, FACTOR_SHARE, 1.0) * headroom)


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
