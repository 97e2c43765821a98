# SPDX-License-Identifier: MIT
"""Rules of docs/reference/protocol.md 1.3, vectorised over the feed pieces of a program."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..feed.override_levels import FACTOR_ONE_Q14
from ..feed.pieces import (
    DEGREE,
    derivative_bounds,
    derivative_extremes,
    exponents,
    way_excess,
)
from .codes import ProgramError
from .image import Program
from .limits import ProgramLimits

Bool = NDArray[np.bool_]
Rule = tuple[Bool, int, ProgramError]
Int = NDArray[np.int64]
Real = NDArray[np.float64]

COEFFICIENT_Q40 = 1 << 54
PIECE_Q40 = 32 << 40
JOIN_Q40 = 1 << 6
ARC_LIMIT_Q40 = 1 << 62
LONGEST_Q32 = 1 << 54
JOIN_FEED_Q24 = 2.0**8
JOIN_ACCELERATION_Q16 = 2.0**10
"""2^-16 mm/s and 2^-6 mm/s^2, in the units to which the controller rounds down what it compares."""
BACKWARDS_MM_S = -(2.0**-10)
WAY_SLACK_MM = 2.0**-14
"""What a piece may go behind its start or beyond its end."""


def piece_faults(program: Program, limits: ProgramLimits | None) -> list[Rule]:
    """What is wrong with the pieces and their joints, in the order of the controller."""
    code = ProgramError
    pieces = program.pieces
    duration, start, c = pieces.duration_q32_s, pieces.start_q40, pieces.c_q40
    large: Bool = np.asarray(((c > COEFFICIENT_Q40) | (c < -COEFFICIENT_Q40)).any(axis=1))
    outside: Bool = np.asarray((start < 0) | (start >= ARC_LIMIT_Q40))
    ranges: list[Rule] = [
        (np.asarray((duration <= 0) | (duration > LONGEST_Q32)), 0, code.PIECE_DURATION),
        (large, 0, code.COEFFICIENT),
        (outside, 0, code.ARC_RANGE),
    ]
    whole = _before_first(ranges, len(pieces))
    if whole == 0:
        return ranges
    return ranges + _shape_faults(program, limits, whole)


def _before_first(rules: list[Rule], count: int) -> int:
    """How many pieces from the first are in range; the others cannot be looked into."""
    return min([int(mask.argmax()) for mask, _, _ in rules if mask.any()], default=count)


def _shape_faults(program: Program, limits: ProgramLimits | None, count: int) -> list[Rule]:
    code = ProgramError
    pieces = program.pieces
    duration, start, c = (
        a[:count] for a in (pieces.duration_q32_s, pieces.start_q40, pieces.c_q40)
    )
    way = _ways_q44(duration, c)
    advance = np.diff(start.astype(object))
    gaps = way[:-1].astype(object) - 16 * advance
    (feed_start, feed_end), (acceleration_start, acceleration_end) = _end_values(duration, c)
    bounds = _bound_faults(duration, c, limits)
    factor = pieces.override_factor_q14
    codes = np.hstack((pieces.override_rate_codes, pieces.override_second_codes))
    override = (factor < FACTOR_ONE_Q14) | (factor > 2 * FACTOR_ONE_Q14)
    start_moving = np.array([_moving(feed_start[0], acceleration_start[0])])
    return [
        (np.asarray(np.abs(way) > PIECE_Q40 << 4), 0, code.PIECE_LONG),
        *bounds,
        (np.asarray(override | (codes == 0).any(axis=1)), 0, code.OVERRIDE),
        (np.asarray(start[:1] != 0, dtype=np.bool_), 0, code.PIECE_FIRST),
        (start_moving, 0, code.START_MOVING),
        (np.asarray(advance < 0, dtype=np.bool_), 1, code.BACKWARDS),
        (np.asarray(np.abs(gaps) > JOIN_Q40 << 4, dtype=np.bool_), 1, code.JOIN_LENGTH),
        (np.abs(feed_end[:-1] - feed_start[1:]) > JOIN_FEED_Q24, 1, code.JOIN_FEED),
        (
            np.abs(acceleration_end[:-1] - acceleration_start[1:]) > JOIN_ACCELERATION_Q16,
            1,
            code.JOIN_ACCELERATION,
        ),
        (_brief(pieces.duration_q32_s, program.period_us), 2, code.PIECE_SHORT),
    ]


def _bound_faults(duration: Int, c: Int, limits: ProgramLimits | None) -> list[Rule]:
    """Feed, acceleration and jerk beyond what is allowed; close cases are looked at more closely."""
    rules = _bound_masks(duration, c, limits, 4)
    suspects = np.flatnonzero(np.logical_or.reduce([mask for mask, _, _ in rules]))
    for first in range(0, suspects.size, 256):
        some = suspects[first : first + 256]
        close = _bound_masks(duration[some], c[some], limits, 9)
        for (mask, _, _), (exact, _, _) in zip(rules, close, strict=True):
            mask[some] = exact
    return rules


def _bound_masks(duration: Int, c: Int, limits: ProgramLimits | None, halvings: int) -> list[Rule]:
    lows, highs = derivative_extremes(duration, c, halvings)
    excess = way_excess(duration, c, halvings)
    backwards = (lows[0] < BACKWARDS_MM_S) | (excess > WAY_SLACK_MM)
    out: list[Rule] = [(np.asarray(backwards), 0, ProgramError.BACKWARDS)]
    if limits is None:
        return out
    peaks = highs[0], np.maximum(-lows[1], highs[1]), np.maximum(-lows[2], highs[2])
    asked = (limits.feed_um_s * 1e-3, limits.acceleration_um_s2 * 1e-3, limits.jerk_mm_s3)
    codes = (ProgramError.FEED, ProgramError.ACCELERATION, ProgramError.JERK)
    for peak, limit, code in zip(peaks, asked, codes, strict=True):
        out.append((np.asarray((peak > limit) & (limit > 0.0)), 0, code))
    return out


def last_piece_faults(program: Program) -> list[Rule]:
    """What is wrong with the end of the feed."""
    pieces = program.pieces
    last = len(pieces) - 1
    duration, c = pieces.duration_q32_s[last:], pieces.c_q40[last:]
    way = int(_ways_q44(duration, c)[0])
    missed = abs(way + ((int(pieces.start_q40[last]) - program.length_q40) << 4)) > JOIN_Q40 << 4
    feed, acceleration = _end_values(duration, c)
    return [
        (np.array([_moving(feed[1][0], acceleration[1][0])]), last, ProgramError.END_MOVING),
        (np.array([missed]), last, ProgramError.PIECE_END),
    ]


def _end_values(duration: Int, c: Int) -> tuple[tuple[Real, Real], tuple[Real, Real]]:
    """Feed in 2^-24 mm/s and acceleration in 2^-16 mm/s^2, each (at the start, at the end) of the pieces."""
    feed, acceleration, _ = derivative_bounds(duration, c)
    v, a = np.floor(feed * 2.0**24), np.floor(acceleration * 2.0**16)
    return (v[:, 0], v[:, -1]), (a[:, 0], a[:, -1])


def _moving(feed_q24: float, acceleration_q16: float) -> bool:
    return abs(feed_q24) > JOIN_FEED_Q24 or abs(acceleration_q16) > JOIN_ACCELERATION_Q16


def _ways_q44(duration: Int, c: Int) -> Int:
    """Way of each piece in 2^-44 mm, rounded down from the exact sum of its terms."""
    shift = exponents(duration) + 32
    ways = [_way_q44(int(d), int(e), row) for d, e, row in zip(duration, shift, c, strict=True)]
    return np.array(ways, dtype=np.int64)


def _way_q44(d: int, e: int, c: Int) -> int:
    if not c[1:].any():
        return (int(c[0]) * d << 4) >> e
    total = 0
    for k in range(DEGREE, 0, -1):
        # Horner over the common denominator 2^(e (DEGREE - k + 1)).
        total = (total + (int(c[k - 1]) << (e * (DEGREE - k)))) * d
    return (total << 4) >> (e * DEGREE)


def _brief(duration: Int, period_us: int) -> Bool:
    """Neighbours (without first and last piece) that last no longer than two periods together."""
    pairs = duration[1:-2] + duration[2:-1]
    return np.asarray(pairs.astype(object) * 1_000_000 <= 2 * period_us << 32, dtype=np.bool_)
