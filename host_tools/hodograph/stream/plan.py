# SPDX-License-Identifier: MIT
"""The plan of a job: a thread makes its chunks (parts) ahead of the sender and keeps them on the disk, not in memory.
Used by cli/stream_command, resuming.py and sender.py. Reads the files of the job. Starts a thread and, for each
toolpath file, a process that reads it.
"""

from __future__ import annotations

import threading
from array import array
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from math import ceil
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..config import Machine, load_paths
from ..errors import InputError, PlanError, RunError, SectionPlanError
from ..events import Events, OutputValues, SwitchedOutputs, events_after, no_events
from ..fixed_point import MM_PER_Q40
from ..job_outputs import acts_at_rest
from ..names import STANDARD_INPUT, is_toolpath
from ..toolpath.files import ReadOptions
from ..toolpath.moves import Command, Dwell, ProgramStop, SwitchedAtRest, ToolChange
from .chunk import Chunk, Rest, parse
from .chunks import JobPlace, SectionChunks
from .geometry import begun_with, blocks_from, switching
from .journal import mark
from .paths import PathsJob
from .reading import StreamReader, StreamSection
from .reading_process import ParallelReader
from .store import PART_BYTES, RESERVE_BYTES, ChunkStore

PROCESSES = 2
"""Processes that plan a job: one reads and fits, the other plans."""

_MEETS_MM = 1e-6
"""A section that begins this near to the end of the one before continues the same job of the controller."""
_RATE_S, _FOR_EVER_S = 3.0, 1e6
_INPUT_WAIT_S = 1.0
"""Wait for the end of a planner that may be reading standard input, which nothing interrupts. It ends with the
process.
"""
MOST_WAITING_BYTES, _MOST_WAITING = 512 << 20, 100_000
"""Bytes and number of planned chunks at which planning pauses. Each waiting chunk keeps its section in memory."""


@dataclass(frozen=True)
class JobFiles:
    """What is streamed, and how it is read. Files are absolute paths, or "-"."""

    files: tuple[Path, ...]
    machine: Machine
    tolerance_mm: float
    reading: ReadOptions


@dataclass(frozen=True)
class Place:
    """A place in a job: section, counted from 0 over all files, and arc length in it in 2^-40 mm."""

    section: int = 0
    arc_q40: int = 0


@dataclass(frozen=True)
class PlanRests:
    """Rests of the axes that no command programs: no chunk in motion fits there, or no feed was found.

    first  file and line of the first one, "part.ngc:12"; None: there is none
    """

    count: int = 0
    first: str | None = None

    def plus(self, file: Path, line: int) -> PlanRests:
        """These and another one."""
        return PlanRests(self.count + 1, self.first or f"{file}:{line}")

    @property
    def text(self) -> str:
        """Number and first place, for the user."""
        return str(self.count) if self.first is None else f"{self.count}, the first at {self.first}"


@dataclass(frozen=True)
class FileEnd:
    """Commands at rest at the end of a file that is followed by another one."""

    file: Path
    commands: tuple[Command, ...]


@dataclass(frozen=True, eq=False)
class PlannedSection:
    """A section of the plan.

    number       in the job, over all files
    before       commands at rest before it
    file_end     of the file before: the axes stand there before they move to this section
    start_q40    arc length of the controller's job at its start
    rest         what the controller does at rest before it; None: a job of the controller begins with it
    standing_mm  positions of the axes before those of its programs, without the work offset
    """

    number: int
    file: Path
    first_line: int
    before: tuple[Command, ...]
    start_q40: int = 0
    rest: Rest | None = None
    standing_mm: tuple[float, ...] = ()
    file_end: FileEnd | None = None


class _EndedError(Exception):
    """The plan is closed while it is being made."""


class JobPlan:
    """Chunks of a job in order, planned ahead of those who read them. A context manager: its end ends the planning.

    Chunks wait on the disk. Planning pauses while much waits, or while the disk has no room.

    notes          of reading and fitting; grows
    section_count  sections planned so far
    rests          of the chunks planned so far
    """

    def __init__(
        self,
        job: JobFiles,
        most_bytes: int | None,
        number: int,
        begin: Place,
        *,
        stops: bool = True,
        processes: int = PROCESSES,
    ) -> None:
        """job what is streamed
        most_bytes  of a chunk; None: set by `allow` later, until then files are only read and fitted
        number      of the controller's job that begins with section 0; another one has it plus the number of its first
                    section
        begin       where the job begins
        stops       whether program stops and tool changes wait for the operator
        processes   1: reading and fitting run in this process too; the chunks are the same
        """
        self.stops = stops
        self._processes = processes
        self._job, self._most, self._number, self._begin = job, most_bytes, number, begin
        self.notes: list[str] = []
        self.after: tuple[Command, ...] = ()
        self.section_count = 0
        self.rests = PlanRests()
        self._store = ChunkStore()
        self._motion_s = array("d", [0.0])
        self._waits_s = array("d", [0.0])
        self._waiting: deque[PlannedSection] = deque()
        """The section of each chunk that may still be read."""
        self._rate = _GreatestRate()
        self._marks = {file: mark(file) for file in job.files if str(file) != STANDARD_INPUT}
        self._error: BaseException | None = None
        self._done = self._ending = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="planner", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        self._thread.join(_INPUT_WAIT_S if self.reads_input else None)
        if not self._thread.is_alive():
            self._store.forget_all()

    @property
    def last_file(self) -> Path:
        """The file whose end is that of the job."""
        return self._job.files[-1]

    @property
    def reads_input(self) -> bool:
        """Whether a file of the job is standard input."""
        return any(str(file) == STANDARD_INPUT for file in self._job.files)

    def allow(self, most_bytes: int) -> None:
        """Sets the greatest size of a chunk; planning waits for it."""
        with self._changed:
            self._most = most_bytes
            self._changed.notify_all()

    def item(self, index: int, wait_s: float) -> tuple[PlannedSection, Chunk, float] | None:
        """The chunk with this index, its section and its new motion in s. None: it is not planned yet after `wait_s`.
        Chunks before it cannot be read again. Raises IndexError after the last chunk, and the error of planning where
        that ended.
        """
        with self._changed:
            self._changed.wait_for(lambda: self.chunks > index or self._done, wait_s)
            if self.chunks > index:
                chunk = parse(self._store.get(index))
                while len(self._waiting) > self.chunks - index:
                    self._waiting.popleft()
                self._changed.notify_all()
                new_s = self._motion_s[index + 1] - self._motion_s[index]
                return self._waiting[0], chunk, new_s
            if self._error is not None:
                raise self._error
            if self._done:
                raise IndexError(index)
            return None

    def by_job(self) -> Iterator[Iterator[Chunk]]:
        """The chunks of each job of the controller, as they are planned. Each job has to be read to its end before the
        next.
        """
        at = [0]

        def chunks() -> Iterator[Chunk]:
            last = False
            while not last:
                item = self.item(at[0], _FOR_EVER_S)
                assert item is not None
                at[0] += 1
                yield item[1]
                last = item[1].header.last

        while True:
            try:
                self.item(at[0], _FOR_EVER_S)
            except IndexError:
                return
            yield chunks()

    @property
    def chunks(self) -> int:
        """Number of chunks planned so far."""
        return self._store.count

    @property
    def byte_count(self) -> int:
        """Bytes of the chunks planned so far."""
        return self._store.byte_count

    def after_s(self, index: int) -> float | None:
        """Time of motion and dwells after the chunk with this index; None: not known before all is planned."""
        with self._changed:
            if not self._done or self._error is not None:
                return None
            at = min(index + 1, self.chunks)
            waits_s = self._waits_s[-1] - self._waits_s[at]
            return self._motion_s[-1] - self._motion_s[at] + waits_s + dwell_s(self.after)

    def _wait_s(self, section: PlannedSection) -> float:
        """Standstill before a section in s, without the time of program stops."""
        if section.rest is None:
            file_end_s = 0.0 if section.file_end is None else dwell_s(section.file_end.commands)
            return file_end_s + dwell_s(section.before)
        period_us = self._job.machine.period_us
        return 1e-6 * period_us * section.rest.ticks(period_us)

    @property
    def planned_s(self) -> float:
        """Motion planned so far."""
        return self._motion_s[-1]

    def is_longer(self, motion_s: float, wait_s: float) -> bool:
        """Whether the motion of the job takes longer than `motion_s`; False: no, or not known after `wait_s`."""
        with self._changed:
            self._changed.wait_for(lambda: self.planned_s > motion_s or self._done, wait_s)
            return self.planned_s > motion_s

    def greatest_rate(self) -> float:
        """Greatest bytes per second of motion so far, as a mean over about _RATE_S."""
        return self._rate.worst

    def _allowed(self) -> int:
        """Waits for the greatest size of a chunk. Raises _EndedError."""
        with self._changed:
            self._changed.wait_for(lambda: self._ending or self._most is not None)
            if self._most is None:
                raise _EndedError
            return self._most

    def _work(self) -> None:
        try:
            last: PlannedSection | None = None
            for section, chunk, new_s in self._planning():
                data = chunk.encode()
                self._require_unchanged(section.file)
                with self._changed:
                    if not self._put(data):
                        return
                    waits_s = 0.0
                    if section is not last:
                        last = section
                        self.section_count += 1
                        waits_s = self._wait_s(section)
                    self._waiting.append(section)
                    self._motion_s.append(self._motion_s[-1] + new_s)
                    self._waits_s.append(self._waits_s[-1] + waits_s)
                    self._rate.extend(self._store, self._motion_s)
                    self._changed.notify_all()
        except BaseException as error:
            self._error = error
        finally:
            with self._changed:
                self._done = True
                self._changed.notify_all()
                if self._ending:
                    self._store.forget_all()

    def _require_unchanged(self, file: Path) -> None:
        """Raises InputError: the file has changed since the job began, and part of a line may have been read."""
        known = self._marks.get(file)
        if known is not None and file.is_file() and mark(file) != known:
            raise InputError(
                f"{file}: has been changed while it was streamed: the job ends before what may have been read of it "
                "half written: stream it again when it is complete"
            )

    def _put(self, data: bytes) -> bool:
        """Stores a chunk, after waiting for room. False: the plan is closed. Raises RunError: the disk is full and
        stays so.
        """
        store, changed = self._store, self._changed
        changed.wait_for(lambda: self._ending or not _is_full(store))
        while not self._ending and not store.put(data):
            if not store.waiting:
                store.forget_all()
                if store.put(data):
                    break
                raise RunError(
                    f"{store.folder}: the disk is full, and the plan of the job is kept there: free "
                    f"{(RESERVE_BYTES + PART_BYTES) >> 20} MiB, or set TMPDIR to a folder with room"
                )
            waiting = store.waiting
            changed.wait_for(partial(self._fewer_than, waiting))
        return not self._ending

    def _fewer_than(self, waiting: int) -> bool:
        return self._ending or self._store.waiting < waiting

    def _planning(self) -> Iterator[tuple[PlannedSection, Chunk, float]]:
        """The chunks of all files, with their sections and their new motion in s."""
        number = 0
        file_end: FileEnd | None = None
        for file in self._job.files:
            self.after = ()
            if is_toolpath(file):
                number = yield from self._toolpath(file, number, file_end)
                if self._ending:
                    return
            else:
                yield from self._paths(file, number, file_end)
                number += len(load_paths(file))
            file_end = FileEnd(file, self.after)

    def _toolpath(
        self, file: Path, number: int, file_end: FileEnd | None
    ) -> Generator[tuple[PlannedSection, Chunk, float], None, int]:
        """The chunks of a toolpath, the first section of which is `number`. Returns the number after the last.

        file_end  of the file before it
        """
        place: JobPlace | None = None
        begins = number <= self._begin.section  # the job begins in this file, or in a later one
        first = number
        reader, switched = self._reader(file), SwitchedOutputs()
        for section in reader.sections():
            begin_q40 = self._begin.arc_q40 if number == self._begin.section else 0
            blocks = blocks_from(section.blocks, begin_q40 * MM_PER_Q40, switched)
            block = next(blocks, None) if number >= self._begin.section else None
            if block is not None:
                before = () if begin_q40 else section.before
                if begins and (begin_q40 or number > first):
                    before = _switched_first(section, before, switched.at_rest, block.events)
                begins = False
                made = PlannedSection(
                    number,
                    file,
                    section.first_line,
                    before,
                    standing_mm=section.standing_mm,
                    file_end=None if begin_q40 else file_end,
                )
                if place is None:
                    first = number
                    block = begun_with(block, switched.begin())
                else:
                    place = replace(place, rest=rest_of(before, stops=self.stops))
                    made = replace(made, start_q40=place.arc_q40, rest=place.rest)
                chunks = SectionChunks(
                    section.machine,
                    file.stem,
                    switching(chain([block], blocks), switched),
                    self._number + first,
                    self._allowed(),
                    begin_q40,
                    place,
                    partial(self._continues, section),
                )
                place = yield from self._chunks_of(made, chunks)
            elif not self._skip(section, switched):
                return number
            file_end = None
            number += 1
        self.after = reader.after
        if begins and number > self._begin.section and acts_at_rest(reader.after):
            self.after = _switched_first(section, reader.after, switched.at_rest, no_events())
        return number

    def _chunks_of(
        self, section: PlannedSection, chunks: SectionChunks
    ) -> Generator[tuple[PlannedSection, Chunk, float], None, JobPlace | None]:
        """The chunks of a section. Returns the place of the next section in the same job; None: the job ends."""
        last, counted = False, 0
        try:
            for planned in chunks.chunks():
                for line in chunks.rest_lines[counted:]:
                    self.rests = self.rests.plus(section.file, line)
                counted = len(chunks.rest_lines)
                last = planned.chunk.header.last
                yield section, planned.chunk, planned.new_s
        except SectionPlanError as error:
            raise PlanError(f"{section.file}:{error.line}: {error.text}") from None
        return None if last else chunks.end

    def _skip(self, section: StreamSection, switched: SwitchedOutputs) -> bool:
        """Reads the remainder of a section that is not planned, whose events are applied. False: the plan is closed."""
        for block in section.blocks:
            switched.act(block.events)
            if self._ending:
                return False
        return True

    def _reader(self, file: Path) -> StreamReader | ParallelReader:
        job = self._job
        reader = StreamReader(file, job.machine, job.tolerance_mm, job.reading, self.notes)
        return ParallelReader(reader) if self._processes > 1 else reader

    def _paths(
        self, file: Path, number: int, file_end: FileEnd | None
    ) -> Iterator[tuple[PlannedSection, Chunk, float]]:
        """The paths of a path file as sections, the first with this number."""
        begin = self._begin
        first = max(begin.section - number, 0)
        begin_q40 = begin.arc_q40 if begin.section >= number else 0
        job = PathsJob(file, self._job.machine, self._number + number, self._allowed(), self.stops)
        for made in job.chunks(first, begin_q40):
            header = made.chunk.header
            before, start_q40 = made.before, header.job_start_q40
            own = None
            if header.rest is None:
                before, start_q40 = () if header.job_start_q40 else before, 0
                own, file_end = None if header.job_start_q40 else file_end, None
            section = PlannedSection(
                number + header.line - 1,
                file,
                header.line,
                before,
                start_q40,
                header.rest,
                made.standing_mm,
                own,
            )
            yield section, made.chunk, made.duration_s

    def _continues(self, section: StreamSection, end_q40: NDArray[np.int64]) -> bool:
        """Whether another section of the file begins where this one ends, at this point."""
        start = section.next_start()
        if start is None:
            return False
        machine_mm = start + np.array(section.machine.offset_mm[: start.size])
        return bool(np.abs(machine_mm - end_q40 * MM_PER_Q40).max() < _MEETS_MM)


def _is_full(store: ChunkStore) -> bool:
    return store.waiting_bytes >= MOST_WAITING_BYTES or store.waiting >= _MOST_WAITING


class _GreatestRate:
    """The greatest bytes per second of motion, as a mean over about _RATE_S."""

    def __init__(self) -> None:
        self.worst = 0.0
        self._first = 0

    def extend(self, store: ChunkStore, motion_s: Sequence[float]) -> None:
        """Takes the newest chunk into account."""
        last = store.count
        while motion_s[last] - motion_s[self._first + 1] > _RATE_S:
            self._first += 1
        time_s = motion_s[last] - motion_s[self._first]
        if time_s >= _RATE_S:
            size = store.end_of(last) - store.end_of(self._first)
            self.worst = max(self.worst, size / time_s)


def _switched_first(
    section: StreamSection, before: tuple[Command, ...], values: OutputValues, events: Events
) -> tuple[Command, ...]:
    """Commands at rest where a job begins within a toolpath: at this section, inside it, or at its end if it is the
    last one. The outputs of this place have to be on before a wait; the program of the section switches them with its
    first setpoint only.

    values  of the outputs there
    events  of the path from there on
    """
    outputs = section.machine.outputs
    if outputs is None:
        return before
    moving = SwitchedOutputs(values)
    moving.act(events_after(events, 0)[0])
    codes = outputs.codes
    wait_s = min(codes.restart_wait_s(values), codes.restart_wait_s(moving.at_rest))
    waits = (Dwell(section.first_line, wait_s),) if wait_s else ()
    if not waits and not acts_at_rest(before):
        return before
    return (SwitchedAtRest(section.first_line, values), *waits, *before)


def rest_of(commands: Sequence[Command], *, stops: bool) -> Rest:
    """The rest that these commands need in the controller."""
    made = [one for one in commands if isinstance(one, (ProgramStop, ToolChange))] if stops else []
    optional = [isinstance(one, ProgramStop) and one.optional for one in made]
    return Rest(ceil(1e3 * dwell_s(commands) - 1e-9), not all(optional), any(optional))


def dwell_s(commands: Sequence[Command]) -> float:
    """Total time of the dwells among commands."""
    return sum(command.duration_s for command in commands if isinstance(command, Dwell))
