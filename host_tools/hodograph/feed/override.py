# SPDX-License-Identifier: MIT
"""Override headroom: the part of the limits that a changing feed override may use, and the override bounds of each feed
piece by override level; docs/theory/feed.md section 7. Used by feed/plan and stream/windows. No I/O.

With program time at the override lambda an axis moves with

    velocity      lambda v
    acceleration  lambda' v + lambda^2 a
    jerk          lambda'' v + 3 lambda lambda' a + lambda^3 j

v, a, j its velocity, acceleration and jerk at an override of 1. The limits bound |lambda| <= f, |lambda'| <= R,
|lambda''| <= Q in each piece. They are computed from samples and not from peaks, since velocity, acceleration and jerk
of an axis seldom have their peaks at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..native.override_headroom import OverrideSamples, Volts
from .kinematics import (
    PathBounds,
    PathKinematics,
    Pieces,
    least_of_pieces,
    raised,
    sample,
)
from .limits import ControllerLimits, Limits, least_in_zones
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
"""Greatest override: 200 %."""

_LEAST_FACTOR = 1.05
"""On a path a factor below this is set to 1: it would use half of the headroom of a changing override and gain less
than 5 %.
"""

_MARGIN = 1.0 - 1e-9
"""Factor of all bounds before they are rounded down to codes; covers rounding errors of doubles."""
_TINY = 1e-12
"""Least magnitude of a peak, to avoid a division by 0."""

FACTOR_SHARE = 0.5
"""Part of the headroom of each limit that a factor above 1 may use."""

RATE_SHARES = (0.5, 0.7, 0.85, 0.95)
"""Parts of the jerk's headroom that lambda' may use; the remainder is for lambda''. The best one depends on the
piece.
"""


def with_override(
    raw: Pieces, controller: ControllerLimits, limits: Limits, paths: Sequence[PathBounds] = ()
) -> FeedPieces:
    """The pieces with override bounds, from the controller's limits and from those along the paths."""
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
    """Override bounds in the format, rounded down: the factor (M,), and codes of override rate and acceleration (M,
    LEVELS).
    """

    factor_q14: Unsigned
    rate_codes: Codes
    second_codes: Codes


@dataclass(frozen=True, eq=False)
class _Piece:
    """Peaks (M,) of the pieces along the path, and the limits."""

    v: Real
    a: Real
    j: Real
    controller: ControllerLimits
    headrooms: Sequence[Headroom]

    def rates(self, at: Real, shares: Sequence[float]) -> Iterator[Real]:
        """Override rate R (M,) for overrides up to `at`, with each of these shares of the headroom of the jerks."""
        left_a = self.controller.acceleration_mm_s2 - at**2 * self.a
        left_j = self.controller.jerk_mm_s3 - at**3 * self.j
        by_rest, by_jerk = left_a / self.v, left_j / (3.0 * at * self.a)
        for headroom in self.headrooms:
            rest, jerk = headroom.rate(at)
            by_rest, by_jerk = np.minimum(by_rest, rest), np.minimum(by_jerk, jerk)
        for share in shares:
            yield np.minimum(by_rest, share * by_jerk)

    def seconds(self, at: Real) -> Callable[[Real], Real]:
        """Override acceleration Q (M,) for overrides up to `at`, as a function of the override rate R (M,)."""
        left_j = self.controller.jerk_mm_s3 - at**3 * self.j
        others = [headroom.seconds(at) for headroom in self.headrooms]

        def second(rate: Real) -> Real:
            own = (left_j - 3.0 * at * rate * self.a) / self.v
            return np.asarray(np.minimum.reduce([own, *(other(rate) for other in others)]))

        return second

    def codes(self, at: Real, shares: Sequence[float]) -> Iterator[tuple[Codes, Codes]]:
        """Codes of override rate and override acceleration (M,) for each share."""
        second = self.seconds(at)
        for found in self.rates(at, shares):
            rate = rate_codes(found * _MARGIN)
            yield rate, second_codes(second(rates_per_s(rate)) * _MARGIN)


def override_bounds(
    feed_mm_s: Real,
    acceleration_mm_s2: Real,
    jerk_mm_s3: Real,
    controller: ControllerLimits,
    program: Limits,
    headrooms: Sequence[Headroom] = (),
) -> OverrideBounds:
    """Override bounds from the peaks of each piece (M,). In each level they ensure: at each override of the level, with
    |lambda'| <= rate and |lambda''| <= second, the motion keeps the controller's limits. At constant lambda <= factor
    it also keeps the program's limits.

    headrooms  those along the paths; if the plan keeps the limits of one, the bounds keep them at each motion of lambda
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
    # The factor is rounded first, so that the override rates use the headroom that the stored factor leaves.
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
    """Codes for overrides up to `at`, for the share of the jerks with which a change by `change` is fastest."""
    choices = piece.codes(at, RATE_SHARES if piece.headrooms else RATE_SHARES[:1])
    rate, second = next(choices)
    taken_s = _move_s(change, rate, second)
    for other in choices:
        other_s = _move_s(change, *other)
        better = other_s < taken_s
        rate, second = np.where(better, other[0], rate), np.where(better, other[1], second)
        taken_s = np.minimum(taken_s, other_s)
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
class Axes:
    """All A axes: raised magnitudes (A, C, K) and limits (A, 1, 1) (inf: none); volts as velocities, v + T a signed."""

    v: Real
    a: Real
    j: Real
    velocity: Real
    acceleration: Real
    jerk: Real
    signed_v: Real
    signed_a: Real
    reach: Real | None
    time_constant: Real | None


@dataclass(frozen=True, eq=False)
class Headroom:
    """The headroom of the limits along a path for the override, in each of M feed pieces."""

    bounds: PathBounds
    pieces: Pieces

    @cached_property
    def _samples(self) -> PathKinematics:
        return sample(self.bounds, self.pieces, filled=True)

    @cached_property
    def axes(self) -> Axes:
        """Number of axes that follow the path."""
        samples, limits, plants = self._samples, self.bounds.limits.axes, self.bounds.plants
        count = len(samples.velocity)
        velocity, acceleration, jerk = (
            _by_axis(given or (np.inf,) * count)
            for given in (limits.velocity_mm_s, limits.acceleration_mm_s2, limits.jerk_mm_s3)
        )
        a, j = raised(samples.acceleration) + _TINY, raised(samples.jerk) + _TINY
        return Axes(
            raised(samples.velocity) + _TINY,
            a,
            j,
            velocity,
            self._less_reserve(acceleration, a),
            self._less_reserve(jerk, j),
            samples.velocity,
            samples.acceleration,
            None if plants is None else _by_axis(one.reach_mm_s for one in plants),
            None if plants is None else _by_axis(one.time_constant_s for one in plants),
        )

    def _less_reserve(self, limit: Real, used: Real) -> Real:
        """Limits (A, 1, 1) less what reserve zones keep for stops, which the override may not use. Where the plan
        itself uses more (A, C, K), the override has the same headroom as outside of the zones.
        """
        limits, arc_mm = self.bounds.limits, self._samples.arc_mm
        if not limits.reserve_zones:
            return limit
        left = [1.0 - zone.share for zone in limits.reserve_zones]
        kept = np.minimum(least_in_zones(arc_mm, limits.reserve_zones, left, with_ends=True), 1.0)
        return np.asarray(
            np.minimum(limit, np.maximum(kept * limit, used / (1.0 - limits.reserve)))
        )

    def factor(self) -> Real:
        """The factor f (M,); below 1: a limit is exceeded at an override of 1."""
        limits, samples, axes = self.bounds.limits, self._samples, self.axes
        feed = raised(samples.feed) + _TINY
        feeds = [zone.feed_mm_s for zone in limits.zones]
        f = least_in_zones(samples.arc_mm, limits.zones, feeds, with_ends=False) / feed
        if limits.centripetal_mm_s2 is not None:
            f = np.minimum(
                f, np.sqrt(limits.centripetal_mm_s2 / (raised(samples.centripetal) + _TINY))
            )
        by_axis = np.minimum(
            axes.velocity / axes.v, np.sqrt(_shared_headroom(axes.a, axes.acceleration))
        )
        by_axis = np.minimum(by_axis, np.cbrt(_shared_headroom(axes.j, axes.jerk)))
        if axes.reach is not None and axes.time_constant is not None:
            by_axis = np.minimum(by_axis, _factor_of_volts(axes, axes.reach, axes.time_constant))
        return self._least(np.minimum(f, by_axis.min(axis=0)))

    def rate(self, factor: Real) -> tuple[Real, Real]:
        """R (M,) for factors (M,): as accelerations and volts allow, and as the whole headroom of the jerks allows;
        below 0: a limit leaves no headroom.
        """
        return self._override_samples.rates(factor)

    def seconds(self, factor: Real) -> Callable[[Real], Real]:
        """Q (M,) for factors (M,), as a function of R (M,)."""
        return partial(self._override_samples.seconds, factor)

    @cached_property
    def _override_samples(self) -> OverrideSamples:
        axes, volts = self.axes, None
        if axes.reach is not None and axes.time_constant is not None:
            volts = Volts(axes.signed_v, axes.signed_a, axes.reach, axes.time_constant)
        return OverrideSamples(
            self._piece_count,
            self._samples.piece,
            *(axes.v, axes.a, axes.j),
            axes.acceleration,
            axes.jerk,
            volts,
        )

    def _least(self, values: Real) -> Real:
        """The least of the samples (C, K) of each piece."""
        return least_of_pieces(self._samples, values, self._piece_count)

    @property
    def _piece_count(self) -> int:
        return int(self.pieces.duration_q32_s.size)


def _by_axis(values: Iterable[float]) -> Real:
    return np.array(list(values), dtype=np.float64)[:, None, None]


def _shared_headroom(peak: Real, limit: Real) -> Real:
    """The factor that uses half of the headroom above a peak; below 1: there is none."""
    headroom = limit / peak - 1.0
    return np.asarray(1.0 + np.where(headroom > 0.0, FACTOR_SHARE, 1.0) * headroom)


def _factor_of_volts(axes: Axes, reach: Real, time_constant: Real) -> Real:
    """The factor that raises |f v + f^2 T a| <= f^2 (g + |v|) - f |v|, g = |v + T a|, half the way to the reach."""
    g = raised(axes.signed_v + time_constant * axes.signed_a) + _TINY
    goal = np.maximum(FACTOR_SHARE * (g + reach), reach * (g > reach))
    whole = g + axes.v
    return np.asarray((axes.v + np.sqrt(axes.v**2 + 4.0 * whole * goal)) / (2.0 * whole))
