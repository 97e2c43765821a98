# SPDX-License-Identifier: MIT
"""A path is planned again where a fault stop of its program would come later than `stop_time_ms` of the machine file;
docs/theory/toolpath-fitting.md section 8.

Profile "optimal" first leaves more of its limits free, around places where stops may then begin, or everywhere. If that
is not enough, and with the other profiles, the feed is lowered step by step.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

from ..errors import PlanError
from ..feed import FeedPlan, FeedZone, Limits, Replan
from ..feed.request import LEAST_FEED_MM_S
from .compiler import Compilation
from .image import Program
from .stop_planning import LongStopError
from .stop_reserve import EVERYWHERE, SPREADS, late_too_often, zones_at_places
from .stops import FAULT

LEAST_STEP, GREATEST_STEP = 0.3, 0.95
"""Factors of the feed from one plan to the next: in proportion to how late stops are, but within these."""

MOST_STEPS = 8
"""How many times the feed is lowered."""


@dataclass(frozen=True)
class Replanning:
    """How a path is planned again, and how a program is made of a plan.

    plan         a plan inside limits
    slower       a plan made again with feed zones; the text, why, goes to its notes
    compile      the program of a plan; raises LongStopError
    search       the program of a plan with few trials and fault stops only; raises LongStopError
    stop_time_s  greatest bound of a fault stop
    """

    plan: Callable[[Limits], FeedPlan]
    slower: Replan
    compile: Callable[[FeedPlan], Compilation]
    search: Callable[[FeedPlan], Compilation]
    stop_time_s: float

    def in_time(self, plan: FeedPlan, late: LongStopError) -> Compilation:
        """The program of the first of some plans whose fault stops are in time. Raises `late`, that of `plan`, where
        none is found.
        """
        found = None
        if plan.request.optimal:
            found = self._with_reserve(plan.limits, late)
            found = None if found is None else _noted(found, late)
        found = found or self._with_less_feed(plan, late)
        if found is None:
            raise late
        return found

    def _with_reserve(self, limits: Limits, late: LongStopError) -> Compilation | None:
        """The program of a plan with zones of reserve around places where stops may begin in a plan whose limits are
        lower everywhere; of one of these plans, where zones are not enough; None: none is in time.
        """
        program, zones = late.program, limits.reserve_zones
        whole: list[FeedPlan] = []
        for share in EVERYWHERE:
            if whole and late_too_often(program, self.stop_time_s):
                break
            lower = self.plan(replace(limits, machine=limits.machine.scaled(1.0 - share)))
            try:
                lowered = self.search(lower).program
                whole.append(lower)
            except LongStopError as error:
                lowered = error.program
                if late_too_often(lowered, self.stop_time_s):
                    continue
            for spread in SPREADS:
                more = zones_at_places(program, lowered, self.stop_time_s, share, spread)
                if not more:
                    break
                zones += tuple(more)
                try:
                    return self.compile(self.plan(replace(limits, reserve_zones=zones)))
                except LongStopError as error:
                    program = error.program
        for plan in whole:
            with suppress(LongStopError):
                return self.compile(plan)
        return None

    def _with_less_feed(self, plan: FeedPlan, late: LongStopError) -> Compilation | None:
        """The program of a plan whose feed is lower where fault stops are late; None: none is in time."""
        error = late
        for _ in range(MOST_STEPS):
            step = self.stop_time_s / error.program.stops.worst(FAULT).time_s
            step = min(max(step, LEAST_STEP), GREATEST_STEP)
            zones = _late_zones(error.program, self.stop_time_s, step)
            if not plan.request.optimal:
                zones = [FeedZone(0.0, plan.length_mm, step * plan.feed_mm_s)]
            if min(zone.feed_mm_s for zone in zones) < LEAST_FEED_MM_S:
                break
            try:
                plan = self.slower(plan, zones, late.reason)
            except PlanError:  # the planner finds nothing at so low a feed
                break
            try:
                self.search(plan)
                return self.compile(plan)
            except LongStopError as again:
                error = again
        return None


def _late_zones(program: Program, stop_time_s: float, share: float) -> list[FeedZone]:
    """The feed pieces whose fault stops are late, each with this share of its mean feed."""
    ends_mm = [*program.piece_starts_mm.tolist(), program.length_q40 * 2.0**-40]
    late = program.stops.bound_us[:, FAULT] * 1e-6 > stop_time_s
    return [
        FeedZone(low, high, share * (high - low) / duration_s)
        for low, high, duration_s, is_late in zip(
            ends_mm[:-1],
            ends_mm[1:],
            program.pieces.duration_s.tolist(),
            late.tolist(),
            strict=True,
        )
        if is_late and low < high
    ]


def _noted(made: Compilation, late: LongStopError) -> Compilation:
    """The same with a note that it was planned again, and why."""
    before_s, after_s = late.program.duration_s, made.program.duration_s
    line = f"planned again with more room for stops, {after_s:.4g} s in place of {before_s:.4g} s: {late.reason}"
    notes = (*made.plan.notes, line)
    return replace(made, plan=replace(made.plan, notes=notes), notes=notes)
