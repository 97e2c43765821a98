# SPDX-License-Identifier: MIT
"""Streams a planned job to the controller: chunks in order as there is room, start, what happens at rest, the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..bus.goto import goto
from ..bus.run import RunSession
from ..bus.sdo.controller import READY
from ..bus.sdo.follow import Follower
from ..bus.sdo.objects import MOVING
from ..bus.sdo.stream_channel import (
    ENDED,
    STOPPED,
    StreamStatus,
    close_stream,
    send_chunk,
    stream_status,
)
from ..config import Machine
from ..errors import RunError
from ..job_run import Operator, at_rest
from ..native import NativeProgram
from .chunk import Chunk
from .journal import Journal
from .plan import JobPlan, PlannedSection

AHEAD_S = 20.0
"""So much motion is sent ahead at most, so that a command acts on little that is already underway."""

_POLL_S = 0.05
_PLAN_WAIT_S = 0.05
_JOURNAL_S = 1.0
_START_COUNTS = 2
_START_AHEAD_S, _START_WAIT_S = 2.0, 1.0
"""A section starts when so much motion is sent, or so long after its first chunk."""


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
    """A job that came to its end."""

    sections: int
    chunks: int
    bytes: int
    motion_s: float
    took_s: float
    underruns: int


@dataclass
class Sender:
    """Sends a job. `progress` is called a few times a second while it moves.

    slow  bytes a second that the bus has for chunks; None: as many as it takes
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
    _next: int = 0
    _bytes: int = 0
    _motion_s: float = 0.0
    _underruns: int = 0
    _journal_s: float = field(default=-1e9)
    _percent: int = 100

    def run(self) -> StreamedJob:
        """Raises RefusedError, BusError, RunError, and what planning raises, when the motion rests."""
        begun_s = self.at.controller.clock.now_s()
        close_stream(self.at.controller)
        sections = 0
        item = self._wait_item()
        while item is not None:
            section = item[0]
            self._section(section, item[1])
            sections += 1
            item = self._wait_item()
        at_rest(self.at, self._file_of_last(), self.plan.after, self.operator)
        if self.journal is not None:
            self.journal.update(done=True)
        took_s = self.at.controller.clock.now_s() - begun_s
        return StreamedJob(
            sections, self._next, self._bytes, self._motion_s, took_s, self._underruns
        )

    def _file_of_last(self) -> Path:
        return self.plan.sections[-1].file

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

    def _look(self) -> None:
        """Raises what has gone wrong on the bus meanwhile."""
        if self.at.rig is not None:
            self.at.rig.check()

    def _section(self, section: PlannedSection, chunk: Chunk) -> None:
        self._to_start(chunk)
        at_rest(self.at, section.file, section.before, self.operator)
        self._to_start(chunk)
        if self.journal is not None:
            header = chunk.header
            self.journal.update(
                section=section.number,
                way_q40=header.job_start_q40,
                committed_q40=header.job_start_q40,
            )
        close_stream(self.at.controller)
        self._stream(section)

    def _to_start(self, chunk: Chunk) -> None:
        """Moves the axes to where a section begins, unless they stand there."""
        _, points = NativeProgram(chunk.image).setpoints(
            self.kernel, self.machine.counts_per_mm, 0, 1
        )
        start: list[int] = points[0].tolist()
        off = np.abs(np.subtract(self.at.controller.targets(len(start)), start)).max()
        if off > _START_COUNTS:
            close_stream(self.at.controller)
            goto(self.at.controller, self.machine, start, unhomed=self.unhomed)

    def _stream(self, section: PlannedSection) -> None:
        """Sends the chunks of a section and waits for its end."""
        controller = self.at.controller
        follower = Follower(controller, self.at.note)
        started = all_sent = False
        sent, first_s = 0, 0.0
        while True:
            self._look()
            status = stream_status(controller) if sent else None
            if started and status is not None:
                self._report(section, status)
                if self._over(section, status, all_sent=all_sent):
                    return
                follower()
            last = None
            if not all_sent and (status is None or status.committed_s < AHEAD_S):
                last = self._send_one(section, status)
            if last is not None:
                sent, all_sent = sent + 1, last
                first_s = first_s or controller.clock.now_s()
            else:
                controller.clock.sleep(_POLL_S)
            if not started and sent and (all_sent or self._may_start(first_s)):
                self._slow_down()
                controller.start(unhomed=self.unhomed)
                started = True

    def _may_start(self, first_s: float) -> bool:
        """Whether enough is sent, or the first chunk has waited for long enough."""
        waited_s = self.at.controller.clock.now_s() - first_s
        return (
            waited_s > _START_WAIT_S
            or stream_status(self.at.controller).committed_s > _START_AHEAD_S
        )

    def _send_one(self, section: PlannedSection, status: StreamStatus | None) -> bool | None:
        """Sends the next chunk, if it is planned and there is room: whether it is the last one of the section."""
        item = self.plan.item(self._next, 0.0)
        if item is None:
            return None
        _, chunk, new_s = item
        behind_s = self.plan.behind_s(self._next)
        header = chunk.header
        data = chunk.with_remaining(None if behind_s is None else behind_s + new_s).encode()
        if status is not None and status.free_bytes < len(data):
            return None
        place = f"{section.file}:{header.line}"
        if not send_chunk(self.at.controller, data, header.job, header.sequence, place):
            return None
        self._next += 1
        self._bytes += len(data)
        self._motion_s += new_s
        if self.journal is not None:
            self.journal.update(committed_q40=header.job_start_q40 + chunk.program.length_q40)
        return header.last

    def _slow_down(self) -> None:
        """Lowers the feed override where the bus has not the bytes that the job needs."""
        needed = self.plan.greatest_rate()
        if self.slow is None or needed * 0.01 * self._percent <= self.slow:
            return
        percent = max(int(100.0 * self.slow / needed), 1)
        self._percent = percent
        self.at.controller.override(percent)
        self.at.note(
            f"the job needs up to {needed / 1000.0:.1f} kB/s and the bus has {self.slow / 1000.0:.1f} for it: "
            f"feed override set to {percent} %"
        )

    def _report(self, section: PlannedSection, status: StreamStatus) -> None:
        now_s = self.at.controller.clock.now_s()
        if self.journal is not None and now_s - self._journal_s >= _JOURNAL_S:
            self._journal_s = now_s
            self.journal.update(way_q40=round(status.way_mm * 2**40))
        if status.underruns > self._underruns:
            self._underruns = status.underruns
            self.at.note(
                f"{section.file}:{status.line}: the next part came too late: the motion rested on the path and goes on"
            )
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

    def _over(self, section: PlannedSection, status: StreamStatus, *, all_sent: bool) -> bool:
        """Whether the section came to its end. Raises RunError: it was stopped, or there is a fault."""
        controller = self.at.controller
        if status.state == ENDED and all_sent:
            controller.wait_for((READY,), 10.0)
            return True
        if status.state == STOPPED:
            controller.wait_for((READY,), 10.0)
            raise RunError(
                f"{section.file}:{status.line}: stopped before its end: the job ends here; "
                "hodograph stream --continue goes on"
            )
        controller.wait_for((*MOVING, READY), 0.0)
        return False
