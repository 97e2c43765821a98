# SPDX-License-Identifier: MIT
"""Streams a planned job to the controller: chunks in order as there is room, start, what happens at rest, the end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..bus.capture.bus_recording import BusRecording
from ..bus.goto import goto
from ..bus.run import RunSession
from ..bus.sdo.controller import READY
from ..bus.sdo.follow import Follower
from ..bus.sdo.objects import MOVING, RESUME
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
from ..bus.signals import interrupts_ignored
from ..config import Machine
from ..errors import HodographError, RunError
from ..fixed_point import nearest_q40
from ..job_run import Operator, execute_at_rest, operator_stops_of, report_messages
from ..native.program import NativeLimits, NativeProgram
from ..pipeline import program_start_counts
from .chunk import Chunk
from .journal import Journal
from .plan import JobPlan, PlannedSection, PlanRests

AHEAD_S = 20.0
"""So much motion is sent ahead at most, so that a command acts on little that is already underway."""

_POLL_S = 0.05
_PLAN_WAIT_S = 0.05
_VIRTUAL_PLAN_WAIT_S = 60.0
"""Longest wait for the planner while virtual time stands still."""
_JOURNAL_S = 1.0
_RECORD_S = 0.5
_UNDERRUN_S = 10.0
_START_COUNTS = 2
_PASSED_Q40 = 1 << 20
"""A section is in motion when the arc length is so far behind its start, 2^-20 mm."""
_START_AHEAD_S, _START_WAIT_S = 2.0, 1.0
"""A section starts at the latest when so much motion is sent, or so long after its first chunk."""

_LONG_WAIT_S = 1.0
"""For the plan, which knows how long a job is."""

_IN_TIME = 0.7
"""A chunk comes in time if its transfer takes this share of the motion that was sent before it."""


class _GoesOnError(Exception):
    """A program stop is over."""


@dataclass(frozen=True)
class StreamProgress:
    """Where a job is.

    ahead_s      motion that the controller has before it would rest
    remaining_s  to the end of the job; None: not all of it is planned yet, and `planned_s` of it is to come at least
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
    """A job that came to its end; `rests`: those of its plan."""

    sections: int
    chunks: int
    bytes: int
    motion_s: float
    took_s: float
    underruns: int
    rests: PlanRests


@dataclass
class Sender:
    """Sends a job. `progress` is called a few times a second while it moves.

    recording  what records the bus meanwhile
    slow       bytes a second that the bus has for chunks; None: as many as it takes
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
    _next: int = 0
    _bytes: int = 0
    _motion_s: float = 0.0
    _underruns: int = 0
    _journal_s: float = field(default=-1e9)
    _kept_s: float = field(default=-1e9)
    _underrun_s: float = field(default=-1e9)
    _percent: int = 100
    _sending_s: float = 0.0
    """What the transfers of _bytes took."""
    _done_s: float = 0.0
    """Motion of jobs that are over."""
    _ahead: deque[PlannedSection] = field(default_factory=deque)
    _unplanned: HodographError | None = None
    """Why the job cannot be planned on. What was sent is still carried out."""

    def run(self) -> StreamedJob:
        """Raises RefusedError, BusError, RunError, and what planning raises, when the motion rests.

        Whatever ends it early stops the axes on their path at once; nothing is waited for before.
        """
        try:
            return self._run()
        except BaseException:
            with interrupts_ignored(), suppress(HodographError):
                self.at.controller.stop_and_wait()
            raise

    def _run(self) -> StreamedJob:
        begun_s = self.at.controller.clock.now_s()
        close_stream(self.at.controller)
        item = self._wait_item()
        while item is not None:
            self._job(item[0], item[1])
            item = self._wait_item()
        if self._ahead:
            execute_at_rest(self.at, self._ahead[-1].file, self.plan.after, self.operator)
        else:
            self.at.note("nothing of the job is left")
        if self.journal is not None:
            self.journal.update(done=True)
        took_s = self.at.controller.clock.now_s() - begun_s
        return StreamedJob(
            self.plan.section_count,
            self._next,
            self._bytes,
            self._motion_s,
            took_s,
            self._underruns,
            self.plan.rests,
        )

    def _wait_item(self) -> tuple[PlannedSection, Chunk, float] | None:
        """The next chunk, as soon as it is planned; None: there is no more."""
        while True:
            try:
                item = self.plan.item(self._next, _PLAN_WAIT_S)
            except IndexError:
                return None
            if item is not None:
                return item
            self._look()

    def _planned(self) -> tuple[PlannedSection, Chunk, float] | None:
        """The next chunk, if it is planned by now. Virtual time stands still for the planner, so that the frames on the
        bus follow from the job alone; not for standard input, which may come at any time.
        """
        stands_still = self.at.controller.clock.is_virtual and not self.plan.reads_input
        return self.plan.item(self._next, _VIRTUAL_PLAN_WAIT_S if stands_still else 0.0)

    def _look(self) -> None:
        """Raises what has gone wrong on the bus meanwhile."""
        if self.at.rig is not None:
            self.at.rig.check()
        now_s = self.at.controller.clock.now_s()
        if self.recording is not None and now_s - self._kept_s >= _RECORD_S:
            self._kept_s = now_s
            self.recording.keep()

    def _job(self, section: PlannedSection, chunk: Chunk) -> None:
        """Sections that the controller runs as one job, from the one that begins with this chunk."""
        self._to_start(section, chunk)
        execute_at_rest(self.at, section.file, section.before, self.operator)
        self._to_start(section, chunk)
        begin_q40 = chunk.header.job_start_q40
        self._ahead = deque([section])
        self._note_place(first=section.number, arc_q40=begin_q40, committed_q40=begin_q40)
        close_stream(self.at.controller)
        self._stream()

    @property
    def _section(self) -> PlannedSection:
        """The one in motion."""
        return self._ahead[0]

    def _note_place(self, *coming: PlannedSection, **changes: int) -> None:
        """Writes to the journal where the job is; `coming`: a section whose first chunk is sent next."""
        if self.journal is not None:
            starts = tuple((one.number, one.start_q40) for one in (*self._ahead, *coming))
            self.journal.update(section=self._section.number, starts=starts, **changes)

    def _to_start(self, section: PlannedSection, chunk: Chunk) -> None:
        """Moves the axes to where a section begins, unless they stand there."""
        program = NativeProgram(chunk.image)
        program.check(NativeLimits(chunk=1))
        start = program_start_counts(program, self.machine, self.kernel, section.standing_mm)
        off = np.abs(np.subtract(self.at.controller.targets(len(start)), start)).max()
        if off > _START_COUNTS:
            close_stream(self.at.controller)
            goto(self.at.controller, self.machine, start, unhomed=self.unhomed)

    def _stream(self) -> None:
        """Sends the chunks of a job and waits for its end."""
        controller = self.at.controller
        follower = Follower(controller, self.at.note)
        started = all_sent = False
        sent, first_s, self._done_s = 0, 0.0, self._motion_s
        while True:
            self._look()
            status = stream_status(controller) if sent else None
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
                controller.start(unhomed=self.unhomed)
                started = True

    def _may_start(self, first_s: float) -> bool:
        """Whether enough is sent, or the first chunk has waited for long enough, or waiting is of no use."""
        waited_s = self.at.controller.clock.now_s() - first_s
        return (
            waited_s > _START_WAIT_S
            or self._need_not_wait()
            or stream_status(self.at.controller).committed_s > _START_AHEAD_S
        )

    def _need_not_wait(self) -> bool:
        """Whether the next chunk comes before the motion leaves the last joint, at the rate of the transfers so far.
        Where a bus whose feed override is not lowered carries less than a job needs, the motion rests at tails anyway:
        it need not wait either, but for a job that is over so soon that it may be sent as a whole before.
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
        """Goes on to the section in motion, and says what is to be said before it."""
        arc_q40 = nearest_q40(status.arc_length_mm)
        while len(self._ahead) > 1 and arc_q40 > self._ahead[1].start_q40 + _PASSED_Q40:
            self._ahead.popleft()
            section = self._section
            report_messages(self.at, section.file, section.before)
            for line, code in () if self.plan.stops else operator_stops_of(section.before):
                self.at.note(f"{section.file}:{line}: {code}: passed without waiting (--no-stops)")

    def _at_program_stop(self) -> None:
        """Waits for the operator and resumes; returns as well when somebody else has resumed or stopped."""
        controller = self.at.controller
        section = self._ahead[1] if len(self._ahead) > 1 else self._section

        def look() -> None:
            self._look()
            controller.clock.sleep(_POLL_S)
            if stream_status(controller).state != PROGRAM_STOP:
                raise _GoesOnError

        with suppress(_GoesOnError):
            for line, code in operator_stops_of(section.before):
                self.operator(f"{section.file}:{line}: {code}", look)
            controller.command(RESUME)

    def _send_one(self, status: StreamStatus | None) -> bool | None:
        """Sends the next chunk, if it is planned and there is room: whether it is the last one of the job."""
        try:
            item = self._planned()
        except HodographError as error:
            self._unplanned = error
            return None
        if item is None:
            return None
        section, chunk, new_s = item
        behind_s = self.plan.behind_s(self._next)
        header = chunk.header
        data = chunk.with_remaining(None if behind_s is None else behind_s + new_s).encode()
        if status is not None and status.free_bytes < len(data):
            return None
        place = f"{section.file}:{header.line}"
        if header.rest is not None:
            # Before the transfer: if this process is killed then, the motion may already be there.
            self._note_place(section)
        begun_s = self.at.controller.clock.now_s()
        if not send_chunk(self.at.controller, data, header.job, header.sequence, place):
            return None
        self._sending_s += self.at.controller.clock.now_s() - begun_s
        self._next += 1
        self._bytes += len(data)
        self._motion_s += new_s
        if header.rest is not None:
            self._ahead.append(section)
        self._note_place(committed_q40=header.job_start_q40 + chunk.program.length_q40)
        return header.last

    def _slow_down(self) -> None:
        """Lowers the feed override where the bus has not the bytes that the job needs."""
        if self.slow is None:
            return
        needed = self.plan.greatest_rate()
        if needed * 0.01 * self._percent <= self.slow:
            return
        percent = max(int(100.0 * self.slow / needed), 1)
        self._percent = percent
        self.at.controller.override(percent)
        self.at.note(
            f"the job needs up to {needed / 1000.0:.1f} kB/s and the bus has {self.slow / 1000.0:.1f} for it: "
            f"feed override set to {percent} %"
        )

    def _report(self, status: StreamStatus) -> None:
        section = self._section
        now_s = self.at.controller.clock.now_s()
        if self.journal is not None and now_s - self._journal_s >= _JOURNAL_S:
            self._journal_s = now_s
            self._note_place(arc_q40=nearest_q40(status.arc_length_mm) - section.start_q40)
        self._note_underruns(status, now_s)
        self._slow_down()
        if self.progress is not None:
            behind_s = self.plan.behind_s(self._next - 1)
            to_come_s = self.plan.planned_s - self._motion_s + status.committed_s
            self.progress(
                StreamProgress(
                    section.file,
                    status.line,
                    section.number,
                    status.committed_s,
                    None if behind_s is None else behind_s + status.committed_s,
                    to_come_s,
                    status.underruns,
                )
            )

    def _note_underruns(self, status: StreamStatus, now_s: float) -> None:
        """Says that the motion rested for want of chunks, now and then: a slow bus may make it rest at each."""
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
        """Whether the job came to its end. Raises RunError: it was stopped, or there is a fault."""
        controller = self.at.controller
        if status.state == UNDERRUN and self._unplanned is not None:
            raise self._unplanned
        if status.state == ENDED and all_sent:
            controller.wait_for((READY,), 10.0)
            return True
        if status.state == STOPPED:
            controller.wait_for((READY,), 10.0)
            raise RunError(
                f"{self._section.file}:{status.line}: stopped before its end: the job ends here; "
                "hodograph stream --continue goes on"
            )
        controller.wait_for((*MOVING, READY), 0.0)
        return False
