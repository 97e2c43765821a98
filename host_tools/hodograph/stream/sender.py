# SPDX-License-Identifier: MIT
"""Sends a planned job to the controller: uploads chunks (parts of the job) in order as its ring buffer has room, starts
the motion, executes commands at rest, and waits for the end. Used by cli/stream_command. Reads and writes objects of
the controller by SDO, moves the axes, writes the journal and the recording, and waits by the clock of the bus, real or
virtual.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..bus.capture.bus_recording import BusRecording
from ..bus.goto import goto
from ..bus.run import FULL_OVERRIDE, RunSession
from ..bus.sdo.controller import BOOT, OFF, READY
from ..bus.sdo.follow import Follower
from ..bus.sdo.objects import BUSY, OVERRIDE, RESUME
from ..bus.sdo.stream_channel import (
    ENDED,
    PROGRAM_STOP,
    STOPPED,
    UNDERRUN,
    StreamStatus,
    close_stream,
    send_chunk,
    stream_status,
)
from ..config import Machine
from ..errors import HodographError, PlanError, RefusedError, RunError
from ..fixed_point import nearest_q40
from ..job_outputs import acts_at_rest
from ..job_run import (
    Operator,
    end_outputs,
    execute_at_rest,
    goes_off_at_end,
    operator_stops_of,
    report_messages,
)
from ..native.program import NativeLimits, NativeProgram
from ..pipeline import program_start_counts
from .chunk import Chunk
from .journal import Journal
from .plan import JobPlan, PlannedSection, PlanRests

AHEAD_S = 20.0
"""Most motion that is sent ahead, so that commands act soon."""

_POLL_S = 0.05
"""Time between two readings of the controller's state."""
_PLAN_WAIT_S = 0.05
"""Time that a call waits for the next planned chunk."""
_VIRTUAL_PLAN_WAIT_S = 60.0
"""Longest wait for the planner while virtual time stands still."""
_JOURNAL_S = 1.0
"""Time between two entries of the journal."""
_RECORD_S = 0.5
"""Time between two writes of the recording."""
_UNDERRUN_S = 10.0
"""Least time between two notes about underruns."""
_START_COUNTS = 2
"""Greatest distance of the axes from the start of the job."""
_PASSED_Q40 = 1 << 20
"""A section counts as in motion from this distance after its start on, 2^-20 mm."""
_START_AHEAD_S, _START_WAIT_S = 2.0, 1.0
"""A section starts as soon as this much motion is sent, or this time after its first chunk."""

_LONG_WAIT_S = 1.0
"""Longest wait for the plan to report whether a job is long."""

_IN_TIME = 0.7
"""A chunk is in time if its transfer takes at most this share of the motion that was sent before it."""


class _ResumedError(Exception):
    """A program stop is over."""


@dataclass(frozen=True)
class StreamProgress:
    """Progress of a job.

    ahead_s      motion that the controller has until it would come to rest
    remaining_s  time to the end of the job; None: not all of it is planned yet
    planned_s    planned time to come
    """

    file: Path
    line: int
    section: int
    ahead_s: float
    remaining_s: float | None
    planned_s: float
    underruns: int


@dataclass(frozen=True)
class StreamedJob:
    """Figures of a finished job; `rests`: those of its plan."""

    sections: int
    chunks: int
    bytes: int
    motion_s: float
    took_s: float
    underruns: int
    rests: PlanRests


@dataclass
class Sender:
    """Sends a job.

    progress   called a few times a second while it moves
    recording  recorder of the bus; None: the bus is not recorded
    slow       bytes per second that the bus has for chunks; None: not limited
    override   feed override in per cent with which the job begins
    """

    at: RunSession
    machine: Machine
    plan: JobPlan
    operator: Operator
    journal: Journal | None = None
    progress: Callable[[StreamProgress], None] | None = None
    kernel: str = "fixed"
    unhomed: bool = False
    slow: float | None = None
    recording: BusRecording | None = None
    override: int = FULL_OVERRIDE
    _next: int = 0
    _bytes: int = 0
    _motion_s: float = 0.0
    _underruns: int = 0
    """Of the controller's job; it counts those of each job from 0."""
    _underruns_before: int = 0
    """Of its finished jobs."""
    _journal_s: float = field(default=-1e9)
    _kept_s: float = field(default=-1e9)
    _underrun_s: float = field(default=-1e9)
    _percent: int = field(init=False)
    """The feed override to which the job was lowered."""
    _operators_percent: int = field(init=False)
    """The feed override before that."""
    _sending_s: float = 0.0
    """Time that the transfers of `_bytes` took."""
    _job_number: int | None = None
    """Of the chunk sent last."""
    _done_s: float = 0.0
    """Motion of finished jobs of the controller."""
    _ahead: deque[PlannedSection] = field(default_factory=deque)
    _outputs_stay: bool = False
    """Whether the outputs stay on at the end of the controller's job, on a machine whose outputs go off there: another
    one may follow, or commands at rest.
    """
    _noted: int = -1
    """The section in the journal."""
    _given_notes: int = 0
    """Number of notes of the plan that were given to the user."""
    _unplanned: HodographError | None = None
    """The error that ended the planning. What was sent before it is still executed."""

    def __post_init__(self) -> None:
        self._percent = self._greatest_percent
        self._operators_percent = self.override

    @property
    def _greatest_percent(self) -> int:
        """The feed override that the bus has to carry, unless it is lowered: an operator may raise it to 100 %."""
        return max(FULL_OVERRIDE, self.override)

    def run(self) -> StreamedJob:
        """Sends the whole job and returns at its end; within `ending_at_stops` of the controller. Raises RefusedError,
        BusError, RunError, and errors of planning once the motion has come to rest. Any exception first stops the axes
        on their path, unless nothing was started.
        """
        try:
            done = self._run()
        except BaseException as error:
            self.at.controller.stop_after(error)
            with suppress(HodographError):
                self._give_back_override()
            raise
        self._give_back_override()
        return done

    def _run(self) -> StreamedJob:
        begun_s = self.at.controller.clock.now_s()
        close_stream(self.at.controller)
        item = self._wait_item()
        while item is not None:
            self._job(item[0], item[1])
            item = self._wait_item()
        self.pass_notes()
        if self._ahead or acts_at_rest(self.plan.after):
            execute_at_rest(self.at, self.plan.last_file, self.plan.after, self.operator)
        else:
            self.at.note("nothing of the job is left")
        end_outputs(self.at, self.machine)
        if self.journal is not None:
            self.journal.update(done=True)
        took_s = self.at.controller.clock.now_s() - begun_s
        return StreamedJob(
            self.plan.section_count,
            self._next,
            self._bytes,
            self._motion_s,
            took_s,
            self._underruns_before + self._underruns,
            self.plan.rests,
        )

    def _wait_item(self) -> tuple[PlannedSection, Chunk, float] | None:
        """Waits for the next chunk to be planned; None: the job has no more."""
        while True:
            try:
                item = self.plan.item(self._next, _PLAN_WAIT_S)
            except IndexError:
                return None
            if item is not None:
                return item
            self._check_bus()
            if self.plan.reads_input:  # which may come after hours; a file is planned at once
                self.at.controller.require_no_stop()

    def _planned(self) -> tuple[PlannedSection, Chunk, float] | None:
        """The next chunk; None: it is not planned yet. Virtual time stands still while the planner works, so that the
        frames on the bus depend on the job alone. It does not stand still for standard input, which may come at any
        time.
        """
        stands_still = self.at.controller.clock.is_virtual and not self.plan.reads_input
        return self.plan.item(self._next, _VIRTUAL_PLAN_WAIT_S if stands_still else 0.0)

    def pass_notes(self) -> None:
        """Gives the user the notes of the plan that have come since the last call."""
        while self._given_notes < len(self.plan.notes):
            self.at.note(self.plan.notes[self._given_notes])
            self._given_notes += 1

    def _check_bus(self) -> None:
        """Raises RunError or BusError for an error on the bus since the last call; keeps recorded frames, and gives
        notes.
        """
        self.pass_notes()
        if self.at.rig is not None:
            self.at.rig.check()
        now_s = self.at.controller.clock.now_s()
        if self.recording is not None and now_s - self._kept_s >= _RECORD_S:
            self._kept_s = now_s
            self.recording.keep()

    def _job(self, section: PlannedSection, chunk: Chunk) -> None:
        """Sends sections that the controller runs as one job, beginning with this one."""
        self.pass_notes()  # before a wait for the operator, and before the motion
        if section.file_end is not None:
            execute_at_rest(
                self.at, section.file_end.file, section.file_end.commands, self.operator
            )
        self._to_start(section, chunk)
        execute_at_rest(self.at, section.file, section.before, self.operator)
        self._to_start(section, chunk)
        self._note_begin(section, chunk)
        close_stream(self.at.controller)
        self._stream(chunk.header.job)

    def _note_begin(self, section: PlannedSection, chunk: Chunk) -> None:
        """Writes the place where a job of the controller begins to the journal."""
        begin_q40 = chunk.header.job_start_q40
        self._ahead = deque([section])
        self._note_place(first=section.number, arc_q40=begin_q40, committed_q40=begin_q40)

    @property
    def _section(self) -> PlannedSection:
        """The section in motion."""
        return self._ahead[0]

    def _note_place(self, *coming: PlannedSection, **changes: int) -> None:
        """Writes the place of the job to the journal; `coming`: a section whose first chunk is sent next."""
        if self.journal is not None:
            section = self._section.number
            starts = tuple((one.number, one.start_q40) for one in (*self._ahead, *coming))
            if section != self._noted:  # the arc length in the journal is that in another section
                self._noted = section
                changes.setdefault("arc_q40", 0)
            self.journal.update(section=section, starts=starts, **changes)

    def _to_start(self, section: PlannedSection, chunk: Chunk) -> None:
        """Moves the axes to the start of a section, unless they stand there."""
        program = NativeProgram(chunk.image)
        fault = program.check(NativeLimits(chunk=1))
        if fault is not None:
            raise PlanError(f"the first chunk is not a program: {fault.text} (code {fault.code})")
        start = program_start_counts(program, self.machine, self.kernel, section.standing_mm)
        off = np.abs(np.subtract(self.at.controller.targets(len(start)), start)).max()
        if off > _START_COUNTS:
            # Before the move: if this process is killed during it, the axes end at this start, not at the last job.
            self._note_begin(section, chunk)
            close_stream(self.at.controller)
            goto(self.at.controller, self.machine, start, unhomed=self.unhomed)

    def _stream(self, job: int) -> None:
        """Sends the chunks of the job of this number and waits for its end."""
        controller = self.at.controller
        follower = Follower(controller, self.at.note)
        self._underruns_before, self._underruns = self._underruns_before + self._underruns, 0
        started = all_sent = False
        sent, first_s, self._done_s = 0, 0.0, self._motion_s
        while True:
            self._check_bus()
            status = stream_status(controller) if sent else None
            if status is not None and status.job != job:
                raise self._lost()
            if started and status is not None:
                self._pass_sections(status)
                self._report(status)
                if self._over(status, all_sent=all_sent):
                    return
                if status.state == PROGRAM_STOP:
                    self._at_program_stop()
                follower()
            last = None
            more = not all_sent and self._unplanned is None
            if more and (status is None or status.committed_s < AHEAD_S):
                last = self._send_one(status)
            if last is not None:
                sent, all_sent = sent + 1, last
                first_s = first_s or controller.clock.now_s()
            else:
                controller.clock.sleep(_POLL_S)
            if self._unplanned is not None and not started:
                raise self._unplanned
            if not started and sent and (all_sent or self._may_start(first_s)):
                self._slow_down()
                self._outputs_stay = goes_off_at_end(self.machine)
                controller.start(
                    unhomed=self.unhomed, job=self._job_number, outputs_stay=self._outputs_stay
                )
                started = True
            elif started and all_sent and self._outputs_stay and self._is_last():
                self._outputs_stay = False
                controller.let_outputs_end()

    def _is_last(self) -> bool:
        """Whether nothing follows what was sent. Then the controller ends the job, also if this process is killed."""
        try:
            self._planned()
        except IndexError:
            return not acts_at_rest(self.plan.after)
        except HodographError:
            pass
        return False

    def _may_start(self, first_s: float) -> bool:
        """Whether the motion may start: enough is sent, or the first chunk has waited long enough, or waiting is
        useless.
        """
        waited_s = self.at.controller.clock.now_s() - first_s
        return (
            waited_s > _START_WAIT_S
            or self._need_not_wait()
            or stream_status(self.at.controller).committed_s > _START_AHEAD_S
        )

    def _need_not_wait(self) -> bool:
        """Whether the motion need not wait for the next chunk: at the rate of the transfers so far, the chunk comes
        before the motion leaves the last joint. If the bus carries fewer bytes than the job needs and the feed override
        is not lowered, the motion comes to rest at tails anyway. Then it waits only for a job so short that all of it
        may be sent before.
        """
        try:
            item = self._planned()
        except HodographError:
            return False
        if item is None:
            return False
        _, chunk, new_s = item
        sent_s = self._motion_s - self._done_s
        transfer_s = chunk.size * self._sending_s / self._bytes
        if transfer_s < _IN_TIME * sent_s or self.slow is not None or transfer_s <= new_s:
            return transfer_s < _IN_TIME * sent_s
        return self.plan.is_longer(self._done_s + _START_AHEAD_S, _LONG_WAIT_S)

    def _pass_sections(self, status: StreamStatus) -> None:
        """Drops the sections that are over, and prints the messages before the one in motion."""
        arc_q40 = nearest_q40(status.arc_length_mm)
        while len(self._ahead) > 1 and arc_q40 > self._ahead[1].start_q40 + _PASSED_Q40:
            self._ahead.popleft()
            section = self._section
            report_messages(self.at, section.file, section.before)
            for line, code in () if self.plan.stops else operator_stops_of(section.before):
                self.at.note(f"{section.file}:{line}: {code}: passed without waiting (--no-stops)")

    def _at_program_stop(self) -> None:
        """Waits for the operator, then resumes. Returns also when another client has resumed or stopped."""
        controller = self.at.controller
        section = self._ahead[1] if len(self._ahead) > 1 else self._section

        def check() -> None:
            self._check_bus()
            controller.clock.sleep(_POLL_S)
            if stream_status(controller).state != PROGRAM_STOP:
                raise _ResumedError

        with suppress(_ResumedError):
            for line, code in operator_stops_of(section.before):
                self.operator(f"{section.file}:{line}: {code}", check)
            controller.command(RESUME)

    def _send_one(self, status: StreamStatus | None) -> bool | None:
        """Sends the next chunk. Returns whether it is the last one of the job; None: it is not planned yet, or the ring
        has no room.
        """
        try:
            item = self._planned()
        except HodographError as error:
            self._unplanned = error
            return None
        if item is None:
            return None
        section, chunk, new_s = item
        after_s = self.plan.after_s(self._next)
        header = chunk.header
        data = chunk.with_remaining(None if after_s is None else after_s + new_s).encode()
        if status is not None and status.free_bytes < len(data):
            return None
        place = f"{section.file}:{header.line}"
        begun_s = self.at.controller.clock.now_s()
        # Before the transfer: if this process is killed during it, the motion may reach the end of the chunk.
        coming = () if header.rest is None else (section,)
        committed_q40 = header.job_start_q40 + chunk.program.length_q40
        self._note_place(*coming, committed_q40=committed_q40)
        try:
            if not send_chunk(self.at.controller, data, header.job, header.sequence, place):
                return None
        except RefusedError:
            self._require_job(header.job, first=status is None)
            raise
        self._sending_s += self.at.controller.clock.now_s() - begun_s
        self._job_number = header.job
        self._next += 1
        self._bytes += len(data)
        self._motion_s += new_s
        if header.rest is not None:
            self._ahead.append(section)
        return header.last

    def _require_job(self, job: int, *, first: bool) -> None:
        """Raises RunError if a chunk was refused because this job is over in the controller. `first`: the chunk would
        have opened the job.
        """
        status = stream_status(self.at.controller)
        if status.job == job and status.state == STOPPED:  # since it was read last
            self._over(status, all_sent=False)
        if (status.job != job and not first) or self.at.controller.state() in (BOOT, OFF):
            raise self._lost() from None

    def _lost(self) -> RunError:
        return RunError(
            f"{self.at.controller.who()} no longer has the job: it has restarted (the drives have stopped by "
            "themselves), or another command has closed the job: hodograph status, hodograph home if axes are homed, "
            "then hodograph stream --continue"
        )

    def _slow_down(self) -> None:
        """Lowers the feed override if the bus carries fewer bytes than the job needs."""
        if self.slow is None:
            return
        needed = self.plan.greatest_rate()
        if needed * 0.01 * self._percent <= self.slow:
            return
        percent = max(int(100.0 * self.slow / needed), 1)
        present = self.at.controller.read(OVERRIDE, 1)
        if present <= percent:
            return  # the operator has lowered it further
        if present != self._percent:
            self._operators_percent = present
        self._percent = percent
        self.at.controller.override(percent)
        self.at.note(
            f"the job needs up to {needed / 1000.0:.1f} kB/s and the bus has {self.slow / 1000.0:.1f} for it: "
            f"feed override set to {percent} %"
        )

    def _give_back_override(self) -> None:
        """Takes the lowered feed override back at standstill, unless another command has changed it since: it would
        apply to later programs.
        """
        controller = self.at.controller
        if self._percent >= self._greatest_percent or controller.state() in BUSY:
            return
        if controller.read(OVERRIDE, 1) == self._percent:
            controller.override(self._operators_percent)
            self.at.note(f"feed override set to {self._operators_percent} % again")

    def _report(self, status: StreamStatus) -> None:
        section = self._section
        now_s = self.at.controller.clock.now_s()
        if self.journal is not None and now_s - self._journal_s >= _JOURNAL_S:
            self._journal_s = now_s
            self._note_place(arc_q40=nearest_q40(status.arc_length_mm) - section.start_q40)
        self._note_underruns(status, now_s)
        self._slow_down()
        if self.progress is not None:
            after_s = self.plan.after_s(self._next - 1)
            to_come_s = self.plan.planned_s - self._motion_s + status.committed_s
            self.progress(
                StreamProgress(
                    section.file,
                    status.line,
                    section.number,
                    status.committed_s,
                    None if after_s is None else after_s + status.committed_s,
                    to_come_s,
                    status.underruns,
                )
            )

    def _note_underruns(self, status: StreamStatus, now_s: float) -> None:
        """Notes underruns, at most once in _UNDERRUN_S: on a slow bus each chunk may have one."""
        if status.underruns <= self._underruns or self._unplanned is not None:
            return
        self._underruns = status.underruns
        if now_s - self._underrun_s < _UNDERRUN_S:
            return
        self._underrun_s = now_s
        times = "once" if status.underruns == 1 else f"{status.underruns} times so far"
        self.at.note(
            f"{self._section.file}:{status.line}: the next part came too late: the motion rested on the path ({times}) "
            "and goes on"
        )

    def _over(self, status: StreamStatus, *, all_sent: bool) -> bool:
        """Whether the job has ended. Raises RunError: it was stopped, or there is a fault."""
        controller = self.at.controller
        if status.state == UNDERRUN and self._unplanned is not None:
            raise self._unplanned
        if status.state == ENDED and all_sent:
            controller.wait_for_end(10.0)
            return True
        if status.state == STOPPED:  # after a quick stop the drives are off
            controller.wait_for((READY, OFF, BOOT), 10.0)
            raise RunError(
                f"{self._section.file}:{status.line}: stopped before its end: the job ends here; "
                "hodograph stream --continue goes on"
            )
        controller.wait_for((*BUSY, READY, OFF, BOOT), 0.0)  # drives off: see the next status
        return False
