# SPDX-License-Identifier: MIT
"""The sequence of planning windows (parts that are planned at once) over a whole path; docs/theory/feed.md 5.6. Used by
optimal/planner, stream/tails and stream/windows. No I/O.

With windows, time and memory are proportional to length. A window has a grid of intervals (grid.py). Each window is
planned to rest at its own end, so a motion to rest inside all limits always exists. The stop at the end of a window
affects only its last intervals; these are not kept. The next window begins at the end of the kept part with the same
F, F', F'' (arc length, feed and acceleration).

The feed over arc length becomes pieces: polynomials of degree 7 in time (track.py). Next to rest and at sudden changes
a piece differs from the feed that it replaces. If a piece exceeds a limit, its window is planned again with tighter
limits on that interval.
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
"""How often a window without a solution is tried from an earlier knot: each time two thirds of the intervals before it
are kept.
"""

_EXCEEDED = 1.003
"""Limit usage of a piece above which its window is planned again."""
_MOST_TIGHTENED = 3
"""How often a window is planned again with tighter limits."""
_INHERITED = 2
"""First intervals of a window whose limits are not tightened: its state at the start determines most of them."""


class NothingFoundError(PlanError):
    """The solver finds no feed for a window that begins at rest."""


def plan_windows(
    spline: Curve, limits: PlanLimits, period_s: float, intervals: int = INTERVALS
) -> Iterator[Ends]:
    """The kept parts of the windows in order, the last one to the end of the path. If no window continues from the kept
    part, the present window is kept to its rest, and the next one begins there. Raises NothingFoundError.
    """
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
    """The window that continues the window `held` from its knot `count`; None: the solver finds none."""
    low = float(held.grid.s[count])
    state = State(float(held.q[count]), float(held.slope[count]))
    high = overview.window_end(low, intervals)
    return plan_window(
        spline, limits, low, high, state, period_s, held, trusted_to(held, overview.stop_s)
    )


def kept(found: Solution, stop_s: float) -> int:
    """Number of intervals of a window that are kept: those far enough from the stop at its end, at least a third."""
    left = found.duration_s - np.cumsum(found.times)
    count = int(np.count_nonzero(left > _STOPS * stop_s))
    return max(count, found.grid.size // 3)


def trusted_to(found: Solution, stop_s: float) -> float:
    """Arc length up to which the next window uses the feed of this one as its estimate: the stop at the end of this one
    affects it little up to there.
    """
    left = found.duration_s - np.concatenate((np.zeros(1), np.cumsum(found.times)))
    return float(found.grid.s[int(np.count_nonzero(left > 2.0 * stop_s))])


class _Overview:
    """Estimates for the whole path: `count` intervals from its start to each arc length `s`, and the stopping time."""

    def __init__(self, s: Real, count: Real, stop_s: float) -> None:
        self.s, self.count, self.stop_s = s, count, stop_s

    def window_end(self, low: float, intervals: int) -> float:
        """End of a window from `low`: `intervals` further on, or the end of the path if at most 35 % more reach it."""
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
    """The window, planned again with tighter limits until no piece exceeds a limit by more than 0.3 %; after
    _MOST_TIGHTENED times, the one with the least excess.
    """
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
    """The greatest limit usage (n,) of each piece of a window; 0 where limits are not to be tightened."""
    track = make_track(ends_of(found, found.grid.size), 1.0, spline.segment_starts_mm)
    usage = piece_usage(spline, found.setting.limits, track)
    if found.setting.start is not None:
        usage[:_INHERITED] = 0.0
    if found.grid.s[-1] < spline.length_mm:
        usage[found.grid.grade < 0] = 0.0  # the stop at the end of a window is not kept
    return usage
