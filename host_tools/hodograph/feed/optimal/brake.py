# SPDX-License-Identifier: MIT
"""A brake to rest along a path without a quadratic program: one polynomial of degree 4 in time; docs/theory/feed.md
5.6. Used by stream/tails. No I/O.

With u = t / T the feed is (1 - u)^2 (v (1 + 2 u) + a T u): it begins with the feed v and the acceleration a, and both
are 0 at its end. Its distance T (v / 2 + a T / 12) gives T. Such a brake takes about a fifth longer than the fastest
one, since its jerk falls evenly.
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from ..pieces import LONGEST_PIECE_MM
from .track import Ends
from .window import State

_PIECE_S = 0.05
"""Approximate duration of a piece."""
_FEWEST, _MOST = 3, 12
"""Least and greatest number of pieces of a brake."""
_LEAST_PERIODS = 3.0
"""Least duration of a piece, in periods."""


def brake_to_rest(state: State, low: float, high: float, period_s: float) -> Ends | None:
    """The brake from a moving state at arc length `low` to rest at `high`, in pieces of equal duration. None: it would
    reverse, or its pieces would be too brief. It may exceed limits.
    """
    if state.q <= 0.0:
        return None
    feed, acceleration, distance = sqrt(state.q), 0.5 * state.slope, high - low
    square = 0.25 * feed * feed + acceleration * distance / 3.0
    if distance <= 0.0 or square < 0.0:
        return None
    total_s = 2.0 * distance / (0.5 * feed + sqrt(square))
    if 3.0 * feed + acceleration * total_s < 0.0:
        return None
    count = min(max(round(total_s / _PIECE_S), _FEWEST), _MOST)
    count = max(count, ceil(2.0 * distance / LONGEST_PIECE_MM))
    if total_s < _LEAST_PERIODS * count * period_s:
        return None
    u, lead = np.linspace(0.0, 1.0, count + 1), acceleration * total_s
    s = low + total_s * (
        feed * (u - u**3 + 0.5 * u**4) + lead * (0.5 * u**2 - 2.0 / 3.0 * u**3 + 0.25 * u**4)
    )
    s[0], s[-1] = low, high
    jerk = (feed * (12.0 * u - 6.0) + lead * (6.0 * u - 4.0)) / total_s**2
    return Ends(
        s,
        (1.0 - u) ** 2 * (feed * (1.0 + 2.0 * u) + lead * u),
        (feed * (6.0 * u**2 - 6.0 * u) + lead * (1.0 - 4.0 * u + 3.0 * u**2)) / total_s,
        (jerk[:-1], jerk[1:]),
        np.full(count, total_s / count),
    )
