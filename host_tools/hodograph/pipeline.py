# SPDX-License-Identifier: MIT
"""From a path file to an accepted program: spline, plan, program, each computed once, on request. Used by all modules
that need the program of a path file. Reads the path file and the files that it names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .config import (
    PLANE_AXES,
    SPACE_AXES,
    Machine,
    PathFile,
    PathSpec,
    SpacePathSpec,
    is_there,
    load_machine,
    load_path_file,
)
from .errors import InputError, PlanError
from .events import Events
from .feed import (
    FeedPlan,
    FeedRequest,
    FeedZone,
    Limits,
    Peak,
    Replan,
    ineffective_limits,
    plan_path,
    replan,
)
from .feed.optimal import plan_optimal, plan_peaks, replan_optimal
from .fixed_point import MM_PER_Q40
from .machine_limits import (
    axis_limits,
    controller_limits,
    controller_verdict,
    plants,
    program_limits,
    stop_terms,
)
from .names import AXES
from .native.program import NativeFault, NativeProgram
from .path_outputs import events_on_path
from .program import (
    Compilation,
    Program,
    ProgramOptions,
    StopTerms,
    compile_path,
    encode,
    fit_plan,
)
from .program.codes import ProgramError
from .program.late_stops import Replanning
from .program.stop_planning import LongStopError
from .spline import PHSpline, SplineResult, from_control_polygon, through_points
from .spline.spatial import (
    SpatialSplineResult,
    spatial_from_control_polygon,
    spatial_through_points,
)
from .spline.spatial.curve import SpatialPHSpline, embedded
from .spline.spatial.extra import with_standing_axes

_Found = TypeVar("_Found", SplineResult, SpatialSplineResult)


_MORE_RESERVE = (0.002, 0.01)
"""Shares of the machine's axis limits that are left free in addition, one after the other, where the controller could
not prove a plan.
"""
THOROUGH_GAIN = 1.1
"""Stop time bounds found with few trials are longer than those of all trials by about this factor."""

_PROVED = (
    ProgramError.AXIS_VELOCITY,
    ProgramError.AXIS_ACCELERATION,
    ProgramError.AXIS_JERK,
    ProgramError.AXIS_STEP,
)
"""Faults that lower limits may avoid."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A program, and the first rule that it breaks (None: it is accepted)."""

    compilation: Compilation
    native: NativeProgram
    fault: NativeFault | None


def _judge(compilation: Compilation, machine: Machine) -> Judged:
    native = NativeProgram(encode(compilation.program))
    return Judged(compilation, native, controller_verdict(native, machine))


@dataclass(frozen=True, eq=False)
class Pipeline:
    """A path file and everything computed from it. Errors come when a step is first requested."""

    file: PathFile
    given_machine: Path | Machine | None = None
    """A machine, or its file, that replaces the one the path file names."""

    @property
    def standing_mm(self) -> tuple[float, ...]:
        """Positions of the path's axes before those of the program, which stand; without the work offset."""
        return ()

    @property
    def whole_machine(self) -> Machine:
        """The machine with all axes of its path, also where the program moves rotary axes alone."""
        return self.machine

    @property
    def unit(self) -> str:
        """Unit of lengths of the path: "mm", or "deg" where rotary axes move alone."""
        return "mm"

    @cached_property
    def machine_or_none(self) -> Machine | None:
        """The machine, None when none is named."""
        if isinstance(self.given_machine, Machine):
            return self.given_machine
        if self.given_machine is not None:
            return load_machine(self.given_machine)
        name = self.file.machine_file
        if name is None:
            return None
        if not is_there(name):
            raise InputError(
                f"{self.file.file}: [machine] file names {name}, which is not there: "
                "correct it or use --machine FILE"
            )
        return load_machine(name)

    @property
    def machine(self) -> Machine:
        """The machine; raises InputError when none is named."""
        if self.machine_or_none is None:
            raise InputError(
                f'{self.file.file}: names no machine: add [machine] file = "..." or use --machine FILE'
            )
        return self.machine_or_none

    @cached_property
    def spline_result(self) -> SplineResult:
        """The spline and how it was found. Raises PlanError for a path in space."""
        return self._solved(self.file.path, from_control_polygon, through_points)

    @cached_property
    def spatial_spline_result(self) -> SpatialSplineResult | None:
        """The spline of a path in space and how it was found; None for a path in the plane."""
        path = self.file.given_path
        if not isinstance(path, SpacePathSpec):
            return None
        return self._solved(path, spatial_from_control_polygon, spatial_through_points)

    def _solved(
        self,
        path: PathSpec | SpacePathSpec,
        from_polygon: Callable[..., _Found],
        through: Callable[..., _Found],
    ) -> _Found:
        """The spline of a path, from its control polygon or through its points. Errors name the file."""
        extra = {"extra": path.extra} if isinstance(path, SpacePathSpec) else {}
        with _named_by(f"{self.file.file}: [path]"):
            if not path.through:
                return from_polygon(path.points, path.closed, **extra)
            return through(
                path.points,
                path.closed,
                ends=path.ends,
                start_tangent=path.start_tangent,
                end_tangent=path.end_tangent,
                knots=path.knots,
                **extra,
            )

    @property
    def found_spline(self) -> SplineResult | SpatialSplineResult:
        """The spline of a path in the plane or in space, and how it was found."""
        return self.spatial_spline_result or self.spline_result

    @cached_property
    def curve(self) -> PHSpline | SpatialPHSpline:
        """The curve of all axes of the machine's path: the spline, and 0 for axes that the path does not move.

        Raises InputError: the machine has too few axes for the path.
        """
        spline, machine = self.found_spline.spline, self.machine_or_none
        axes = spline.axes if machine is None else len(machine.path_axes)
        if axes < spline.axes:
            raise _too_few_axes(self.file, spline.axes, axes)
        if isinstance(spline, PHSpline):
            if axes == PLANE_AXES:
                return spline
            spline = embedded(spline, 0.0)
        return with_standing_axes(spline, axes - spline.axes)

    @property
    def feed(self) -> FeedRequest:
        """The requested feed; raises InputError when the file has no section [feed]."""
        if self.file.feed is None:
            raise InputError(
                f"{self.file.file}: the section [feed] is missing: add it with nominal_mm_s and ramp_time_s"
            )
        return self.file.feed

    @property
    def plan(self) -> FeedPlan:
        """The feed over the spline, before the program is made of it (`compilation.plan`)."""
        return self._timed_plan[0]

    @property
    def planning_s(self) -> float:
        """Wall time that planning took."""
        return self._timed_plan[1]

    @cached_property
    def limits(self) -> Limits:
        """What a plan keeps: the limits of the path file, and those of the machine's axes."""
        machine = self.machine_or_none
        if machine is None:
            return self.file.limits
        return self.file.limits.on_machine(
            machine.path_names, axis_limits(machine), machine.path_units
        )

    @cached_property
    def peaks(self) -> dict[str, Peak]:
        """The peak of each limited quantity of the plan."""
        return self.peaks_of(self.plan)

    def peaks_of(self, plan: FeedPlan) -> dict[str, Peak]:
        """As `peaks`, of another plan of the path, such as `compilation.plan`."""
        machine, limits = self.machine_or_none, self.limits
        controller = controller_limits(machine) if machine is not None else None
        return plan_peaks(plan, self.curve, limits, controller, plants(machine, limits))

    @cached_property
    def _timed_plan(self) -> tuple[FeedPlan, float]:
        begin = perf_counter()
        plan = self._planned(self.limits)
        return plan, perf_counter() - begin

    def _planned(self, limits: Limits) -> FeedPlan:
        feed, machine = self.feed, self.machine_or_none
        spline = self.curve
        controller = controller_limits(machine) if machine is not None else None
        period_us = machine.period_us if machine is not None else 1000
        with _named_by(f"{self.file.file}:"):
            make = plan_optimal if feed.optimal else plan_path
            plan = make(
                spline,
                feed,
                limits,
                controller,
                plants(machine, limits),
                period_us=period_us,
            )
            return fit_plan(spline, plan, self._replan)

    @property
    def compilation(self) -> Compilation:
        """The program for the machine."""
        return self._judged.compilation

    @cached_property
    def _judged(self) -> Judged:
        return self._judge_plans()

    def _judge_plans(self) -> Judged:
        """The first program that the controller accepts; where it accepts none, the last one tried.

        The controller's bounds of what lies between its samples may be too wide for a plan that uses a limit fully.
        Such a plan is made again with lower limits.
        """
        machine, limits = self.machine, self.limits
        judged = _judge(self._compiled(self.plan), machine)
        for reserve in _MORE_RESERVE:
            if judged.fault is None or judged.fault.code not in _PROVED:
                break
            lower = replace(limits, machine=limits.machine.scaled(1.0 - reserve))
            judged = _judge(self._compiled(self._planned(lower)), machine)
        return judged

    @property
    def _replan(self) -> Replan:
        return replan_optimal if self.feed.optimal else replan

    def _compiled(self, plan: FeedPlan) -> Compilation:
        """The program of a plan. Where a fault stop would take too long, the program of a plan made again. Raises
        PlanError: fault stops of no plan are in time.
        """
        try:
            return self._with_stops(plan, self.stop_terms)
        except LongStopError as error:
            late = error
        again = Replanning(
            self._planned,
            self._slower,
            self._compiled_again,
            self._searched,
            self.machine.stop_time_ms * 1e-3,
            self._late_in_excerpt,
        )
        with _named_by(f"{self.file.file}:"):
            return again.in_time(plan, late)

    def _late_in_excerpt(self, limits: Limits, late: Program) -> bool:
        """Whether an excerpt of the path shows that a plan with these limits has late stops too often. False: there is
        no excerpt.
        """
        return False

    def _slower(self, plan: FeedPlan, zones: Sequence[FeedZone], why: str) -> FeedPlan:
        """The plan made again with further feed zones; `why` goes to its notes."""
        return self._replan(plan, zones, why)

    def _compiled_again(self, plan: FeedPlan) -> Compilation:
        """The program of a plan made again. All trials are made only if few trials find stops that are late by at most
        THOROUGH_GAIN. Raises LongStopError.
        """
        try:
            self._searched(plan)
        except LongStopError as error:
            if error.late_by > THOROUGH_GAIN:
                raise
        return self._with_stops(plan, self.stop_terms)

    def _searched(self, plan: FeedPlan) -> Compilation:
        """The program of a plan whose stops are searched with few trials, and fault stops only."""
        return self._with_stops(plan, replace(self.stop_terms, quick=True, only_fault=True))

    def _with_stops(self, plan: FeedPlan, terms: StopTerms) -> Compilation:
        """The program of a plan. Raises LongStopError."""
        machine = self.machine
        limits = program_limits(machine)
        spline = self.curve
        events = self.events  # its errors name file and table
        with _named_by(f"{self.file.file}:"):
            return compile_path(
                spline,
                plan,
                ProgramOptions(
                    self.file.name,
                    machine.offset_mm,
                    limits,
                    machine.period_us,
                    terms,
                    events,
                    machine.first_axis,
                ),
                self._replan,
            )

    @property
    def events(self) -> Events:
        """The outputs that switch on the path. Raises InputError: one that the machine does not have."""
        return events_on_path(self.file, self.machine, self.curve)

    @property
    def stop_terms(self) -> StopTerms:
        """What the stops of the program keep in addition to the limits of its plan."""
        return stop_terms(self.machine, self.file.limits)

    @property
    def program(self) -> Program:
        """The program for the machine."""
        return self.compilation.program

    @property
    def image(self) -> bytes:
        """The program's bytes. Raises PlanError: the controller could not prove that it keeps the machine's limits."""
        return self.accepted.image

    @property
    def accepted(self) -> NativeProgram:
        """The program as the controller accepts it; raises PlanError as `image` does."""
        fault = self._judged.fault
        if fault is not None:
            at_mm = self.program.pieces.start_q40[fault.index] * MM_PER_Q40
            raise PlanError(
                f"{self.file.file}: the controller would refuse the program: {fault.text} (code {fault.code}) in the "
                f"feed piece at {at_mm:.6g} mm: lower [limits] there, and please report this path"
            )
        return self._judged.native

    def notes(self, plan: FeedPlan) -> tuple[str, ...]:
        """What the user should know about the spline and about a plan for it, one line each."""
        excesses = tuple(f"feed: {excess.excess_text}" for excess in plan.excesses)
        limits, found = self.limits, self.found_spline
        length_mm = found.spline.length_mm
        idle = ineffective_limits(
            limits, self.feed, length_mm, plants(self.machine_or_none, limits)
        )
        return (*found.notes, *plan.notes, *excesses, *idle)

    @property
    def drawing_axes(self) -> tuple[str, ...]:
        """The axes that draw the path with their units, for figures."""
        machine = self.machine
        named = zip(machine.path_names, machine.path_units, strict=True)
        return tuple(f"{name}, {unit}" for name, unit in named)[:SPACE_AXES]


@dataclass(frozen=True, eq=False)
class TurningPipeline(Pipeline):
    """The pipeline of a path of rotary axes alone, while x, y and z stand. Its machine is `Machine.turning`, its points
    are those of the axes that the program moves. Lengths and feeds are in degrees.
    """

    given_whole: Machine | None = None
    given_standing_mm: tuple[float, ...] = ()

    @property
    def standing_mm(self) -> tuple[float, ...]:
        """Positions of the path's axes before those of the program, which stand."""
        return self.given_standing_mm

    @property
    def whole_machine(self) -> Machine:
        """The machine with all axes of its path."""
        return self.machine if self.given_whole is None else self.given_whole

    @property
    def unit(self) -> str:
        """Unit of lengths of the path."""
        return "deg"


def pipeline_of(file: PathFile, machine: Path | Machine | None = None) -> Pipeline:
    """The pipeline of a path file, on its own machine or on this one. Raises InputError: rotary axes move alone, and
    the machine's path lacks them.
    """
    plain, path = Pipeline(file, machine), file.given_path
    if not (isinstance(path, SpacePathSpec) and path.turns_alone):
        return plain
    whole = plain.machine_or_none
    count = path.axes if whole is None else len(whole.path_axes)
    if count < path.axes:
        raise _too_few_axes(file, path.axes, count)
    first = min(SPACE_AXES, count - PLANE_AXES)
    points = np.concatenate((path.points, path.extra), axis=1)
    still = np.zeros((len(points), count - path.axes))
    moved = np.concatenate((points, still), axis=1)[:, first:]
    _require_one_direction(file, moved, path.closed)
    limits = replace(
        file.limits, axis=file.limits.axis.from_axis(first), names=AXES[: path.axes - first]
    )
    return TurningPipeline(
        replace(file, given_path=_drawn_by(path, moved), limits=limits),
        None if whole is None else whole.turning,
        whole,
        tuple(path.points[0, :first].tolist()),
    )


def _require_one_direction(file: PathFile, moved: NDArray[np.float64], closed: bool) -> None:
    """Raises PlanError: the only axis that moves reverses. A smooth curve reverses only by a loop in the plane of two
    axes.
    """
    turning = np.flatnonzero(np.ptp(moved, axis=0))
    step = np.diff(moved[:, turning[0]])
    back = np.flatnonzero(np.sign(step) == -np.sign(step[step != 0.0][0]))
    if turning.size > 1 or not (closed or back.size):
        return
    place = "a closed path" if closed else f"point {back[0]}"
    raise PlanError(
        f"{file.file}: [path] the only rotary axis reverses at {place}: end the path there, and put the rest "
        "into a file of its own"
    )


def start_counts(pipeline: Pipeline, kernel: str) -> list[int]:
    """Positions of all axes of the machine's path at the start of a pipeline's program, in counts."""
    return program_start_counts(
        pipeline.accepted, pipeline.whole_machine, kernel, pipeline.standing_mm
    )


def program_start_counts(
    program: NativeProgram, whole: Machine, kernel: str, standing_mm: Sequence[float] | None = None
) -> list[int]:
    """Positions of all axes of a machine's path at the start of a program, in counts.

    whole        the machine with all axes of its path
    standing_mm  positions of the axes before those of the program, without the work offset; None: not known

    Raises InputError: the program has more path axes than the machine, or it moves rotary axes alone and the positions
    of the others are not known.
    """
    if program.first_axis and not standing_mm:
        raise InputError(
            "the program moves rotary axes alone, and does not hold where x, y and z stand: give its path file, or "
            "hodograph run its toolpath"
        )
    if program.axis_count > len(whole.path_axes):
        raise InputError(
            f"the program has {program.axis_count} path axes, {whole.file} has {len(whole.path_axes)}: "
            "compile its path for this machine"
        )
    moved = whole.turning if program.first_axis else whole
    before = [
        round((at + offset) * counts)
        for at, offset, counts in zip(
            standing_mm or (), whole.offset_mm, whole.path_counts, strict=False
        )
    ]
    return [*before, *program.counts_at(kernel, moved.path_counts)]


def _drawn_by(path: SpacePathSpec, moved: NDArray[np.float64]) -> PathSpec | SpacePathSpec:
    """A path of rotary axes alone as a path in the plane or in space of its program's axes (n, 2 or 3)."""
    if moved.shape[1] > PLANE_AXES:
        return replace(path, points=moved, extra=np.zeros((0, 0)))
    plane = moved[:, 0] + 1j * moved[:, 1]
    return PathSpec(path.closed, plane, path.through, path.ends, None, None, path.knots)


def _too_few_axes(file: PathFile, points: int, axes: int) -> InputError:
    one, every = ("only two", "three") if axes == PLANE_AXES else (f"{axes}", f"{points}")
    return InputError(
        f"{file.file}: [path] has points [{', '.join(AXES[:points])}], but {one} axes of the "
        f"machine follow a path: name {every} of them, path = [...], at the top of its file, or give "
        f"points [{', '.join(AXES[:axes])}]"
    )


@contextmanager
def _named_by(place: str) -> Iterator[None]:
    """Puts a file, or a place in it, before the messages of errors."""
    try:
        yield
    except (InputError, PlanError) as error:
        error.args = (f"{place} {error}",)
        raise


def load_pipeline(
    file: Path, machine: Path | None = None, *, allow_space: bool = False
) -> Pipeline:
    """The pipeline that begins with a path file; raises InputError, or PlanError for a path in space if not allowed."""
    found = load_path_file(file)
    if not allow_space:
        found.require_planar()
    return pipeline_of(found, machine)
