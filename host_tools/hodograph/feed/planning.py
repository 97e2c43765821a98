# SPDX-License-Identifier: MIT
"""Planning a feed for a path length inside limits; docs/theory/numerics.md 5.4 and 5.5."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import isfinite

from ..errors import InputError, PlanError
from .limits import ControllerLimits, Limits
from .pieces import derivative_peaks
from .plan import Excess, FeedPlan
from .quantise import RawPieces
from .ramp import ACCELERATION, JERK, Ramp
from .reduction import Cap, choose
from .request import FeedRequest, check_period
from .timeline import timeline

SHORTEST_MM, LONGEST_MM = 2.0**-10, 2.0**22 - 1.0
LONGEST_S = 2.0**22 - 1.0


def plan_feed(
    length_mm: float,
    request: FeedRequest,
    limits: Limits | None = None,
    controller: ControllerLimits | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """Plans `request` over a path of `length_mm`.

    The feed is lowered, and n_c found again, where the path is too short for its ramps, where the limits
    of the path file bind (policy "respect") and where those of the controller do, less their
    reserve. Without a controller (no machine file) roomy limits are assumed. Raises InputError for a length out
    of range and PlanError where no feed will do.
    """
    check_period(period_us)
    if request.optimal:
        raise PlanError(
            f'feed: profile "{request.profile}" needs the path itself, not only its length'
        )
    check_length(length_mm)
    return _plan(Fraction(length_mm), request, limits or Limits(), controller, period_us, ())


def check_length(length_mm: float) -> None:
    """Raises InputError for a length that the program format does not know."""
    if not (isfinite(length_mm) and SHORTEST_MM <= length_mm <= LONGEST_MM):
        raise InputError(
            f"path: its length {length_mm:g} mm must be from {SHORTEST_MM:.3g} to {LONGEST_MM:.7g} mm: "
            "scale its points (they are in mm)"
        )


def plan_again(plan: FeedPlan, feed_mm_s: float, reason: str) -> FeedPlan:
    """The same request planned with the feed at most `feed_mm_s`; `reason` goes to the notes."""
    again = _plan(
        plan.line.length_mm,
        plan.request,
        plan.limits,
        plan.controller,
        plan.period_us,
        (Cap(feed_mm_s, reason),),
    )
    return replace(again, path=plan.path, machine=plan.machine)


def _plan(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    caps: tuple[Cap, ...],
) -> FeedPlan:
    least_constant_s = 1e-6 * period_us * (1.0 + 1e-3)
    for _ in range(20):
        shape, reasons = choose(
            length, request, limits, controller, period_us, least_constant_s, caps
        )
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
            controller or _assumed(shape.ramp),
            period_us,
            line,
            shape.history,
            (*reasons, *((shape.note,) if shape.note else ())),
            _excesses(shape.ramp, limits),
        )
        excess = _piece_excess(plan)
        if excess <= 1.0:
            return replace(plan, notes=(*plan.notes, *_fit_notes(plan.raw, period_us)))
        reason = f"pieces of more than a period of {period_us} us exceed the limits"
        caps = (*caps, Cap(shape.ramp.feed_mm_s / excess * (1.0 - 1e-6), reason))
    raise PlanError("feed: no feed keeps the pieces inside the limits: raise them or ramp_time_s")


def _assumed(ramp: Ramp) -> ControllerLimits:
    """Limits of a controller that nobody named: roomy ones, so that they never bind."""
    feed = ramp.feed_mm_s
    acceleration, jerk = ramp.peak(ACCELERATION), ramp.peak(JERK)
    return ControllerLimits(
        2.0 * feed, 8.0 * acceleration + 10.0 * feed, 16.0 * jerk + 100.0 * feed
    )


def _fit_notes(raw: RawPieces, period_us: int) -> tuple[str, ...]:
    if raw.faithful:
        return ()
    return (
        f"the ramp has too few periods of {period_us} us for its profile: its pieces stay within "
        f"{raw.jerk_error_mm_s3:.3g} mm/s^3 of its jerk and {raw.length_error_mm:.2g} mm of its way "
        "(a longer ramp, or quintic, or minimax of degree 5 or 6, has none of this)",
    )


def _excesses(ramp: Ramp, limits: Limits) -> tuple[Excess, ...]:
    values = (
        ("feed_mm_s", ramp.feed_mm_s),
        ("acceleration_mm_s2", ramp.peak(ACCELERATION)),
        ("jerk_mm_s3", ramp.peak(JERK)),
    )
    return tuple(
        Excess(name, getattr(limits, name), value)
        for name, value in values
        if getattr(limits, name) is not None and value > getattr(limits, name) * (1.0 + 1e-9)
    )


def _piece_excess(plan: FeedPlan) -> float:
    """Greatest bound of a piece over the controller's limit less half of what a plan keeps free.

    Where the pieces are only near the profile, policy "respect" holds for them too; and where a bound on the
    override would round to zero, the feed has to fall.
    """
    pieces = plan.pieces
    peaks = [float(p.max()) for p in derivative_peaks(pieces.duration_q32_s, pieces.c_q40)]
    own = plan.controller
    keep = 1.0 - 0.5 * own.kept_free
    bounds = [own.feed_mm_s * keep, own.acceleration_mm_s2 * keep, own.jerk_mm_s3 * keep]
    if plan.limits.policy == "respect" and not plan.raw.faithful:
        asked = plan.limits.acceleration_mm_s2, plan.limits.jerk_mm_s3
        bounds[1:] = [min(b, x) if x else b for b, x in zip(bounds[1:], asked, strict=True)]
    excess = max(peak / bound for peak, bound in zip(peaks, bounds, strict=True))
    least_code = min(pieces.override_rate_codes.min(), pieces.override_second_codes.min())
    return excess if least_code > 0 else max(excess, 2.0)
