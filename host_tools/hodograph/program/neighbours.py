# SPDX-License-Identifier: MIT
"""No tick may pass more than two segment ends, even at 200 %; docs/protocol.md 1.2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..feed.pieces import FeedPieces, derivative_extremes

Int = NDArray[np.int64]
Real = NDArray[np.float64]


def brief_pairs(joints_q40: Int, pieces: FeedPieces, period_us: int) -> tuple[Int, Real, Real]:
    """Pairs of neighbouring segments not longer than the way of one tick at 200 %.

    joints_q40  (N + 1,) arc lengths of the joints
    Returns the first segment (K,) of each such pair, the pair's way in mm and the feed in mm/s that
    would be slow enough. Pairs with the first or last segment of the path are free of the rule.
    """
    count = joints_q40.size - 1
    if count < 4:
        empty: Real = np.zeros(0)
        return np.zeros(0, dtype=np.int64), empty, empty
    way = (joints_q40[3:-1] - joints_q40[1:-3]).astype(np.float64) * 2.0**-40
    feed = highest_feed(joints_q40[1:-3], joints_q40[3:-1], pieces)
    allowed: Real = way / (2.0 * period_us * 1e-6)
    brief = np.flatnonzero(~(allowed > feed))
    return np.asarray(brief + 1, dtype=np.int64), way[brief], allowed[brief]


def highest_feed(low_q40: Int, high_q40: Int, pieces: FeedPieces) -> Real:
    """Bound of the feed (K,) over stretches low … high of arc length, from the pieces over them."""
    peak = derivative_extremes(pieces.duration_q32_s, pieces.c_q40)[1][0]
    first = np.clip(np.searchsorted(pieces.start_q40, low_q40, side="right") - 1, 0, None)
    last = np.searchsorted(pieces.start_q40, high_q40, side="left")
    ranges = np.column_stack((first, np.maximum(last, first + 1))).ravel()
    padded = np.append(peak, 0.0)
    return np.asarray(np.maximum.reduceat(padded, ranges)[::2])
