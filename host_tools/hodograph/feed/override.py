# SPDX-License-Identifier: MIT
"""Bounds for hold and override of each feed piece; docs/numerics.md section 7."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .limits import ControllerLimits, Limits
from .room import FACTOR_SHARE, RATE_SHARES, Room

Real = NDArray[np.float64]
Unsigned = NDArray[np.uint32]

GREATEST_FACTOR = 2.0

_LEAST_FACTOR = 1.05
"""Along a path a factor below is 1: it would take half of the room that a hold has, and be of no use."""

_HAIR = 1.0 - 1e-9
_U32_MAX = 2.0**32 - 1.0
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class OverrideBounds:
    """Integers of the format, one each per piece; rounded down."""

    factor_q24: Unsigned
    rate_q16_per_s: Unsigned
    second_q8_per_s2: Unsigned


def override_bounds(
    feed_mm_s: Real,
    acceleration_mm_s2: Real,
    jerk_mm_s3: Real,
    controller: ControllerLimits,
    program: Limits,
    rooms: Sequence[Room] = (),
) -> OverrideBounds:
    """Bounds from the peaks of each piece (M,), such that for every |lambda| <= factor,
    |lambda'| <= rate, |lambda''| <= second rate the controller's limits hold, and at constant
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
    factor_q24 = np.floor(np.clip(factor * _HAIR, 1.0, GREATEST_FACTOR) * 2.0**24)
    factor = factor_q24 / 2.0**24
    room_a = controller.acceleration_mm_s2 - factor**2 * a
    room_j = controller.jerk_mm_s3 - factor**3 * j
    own_rate = np.minimum(room_a / v, 0.5 * room_j / (3.0 * factor * a))

    def rates(share: float) -> tuple[Real, Real]:
        rate = own_rate
        for one in binding:
            rate = np.minimum(rate, one.rate(factor, share))
        rate_q16 = np.floor(np.clip(rate * _HAIR * 2.0**16, 0.0, _U32_MAX))
        second = (room_j - 3.0 * factor * (rate_q16 / 2.0**16) * a) / v
        for one in binding:
            second = np.minimum(second, one.second(factor, rate_q16 / 2.0**16))
        return rate_q16, np.floor(np.clip(second * _HAIR * 2.0**8, 0.0, _U32_MAX))

    rate_q16, second_q8 = rates(RATE_SHARES[0])
    for share in RATE_SHARES[1:] if binding else ():
        other = rates(share)
        better = _hold_s(*other) < _hold_s(rate_q16, second_q8)
        rate_q16 = np.where(better, other[0], rate_q16)
        second_q8 = np.where(better, other[1], second_q8)
    return OverrideBounds(
        factor_q24.astype(np.uint32), rate_q16.astype(np.uint32), second_q8.astype(np.uint32)
    )


def _hold_s(rate_q16: Real, second_q8: Real) -> Real:
    """Time from rate 1 to rest within these bounds; inf where one is 0."""
    rate = np.maximum(rate_q16, 0.5) / 2.0**16
    second = np.maximum(second_q8, 0.5) / 2.0**8
    time_s = np.where(second < rate**2, 2.0 / np.sqrt(second), 1.0 / rate + rate / second)
    return np.asarray(np.where((rate_q16 > 0.0) & (second_q8 > 0.0), time_s, np.inf))


def _shared(peak: Real, limit: float) -> Real:
    return np.asarray(1.0 + FACTOR_SHARE * np.maximum(limit - peak, 0.0) / peak)


def _ratio(limit: float | None, peak: Real) -> Real:
    return np.full_like(peak, np.inf) if limit is None else np.asarray(limit / peak)
