# SPDX-License-Identifier: MIT
"""Accelerate, go on, decelerate: the exact arc length over time; docs/theory/numerics.md 5.1."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .ramp import ACCELERATION, DISPLACEMENT, FEED, JERK, Ramp

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Timeline:
    """A ramp up, constant feed for `constant_s` and the mirrored ramp down, over `length_mm`.

    `length_mm` and `constant_s` are exact; without a constant stretch the way of the two ramps is
    the length but for the rounding of the feed.
    """

    ramp: Ramp
    length_mm: Fraction
    constant_s: Fraction

    @property
    def duration_s(self) -> Fraction:
        """Time of the whole, exactly."""
        return 2 * Fraction(self.ramp.time_s) + self.constant_s

    def arc_length(self, t_s: ArrayLike) -> Real:
        """F at times 0 … duration (clipped); mm."""
        t, left, up, down = self._phases(t_s)
        ramp = self.ramp
        rise = ramp.value(DISPLACEMENT, np.clip(t, 0.0, ramp.time_s))
        fall = float(self.length_mm) - ramp.value(DISPLACEMENT, np.clip(left, 0.0, ramp.time_s))
        middle = ramp.feed_mm_s * (t - 0.5 * ramp.time_s)
        return np.asarray(np.where(up, rise, np.where(down, fall, middle)))

    def feed(self, t_s: ArrayLike) -> Real:
        """F'; mm/s."""
        return self._derivative(FEED, t_s, self.ramp.feed_mm_s, 1.0)

    def acceleration(self, t_s: ArrayLike) -> Real:
        """F''; mm/s^2."""
        return self._derivative(ACCELERATION, t_s, 0.0, -1.0)

    def jerk(self, t_s: ArrayLike) -> Real:
        """F'''; mm/s^3. Where it jumps, the value of the ramp."""
        return self._derivative(JERK, t_s, 0.0, 1.0)

    def _derivative(self, order: int, t_s: ArrayLike, middle: float, sign: float) -> Real:
        t, left, up, down = self._phases(t_s)
        rise = self.ramp.value(order, np.clip(t, 0.0, self.ramp.time_s))
        fall = sign * self.ramp.value(order, np.clip(left, 0.0, self.ramp.time_s))
        return np.asarray(np.where(up, rise, np.where(down, fall, middle)))

    def _phases(self, t_s: ArrayLike) -> tuple[Real, Real, NDArray[np.bool_], NDArray[np.bool_]]:
        duration = float(self.duration_s)
        t = np.clip(np.asarray(t_s, dtype=np.float64), 0.0, duration)
        left = duration - t
        up = t <= self.ramp.time_s
        return t, left, up, ~up & (left <= self.ramp.time_s)


def timeline(ramp: Ramp, length_mm: Fraction) -> Timeline:
    """The timeline of `ramp` over a length; the ramp's feed must not be above length / time."""
    ways = Fraction(ramp.feed_mm_s) * Fraction(ramp.time_s)
    rest = length_mm - ways
    if rest <= ways * Fraction(1, 2**40):
        rest = Fraction(0)
    return Timeline(ramp, length_mm, rest / Fraction(ramp.feed_mm_s))
