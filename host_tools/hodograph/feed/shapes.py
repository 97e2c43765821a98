# SPDX-License-Identifier: MIT
"""Making the ramp of a request for a given feed: pattern search for n_c; docs/theory/numerics.md 5.4."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import PlanError
from .pattern_search import SearchStep, pattern_search
from .ramp import JERK, Ramp, exponential_ramp, minimax_ramp, quintic_ramp
from .request import FeedRequest

N_C_START, N_C_LOW, N_C_HIGH = 5.0, 2.0, 12.0
REVERSE_MM_S = -(2.0**-14)
"""Feed below this counts as reverse motion; (18) always dips a little, the format refuses 2^-10 mm/s."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A ramp, the search that led to it (empty without one), and what the user should know of it."""

    ramp: Ramp
    history: tuple[SearchStep, ...] = ()
    note: str | None = None


def make_shape(request: FeedRequest, feed_mm_s: float) -> Shape:
    """The ramp of `request` at another feed. Raises PlanError where a given n_c asks for reverse motion."""
    time_s = request.ramp_time_s
    if request.profile == "quintic":
        return Shape(quintic_ramp(feed_mm_s, time_s))
    if request.profile == "minimax":
        return Shape(minimax_ramp(feed_mm_s, time_s, request.degree))
    if isinstance(request.n_c, str):
        return optimise_n_c(feed_mm_s, time_s)
    ramp = exponential_ramp(feed_mm_s, time_s, request.n_c)
    lowest = ramp.lowest_feed()
    if lowest < REVERSE_MM_S:
        raise PlanError(
            f"feed: n_c = {request.n_c:g} asks for reverse motion at {feed_mm_s:.6g} mm/s within "
            f'{time_s:g} s (the feed falls to {lowest:.3g} mm/s): give n_c = "optimise"'
        )
    return Shape(ramp)


def optimise_n_c(feed_mm_s: float, time_s: float) -> Shape:
    """The exponential ramp of least peak jerk, by the paper's search; plain where none is better."""

    def objective(n_c: float) -> float:
        ramp = exponential_ramp(feed_mm_s, time_s, n_c)
        return ramp.peak(JERK) if ramp.lowest_feed() >= REVERSE_MM_S else float("inf")

    history = pattern_search(objective, N_C_START, N_C_LOW, N_C_HIGH)
    best = history[-1]
    plain = exponential_ramp(feed_mm_s, time_s, 0.0)
    if not best.value < plain.peak(JERK):
        note = (
            f"n_c = 0 (the plain quintic ramp): at {feed_mm_s:.6g} mm/s within {time_s:g} s no n_c in "
            f"{N_C_LOW:g} … {N_C_HIGH:g} lowers the peak jerk"
        )
        return Shape(plain, history, note)
    ramp = exponential_ramp(feed_mm_s, time_s, best.best)
    if min(best.best - N_C_LOW, N_C_HIGH - best.best) < 1e-5:
        return Shape(ramp, history, f"n_c = {best.best:g} is at a bound of the search")
    return Shape(ramp, history)
