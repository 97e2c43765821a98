# SPDX-License-Identifier: MIT
"""A whole path in windows, so that any length takes time and memory in proportion; docs/theory/numerics.md 5.6.

Every window is planned to rest at its own end, so whatever comes after it there is a way to stop inside all
limits: a join can never lead into a dead end. Of each window only the first part is kept, before the place
where having to stop makes itself felt; the next window begins there with the same F, F', F''.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline import PHSpline
from .bounds import Bounds
from .knots import Sketch, sketch
from .measured import measured
from .track import Ends, ends_of
from .window import Solution, State, plan_window

Real = NDArray[np.float64]

INTERVALS = 960
"""About so many intervals a window."""

_STOPS = 4.0
"""What is not kept of a window, in times that stopping takes."""

_RETREATS = 4


class NothingFoundError(PlanError):
    """The programs of a window that begins at rest have no solution, or none that the solver finds."""


def plan_windows(
    spline: PHSpline, bounds: Bounds, period_s: float, intervals: int = INTERVALS
) -> Iterator[Ends]:
    """The parts of the plan in order. Raises NothingFoundError."""
    length = spline.length_mm
    overview = _overview(spline, bounds, period_s)
    held: Solution | None = None
    count = 0
    while True:
        found, start = None, 0
        if held is not None:
            for _ in range(_RETREATS):
                start = count
                found = _continued(spline, bounds, overview, held, start, intervals, period_s)
                if found is not None:
                    break
                count = 2 * count // 3
            else:
                start = held.grid.size
            yield ends_of(held, start)
        if found is None:
            low = 0.0 if held is None else float(held.grid.s[-1])
            high = overview.window_end(low, intervals)
            found = plan_window(spline, bounds, low, high, None, period_s)
        if found is None:
            raise NothingFoundError(f"feed: nothing found from arc length {low:g} mm")
        held = found = measured(spline, found)
        if found.grid.s[-1] >= length:
            yield ends_of(found, found.grid.size)
            return
        count = _keep(found, overview.stop_s)


def _continued(
    spline: PHSpline,
    bounds: Bounds,
    overview: _Overview,
    held: Solution,
    count: int,
    intervals: int,
    period_s: float,
) -> Solution | None:
    """The window that goes on from knot `count` of the one before."""
    low = float(held.grid.s[count])
    state = State(float(held.q[count]), float(held.slope[count]))
    high = overview.window_end(low, intervals)
    return plan_window(
        spline, bounds, low, high, state, period_s, held, _trusted_to(held, overview.stop_s)
    )


def _keep(found: Solution, stop_s: float) -> int:
    """How many intervals are far enough from the stop at the end."""
    left = found.duration_s - np.cumsum(found.times)
    count = int(np.count_nonzero(left > _STOPS * stop_s))
    return max(count, found.grid.size // 3)


def _trusted_to(found: Solution, stop_s: float) -> float:
    left = found.duration_s - np.concatenate((np.zeros(1), np.cumsum(found.times)))
    return float(found.grid.s[int(np.count_nonzero(left > 2.0 * stop_s))])


class _Overview:
    """Roughly how long intervals are along the path, and how long stopping takes."""

    def __init__(self, s: Real, count: Real, stop_s: float) -> None:
        self.s, self.count, self.stop_s = s, count, stop_s

    def window_end(self, low: float, intervals: int) -> float:
        """Arc length `intervals` further on, or the end of the path if that is near."""
        at = float(np.interp(low, self.s, self.count))
        if self.count[-1] - at < 1.35 * intervals:
            return float(self.s[-1])
        return float(np.interp(at + intervals, self.count, self.s))


def _overview(spline: PHSpline, bounds: Bounds, period_s: float) -> _Overview:
    found: Sketch = sketch(spline, bounds, 0.0, spline.length_mm, None, period_s)
    density = 1.0 / found.step_s
    count = np.concatenate(
        (np.zeros(1), np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(found.t)))
    )
    feed = float(np.sqrt(found.q.max()))
    jerk = bounds.least_jerk
    pull = min(0.7 * bounds.least_acceleration, (jerk * feed) ** 0.5)
    return _Overview(found.s, count, feed / pull + pull / jerk)
