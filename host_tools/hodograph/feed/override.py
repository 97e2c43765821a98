# SPDX-License-Identifier: MIT
"""Bounds for the rate of program time in each feed piece, by level; docs/theory/numerics.md section 7."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .headroom import FACTOR_SHARE, RATE_SHARES, Room
from .limits import ControllerLimits, Limits
from .override_levels import (
    FACTOR_ONE_Q14,
    FULL,
    LEVEL_RATES,
    LEVELS,
    Codes,
    rate_codes,
    rates_per_s,
    second_codes,
    seconds_per_s2,
)

Real = NDArray[np.float64]
Unsigned = NDArray[np.uint32]

GREATEST_FACTOR = 2.0

_LEAST_FACTOR = 1.05
"""Along a path a factor below is 1: it would take half of the room that a changing rate has, and be of no use."""

_HAIR = 1.0 - 1e-9
_TINY = 1e-12


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
    rooms: Sequence[Room]

    def rate(self, at: Real, share: float) -> Real:
        """R (M,) for rates up to `at`, with `share` of what is left of the jerks."""
        room_a = self.controller.acceleration_mm_s2 - at**2 * self.a
        room_j = self.controller.jerk_mm_s3 - at**3 * self.j
        rate = np.minimum(room_a / self.v, share * room_j / (3.0 * at * self.a))
        for room in self.rooms:
            rate = np.minimum(rate, room.rate(at, share))
        return rate

    def second(self, at: Real, rate: Real) -> Real:
        """Q (M,) for these rates and slopes."""
        room_j = self.controller.jerk_mm_s3 - at**3 * self.j
        second: Real = (room_j - 3.0 * at * rate * self.a) / self.v
        for room in self.rooms:
            second = np.minimum(second, room.second(at, rate))
        return second

    def codes(self, at: Real, share: float) -> tuple[Codes, Codes]:
        rate = rate_codes(self.rate(at, share) * _HAIR)
        return rate, second_codes(self.second(at, rates_per_s(rate)) * _HAIR)


def override_bounds(
    feed_mm_s: Real,
    acceleration_mm_s2: Real,
    jerk_mm_s3: Real,
    controller: ControllerLimits,
    program: Limits,
    rooms: Sequence[Room] = (),
) -> OverrideBounds:
    """Bounds from the peaks of each piece (M,), such that in each level, for every lambda up to its rate,
    |lambda'| <= rate and |lambda''| <= second, the controller's limits hold, and at constant
    lambda <= factor the program's too. `rooms` are those along the path; where the plan obeys the limits of one,
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
    for room in rooms:
        factor = np.minimum(factor, room.factor())
    binding = [room for room in rooms if room.bounds.obeyed]
    if binding:
        factor = np.where(factor < _LEAST_FACTOR, 1.0, factor)
    # Rounded first: the rates then use the room that the stored factor really leaves.
    factor_q14 = np.floor(np.clip(factor * _HAIR, 1.0, GREATEST_FACTOR) * FACTOR_ONE_Q14)
    factor = factor_q14 / FACTOR_ONE_Q14
    piece = _Piece(v, a, j, controller, binding)
    rates = np.zeros((v.size, LEVELS), dtype=np.uint8)
    seconds = np.zeros_like(rates)
    below = 0.0
    for level in range(LEVELS):
        at = factor if level == FULL else np.full_like(v, LEVEL_RATES[level])
        way = np.maximum(at - 1.0, 1.0 - below) if level == FULL else at - below
        rates[:, level], seconds[:, level] = _best(piece, at, way)
        below = LEVEL_RATES[min(level, FULL - 1)]
    return OverrideBounds(factor_q14.astype(np.uint32), rates, seconds)


def _best(piece: _Piece, at: Real, way: Real) -> tuple[Codes, Codes]:
    """Codes for rates up to `at`, of the share of the jerks with which they change by `way` soonest."""
    rate, second = piece.codes(at, RATE_SHARES[0])
    for share in RATE_SHARES[1:] if piece.rooms else ():
        other = piece.codes(at, share)
        better = _move_s(way, *other) < _move_s(way, rate, second)
        rate, second = np.where(better, other[0], rate), np.where(better, other[1], second)
    return rate, second


def _move_s(way: Real, rate: Codes, second: Codes) -> Real:
    """Time in which the rate goes this way from rest to rest; inf where a bound is 0."""
    r, q = np.maximum(rates_per_s(rate), 1e-9), np.maximum(seconds_per_s2(second), 1e-9)
    time_s = np.where(way * q < r**2, 2.0 * np.sqrt(way / q), way / r + r / q)
    return np.asarray(np.where((rate > 0) & (second > 0), time_s, np.inf))


def _shared(peak: Real, limit: float) -> Real:
    return np.asarray(1.0 + FACTOR_SHARE * np.maximum(limit - peak, 0.0) / peak)


def _ratio(limit: float | None, peak: Real) -> Real:
    return np.full_like(peak, np.inf) if limit is None else np.asarray(limit / peak)
