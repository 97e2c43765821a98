# SPDX-License-Identifier: MIT
"""The profile with two ramps and a constant feed between them: exact arc length over time, and its integer feed pieces;
docs/theory/feed.md 5.1 and section 6. Used by feed/planning. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..fixed_point import MM_PER_Q40, nearest_q40, to_q40
from .pieces import LONGEST_PIECE_MM, RawPieces, derivative_bounds, round_pieces
from .ramp import ACCELERATION, DISPLACEMENT, FEED, JERK, Ramp

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 96, 128)
"""Numbers of pieces per ramp, in the order in which they are tried."""
_TIGHT = 1.01
"""Greatest ratio of the controller's bound of an acceleration or jerk to its true peak."""
_LEAST_FEED_MM_S = -(2.0**-11)
"""Least Bernstein coefficient of the feed: a little below 0 is accepted."""

# A piece in its own s = 0 … 1: Hermite data F', F'' at both ends and the distance, by quintic; the two free
# coefficients of degree 6 and 7 by least squares on the jerk at Chebyshev points.
_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(12) + 0.5) / 12)
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(12)
_FREE = np.array([[0, 0, 0, 1, -3, 3, -1, 0], [0, 0, 0, 0, 1, -3, 3, -1]], dtype=np.float64)
_THIRD = np.array([0, 0, 0, 6, 24, 60, 120, 210], dtype=np.float64)
_POWERS = _SAMPLES[:, None] ** np.maximum(np.arange(8) - 3, 0)
_FIT = np.linalg.pinv((_FREE * _THIRD) @ _POWERS.T)


@dataclass(frozen=True, eq=False)
class Timeline:
    """A ramp up, constant feed for `constant_s` and the mirrored ramp down, over `length_mm`.

    `length_mm` and `constant_s` are exact. Without a constant stretch the distance of the two ramps is the length,
    except for the rounding of the feed.
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

    def value(self, order: int, t_s: ArrayLike) -> Real:
        """F (order 0) or a derivative of it."""
        return (self.arc_length, self.feed, self.acceleration, self.jerk)[order](t_s)

    @property
    def time_s(self) -> float:
        """Time of the whole."""
        return float(self.duration_s)

    @property
    def follows_joints(self) -> bool:
        """Pieces do not depend on the joints of segments."""
        return False

    def peaks(self) -> tuple[float, float, float]:
        """Greatest feed, acceleration and jerk along the path."""
        ramp = self.ramp
        return ramp.feed_mm_s, ramp.peak(ACCELERATION), ramp.peak(JERK)

    def raw_pieces(
        self, length_q40: int, period_us: int, joints_q40: Int | None = None
    ) -> RawPieces:
        """Integer pieces over exactly this length, which may differ from the own one by rounding; `joints_q40` is not
        used.
        """
        if length_q40 == nearest_q40(self.length_mm):
            return quantise(self, length_q40, period_us)
        length = Fraction(length_q40, 2**40)
        ramp = self.ramp
        if not self.constant_s:
            ramp = replace(ramp, feed_mm_s=float(length / Fraction(ramp.time_s)))
        return quantise(timeline(ramp, length), length_q40, period_us)

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
    distances = Fraction(ramp.feed_mm_s) * Fraction(ramp.time_s)
    rest = length_mm - distances
    if rest <= distances * Fraction(1, 2**40):
        rest = Fraction(0)
    return Timeline(ramp, length_mm, rest / Fraction(ramp.feed_mm_s))


def quantise(line: Timeline, length_q40: int, period_us: int) -> RawPieces:
    """Pieces of the timeline over exactly `length_q40`. No two consecutive ones, except the first and the last, last
    less than two periods together.
    """
    end = round(line.duration_s * 2**32)
    up_end = round(Fraction(line.ramp.time_s) * 2**32)
    down_start = end - up_end if line.constant_s else up_end
    middle = _constant_cuts(line, up_end, down_start)
    middle_starts = _constant_starts(line, middle)
    straight = np.zeros((middle.size - 1, 8))
    straight[:, 1] = np.diff(middle_starts) * MM_PER_Q40
    inner = round_pieces(middle, middle_starts, straight)
    for cuts in _cut_counts(line, up_end, period_us):
        up_cuts = _ramp_cuts(line, up_end, cuts)
        # The ramp down is the ramp up in reverse, from the exact end, which differs from the last tick by rounding.
        down_cuts = end - _ramp_cuts(line, end - down_start, cuts)[::-1]
        up = _fit_ramp(line, up_cuts, 0.0, False)
        down = _fit_ramp(line, down_cuts, float(line.duration_s), True)
        up_starts = np.append(_distance_sums(up)[:-1], middle_starts[0])
        down_starts = np.append(
            middle_starts[-1], length_q40 - _distance_sums(down)[-1] + _distance_sums(down)[1:]
        )
        raw = RawPieces(
            np.concatenate((np.diff(up_cuts), np.diff(middle), np.diff(down_cuts))),
            np.concatenate((up_starts[:-1], middle_starts[:-1], down_starts[:-1])),
            np.concatenate(
                (
                    round_pieces(up_cuts, up_starts, up.shape),
                    inner,
                    round_pieces(down_cuts, down_starts, down.shape),
                )
            ),
            max(up.jerk_error, down.jerk_error),
            max(up.distance_error, down.distance_error),
        )
        if raw.faithful and _tight(raw, line):
            break
    return raw


@dataclass(frozen=True, eq=False)
class _Ramp:
    distance: Real  # mm, of each piece
    shape: Real  # (n, 8), powers of s, mm
    jerk_error: float
    distance_error: float


def _cut_counts(line: Timeline, ramp_q32: int, period_us: int) -> list[int]:
    """Numbers of pieces per ramp to try: long enough for the period, short enough in mm."""
    most = max(1, int(ramp_q32 / 2**32 / (period_us * 1e-6 * (1.0 + 1e-6))))
    least = line.ramp.feed_mm_s * line.ramp.time_s / LONGEST_PIECE_MM
    fit = [n for n in _COUNTS if least <= n <= most]
    if not fit:
        return [min(most, int(np.ceil(least)) if least > _COUNTS[-1] else most)]
    return fit


def _ramp_cuts(line: Timeline, end: int, count: int) -> Int:
    """Even cuts of the ramp, without those at which a negative feed of (18) has not been compensated yet: starts of
    pieces have to rise.
    """
    cuts = _even(0, end, count)
    distance = line.ramp.value(DISPLACEMENT, cuts * 2.0**-32)
    keep = distance > 2.0**-38
    keep[0] = keep[-1] = True
    return cuts[keep]


def _even(start: int, end: int, count: int) -> Int:
    return np.array([start + (end - start) * j // count for j in range(count + 1)], dtype=np.int64)


def _fit_ramp(line: Timeline, cuts: Int, origin_s: float, backwards: bool) -> _Ramp:
    """Polynomials for the pieces between `cuts`; backwards: from origin_s - t on the ramp."""
    t = cuts.astype(np.float64) * 2.0**-32
    h = np.diff(t)[:, None]
    sign = -1.0 if backwards else 1.0

    def ramp(order: int, s: Real) -> Real:
        local = t[:-1, None] + s * h
        value = line.ramp.value(order, origin_s - local if backwards else local)
        return sign**order * value if order else value

    ends = np.array([0.0, 1.0])
    v, a = ramp(FEED, ends) * h, ramp(ACCELERATION, ends) * h**2
    distance = 0.5 * h[:, 0] * (ramp(FEED, 0.5 + 0.5 * _GAUSS_X) @ _GAUSS_W)
    shape = _hermite(distance, v[:, 0], v[:, 1], a[:, 0], a[:, 1])
    target = ramp(JERK, _SAMPLES) * h**3
    shape = shape + (target - (shape * _THIRD) @ _POWERS.T) @ _FIT @ _FREE
    jerk = ramp(JERK, _CHECK) * h**3 - (shape * _THIRD) @ _CHECK_POWERS.T
    # The error of the distance is that of the jerk, integrated three times from both ends: below jerk h^3 / 100.
    worst = np.abs(jerk).max(axis=1)
    return _Ramp(distance, shape, float((worst / h[:, 0] ** 3).max()), float(worst.max() / 100.0))


_CHECK = np.linspace(0.0, 1.0, 33)
"""Places of a piece at which its jerk is compared with the exact profile."""
_CHECK_POWERS = _CHECK[:, None] ** np.maximum(np.arange(8) - 3, 0)
"""Powers of _CHECK of the terms of the jerk."""


def _hermite(distance: Real, v0: Real, v1: Real, a0: Real, a1: Real) -> Real:
    out = np.zeros((distance.size, 8))
    out[:, 1], out[:, 2] = v0, a0 / 2.0
    p = distance - v0 - a0 / 2.0
    v = v1 - v0 - a0
    a = a1 - a0
    out[:, 3] = 10.0 * p - 4.0 * v + a / 2.0
    out[:, 4] = -15.0 * p + 7.0 * v - a
    out[:, 5] = 6.0 * p - 3.0 * v + a / 2.0
    return out


def _distance_sums(ramp: _Ramp) -> Int:
    """Distances from the start of the ramp to the ends of its pieces, 0 first; 2^-40 mm."""
    total = np.concatenate((np.zeros(1), np.cumsum(ramp.distance)))
    return to_q40(total)


def _constant_cuts(line: Timeline, start: int, end: int) -> Int:
    if end == start:
        return np.array([start], dtype=np.int64)
    distance = line.ramp.feed_mm_s * (end - start) / 2**32
    return _even(start, end, int(np.ceil(distance / LONGEST_PIECE_MM)))


def _constant_starts(line: Timeline, cuts: Int) -> Int:
    """F = V (t - T/2) at the cuts, in exact arithmetic."""
    feed = Fraction(line.ramp.feed_mm_s)
    first = round(feed * (Fraction(int(cuts[0]), 2**32) - Fraction(line.ramp.time_s) / 2) * 2**72)
    step = round(feed * 2**72)  # per 2^-32 s, in 2^-104 mm: exact to far below 2^-40 mm
    base = int(cuts[0])
    half = 1 << 31
    return np.array(
        [(first + ((int(t) - base) * step >> 32) + half) >> 32 for t in cuts], dtype=np.int64
    )


def _tight(raw: RawPieces, line: Timeline) -> bool:
    """Whether the Bernstein bounds, which the controller checks, are close to the true extremes."""
    feed, acceleration, jerk = derivative_bounds(raw.duration_q32_s, raw.c_q40)
    return bool(
        feed.min() > _LEAST_FEED_MM_S
        and np.abs(acceleration).max() < _TIGHT * line.ramp.peak(ACCELERATION)
        and np.abs(jerk).max() < _TIGHT * line.ramp.peak(JERK)
    )
