# SPDX-License-Identifier: MIT
"""The sequence of planning windows (parts that are planned at once) over a whole path; docs/theory/feed.md 5.6. Used by
optimal/planner, stream/tails and stream/windows. No I/O.

With windows, time and memory are proportional to length. Each window is planned to rest at its own end, so a motion to
rest inside all limits always exists. Only the first part of a window is kept, which the stop at the end does not
affect; the next window begins there with the same F, F', F''. A window is planned again if its pieces exceed a limit:
next to rest and at sudden changes a polynomial of degree 7 differs from the feed over arc length that it replaces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline.frames import Curve
from .knots import FirstEstimate, first_estimate
from .plan_limits import PlanLimits
from .track import Ends, ends_of, make_track, piece_usage
from .window import Solution, State, plan_window, tightened

Real = NDArray[np.float64]

INTERVALS = 960
"""Approximate number of intervals of a window."""

_STOPS = 4.0
"""The part of a window that is not kept, as a multiple of the stopping time."""

_RETREATS = 4


_EXCEEDED = 1.003
_MOST_TIGHTENED = 3
_INHERITED = 2
"""Intervals whose limits stay, since the state at the start of a window determines them."""


class NothingFoundError(PlanError):
    """The solver finds no feed for a window that begins at rest."""


def plan_windows(
    spline: Curve, limits: PlanLimits, period_s: float, intervals: int = INTERVALS
) -> Iterator[Ends]:
    """The parts of the plan in order. Raises NothingFoundError."""
    length = spline.length_mm
    overview = _overview(spline, limits, period_s)
    held: Solution | None = None
    count = 0
    while True:
        found, start = None, 0
        if held is not None:
            for _ in range(_RETREATS):
                start = count
                found = _continued(spline, limits, overview, held, start, intervals, period_s)
                if found is not None:
                    break
                count = 2 * count // 3
            else:
                start = held.grid.size
            yield ends_of(held, start)
        if found is None:
            low = 0.0 if held is None else float(held.grid.s[-1])
            high = overview.window_end(low, intervals)
            found = plan_window(spline, limits, low, high, None, period_s)
        if found is None:
            raise NothingFoundError(f"feed: nothing found from arc length {low:g} mm")
        held = found = measured(spline, found)
        if found.grid.s[-1] >= length:
            yield ends_of(found, found.grid.size)
            return
        count = kept(found, overview.stop_s)


def _continued(
    spline: Curve,
    limits: PlanLimits,
    overview: _Overview,
    held: Solution,
    count: int,
    intervals: int,
    period_s: float,
) -> Solution | None:
    """The window that continues from knot `count` of the one before."""
    low = float(held.grid.s[count])
    state = State(float(held.q[count]), float(held.slope[count]))
    high = overview.window_end(low, intervals)
    return plan_window(
        spline, limits, low, high, state, period_s, held, trusted_to(held, overview.stop_s)
    )


def kept(found: Solution, stop_s: float) -> int:
    """Number of intervals that are far enough from the stop at the end."""
    left = found.duration_s - np.cumsum(found.times)
    count = int(np.count_nonzero(left > _STOPS * stop_s))
    return max(count, found.grid.size // 3)


def trusted_to(found: Solution, stop_s: float) -> float:
    """Arc length up to which the stop at the end affects a window so little that the next one uses its feed as
    estimate.
    """
    left = found.duration_s - np.concatenate((np.zeros(1), np.cumsum(found.times)))
    return float(found.grid.s[int(np.count_nonzero(left > 2.0 * stop_s))])


class _Overview:
    """Estimates of the length of intervals along the path, and of the stopping time."""

    def __init__(self, s: Real, count: Real, stop_s: float) -> None:
        self.s, self.count, self.stop_s = s, count, stop_s

    def window_end(self, low: float, intervals: int) -> float:
        """Arc length `intervals` further on, or the end of the path if that is near."""
        at = float(np.interp(low, self.s, self.count))
        if self.count[-1] - at < 1.35 * intervals:
            return float(self.s[-1])
        return float(np.interp(at + intervals, self.count, self.s))


def _overview(spline: Curve, limits: PlanLimits, period_s: float) -> _Overview:
    found: FirstEstimate = first_estimate(spline, limits, 0.0, spline.length_mm, None, period_s)
    density = 1.0 / found.step_s
    count = np.concatenate(
        (np.zeros(1), np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(found.t)))
    )
    return _Overview(found.s, count, stopping_s(limits, float(np.sqrt(found.q.max()))))


def stopping_s(limits: PlanLimits, feed_mm_s: float) -> float:
    """Estimate of the stopping time from a feed."""
    jerk = limits.least_jerk
    pull = min(0.7 * limits.least_acceleration, math.sqrt(jerk * feed_mm_s))
    return feed_mm_s / pull + pull / jerk


def measured(spline: Curve, found: Solution) -> Solution:
    """The window with tighter limits on intervals whose piece exceeds one by more than 0.3 %."""
    best, trial = found, found
    usage = _usage(spline, found)
    least, tight = usage.max(), np.ones(usage.size)
    for _ in range(_MOST_TIGHTENED):
        if usage.max() <= _EXCEEDED:
            break
        tight *= np.where(usage > 1.0 + 0.3 * (_EXCEEDED - 1.0), usage, 1.0)
        tried = tightened(trial, tight)
        if tried is None:
            break
        trial, usage = tried, _usage(spline, tried)
        if usage.max() < least:
            best, least = trial, usage.max()
    return best


def _usage(spline: Curve, found: Solution) -> Real:
    track = make_track(ends_of(found, found.grid.size), 1.0, spline.segment_starts_mm)
    usage = piece_usage(spline, found.setting.limits, track)
    if found.setting.start is not None:
        usage[:_INHERITED] = 0.0
    if found.grid.s[-1] < spline.length_mm:
        usage[found.grid.grade < 0] = 0.0  # the stop at the end of a window is not kept
    return usage
