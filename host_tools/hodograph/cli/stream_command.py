# SPDX-License-Identifier: MIT
"""hodograph stream: toolpaths of any length, and lists of paths, through a controller with little memory. Started by
cli/main. Used by cli/run_command. Reads files, may start processes, moves the axes, writes the journal and a recording,
and prints to stdout and stderr.
"""

from __future__ import annotations

import gc
import math
import os
import random
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from ..bus.address import BusAddress
from ..bus.capture.bus_recording import BusRecording
from ..bus.capture.recordings import check_suffix
from ..bus.capture.setpoint_check import step_limits
from ..bus.capture.setpoint_watch import jumps
from ..bus.goto import SHORTEST_MOVE_MM
from ..bus.outputs import require_standstill_outputs
from ..bus.own_bus import opened_bus
from ..bus.run import FULL_OVERRIDE, RunSession, bring_up
from ..bus.sdo.controller import connect
from ..bus.sdo.objects import HOMED, HOMING_METHOD, MOVING, OVERRIDE, STREAM
from ..bus.sdo.stream_channel import close_stream, stream_status
from ..bustime import machine_bus_time, require_fit
from ..config import SPACE_AXES, Machine, is_list_of_paths, load_machine, load_paths
from ..errors import BusError, InputError, RefusedError, RunError
from ..fixed_point import MM_PER_Q40, nearest_q40
from ..job_run import goes_off_at_end
from ..machine_limits import program_limits
from ..names import PATH_SUFFIX, STANDARD_INPUT, is_toolpath
from ..native.program import NativeLimits
from ..pipeline import Pipeline
from ..program.inspection import RING_BYTES
from ..stream.chunk import BLOCK_HEAD, largest_chunk
from ..stream.chunks import CHUNK_BYTES
from ..stream.journal import (
    JOURNAL_ELSEWHERE,
    Entry,
    Journal,
    journal_lock,
    load,
    machine_mark,
    mark,
    require_same_machine,
)
from ..stream.output_check import require_outputs
from ..stream.plan import JobFiles, JobPlan, Place, PlanRests
from ..stream.resuming import Nearest, nearest_place, place_of_arc, place_of_line
from ..stream.sender import Sender, StreamedJob, StreamProgress
from ..stream.simulation import StreamedMotion, simulate_chunks
from ..toolpath.files import ReadOptions
from .bus_session import await_enter, pass_stop, session
from .output import (
    duration_text,
    note,
    number,
    print_json,
    print_rows,
    progress,
    require_places,
    size_text,
)
from .toolpath_commands import (
    reading_of,
    refuse_toolpath_options,
    require_toolpath,
    tolerance_of,
)

_EVERY_S = 5.0
_EXACT_COUNTS = 1.5
"""Axes that are so near to a place stand at it."""
_FRAME_BITS, _FRAME_BYTES, _USED = 135, 7, 0.85
"""Bits, with all stuff bits, and bytes of a frame of a block download; share of the free bus that it can use besides
answers and pauses.
"""


def stream(options: Namespace) -> None:
    """hodograph stream."""
    if options.resume:
        _continue(options)
        return
    if not options.files:
        raise InputError("stream: give one FILE at least, or - for standard input, or --continue")
    require_places(options.record)
    for file in options.files:
        _require_job_file(options, file)
    _require_begin(options)
    gc.freeze()  # modules stay: the garbage collector need not search them again
    if options.simulate:
        if options.record is not None:
            raise InputError("--record: --simulate has no bus to record")
        _simulate(_job(options), options)
        return
    with opened_bus(options.bus, note, None if options.pace == "fast" else 1.0) as address:
        stream_on(options, address)


def stream_on(options: Namespace, address: BusAddress) -> None:
    """Streams the files of `stream`, or of `run` if they do not fit the memory of the controller."""
    job = _job(options)
    require_fit(job.machine)
    begin = _begin(job, options)
    number = random.SystemRandom().randrange(1, 2**31)
    entry = _entry(job, number)
    if entry is not None and begin is not None:
        entry = _continued(entry, number, begin.place)
    with nullcontext() if entry is None else journal_lock(journal_file(options)):
        _run(job, options, address, number, begin or Place(), entry)


def _require_begin(options: Namespace) -> None:
    """Raises InputError: the place of --from-line or --from is not that of one file that can be read twice."""
    name = "--from-line" if options.from_line is not None else "--from"
    if options.from_line is None and options.from_mm is None:
        return
    if len(options.files) > 1 or str(options.files[0]) == STANDARD_INPUT:
        raise InputError(f"{name}: takes one FILE, and not standard input")
    if options.from_line is not None and not is_toolpath(options.files[0]):
        raise InputError(f"--from-line: {options.files[0]} has no source lines: use --from MM")
    if options.from_line is not None and options.from_line < 1:
        raise InputError("--from-line: lines count from 1")
    if options.from_mm is not None and not 0.0 <= options.from_mm < math.inf:
        raise InputError("--from: an arc length of 0 mm or more is needed")


def _begin(job: JobFiles, options: Namespace) -> Nearest | None:
    """The place of --from-line or --from; None: the job begins at its start. Raises InputError, PlanError."""
    if options.from_line is not None:
        return place_of_line(job, options.from_line)
    if options.from_mm is not None:
        return place_of_arc(job, options.from_mm)
    return None


def _require_job_file(options: Namespace, file: Path) -> None:
    """Raises InputError: the file is neither a toolpath nor a path file, or has options of the other kind."""
    if file.suffix == PATH_SUFFIX:
        refuse_toolpath_options(options, file)
    else:
        require_toolpath(file)


def has_paths(file: Path) -> bool:
    """Whether a file is a path file with a list of paths. Raises InputError."""
    return file.suffix == PATH_SUFFIX and is_list_of_paths(file)


def _machine(options: Namespace) -> Machine:
    if options.machine is not None:
        return load_machine(options.machine)
    first: Path = options.files[0]
    if is_toolpath(first):
        raise InputError(f"{first}: a toolpath names no machine: add --machine FILE")
    return Pipeline(load_paths(first)[0].file).machine


def _job(options: Namespace) -> JobFiles:
    for file in options.files:
        _require_regular(file)
    machine = _machine(options)
    job = JobFiles(tuple(options.files), machine, tolerance_of(options), reading_of(options))
    _require_outputs(job)
    return job


def _require_regular(file: Path) -> None:
    """Raises InputError: the file is a pipe or the like, which cannot be read twice."""
    if str(file) != STANDARD_INPUT and file.exists() and not file.is_file():
        raise InputError(f"{file}: is no regular file: stream it as -, from standard input")


def _require_outputs(job: JobFiles) -> None:
    """Raises InputError, before anything moves: the machine does not have an output of the job."""
    for file in job.files:
        require_outputs(file, job.machine, job.reading)


def journal_file(options: Namespace) -> Path:
    """Where the journal is. Raises InputError: no place is named, and the user has no home folder."""
    given: Path | None = options.journal
    if given is not None:
        return given
    try:
        home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    except RuntimeError:  # no HOME, and no entry of this user, as in a container
        raise InputError(
            f"the journal has no place: this user has no home folder: {JOURNAL_ELSEWHERE}"
        ) from None
    return Path(home) / "hodograph" / "stream.json"


def _entry(job: JobFiles, number: int) -> Entry | None:
    """What the journal of a job begins with; None: it has none."""
    if any(str(file) == STANDARD_INPUT for file in job.files):
        note("standard input cannot be read again: --continue is not possible for this job")
        return None
    marks = tuple(mark(file) for file in job.files)
    own = {"tolerance_mm": job.tolerance_mm, "reading": asdict(job.reading)}
    machine = job.machine
    file = str(machine.file.resolve())
    return Entry(marks, file, own, number, machine_sha256=machine_mark(machine))


def _continue(options: Namespace) -> None:
    """Continues the job of the journal."""
    if options.files:
        raise InputError("stream --continue: goes on with the files of the last job: give none")
    if options.from_line is not None or options.from_mm is not None:
        raise InputError(
            "stream --continue: goes on where the axes stand: leave --from-line and --from out"
        )
    reading = reading_of(options)
    if options.machine is not None or options.tolerance is not None or reading != ReadOptions():
        raise InputError(
            "stream --continue: goes on with the machine, the tolerance and the reading options of the last job: "
            "give none, or stream the job from its start"
        )
    file = journal_file(options)
    with journal_lock(file):
        entry = load(file)
        own = entry.options
        given: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in own["reading"].items()
        }
        files = tuple(Path(one.path) for one in entry.files)
        machine = load_machine(Path(entry.machine))
        require_same_machine(entry, machine)
        job = JobFiles(files, machine, own["tolerance_mm"], ReadOptions(**given))
        _require_outputs(job)
        require_fit(job.machine)
        with opened_bus(options.bus, note, None if options.pace == "fast" else 1.0) as address:
            _run(job, options, address, random.SystemRandom().randrange(1, 2**31), None, entry)


def _run(
    job: JobFiles,
    options: Namespace,
    address: BusAddress,
    job_number: int,
    start: Place | Nearest | None,
    entry: Entry | None,
) -> None:
    """Streams a job from a place, at which the axes must stand if it is a Nearest; None: from the place where the job
    of `entry`, its journal, is at rest.
    """
    kernel = options.kernel or job.machine.kernel
    begin = start.place if isinstance(start, Nearest) else start
    continued = begin is None
    if begin is None:
        assert entry is not None
        begin = _rests_at(entry, job.machine, address, options.wait)  # None: the job is lost

    def planned(begin: Place) -> JobPlan:
        stops, processes = not options.no_stops, options.jobs
        return JobPlan(job, None, job_number, begin, stops=stops, processes=processes)

    with ExitStack() as stack:
        plan = None if begin is None else stack.enter_context(planned(begin))
        recording = stack.enter_context(recorded(options.record, job.machine, address))
        at = stack.enter_context(session(job.machine, address, options))
        stack.enter_context(at.controller.ending_at_stops())
        if goes_off_at_end(job.machine):
            require_standstill_outputs(at.controller)
        override = _first_override(at, options, continued=continued)
        bring_up(at, job.machine, kernel, override)
        if isinstance(start, Nearest):
            _require_at(at, job.machine, start, unhomed=options.unhomed)
        if begin is None:
            assert entry is not None
            begin = _nearest(at, job, entry, unhomed=options.unhomed)
        if continued:
            assert entry is not None
            entry = _continued(entry, job_number, begin)
        journal = None if entry is None else Journal(journal_file(options), entry)
        close_stream(at.controller)
        most = min(largest_chunk(at.controller.read(STREAM, 7)), CHUNK_BYTES)
        if plan is None:
            plan = stack.enter_context(planned(begin))
        plan.allow(most)
        sender = Sender(
            at,
            job.machine,
            plan,
            pass_stop if options.no_stops else await_enter,
            journal,
            None if options.quiet or options.no_progress else _Progress(_EVERY_S),
            kernel,
            unhomed=options.unhomed,
            slow=_free_rate(job.machine, address),
            recording=recording,
            override=override,
        )
        stack.callback(sender.pass_notes)
        done = sender.run()
    _print(done, options)


def _first_override(at: RunSession, options: Namespace, *, continued: bool) -> int:
    """The feed override with which a job begins. One that continues keeps the present one: an operator may have lowered
    it for a reason.
    """
    if options.override is not None:
        return int(options.override)
    if not continued:
        return FULL_OVERRIDE
    percent = at.controller.read(OVERRIDE, 1)
    if percent != FULL_OVERRIDE:
        note(f"goes on with the present feed override, {percent} %: --override sets another one")
    return percent


def _continued(entry: Entry, job_number: int, begin: Place) -> Entry:
    """The entry of a job that continues as another job of the controller; notes where it continues."""
    note(f"goes on in section {begin.section + 1} at {number(begin.arc_q40 * MM_PER_Q40)} mm of it")
    return replace(
        entry,
        job0=job_number,
        section=begin.section,
        arc_q40=begin.arc_q40,
        committed_q40=begin.arc_q40,
        first=begin.section,
        starts=((begin.section, 0),),
    )


@contextmanager
def recorded(
    file: Path | None, machine: Machine, address: BusAddress
) -> Iterator[BusRecording | None]:
    """Records the bus, if there is a file for it. Raises RunError at its end: frames are missing, a setpoint jumps."""
    if file is None:
        yield None
        return
    check_suffix(file)
    if not address.is_raw:
        raise BusError(f"{address}: --record takes SocketCAN: use socketcan:CHANNEL")
    made = BusRecording(address, file, machine.nodes)
    try:
        yield made
    finally:
        made.close()
    note(f"{file}: {made.frame_count} frames")
    if made.dropped:
        raise RunError(made.dropped_text())
    found = jumps(made.steps, step_limits(machine))
    if found:
        raise RunError(f"{file}: {found[0]}; the file is complete")


def _rests_at(entry: Entry, machine: Machine, address: BusAddress, wait_s: float) -> Place | None:
    """The place of rest after a stop, from the controller; None: the controller does not have the job."""
    with connect(address, machine.node, machine.bitrate) as controller:
        if not controller.answers(wait_s):
            return None
        if stream_status(controller).job != entry.job:
            return None  # another job moves there
        if controller.state() in MOVING:  # also while a stop brakes
            controller.stop_and_wait()
        status = stream_status(controller)
        return Place(*entry.place_at(nearest_q40(status.arc_length_mm)))


def _nearest(at: RunSession, job: JobFiles, entry: Entry, *, unhomed: bool) -> Place:
    """The place of the job nearest to the axes. Raises RefusedError: they are not homed, or not on the path."""
    machine = job.machine
    note("the controller no longer knows the job: it goes on where the axes stand on its path")
    if not unhomed:
        _require_homed(
            at, machine, ", hodograph goto back to the path, then hodograph stream --continue"
        )
    counts = at.controller.targets(machine.path_count)
    found = nearest_place(
        job,
        entry,
        tuple(one / per for one, per in zip(counts, machine.path_counts, strict=True)),
    )
    if found.distance_mm > machine.start_tolerance_mm:
        raise RefusedError(_off_the_path(machine, found))
    scales = machine.path_counts
    off_counts = max(
        abs(one - point * per)
        for one, point, per in zip(counts, found.point_mm, scales, strict=False)
    )
    if off_counts > _EXACT_COUNTS and found.distance_mm < SHORTEST_MOVE_MM:
        # A move this short makes a detour, which would mark the part: a longer one goes back along the path.
        back_q40 = nearest_q40(2.0 * SHORTEST_MOVE_MM)
        return replace(found.place, arc_q40=max(found.place.arc_q40 - back_q40, 0))
    return found.place


def _require_homed(at: RunSession, machine: Machine, then: str = "") -> None:
    """Raises RefusedError: axes with a homing method are not homed. `then`: what the operator does after homing."""
    lost = [
        axis.name
        for i, axis in enumerate(machine.axes, 1)
        if at.controller.read(HOMING_METHOD, i) and not at.controller.read(HOMED, i)
    ]
    if lost:
        raise RefusedError(
            f"axis {', '.join(lost)} is not homed, so its position is not known: hodograph home{then}"
        )


def _require_at(at: RunSession, machine: Machine, place: Nearest, *, unhomed: bool) -> None:
    """Raises RefusedError: the axes are not homed, or not at this place. A straight move there could pass the part."""
    if not unhomed:
        _require_homed(at, machine)
    counts = at.controller.targets(machine.path_count)
    scales = machine.path_counts
    off = [
        one / per - point for one, per, point in zip(counts, scales, place.point_mm, strict=False)
    ]
    distance_mm = math.hypot(*off)
    if distance_mm > machine.start_tolerance_mm:
        raise RefusedError(
            f"the axes stand {number(distance_mm)} mm from the path at line {place.line}, and "
            f"{machine.start_tolerance_mm:g} mm are allowed: {_goto(machine, place)}, then the same command again"
        )


def _goto(machine: Machine, place: Nearest) -> str:
    """What the operator does to move the axes to a place; z is the last one to move."""
    point = [_coordinate(one) for one in place.point_mm]
    down = f", then the same command with --z {point[2]}" if len(point) > SPACE_AXES - 1 else ""
    turned = [
        f"{axis.name} {at}"
        for axis, at in zip(machine.path_axes[SPACE_AXES:], point[SPACE_AXES:], strict=True)
    ]
    along = f", with {', '.join(turned)} (hodograph goto of a path file)" if turned else ""
    return f"lift the tool, hodograph goto {machine.file} --to {point[0]} {point[1]}{down}{along}"


def _coordinate(value: float) -> str:
    """A coordinate to 1 nm: with six digits far from zero it would be another place than that of the path."""
    return f"{round(value, 6) + 0.0:.6f}".rstrip("0").rstrip(".")


def _off_the_path(machine: Machine, found: Nearest) -> str:
    """The refusal of axes that do not stand on the path. They have left it after the last place in the journal: they
    are sent back there, so that no part of it is omitted.
    """
    back = found.passed or found
    return (
        f"the axes stand {number(found.distance_mm)} mm from the path of the job, at line {found.line}, and "
        f"{machine.start_tolerance_mm:g} mm are allowed: {_goto(machine, back)}, then hodograph stream --continue: "
        f"back to line {back.line}, which they have passed"
    )


def _free_rate(machine: Machine, address: BusAddress) -> float | None:
    """Bytes per second that a bus has for chunks; None: it has no bit rate."""
    if not address.is_socketcan or address.channel.startswith("vcan"):
        return None
    free = 1.0 - 0.01 * machine_bus_time(machine).load_percent
    return max(free, 0.01) * machine.bitrate / _FRAME_BITS * _FRAME_BYTES * _USED


class _Progress:
    """Prints the progress of the job from time to time."""

    def __init__(self, every_s: float) -> None:
        self._every_s, self._due_s = every_s, time.monotonic() + every_s

    def __call__(self, now: StreamProgress) -> None:
        if time.monotonic() < self._due_s:
            return
        self._due_s = time.monotonic() + self._every_s
        if now.remaining_s is None:
            left = f"more than {duration_text(now.planned_s)} left"
        else:
            left = f"{duration_text(now.remaining_s)} left"
        note(f"{now.file}:{now.line}: {left}, {now.ahead_s:.1f} s ahead in the controller")


def _print(done: StreamedJob, options: Namespace) -> None:
    if options.json:
        print_json(asdict(done))
        return
    print_rows(
        [
            ("sections", str(done.sections)),
            ("chunks", f"{done.chunks}, {size_text(done.bytes)}"),
            ("motion", f"{duration_text(done.motion_s)} in {duration_text(done.took_s)}"),
            ("rests for want of chunks", str(done.underruns)),
            ("rests of the plan", done.rests.text),
        ]
    )


@dataclass(frozen=True)
class _SimulatedJob:
    """Figures of a job that was planned and simulated.

    motions      the jobs of the controller
    rate         greatest bytes for each second of motion, over 3 s
    """

    motions: tuple[StreamedMotion, ...]
    motion_s: float
    took_s: float
    rate: float
    chunks: int
    bytes: int
    rests: PlanRests

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on in `stream --simulate --json`."""
        return {
            "duration_s": self.motion_s,
            "wall_s": self.took_s,
            "greatest_bytes_per_s": self.rate,
            "chunks": self.chunks,
            "bytes": self.bytes,
            "rests": asdict(self.rests),
            "job": [asdict(one) for one in self.motions],
        }


def _simulate(job: JobFiles, options: Namespace) -> None:
    """All chunks through the controller's core, without a bus."""
    found = _simulated(job, options)
    if options.json:
        print_json(found.summary())
        return
    print_rows(
        [
            ("sections", str(sum(one.sections for one in found.motions))),
            ("chunks", f"{found.chunks}, {size_text(found.bytes)}"),
            (
                "motion",
                f"{duration_text(found.motion_s)}, planned and simulated in {duration_text(found.took_s)}",
            ),
            ("bytes a second", f"{number(found.rate)} at most, over 3 s"),
            ("rests of the plan", found.rests.text),
        ]
    )
    for k, one in enumerate(found.motions, 1):
        many = f" with {one.sections} sections" if one.sections > 1 else ""
        print(f"job {k}{many}: {one.ticks} ticks, setpoints SHA-256 {one.setpoints_sha256}")
        if job.machine.outputs is not None:
            print(f"    outputs SHA-256 {one.outputs_sha256}")


def _simulated(job: JobFiles, options: Namespace) -> _SimulatedJob:
    """Plans and simulates a job; prints the notes of its plan."""
    machine = job.machine
    kernel = options.kernel or machine.kernel
    begin = _begin(job, options)
    place = Place() if begin is None else begin.place
    motions: list[StreamedMotion] = []
    begin_s = time.perf_counter()
    most = largest_chunk(RING_BYTES - BLOCK_HEAD)
    with (
        JobPlan(job, most, 1, place, processes=options.jobs) as plan,
        progress("simulate", "job") as bar,
    ):
        for chunks in plan.by_job():
            first = next(chunks)
            moved = machine.turning if first.program.first_axis else machine
            limits = NativeLimits(**asdict(program_limits(moved)), chunk=1)
            every = chain([first], chunks)
            motions.append(simulate_chunks(every, limits, kernel, moved.path_counts))
            bar(len(motions))
        notes = plan.notes
        found = _SimulatedJob(
            tuple(motions),
            plan.planned_s,
            time.perf_counter() - begin_s,
            plan.greatest_rate(),
            plan.chunks,
            plan.byte_count,
            plan.rests,
        )
    for line in notes:
        note(line)
    return found


COMMANDS = {"stream": stream}
