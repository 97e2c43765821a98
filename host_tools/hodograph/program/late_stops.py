# SPDX-License-Identifier: MIT
"""Plans a path again if a fault stop of its program would take longer than `stop_time_ms` of the machine file;
docs/theory/toolpath-fitting.md section 8.

With profile "optimal" more of the limits is left free first: around places at which stops may then begin, or
everywhere. If that is not enough, and with the other profiles, the feed is lowered step by step. Used by pipeline.py.

No I/O.
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
"""Least and greatest factor of the feed from one plan to the next. Between them it is in proportion to the lateness of
stops.
"""

MOST_STEPS = 8
"""How many times the feed is lowered at most."""

FAILED_STEP = 0.7
"""Factor of the feed if no program can be made of a plan for another reason than a late stop."""


@dataclass(frozen=True)
class Replanning:
    """Plans a path again, with functions for plans and programs.

    plan         a plan inside limits; raises PlanError
    slower       a plan made again with feed zones; the text, why, goes to its notes; raises PlanError
    compile      the program of a plan; raises LongStopError, and another PlanError
    search       the program of a plan with few trials and fault stops only; raises as `compile` does
    stop_time_s  greatest bound of a fault stop
    late_in_excerpt
                 whether an excerpt of the path shows that a plan with these limits has late stops too often; the
                 program is that of the first plan
    """

    plan: Callable[[Limits], FeedPlan]
    slower: Replan
    compile: Callable[[FeedPlan], Compilation]
    search: Callable[[FeedPlan], Compilation]
    stop_time_s: float
    late_in_excerpt: Callable[[Limits, Program], bool]

    def in_time(self, plan: FeedPlan, late: LongStopError) -> Compilation:
        """The first program whose fault stops are in time; `late` is the refusal of `plan`. Plans that are not found,
        or of which no program can be made, are skipped. Raises PlanError: no program is in time.
        """
        found = None
        if plan.request.optimal:
            found = self._with_reserve(plan.limits, late)
            found = None if found is None else _noted(found, late)
        found = found or self._with_less_feed(plan, late)
        if found is None:
            raise PlanError(
                f"stops: {late.reason}, and no plan was found with shorter stops: {late.remedy}"
            )
        return found

    def _with_reserve(self, limits: Limits, late: LongStopError) -> Compilation | None:
        """The program of a plan with reserve zones around places at which stops may begin, which a plan with lower
        limits everywhere shows. If zones are not enough, the program of such a plan. None: none is in time.
        """
        program, zones = late.program, limits.reserve_zones
        whole: list[FeedPlan] = []
        for share in EVERYWHERE:
            if whole and late_too_often(program, self.stop_time_s):
                break
            less = replace(limits, machine=limits.machine.scaled(1.0 - share))
            if self.late_in_excerpt(less, late.program):
                continue
            try:
                lower = self.plan(less)
                lowered = self.search(lower).program
                whole.append(lower)
            except LongStopError as error:
                lowered = error.program
                if late_too_often(lowered, self.stop_time_s):
                    continue
            except PlanError:
                continue
            for spread in SPREADS:
                more = zones_at_places(program, lowered, self.stop_time_s, share, spread)
                if not more:
                    break
                wider = (*zones, *more)
                try:
                    return self.compile(self.plan(replace(limits, reserve_zones=wider)))
                except LongStopError as error:
                    program, zones = error.program, wider
                except PlanError:  # without these zones
                    continue
        for plan in whole:
            with suppress(PlanError):
                return self.compile(plan)
        return None

    def _with_less_feed(self, plan: FeedPlan, late: LongStopError) -> Compilation | None:
        """The program of a plan whose feed is lower where fault stops are late; None: none is in time."""
        program, share = late.program, 1.0
        for _ in range(MOST_STEPS):
            zones = self._slower_zones(plan, program, share)
            if not zones:
                break
            try:
                slower = self.slower(plan, zones, late.reason)
            except PlanError:
                share *= FAILED_STEP
                continue
            try:
                self.search(slower)
                return self.compile(slower)
            except LongStopError as again:
                plan, program, share = slower, again.program, 1.0
            except PlanError:
                share *= FAILED_STEP
        return None

    def _slower_zones(self, plan: FeedPlan, program: Program, share: float) -> list[FeedZone]:
        """Feed zones for the next plan, with lower feeds than this program of `plan`; empty: no feed may be lower.
        `share`: a further factor of their feeds.
        """
        step = self.stop_time_s / program.stops.worst(FAULT).time_s
        step = share * min(max(step, LEAST_STEP), GREATEST_STEP)
        if plan.request.optimal:
            late = program.stops.late(FAULT, self.stop_time_s)
            return program.pieces.slower_zones(late, step, program.length_q40)
        feed_mm_s = max(step * plan.feed_mm_s, LEAST_FEED_MM_S)
        whole = FeedZone(0.0, plan.length_mm, feed_mm_s)
        return [whole] if feed_mm_s < plan.feed_mm_s else []


def _noted(made: Compilation, late: LongStopError) -> Compilation:
    """The program with a note that the path was planned again, with the reason."""
    before_s, after_s = late.program.duration_s, made.program.duration_s
    line = f"planned again with more room for stops, {after_s:.4g} s in place of {before_s:.4g} s: {late.reason}"
    notes = (*made.plan.notes, line)
    return replace(made, plan=replace(made.plan, notes=notes), notes=notes)
