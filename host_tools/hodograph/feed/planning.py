# SPDX-License-Identifier: MIT
"""Planning a feed with ramps inside limits: for a path's length, and for the path itself; docs/theory/feed.md 5.4 and
5.5. Profile "optimal" has a planner of its own (feed.optimal). Used by bus/goto, paper/compare, pipeline and
program/compiler. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import log

from ..errors import PlanError
from ..spline.frames import Curve
from .kinematics import PathBounds
from .limits import ControllerLimits, FeedZone, Limit, Limits, Peak, Plants, as_drives_limit
from .pieces import RawPieces, derivative_peaks
from .plan import FeedPlan, assumed_controller
from .ramp import ACCELERATION, JERK, Ramp
from .reduction import choose, highest
from .request import (
    LEAST_FEED_MM_S,
    LONGEST_S,
    FeedRequest,
    check_length,
    check_period,
)
from .timeline import timeline
from .usage import limit_peaks

_CLOSE = 1e-4
"""The search for the constant feed ends when the logarithm of the limit usage, or of the feed, is this exact."""
_MARGIN = 1e-6
"""A plan may exceed a limit by this share; the search for the feed aims below it by as much."""
_MOST_TRIALS = 30
"""Greatest number of feeds that are tried."""
_MOST_ROUNDS = 20
"""Greatest number of plans in which the limits are corrected by the excess of the pieces."""
_REMEDY = "raise the limit, or smooth the path there (points too close together make such places)"


def plan_feed(
    length_mm: float,
    request: FeedRequest,
    limits: Limits | None = None,
    controller: ControllerLimits | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """Plans `request` over a path of `length_mm`.

    The feed is lowered, and n_c found again, in three cases: the path is too short for the ramps, a limit of the path
    file is exceeded (policy "respect"), or a limit of the controller less its reserve is. Without a machine file the
    limits of the controller are never reached. Raises InputError: the length is out of range. Raises PlanError: no feed
    keeps the limits.
    """
    check_period(period_us)
    if request.optimal:
        raise PlanError(
            f'feed: profile "{request.profile}" needs the path itself, not only its length'
        )
    check_length(length_mm)
    return _plan(Fraction(length_mm), request, limits or Limits(), controller, period_us, ())


def plan_path(
    spline: Curve,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None = None,
    plants: Plants | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """As `plan_feed`, and under policy "respect" with a feed at which the motion along `spline` keeps the limits of
    axes, curvature, volts (`plants`) and feed zones too. Under "report" these are listed where they are exceeded, and
    only the machine's are kept.
    """
    limits = limits.of_axes(spline.axes)
    plan = plan_feed(spline.length_mm, request, limits, controller, period_us=period_us)
    respect = limits.policy == "respect"
    bounds = PathBounds(spline, limits, plants, kept=respect)
    if not bounds.bind:
        return plan
    if respect:
        return replace(_reduced(plan, bounds), paths=(bounds,))
    must = PathBounds(spline, limits.of_machine, as_drives_limit(plants))
    if must.bind:
        plan = _reduced(plan, must)
    exceeded = (
        peak
        for peak in limit_peaks(bounds, plan.raw)
        if peak.value > peak.limit.given * (1.0 + _MARGIN)
    )
    return replace(
        plan,
        paths=(bounds, must) if must.bind else (bounds,),
        excesses=(*plan.excesses, *exceeded),
    )


def replan(plan: FeedPlan, zones: Sequence[FeedZone], reason: str) -> FeedPlan:
    """The plan made again with the feed nowhere above the least of the zones; `reason` goes to the notes."""
    assert not plan.request.optimal, "replan_optimal makes such plans again"
    lowest = min(zone.feed_mm_s for zone in zones)
    return _below(plan, Limit("feed_mm_s", lowest, "format", words=reason))


def _below(plan: FeedPlan, limit: Limit) -> FeedPlan:
    """The request of a plan, planned again with one more limit of the feed."""
    again = _plan(
        plan.curve.length_mm, plan.request, plan.limits, plan.controller, plan.period_us, (limit,)
    )
    return replace(again, paths=plan.paths, assumed=plan.assumed)


def _plan(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    further: tuple[Limit, ...],
) -> FeedPlan:
    """The plan whose pieces keep the limits too, not only the exact profile; `further` limits of the feed."""
    for _ in range(_MOST_ROUNDS):
        shape, reasons = choose(length, request, limits, controller, period_us, further)
        line = timeline(shape.ramp, length)
        if line.duration_s >= LONGEST_S:
            raise PlanError(
                f"feed: {float(length):g} mm at {shape.ramp.feed_mm_s:.3g} mm/s would take longer than "
                f"{LONGEST_S:.7g} s ({'; '.join(reasons) or 'as asked'}): raise the feed, that limit or "
                "ramp_time_s"
            )
        plan = FeedPlan(
            request,
            limits,
            controller or assumed_controller(*line.peaks()),
            period_us,
            line,
            (*reasons, *((shape.note,) if shape.note else ())),
            _excesses(shape.ramp, limits),
            shape.history,
            assumed=controller is None,
        )
        excess = _piece_excess(plan)
        if excess <= 1.0:
            return replace(plan, notes=(*plan.notes, *_fit_notes(plan.raw, period_us)))
        lower = shape.ramp.feed_mm_s / excess * (1.0 - 1e-6)
        reason = f"pieces of more than a period of {period_us} us exceed the limits"
        further = (*further, Limit("feed_mm_s", lower, "format", words=reason))
    raise PlanError("feed: no feed keeps the pieces inside the limits: raise them or ramp_time_s")


def _fit_notes(raw: RawPieces, period_us: int) -> tuple[str, ...]:
    if raw.faithful:
        return ()
    return (
        f"the ramp has too few periods of {period_us} us for its profile: its pieces stay within "
        f"{raw.jerk_error_mm_s3:.3g} mm/s^3 of its jerk and {raw.length_error_mm:.2g} mm of its length "
        "(a longer ramp, or quintic, or minimax of degree 5 or 6, has none of this)",
    )


def _excesses(ramp: Ramp, limits: Limits) -> tuple[Peak, ...]:
    values = (
        ("feed_mm_s", ramp.feed_mm_s),
        ("acceleration_mm_s2", ramp.peak(ACCELERATION)),
        ("jerk_mm_s3", ramp.peak(JERK)),
    )
    return tuple(
        Peak(Limit(key, getattr(limits, key)), value)
        for key, value in values
        if getattr(limits, key) is not None and value > getattr(limits, key) * (1.0 + 1e-9)
    )


def _piece_excess(plan: FeedPlan) -> float:
    """Greatest peak of a piece over the controller's limit less half of the reserve. With policy "respect" the pieces
    have to keep the limits of the path file too. The feed also has to be lower if an override bound would be rounded to
    0.
    """
    pieces = plan.pieces
    peaks = [float(p.max()) for p in derivative_peaks(pieces.duration_q32_s, pieces.c_q40)]
    own = plan.controller
    keep = 1.0 - 0.5 * own.kept_free
    bounds = [own.feed_mm_s * keep, own.acceleration_mm_s2 * keep, own.jerk_mm_s3 * keep]
    if plan.limits.policy == "respect" and not plan.raw.faithful:
        requested = plan.limits.acceleration_mm_s2, plan.limits.jerk_mm_s3
        bounds[1:] = [min(b, x) if x else b for b, x in zip(bounds[1:], requested, strict=True)]
    excess = max(peak / bound for peak, bound in zip(peaks, bounds, strict=True))
    least_code = min(pieces.override_rate_codes.min(), pieces.override_second_codes.min())
    return excess if least_code > 0 else max(excess, 2.0)


def _reduced(plan: FeedPlan, bounds: PathBounds) -> FeedPlan:
    """The plan at the highest feed that the limits along the path allow."""
    worst = _worst(plan, bounds)
    if worst.usage <= 1.0:
        return plan

    def attempt(feed: float) -> tuple[FeedPlan, float]:
        nonlocal worst
        if feed < LEAST_FEED_MM_S:
            raise PlanError(_infeasible(worst))
        words = f"{worst.limit.reason}, {worst.place}"
        tried = _below(plan, Limit("feed_mm_s", feed, worst.limit.source, words=words))
        found = _worst(tried, bounds)
        if found.usage > 1.0:
            worst = found
        return tried, log(found.usage)

    best = highest(plan.feed_mm_s, log(worst.usage), attempt, _CLOSE, _MARGIN, _MOST_TRIALS)
    if best is None:
        raise PlanError(_infeasible(worst))
    return best


def _infeasible(peak: Peak) -> str:
    return f"feed: no useful feed keeps {peak.limit.reason}, {peak.place}: {_REMEDY}"


def _worst(plan: FeedPlan, bounds: PathBounds) -> Peak:
    return max(limit_peaks(bounds, plan.raw), key=lambda one: one.usage)
