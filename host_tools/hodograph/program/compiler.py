# SPDX-License-Identifier: MIT
"""Compiles a spline and a feed plan to a program; docs/theory/numerics.md section 8. Used by all modules of host_tools
that compile a program, such as pipeline. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, PlanError
from ..events import Events, no_events
from ..feed import FeedPlan, FeedZone, Replan, replan
from ..feed.pieces import FeedPieces
from ..fixed_point import MM_PER_Q40, nearest_q40
from ..spline import PHSpline
from ..spline.frames import Curve, frames
from ..spline.spatial import SpatialPHSpline
from .check import LEAST_FEED_MM_S, Fault, boxes_q40, brief_pairs, check
from .codes import ProgramError
from .geometry import Geometry, quantise
from .image import NAME_SIZE, Program, ProgramLimits
from .stop_planning import StopTerms, plan_stops
from .stops import no_stops

Int = NDArray[np.int64]

_FEED_MARGIN_MM_S = 2.0**-22
"""The controller compares feeds in 2^-24 mm/s."""

_U32_MAX = 2**32 - 1
_MOST_ROUNDS = 12
"""Greatest number of plans with a feed lowered for the length of their segments."""
_PLACES = 9
"""Least curvature of a feed piece that messages name, 1/mm."""


@dataclass(frozen=True, eq=False)
class Compilation:
    """A program, its plan (with a lower feed where segments are short), notes for the user, and the greatest distance
    of a segment's start from the ideal curve.
    """

    program: Program
    plan: FeedPlan
    notes: tuple[str, ...]
    drift_mm: float


@dataclass(frozen=True)
class ProgramOptions:
    """The other parts of a program, in addition to path and feed.

    offset_mm   work offset of each axis of the path; (): none
    limits      of the controller, including travel; None: only the rules of the format are checked
    period_us   has to be that of the plan; None: not compared
    stops       limits of its stops in addition to those of the plan
    events      outputs on the path, by place
    first_axis  the machine's number of the program's first axis
    """

    name: str = ""
    offset_mm: tuple[float, ...] = ()
    limits: ProgramLimits | None = None
    period_us: int | None = None
    stops: StopTerms = field(default_factory=StopTerms)
    events: Events = field(default_factory=no_events)
    first_axis: int = 0


_USUAL = ProgramOptions()


def compile_program(
    spline: PHSpline | SpatialPHSpline, plan: FeedPlan, options: ProgramOptions = _USUAL
) -> Program:
    """The program of `compile_path` for a profile with ramps, for callers that need nothing else."""
    return compile_path(spline, plan, options).program


def compile_path(
    spline: PHSpline | SpatialPHSpline,
    plan: FeedPlan,
    options: ProgramOptions = _USUAL,
    replan: Replan = replan,
) -> Compilation:
    """Compiles `plan` along `spline`, shifted by the work offset into machine coordinates.

    Under policy "respect" the feed is lowered, by `replan`, where a tick at 200 % would cross two consecutive segments.
    Raises InputError (period, offset) and PlanError (the path leaves the travel, segments are too short, a fault stop
    is too long, or `check` finds another fault).
    """
    period_us = options.period_us
    if period_us is not None and period_us != plan.period_us:
        raise InputError(
            f"period_us {period_us} differs from the plan's {plan.period_us}: plan again"
        )
    geometry = quantise(spline, options.offset_mm)
    length_q40 = int(geometry.start_q40[-1])
    if abs(length_q40 * MM_PER_Q40 - plan.length_mm) > 1e-6:
        raise InputError(
            f"the plan is for {plan.length_mm:.9g} mm, the path has {length_q40 * MM_PER_Q40:.9g} mm"
        )
    plan, pieces = _fit_feed(plan, geometry.start_q40, spline, replan)
    program = _program(spline, geometry, plan, pieces, options)
    _require_override_headroom(program, spline)
    program = plan_stops(program, plan, options.stops)
    # A program with fault stops only is never run, and its plan is compiled again.
    fault = None if options.stops.only_fault else check(program, options.limits)
    if fault is not None:
        raise PlanError(_advice(fault, program, options.limits, spline, plan.limits.names))
    return Compilation(program, plan, plan.notes, geometry.drift_mm)


def _program(
    spline: PHSpline | SpatialPHSpline,
    geometry: Geometry,
    plan: FeedPlan,
    pieces: FeedPieces,
    options: ProgramOptions,
) -> Program:
    """The program without stops. A name that is too long is cut."""
    name, offset_mm = options.name.encode()[:NAME_SIZE], options.offset_mm
    length_q40 = int(geometry.start_q40[-1])
    return Program(
        name=name.decode(errors="ignore"),
        period_us=plan.period_us,
        closed=spline.closed,
        duration_q32_s=pieces.total_q32_s,
        length_q40=length_q40,
        offset_q40=tuple(nearest_q40(mm) for mm in offset_mm or (0.0,) * spline.axes),
        feed_limit_um_s=_limit(plan.limits.feed_mm_s, 1000.0),
        acceleration_limit_um_s2=_limit(plan.limits.acceleration_mm_s2, 1000.0),
        jerk_limit_mm_s3=_limit(plan.limits.jerk_mm_s3, 1.0),
        start_q40=geometry.start_q40[:-1],
        point_q40=geometry.point_q40,
        a_q44=geometry.a_q44,
        pieces=pieces,
        stops=no_stops(len(pieces)),
        extra_q40=geometry.extra_q40,
        events=_on_path(options.events, length_q40),
        first_axis=options.first_axis,
    )


def _require_override_headroom(program: Program, spline: Curve) -> None:
    """Raises PlanError where an override rate or override acceleration of a feed piece is rounded to 0."""
    pieces = program.pieces
    least = np.minimum(pieces.override_rate_codes, pieces.override_second_codes).min(axis=1)
    lacking = np.flatnonzero(least == 0)
    if not lacking.size:
        return
    first = int(lacking[0])
    ends_mm = np.append(pieces.start_q40, program.length_q40).astype(np.float64) * MM_PER_Q40
    low_mm, high_mm = float(ends_mm[first]), float(ends_mm[first + 1])
    curvature = np.abs(frames(spline, np.linspace(low_mm, high_mm, _PLACES)).curvature)
    sharpest = float(curvature.max())
    raise PlanError(
        f"program: the feed piece at {low_mm:.6g} mm, where the curvature is up to {sharpest:.3g} 1/mm, leaves no "
        "headroom for a changing override: raise the limits, or smooth the path there (points too close together make "
        "such places)"
    )


def fit_plan(spline: PHSpline | SpatialPHSpline, plan: FeedPlan, replan: Replan) -> FeedPlan:
    """The plan of which `compile_path` makes a program, made again with a lower feed where segments are too short.

    Raises PlanError: segments are too short for any feed. Raises InputError: the path is beyond the format.
    """
    geometry = quantise(spline)
    return _fit_feed(plan, geometry.start_q40, spline, replan)[0]


def _fit_feed(
    plan: FeedPlan, joints_q40: Int, spline: Curve, replan: Replan
) -> tuple[FeedPlan, FeedPieces]:
    """The plan with its feed low enough for the segments, and its pieces over their exact length."""
    length_q40 = int(joints_q40[-1])
    for _ in range(_MOST_ROUNDS):
        pieces = plan.pieces_over(length_q40, joints_q40)
        pairs, distance_mm, allowed_mm_s = brief_pairs(joints_q40, pieces, plan.period_us)
        if not pairs.size:
            return plan, pieces
        worst = int(allowed_mm_s.argmin())
        feeds = allowed_mm_s * (1.0 - 1e-6) - _FEED_MARGIN_MM_S
        feed = float(feeds[worst])
        span, place_mm = _span(spline, joints_q40, int(pairs[worst]))
        where = (
            f"the path has {distance_mm[worst]:.4g} mm in two neighbouring segments at arc length "
            f"{place_mm:.6g} mm (span {span}), less than one tick at 200 %"
        )
        if feed < LEAST_FEED_MM_S:
            raise PlanError(f"{where} at any feed: take points that lie further apart there")
        if plan.limits.policy == "report":
            # Rounded down, so that the value in the note is low enough.
            raise PlanError(
                f"{where}: {feed * (1.0 - 5e-4):.4g} mm/s would do; "
                'lower nominal_mm_s or set policy "respect"'
            )
        low, high = joints_q40[pairs] * MM_PER_Q40, joints_q40[pairs + 2] * MM_PER_Q40
        zones = zip(low.tolist(), high.tolist(), feeds.tolist(), strict=True)
        plan = replan(plan, [FeedZone(*zone) for zone in zones], where)
    raise PlanError("path: no feed found at which no tick passes more than two segment ends")


def _on_path(events: Events, length_q40: int) -> Events:
    """The events; one at the end of the path stays at the end after rounding."""
    held = events.copy()
    held["place"] = np.minimum(events["place"], length_q40)
    return held


def _span(spline: Curve, joints_q40: Int, segment: int) -> tuple[int, float]:
    """The span of the path that a segment belongs to, and the arc length in mm where the segment starts."""
    place_mm = float(joints_q40[segment]) * MM_PER_Q40
    return int(np.searchsorted(spline.segment_starts_mm, place_mm + 1e-9, side="right")), place_mm


def _limit(value: float | None, scale: float) -> int:
    """The limit in units of the format, rounded up unless only the product was rounded."""
    return 0 if value is None else max(1, min(ceil(value * scale * (1.0 - 1e-12)), _U32_MAX))


def _advice(
    fault: Fault,
    program: Program,
    limits: ProgramLimits | None,
    spline: Curve,
    names: Sequence[str],
) -> str:
    text = f"program: {fault.code.text} ({fault.code.name}, {fault.place})"
    if fault.code is not ProgramError.TRAVEL or limits is None:
        return text
    span, _ = _span(spline, program.start_q40, fault.index)
    lowest, highest = (corner[fault.index] * MM_PER_Q40 for corner in boxes_q40(program))
    axes = ", ".join(
        f"{axis} {low:.6g} … {high:.6g} mm (travel {travel_low * MM_PER_Q40:g} … {travel_high * MM_PER_Q40:g})"
        for axis, low, high, travel_low, travel_high in zip(
            names, lowest, highest, limits.min_q40_mm, limits.max_q40_mm, strict=True
        )
    )
    return f"{text}: in span {span} its box is {axes}; change [work] offset_mm or the path"
