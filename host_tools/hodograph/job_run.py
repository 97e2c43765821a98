# SPDX-License-Identifier: MIT
"""Runs a job on the bus: its sections one after the other, and the machine commands at rest between them.

Used by cli/, by api/bus, and by stream/sender (the functions for rests). Reads and writes objects of the controller by
SDO, receives frames, writes recordings, and waits by the clock of the bus. Each section is one program: it is uploaded
where the axes stand, started, recorded and analysed. At rest the job waits for dwells, waits for the operator at
program stops and tool changes, and prints messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from time import perf_counter

import numpy as np

from .bus.capture.setpoint_check import SetpointJumpError
from .bus.diagnostics.texts import STATES
from .bus.goto import goto
from .bus.outputs import require_standstill_outputs, set_outputs
from .bus.run import BusRun, Progress, RunSession, analysed, bring_up, record_program
from .bus.sdo.controller import FAULT_STATE, READY, Controller
from .config import Machine
from .errors import PlanError, RefusedError, RunError
from .events import OutputValues
from .job import Job, JobSection
from .job_outputs import acts_at_rest
from .job_simulation import JobMotion
from .native import NativeProgram
from .program.image import LARGEST_BANK, RECORD_BYTES, memory_bytes
from .toolpath.moves import Command, Dwell, Message, ProgramStop, SwitchedAtRest, ToolChange

_CHECK_S = 0.1
"""Time between two checks of the bus, in a dwell and while the operator is awaited."""
_START_COUNTS = 2
"""If no axis is farther from the start of a section, it begins without a move there. The last end was rounded."""


class NoRoomError(PlanError):
    """A section takes more memory than the controller has for a program."""


BusCheck = Callable[[], None]
"""Waits 0.1 s. Raises RunError for a fault, a stop, or drives that are off; BusError when the controller is gone."""

Operator = Callable[[str, BusCheck], None]
"""Shows the operator why the job stops (file, line, code), and returns when the job may continue.

Has to call the check again and again while it waits.
"""


@dataclass(frozen=True, eq=False)
class PreparedJob:
    """A job with the programs of its sections, all of which the controller accepts."""

    job: Job
    kernel: str
    programs: tuple[NativeProgram, ...]
    planning_s: float

    @property
    def ticks(self) -> int:
        """Of all sections."""
        return sum(program.ticks for program in self.programs)


@dataclass(frozen=True, eq=False)
class JobRun:
    """A recorded run of a job."""

    motion: JobMotion
    runs: tuple[BusRun, ...]

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on in `hodograph run --json`: of the whole, and of each section."""
        misses = [run.deadline_misses or 0 for run in self.runs]
        return self.motion.summary() | {
            "bus": self.runs[0].bus,
            "pace": self.runs[0].pace,
            "deadline_misses": sum(misses),
            "frames": sum(run.frames for run in self.runs),
            "unhomed_starts": sum(run.unhomed_starts for run in self.runs),
            "section": [
                section.lines_summary() | run.summary()
                for section, run in zip(self.motion.job.sections, self.runs, strict=True)
            ],
        }


def prepared(job: Job, kernel: str) -> PreparedJob:
    """Plans and compiles every section, so that every error is found before anything moves.

    Raises InputError, and PlanError (NoRoomError: a section does not fit the memory of the machine's controller).
    """
    begin = perf_counter()
    programs = []
    for section in job.sections:
        program = section.pipeline.accepted
        needed = memory_bytes(program.image, RECORD_BYTES[kernel])
        room = job.machine.program_bytes or LARGEST_BANK
        if needed > room:
            problem = (
                f"{job.file}:{section.first_line}: the section up to line {section.last_line} takes {needed} bytes of "
                f"a controller, which has {room}"
            )
            raise NoRoomError(f"{problem}: hodograph stream takes jobs of any length")
        programs.append(program)
    return PreparedJob(job, kernel, tuple(programs), perf_counter() - begin)


def operator_stops(job: Job) -> Iterator[tuple[int, str]]:
    """The program stops and tool changes of a job, as source line and code ("M0", "M1", "M6 T2")."""
    for section in job.sections:
        yield from operator_stops_of(section.before)
    yield from operator_stops_of(job.after)


def operator_stops_of(commands: Sequence[Command]) -> Iterator[tuple[int, str]]:
    """The program stops and tool changes among some commands."""
    for command in commands:
        if isinstance(command, ProgramStop):
            yield command.line, "M1" if command.optional else "M0"
        elif isinstance(command, ToolChange):
            yield command.line, f"M6 T{command.tool}"


def run_job(
    at: RunSession,
    made: PreparedJob,
    operator: Operator,
    progress: Progress | None = None,
    record: Path | None = None,
    *,
    unhomed: bool = False,
) -> JobRun:
    """Runs a job; the axes first move to its start.

    record  file for the frames; a job with several sections writes one file each: NAME.1.log, NAME.2.log, …

    A job ends at a fault, a stop (also one at rest), or a setpoint step beyond the limits. If a section reaches its end
    but its recording differs from its program (a hold, a feed override), the job continues and raises this error at its
    end.
    Raises RefusedError, BusError and RunError, naming file and line.
    """
    with at.controller.ending_at_stops():
        if _switches_at_rest(made.job):
            require_standstill_outputs(at.controller)
        bring_up(at, made.job.machine, made.kernel)
        return _run_sections(at, made, operator, progress, record, unhomed=unhomed)


def _switches_at_rest(job: Job) -> bool:
    """Whether outputs are switched, or kept on, at a rest of the job."""
    commands = chain(job.after, *(section.before for section in job.sections))
    return goes_off_at_end(job.machine) or any(isinstance(one, SwitchedAtRest) for one in commands)


def _run_sections(
    at: RunSession,
    made: PreparedJob,
    operator: Operator,
    progress: Progress | None,
    record: Path | None,
    *,
    unhomed: bool,
) -> JobRun:
    job = made.job
    runs: list[BusRun] = []
    failure: RunError | None = None
    passed = 0
    _to_start(at, job.sections[0], made, made.programs[0], unhomed)
    for number, (section, program) in enumerate(zip(job.sections, made.programs, strict=True), 1):
        execute_at_rest(at, job.file, section.before, operator)
        place = f"{job.file}:{section.first_line}: section {number} of {len(job.sections)}"
        # No move, unless an operator moved the axes during the stop.
        _to_start(at, section, made, program, unhomed)
        own = None if progress is None else _shifted(progress, passed)
        follows = number < len(job.sections) or acts_at_rest(job.after)
        stay = goes_off_at_end(job.machine) and follows
        recorded = record_program(
            at, job.machine, program.image, own, unhomed=unhomed, outputs_stay=stay
        )
        _require_end(at, section, made, program, place)
        passed += program.ticks
        report_messages(at, job.file, [command for _, command in section.events])
        try:
            file = _record_of(record, number, job)
            machine = section.pipeline.machine
            runs.append(analysed(at, machine, program.image, made.kernel, recorded, file))
        except SetpointJumpError as error:
            raise RunError(f"{place}: {error}") from None
        except RunError as error:
            failure = failure or RunError(f"{place}: {error}")
    execute_at_rest(at, job.file, job.after, operator)
    end_outputs(at, job.machine)
    if failure is not None:
        raise failure
    motion = JobMotion(job, tuple(run.motion for run in runs), made.planning_s)
    return JobRun(motion, tuple(runs))


def _shifted(progress: Progress, done: int) -> Progress:
    return lambda tick: progress(done + tick)


def _record_of(record: Path | None, number: int, job: Job) -> Path | None:
    if record is None or len(job.sections) == 1:
        return record
    return record.with_name(f"{record.stem}.{number}{record.suffix}")


def _place(section: JobSection, made: PreparedJob, program: NativeProgram, tick: int) -> list[int]:
    """Setpoint of all axes of the path at a tick of a section, in counts."""
    moved, machine = section.pipeline.machine, made.job.machine
    setpoint = program.counts_at(made.kernel, moved.path_counts, tick)
    stands = section.standing_mm + machine.offset_mm[: moved.first_axis]
    counts = np.rint(stands * machine.path_counts[: moved.first_axis])
    return [*counts.astype(int).tolist(), *setpoint]


def _off_counts(at: RunSession, place: list[int]) -> int:
    """Greatest distance of an axis from a place, in counts."""
    return int(np.abs(np.subtract(at.controller.targets(len(place)), place)).max())


def _to_start(
    at: RunSession, section: JobSection, made: PreparedJob, program: NativeProgram, unhomed: bool
) -> None:
    start = _place(section, made, program, 0)
    if _off_counts(at, start) > _START_COUNTS:
        goto(at.controller, made.job.machine, start, unhomed=unhomed)


def _require_end(
    at: RunSession, section: JobSection, made: PreparedJob, program: NativeProgram, place: str
) -> None:
    """Raises RunError: the axes stand at a place that is not the end of the program."""
    end, first = _place(section, made, program, program.ticks), section.pipeline.machine.first_axis
    if list(at.controller.targets(len(end)))[first:] != end[first:]:
        raise RunError(f"{place}: stopped before its end: the job ends here")


def execute_at_rest(
    at: RunSession, file: Path, commands: Sequence[Command], operator: Operator
) -> None:
    """Executes the commands at a rest in their order. Commands for which the machine has no device are skipped."""
    for command in commands:
        report_messages(at, file, [command])
        if isinstance(command, SwitchedAtRest):
            _switch(at.controller, command.values)
        if isinstance(command, Dwell):
            _dwell(at, command.duration_s)
        for line, code in operator_stops_of([command]):
            operator(f"{file}:{line}: {code}", lambda: _check_bus(at, _CHECK_S))


def goes_off_at_end(machine: Machine) -> bool:
    """Whether the outputs of a machine go off at the end of a job."""
    return machine.outputs is not None and machine.outputs.off_at_end


def end_outputs(at: RunSession, machine: Machine) -> None:
    """Switches the outputs off at the end of a job, on a machine that has this configured. The end of the last program
    did not, if the job went on at rest after it.
    """
    if goes_off_at_end(machine):
        _switch(at.controller, OutputValues())


def _switch(controller: Controller, values: OutputValues) -> None:
    """Switches the outputs at a rest. Raises RunError: a stop came, perhaps just before. Then they are on again, until
    the job that ends stops too (`stop_after`).
    """
    controller.require_no_stop()
    try:
        set_outputs(controller, values)
    except RefusedError:
        controller.require_no_stop()  # a quick stop has switched the drives off
        raise
    controller.require_no_stop()


def report_messages(at: RunSession, file: Path, commands: Sequence[Command]) -> None:
    """Prints the messages among some commands. Those within a section are printed at its end."""
    for command in commands:
        if isinstance(command, Message):
            at.note(f"{file}:{command.line}: {command.text}")


def _dwell(at: RunSession, duration_s: float) -> None:
    end_s = at.controller.clock.now_s() + duration_s
    while (left_s := end_s - at.controller.clock.now_s()) > 0.0:
        _check_bus(at, min(left_s, _CHECK_S))


def _check_bus(at: RunSession, wait_s: float) -> None:
    """Waits at rest. Raises RunError for a fault, a stop, or drives that are off; BusError: the controller is gone."""
    if at.rig is not None:
        at.rig.check()
    state = at.controller.state()
    if state == FAULT_STATE:
        raise at.controller.fault_error()
    if state != READY:
        raise RunError(
            f"{at.controller.who()} is in state {STATES.get(state, state)} at a rest of the job: another command has "
            "moved the axes or switched the drives off, or the controller has restarted, so the job ends here: see "
            "hodograph status"
        )
    at.controller.require_no_stop()
    at.controller.clock.sleep(wait_s)
