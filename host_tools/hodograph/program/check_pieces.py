# SPDX-License-Identifier: MIT
"""Rules of docs/protocol.md 1.3, vectorised over the feed pieces of a program."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..feed.pieces import DEGREE, derivative_bounds, exponents
from .codes import ProgramError
from .image import Program

if TYPE_CHECKING:
    from .check import ProgramLimits

Bool = NDArray[np.bool_]
Int = NDArray[np.int64]
Real = NDArray[np.float64]

COEFFICIENT_Q40 = 1 << 54
PIECE_Q40 = 32 << 40
JOIN_Q40 = 1 << 6
JOIN_FEED_MM_S = 2.0**-16
JOIN_ACCELERATION_MM_S2 = 2.0**-6
BACKWARDS_MM_S = -(2.0**-10)
ONE_Q24 = 1 << 24


def piece_faults(
    program: Program, limits: ProgramLimits | None
) -> list[tuple[Bool, int, ProgramError]]:
    """Masks of what is wrong: (mask, index of its first element, code)."""
    code = ProgramError
    pieces = program.pieces
    duration, start, c = pieces.duration_q32_s, pieces.start_q40, pieces.c_q40
    empty = duration <= 0
    if empty.any():
        return [(empty, 0, code.PIECE_DURATION)]
    large: Bool = np.asarray(((c > COEFFICIENT_Q40) | (c < -COEFFICIENT_Q40)).any(axis=1))
    if large.any():
        return [(large, 0, code.COEFFICIENT)]
    way_q44 = _ways_q44(duration, c)
    gaps = way_q44[:-1].astype(object) - (np.diff(start.astype(object)) << 4)
    feed, acceleration, jerk = derivative_bounds(duration, c)
    last = len(pieces) - 1
    rest_start = (
        abs(feed[0, 0]) > JOIN_FEED_MM_S or abs(acceleration[0, 0]) > JOIN_ACCELERATION_MM_S2
    )
    rest_end = (
        abs(feed[-1, -1]) > JOIN_FEED_MM_S or abs(acceleration[-1, -1]) > JOIN_ACCELERATION_MM_S2
    )
    missed = abs(int(way_q44[-1]) + ((int(start[-1]) - program.length_q40) << 4)) > JOIN_Q40 << 4
    factor = pieces.override_factor_q24
    rates = (pieces.override_rate_q16_per_s == 0) | (pieces.override_second_q8_per_s2 == 0)
    out = [
        (way_q44 > PIECE_Q40 << 4, 0, code.PIECE_LONG),
        (np.asarray(start[:1] != 0, dtype=np.bool_), 0, code.PIECE_FIRST),
        (np.asarray(np.abs(gaps) > JOIN_Q40 << 4, dtype=np.bool_), 1, code.JOIN_LENGTH),
        (np.abs(feed[:-1, -1] - feed[1:, 0]) > JOIN_FEED_MM_S, 1, code.JOIN_FEED),
        (
            np.abs(acceleration[:-1, -1] - acceleration[1:, 0]) > JOIN_ACCELERATION_MM_S2,
            1,
            code.JOIN_ACCELERATION,
        ),
        (np.array([rest_start]), 0, code.START_MOVING),
        (np.array([rest_end]), last, code.END_MOVING),
        (np.array([missed]), last, code.PIECE_END),
        (_brief(duration, program.period_us), 2, code.PIECE_SHORT),
        (feed.min(axis=1) < BACKWARDS_MM_S, 0, code.BACKWARDS),
        ((factor < ONE_Q24) | (factor > 2 * ONE_Q24) | rates, 0, code.OVERRIDE),
    ]
    if limits is not None:
        out += [
            (_above(feed, limits.feed_um_s * 1e-3), 0, code.FEED),
            (_above(acceleration, limits.acceleration_um_s2 * 1e-3), 0, code.ACCELERATION),
            (_above(jerk, float(limits.jerk_mm_s3)), 0, code.JERK),
        ]
    return out


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


def _above(values: Real, limit: float) -> Bool:
    if limit == 0.0:
        return np.zeros(values.shape[0], dtype=np.bool_)
    return np.asarray(np.abs(values).max(axis=1) > limit)
