# SPDX-License-Identifier: MIT
"""Feed reduction: the highest constant feed that the path, the limits and the format allow; docs/theory/feed.md 5.5.
Used by feed/planning. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from math import exp, log
from typing import TypeVar

from ..errors import PlanError
from .limits import ControllerLimits, Limit, Limits, least
from .pieces import LONGEST_PIECE_MM
from .ramp import ACCELERATION, JERK, Shape, make_shape
from .request import FeedRequest

T = TypeVar("T")

_MARGIN = 1e-9
"""How far the search first aims below a limit, in the logarithm of the feed."""
_CLOSE = 1e-6
"""The search ends when the logarithm of the limit usage, or of the feed, is this exact."""
_MOST_TRIALS = 40
"""Greatest number of feeds that are tried."""

_LEAST_GAIN = 0.05
"""Least assumed ratio of a step in the logarithm of the peak to the step in that of the feed."""

_ORDERS = {"acceleration_mm_s2": ACCELERATION, "jerk_mm_s3": JERK}
"""Derivatives of a ramp, by the key of their limit."""


def choose(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    further: tuple[Limit, ...],
) -> tuple[Shape, tuple[str, ...]]:
    """The ramp with the highest feed that all limits allow, and what lowered it.

    further  more limits of the feed. The stretch of constant feed, if any, lasts at least a period.
    """
    make = partial(make_shape, request)
    ramp_s = Fraction(request.ramp_time_s)
    only_ramps = float(length / ramp_s)
    lowest = least(
        (
            Limit("feed_mm_s", float(request.nominal_mm_s), "feed"),
            *_feed_limits(limits, controller, period_us),
            *further,
            _feed_limit(
                only_ramps,
                f"the path of {float(length):.6g} mm is too short for two ramps of {request.ramp_time_s:g} s",
            ),
        )
    )
    with_constant = float(length / (ramp_s + Fraction(1e-6 * period_us * (1.0 + 1e-3))))
    too_brief = _feed_limit(
        with_constant, "the stretch of constant feed would be shorter than a period"
    )
    if with_constant < lowest.value < only_ramps:
        lowest = too_brief
    shape, binding = _reduced(make, lowest.value, _ramp_limits(limits, controller))
    if binding is not None and with_constant < shape.ramp.feed_mm_s < only_ramps:
        shape, binding, lowest = make(with_constant), None, too_brief
    if not shape.ramp.feed_mm_s < request.nominal_mm_s:
        return shape, ()
    why = (binding or lowest).reason
    reduced = (
        f"feed lowered from {request.nominal_mm_s:g} to {shape.ramp.feed_mm_s:.6g} mm/s: {why}"
    )
    return shape, (reduced,)


def _feed_limit(value: float, words: str) -> Limit:
    return Limit("feed_mm_s", value, "format", words=words)


def _feed_limits(
    limits: Limits, controller: ControllerLimits | None, period_us: int
) -> list[Limit]:
    out = [
        _feed_limit(
            0.99 * LONGEST_PIECE_MM / (1e-6 * period_us),
            f"pieces of the format end within 32 mm, more than a period of {period_us} us",
        )
    ]
    if limits.policy == "respect" and limits.feed_mm_s is not None:
        out.append(Limit("feed_mm_s", limits.feed_mm_s))
    if controller is not None:
        out.append(controller.limit("feed_mm_s"))
    return out


def _ramp_limits(limits: Limits, controller: ControllerLimits | None) -> list[Limit]:
    """The limits of the ramp's acceleration and jerk."""
    out = []
    for key in _ORDERS:
        own = getattr(limits, key)
        if limits.policy == "respect" and own is not None:
            out.append(Limit(key, own))
        if controller is not None:
            out.append(controller.limit(key))
    return out


def _reduced(
    make: Callable[[float], Shape], feed_mm_s: float, limits: list[Limit]
) -> tuple[Shape, Limit | None]:
    """The shape at `feed_mm_s`, or at the highest lower feed that keeps all limits, with the limit that lowered it."""
    shape = make(feed_mm_s)
    excess, worst = _excess(shape, limits)
    if worst is None or excess <= 0.0:
        return shape, None

    def attempt(feed: float) -> tuple[tuple[Shape, Limit | None], float]:
        tried = make(feed)
        found, exceeded = _excess(tried, limits)
        return (tried, exceeded), found

    best = highest(feed_mm_s, excess, attempt, _CLOSE, _MARGIN, _MOST_TRIALS)
    if best is None:
        raise PlanError(f"feed: no feed keeps {worst.reason}: raise it")
    return best


def _excess(shape: Shape, limits: list[Limit]) -> tuple[float, Limit | None]:
    """Logarithm of the greatest limit usage of a ramp (above 0: exceeded), and that limit."""
    worst, found = -1.0, None
    for limit in limits:
        excess = log(shape.ramp.peak(_ORDERS[limit.key]) / limit.value)
        if found is None or excess > worst:
            worst, found = excess, limit
    return worst, found


def highest(
    feed_mm_s: float,
    excess: float,
    attempt: Callable[[float], tuple[T, float]],
    close: float,
    margin: float,
    most_trials: int,
) -> T | None:
    """The result of `attempt` for the highest feed with an excess of at most 0, by the secant method within a bracket;
    None: no such feed was found.

    attempt    for a feed: its result, and the logarithm of its greatest limit usage (above 0: exceeded)
    excess     of `feed_mm_s`, above 0
    close      the search ends when the excess is this near to 0, or the bracket this narrow
    margin     by how much first steps go below proportion

    Peaks are about proportional to a power of the feed. The first steps are in proportion until one keeps all limits,
    and longer if the last one reduced the excess less. Then follows the secant between the logarithms of feed and
    excess.
    """
    high, high_excess = log(feed_mm_s), excess
    gain = 1.0
    low = low_excess = 0.0
    best: T | None = None
    for _ in range(most_trials):
        if best is None:
            trial = high - high_excess / gain - margin
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
