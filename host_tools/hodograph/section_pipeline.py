# SPDX-License-Identifier: MIT
"""The pipeline of a section of a job: its curve is fitted already, and equal sections share its plan and program. Used
by api/path and job. No I/O; reads the clock.

job.py makes one for each section, the API one for a fitted path. In addition to what `Pipeline` does, it lowers the
feed where a plan would leave no headroom for a changing override.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .equal_sections import SharedPrograms, moved_program
from .errors import PlanError
from .events import Events, no_events
from .feed import FeedPieces, FeedPlan, FeedZone, Limits
from .fixed_point import MM_PER_Q40
from .machine_limits import program_limits
from .pipeline import THOROUGH_GAIN, Judged, Pipeline
from .program.compiler import Compilation
from .program.geometry import first_point_q40, quantise
from .program.image import Program
from .program.stop_planning import LongStopError, StopTerms
from .program.stop_reserve import late_share, late_too_often
from .spline.build import FoundSpline
from .spline.curve import PHSpline
from .spline.spatial import SpatialPHSpline, sliced
from .toolpath.fit.fitting import FittedPath

Int = NDArray[np.int64]

_MORE_RESERVE = (0.004, 0.008, 0.02, 0.05)
"""Shares of the axis limits that plans leave free: one after the other is tried until a program can be made."""

_SLOWER, _MOST_SLOWER = 0.7, 12
"""Factor on the mean feed of a piece for which no reserve suffices, and how often it is applied at most."""

_THOROUGH_CHORDS = 1000
"""A section with at most so many chords and feed pieces is searched for stops with all trials, if few do not suffice.
"""

_EXCERPT_STOPS = 5.0
"""Duration of an excerpt of a section, as a multiple of the longest stop."""

_LONG_EXCERPTS = 8.0
"""A section that lasts this multiple of its excerpt is long enough for one."""

_ALIKE = 1.1
"""Stops may be late more often in the excerpt than in the whole by this factor; otherwise it shows nothing."""


@dataclass(frozen=True, eq=False)
class SectionPipeline(Pipeline):
    """A pipeline whose curve is that of a section.

    fitted        the section's curve and reference
    given_events  outputs that switch on the path
    shared        plan and programs of all sections of the job that are equal to this one
    """

    fitted: FittedPath | None = None
    given_events: Events = field(default_factory=no_events)
    shared: SharedPrograms = field(default_factory=SharedPrograms)

    @property
    def events(self) -> Events:
        """The outputs that switch on the path."""
        return self.given_events

    @cached_property
    def found_spline(self) -> FoundSpline[PHSpline] | FoundSpline[SpatialPHSpline]:
        """The curve, in the plane where only two axes of the machine follow a path."""
        assert self.fitted is not None
        curve = self.fitted.curve
        if len(self.machine.path_axes) > 2:
            return FoundSpline(curve, 0)
        return FoundSpline(_in_plane(curve), 0)

    @property
    def stop_terms(self) -> StopTerms:
        """What the stops of the program keep; they are searched with few trials."""
        return replace(super().stop_terms, quick=True)

    @cached_property
    def _timed_plan(self) -> tuple[FeedPlan, float]:
        begin = perf_counter()
        if self.shared.plan is None:
            self.shared.plan = self._planned(self.limits)
        return self.shared.plan, perf_counter() - begin

    def _judge_plans(self) -> Judged:
        """The program of an equal section, moved to this one's place; where there is none, its own."""
        known = self.shared.judged.get(self.given_events.tobytes())
        moved = known and moved_program(known, self._start_q40, program_limits(self.machine))
        if moved:
            return moved
        judged = super()._judge_plans()
        self.shared.judged.setdefault(self.given_events.tobytes(), judged)
        return judged

    @property
    def _start_q40(self) -> Int:
        """The first point of its program (axes,), in machine coordinates."""
        assert self.fitted is not None
        return first_point_q40(self.fitted.curve, self.machine.offset_mm)

    def _planned(self, limits: Limits) -> FeedPlan:
        """A plan whose pieces all leave headroom for the least override rate: made with more reserve, then with a lower
        feed in those that do not.
        """
        plan = super()._planned(limits)
        for reserve in _MORE_RESERVE:
            if not self._without_override(plan)[1].any():
                return plan
            plan = super()._planned(replace(limits, reserve=max(limits.reserve, reserve)))
        return self._passed_slowly(plan)

    def _late_in_excerpt(self, limits: Limits, late: Program) -> bool:
        stop_s = self.machine.stop_time_ms * 1e-3
        excerpt = self._excerpt(late, stop_s)
        if excerpt is None:
            return False
        length_mm = excerpt.curve.length_mm
        zones = tuple(
            replace(one, to_mm=min(one.to_mm, length_mm))
            for one in limits.zones
            if one.from_mm < length_mm
        )
        try:
            excerpt._searched(excerpt._planned(replace(limits, zones=zones)))
        except LongStopError as error:
            return late_too_often(error.program, stop_s)
        except PlanError:
            pass
        return False

    def _excerpt(self, late: Program, stop_s: float) -> SectionPipeline | None:
        """The start of the section, where stops are late as often as in the whole of `late`, a program of the section.
        None: there is none, or the section is short.
        """
        assert self.fitted is not None
        end_s = np.cumsum(late.pieces.duration_s)
        if end_s[-1] < _LONG_EXCERPTS * _EXCERPT_STOPS * stop_s:
            return None
        count = int(np.searchsorted(end_s, _EXCERPT_STOPS * stop_s)) + 1
        if late_share(late, stop_s, slice(count)) > _ALIKE * late_share(late, stop_s):
            return None
        end_mm = float(late.pieces.start_q40[count]) * MM_PER_Q40
        curve = self.fitted.curve
        segments = int(np.count_nonzero(curve.segment_starts_mm[:-1] < end_mm))
        fitted = replace(self.fitted, curve=sliced(curve, 0, segments))
        return replace(self, fitted=fitted, given_events=no_events(), shared=SharedPrograms())

    def _slower(self, plan: FeedPlan, zones: Sequence[FeedZone], why: str) -> FeedPlan:
        again = super()._slower(plan, zones, why)
        passed = self._passed_slowly(again)
        if passed is again:
            return again
        return replace(passed, notes=(*passed.notes, again.notes[-1]))

    def _passed_slowly(self, plan: FeedPlan) -> FeedPlan:
        """The plan, with a lower feed in pieces that leave no headroom for a changing override."""
        for _ in range(_MOST_SLOWER):
            pieces, lacking = self._without_override(plan)
            slower = pieces.slower_zones(lacking, _SLOWER, self._length_q40)
            if not slower:
                break
            plan = super()._planned(replace(plan.limits, zones=(*plan.limits.zones, *slower)))
        return plan

    def _without_override(self, plan: FeedPlan) -> tuple[FeedPieces, NDArray[np.bool_]]:
        """The pieces of a plan, and which of them (n,) leave no headroom for a changing override. The plan may have
        missed a bend of less than a micrometre between two places where it evaluates limits.
        """
        pieces = plan.pieces_over(self._length_q40, self._joints_q40)
        codes = np.minimum(pieces.override_rate_codes, pieces.override_second_codes)
        return pieces, np.asarray(codes.min(axis=1) == 0)

    @cached_property
    def _joints_q40(self) -> Int:
        """Joints of the curve in its program."""
        return quantise(self.curve, ()).start_q40

    @property
    def _length_q40(self) -> int:
        return int(self._joints_q40[-1])

    def _compiled_again(self, plan: FeedPlan) -> Compilation:
        return self._with_stops(plan, self.stop_terms)

    def _with_stops(self, plan: FeedPlan, terms: StopTerms) -> Compilation:
        """The program of a plan. Its stops are searched with few trials, and with all where the stop time bounds are a
        little too long. Raises LongStopError.
        """
        try:
            return super()._with_stops(plan, terms)
        except LongStopError as error:
            assert self.fitted is not None
            few = max(self.fitted.reference.count, error.program.piece_count) <= _THOROUGH_CHORDS
            if not few or error.late_by > THOROUGH_GAIN:
                raise
            return super()._with_stops(plan, replace(terms, quick=False))


def _in_plane(curve: SpatialPHSpline) -> PHSpline:
    """The plane curve of one whose z does not change."""
    w = curve.preimage[:, 0] + 1j * curve.preimage[:, 3]
    return PHSpline(curve.origin[:, 0] + 1j * curve.origin[:, 1], w, False)
