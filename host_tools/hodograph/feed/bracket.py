# SPDX-License-Identifier: MIT
"""The highest feed that keeps its bounds, by a secant within a bracket; docs/theory/numerics.md 5.5."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, log
from typing import TypeVar

T = TypeVar("T")

_LEAST_GAIN = 0.05
"""Of a step down in the logarithm of the peak, over that of the feed: less is taken as so much."""


def highest(
    feed_mm_s: float,
    excess: float,
    attempt: Callable[[float], tuple[T, float]],
    close: float,
    hair: float,
    most_trials: int,
) -> T | None:
    """What `attempt` makes of the highest feed with an excess of at most 0; None where none is found.

    attempt  of a feed: what it gives and the logarithm of its worst peak over bound (above 0: broken)
    excess   of `feed_mm_s`, above 0
    close    how near to 0 the excess may stay, and how narrow the bracket, when the search ends
    hair     what first steps go below proportion

    Peaks go about with the feed: first steps in proportion until one obeys, longer where the last one has brought less;
    then the secant between the logarithms of feed and excess.
    """
    high, high_excess = log(feed_mm_s), excess
    gain = 1.0
    low = low_excess = 0.0
    best: T | None = None
    for _ in range(most_trials):
        if best is None:
            trial = high - high_excess / gain - hair
        else:
            share = -low_excess / (high_excess - low_excess)
            trial = low + (high - low) * max(0.05, min(0.95, share))
        made, found = attempt(exp(trial))
        if found > 0.0:
            gain = min(1.0, max(_LEAST_GAIN, (high_excess - found) / (high - trial)))
            high, high_excess = trial, found
            continue
        best, low, low_excess = made, trial, found
        if low_excess > -close or high - low < close:
            break
    return best
