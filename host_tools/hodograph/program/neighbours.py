# SPDX-License-Identifier: MIT
"""No tick may pass more than two segment ends, even at 200 %; docs/reference/protocol.md 1.2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..feed.pieces import FeedPieces, derivative_extremes

Int = NDArray[np.int64]
Real = NDArray[np.float64]


LEAST_FEED_MM_S = 2.0**-10
"""A slower feed counts as this one: pairs that are too short for it are too short at any feed."""

REACH_Q40 = 1 << 27
"""How far a piece may reach beyond its ends: 2^-14 mm (check_pieces.WAY_SLACK_MM), and a gap at a joint."""

_LEAST_FEED_Q24 = 1 << 14


def brief_pairs(joints_q40: Int, pieces: FeedPieces, period_us: int) -> tuple[Int, Real, Real]:
    """Pairs of neighbouring segments not longer than the way of one tick at 200 %.

    joints_q40  (N + 1,) arc lengths of the joints
    Returns the first segment (K,) of each such pair, the pair's way in mm and the highest feed in mm/s that
    would be slow enough. Pairs with the first or last segment of the path are free of the rule.
    """
    if joints_q40.size < 5:
        empty: Real = np.zeros(0)
        return np.zeros(0, dtype=np.int64), empty, empty
    low, high = joints_q40[1:-3], joints_q40[3:-1]
    allowed_q24 = _crossing_feed_q24(high - low, period_us)
    allowed: Real = np.ldexp(allowed_q24.astype(np.float64), -24)
    fast = ~(highest_feed(low, high, pieces) <= allowed)
    brief = np.flatnonzero(fast | (allowed_q24 < _LEAST_FEED_Q24))
    way: Real = np.ldexp((high - low)[brief].astype(np.float64), -40)
    return np.asarray(brief + 1, dtype=np.int64), way, allowed[brief]


def _crossing_feed_q24(way_q40: Int, period_us: int) -> Int:
    """A feed in 2^-24 mm/s at which twice a period does not quite cover the way; rounded as the controller does."""
    return np.asarray((way_q40 >> 16) * (4_000_000 // period_us) // 8 - 1)


def highest_feed(low_q40: Int, high_q40: Int, pieces: FeedPieces) -> Real:
    """Bound of the feed (K,) over stretches low … high of arc length, from the pieces that reach into them."""
    peak = derivative_extremes(pieces.duration_q32_s, pieces.c_q40)[1][0]
    first = np.clip(
        np.searchsorted(pieces.start_q40, low_q40 - REACH_Q40, side="left") - 1, 0, None
    )
    last = np.searchsorted(pieces.start_q40, high_q40 + REACH_Q40, side="right")
    ranges = np.column_stack((first, np.maximum(last, first + 1))).ravel()
    padded = np.append(peak, 0.0)
    return np.asarray(np.maximum.reduceat(padded, ranges)[::2])
