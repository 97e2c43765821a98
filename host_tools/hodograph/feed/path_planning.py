# SPDX-License-Identifier: MIT
"""Planning a feed for a path, inside the limits that depend on where on it the motion is;
docs/theory/numerics.md 5.5."""

from __future__ import annotations

from dataclasses import replace
from math import log

from ..errors import PlanError
from ..spline import PHSpline
from .bracket import highest
from .kinematics import PathBounds
from .limits import ControllerLimits, Limits
from .plan import Excess, FeedPlan
from .planning import plan_again, plan_feed
from .plant import Plants, as_drives_limit
from .request import LEAST_FEED_MM_S, FeedRequest
from .usage import Strain, strains

_CLOSE = 1e-4
_HAIR = 1e-6
_MOST_TRIALS = 30
_REMEDY = "raise the limit, or smooth the path there (points too close together make such places)"


def plan_path(
    spline: PHSpline,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None = None,
    plants: Plants | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """As `plan_feed`, and under policy "respect" with a feed at which the motion along `spline` keeps the limits of
    axes, curvature, volts (`plants`) and stretches too. Under "report" these are listed where they are broken, and only
    the machine's are kept.
    """
    plan = plan_feed(spline.length_mm, request, limits, controller, period_us=period_us)
    respect = limits.policy == "respect"
    bounds = PathBounds(spline, limits, plants, obeyed=respect)
    if not bounds.bind:
        return plan
    if respect:
        return replace(_lowered(plan, bounds), path=bounds)
    must = PathBounds(spline, limits.of_machine, as_drives_limit(plants))
    if must.bind:
        plan = _lowered(plan, must)
    broken = (
        Excess(one.name, one.limit, one.peak)
        for one in strains(bounds, plan.raw)
        if one.peak > one.limit * (1.0 + _HAIR)
    )
    return replace(
        plan, path=bounds, machine=must if must.bind else None, excesses=(*plan.excesses, *broken)
    )


def _lowered(plan: FeedPlan, bounds: PathBounds) -> FeedPlan:
    """The plan at the highest feed that the bounds allow."""
    worst = _worst(plan, bounds)
    if worst.ratio <= 1.0:
        return plan

    def attempt(feed: float) -> tuple[FeedPlan, float]:
        nonlocal worst
        if feed < LEAST_FEED_MM_S:
            raise PlanError(f"feed: no feed of use obeys {worst.reason}, {worst.place}: {_REMEDY}")
        tried = plan_again(plan, feed, f"{worst.reason}, {worst.place}")
        found = _worst(tried, bounds)
        if found.ratio > 1.0:
            worst = found
        return tried, log(found.ratio)

    best = highest(plan.feed_mm_s, log(worst.ratio), attempt, _CLOSE, _HAIR, _MOST_TRIALS)
    if best is None:
        raise PlanError(f"feed: no feed of use obeys {worst.reason}, {worst.place}: {_REMEDY}")
    return best


def _worst(plan: FeedPlan, bounds: PathBounds) -> Strain:
    return max(strains(bounds, plan.raw), key=lambda one: one.ratio)
