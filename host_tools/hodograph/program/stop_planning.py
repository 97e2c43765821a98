# SPDX-License-Identifier: MIT
"""Plans the stops of a program: the numbers of its brakes, and the bounds that follow from them;
docs/theory/numerics.md
section 7.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from ..errors import PlanError
from ..feed import AxisLimits, Plan
from ..feed.plant import Plants
from ..native.program import NativeProgram
from ..native.stop_bounds import stop_bounds
from ..native.stop_search import FREE, StopLimits, StopSearch
from .image import Program, encode
from .stops import FAULT, HOLD, Stops


@dataclass(frozen=True)
class StopTerms:
    """What stops have to keep beside the limits of a plan.

    plants        of x and y with the volts that the path file gives them; for holds. None: any
    drives        the same with all the volts that their drives have; for fault stops. None: any
    axis          limits of the machine's axes, for both
    stop_time_ms  greatest bound of a fault stop; 0: any
    """

    plants: Plants | None = None
    drives: Plants | None = None
    axis: AxisLimits = field(default_factory=AxisLimits)
    stop_time_ms: int = 0


def plan_stops(program: Program, plan: Plan, terms: StopTerms) -> Program:
    """The program with its stop table. Raises PlanError: a fault stop may take longer than `stop_time_ms`."""
    image = NativeProgram(encode(program))
    search = StopSearch(image)
    codes = np.zeros((program.piece_count, 2, 3), dtype=np.uint8)
    for kind, limits in ((HOLD, hold_limits(plan, terms)), (FAULT, fault_limits(plan, terms))):
        codes[:, kind] = search.codes(limits.raised(search.used(limits)))[0]
    return _checked(with_bounds(replace(program, stops=replace(program.stops, codes=codes))), terms)


def with_bounds(program: Program) -> Program:
    """The program with the bounds that its numbers have."""
    image = NativeProgram(encode(program))
    (hold_us, hold_um), (fault_us, fault_um) = (stop_bounds(image, kind) for kind in (HOLD, FAULT))
    stops = Stops(
        program.stops.codes,
        np.stack((hold_us, fault_us), axis=1),
        (int(hold_us.max()), int(fault_us.max())),
        (int(hold_um.max()), int(fault_um.max())),
    )
    return replace(program, stops=stops)


def _checked(program: Program, terms: StopTerms) -> Program:
    worst = program.stops.worst(FAULT)
    if terms.stop_time_ms and worst.time_s > terms.stop_time_ms * 1e-3:
        place = float(program.pieces.start_q40[worst.piece]) * 2.0**-40
        raise PlanError(
            f"stops: a fault stop at arc length {place:.6g} mm (piece {worst.piece}) may take {worst.time_s:.3g} s, "
            f"longer than stop_time_ms = {terms.stop_time_ms} of the machine file: "
            "lower the feed there, or raise stop_time_ms or the machine's acceleration and jerk"
        )
    return program


def hold_limits(plan: Plan, terms: StopTerms) -> StopLimits:
    """What feed hold and stop keep: the limits of the path file and of the machine."""
    own = plan.limits
    machine = fault_limits(plan, StopTerms(axis=terms.axis))
    return replace(
        machine,
        feed=_least(own.feed_mm_s, machine.feed),
        acceleration=_least(own.acceleration_mm_s2, machine.acceleration),
        jerk=_least(own.jerk_mm_s3, machine.jerk),
        centripetal=_least(own.centripetal_mm_s2, inf),
        axis_velocity=_both(own.axis.velocity_mm_s, machine.axis_velocity),
        axis_acceleration=_both(own.axis.acceleration_mm_s2, machine.axis_acceleration),
        axis_jerk=_both(own.axis.jerk_mm_s3, machine.axis_jerk),
        caps=tuple((cap.from_mm, cap.to_mm, cap.feed_mm_s) for cap in own.caps),
        reach=_reach(terms.plants),
        time_constant=_time_constants(terms.plants),
        reach_at_pace=False,
        rise_is_cut=True,
    )


def fault_limits(plan: Plan, terms: StopTerms) -> StopLimits:
    """What fault stops keep: the limits of the machine."""
    machine = plan.controller
    return StopLimits(
        feed=machine.feed_mm_s,
        acceleration=machine.acceleration_mm_s2,
        jerk=machine.jerk_mm_s3,
        axis_velocity=_both(terms.axis.velocity_mm_s, FREE),
        axis_acceleration=_both(terms.axis.acceleration_mm_s2, FREE),
        axis_jerk=_both(terms.axis.jerk_mm_s3, FREE),
        reach=_reach(terms.drives),
        time_constant=_time_constants(terms.drives),
        reach_at_pace=True,
    )


def _least(limit: float | None, other: float) -> float:
    return other if limit is None else min(limit, other)


def _both(limit: tuple[float, float] | None, other: tuple[float, float]) -> tuple[float, float]:
    return other if limit is None else (min(limit[0], other[0]), min(limit[1], other[1]))


def _reach(plants: Plants | None) -> tuple[float, float]:
    return FREE if plants is None else (plants[0].reach_mm_s, plants[1].reach_mm_s)


def _time_constants(plants: Plants | None) -> tuple[float, float]:
    return (0.0, 0.0) if plants is None else (plants[0].time_constant_s, plants[1].time_constant_s)
