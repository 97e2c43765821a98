# SPDX-License-Identifier: MIT
"""Path files with several paths as one job: each path becomes one chunk (part of the job), and the axes rest between
them. Used by plan.py. Reads the path file, and the files that it names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..config import ListedPath, Machine, load_paths
from ..errors import InputError, PlanError
from ..events import Events, SwitchedOutputs, events_after, no_events
from ..feed.limits import zones_after
from ..fixed_point import MM_PER_Q40, nearest_q40
from ..pipeline import Pipeline, pipeline_of
from ..program.inspection import end_point_q40
from ..spline import PHSpline
from ..spline.build import FoundSpline
from ..spline.spatial.curve import SpatialPHSpline
from ..toolpath.moves import Command, Dwell, ProgramStop
from .chunk import ENOUGH_Q40, Chunk, ChunkHeader, Rest, make
from .chunks import JobPlace
from .geometry import LEAST_REST_MM, curve_after

Int = NDArray[np.int64]

_MEETS_Q40 = 1 << 16
"""2^-24 mm: greatest distance from the end of a path to the start of the next (docs/reference/protocol.md 1.7)."""


@dataclass(frozen=True, eq=False)
class _BegunPipeline(Pipeline):
    """The pipeline of the first path of a job: from an arc length on, with given events."""

    begin_mm: float = 0.0
    given_events: Events = field(default_factory=no_events)
    given_standing_mm: tuple[float, ...] = ()

    @property
    def standing_mm(self) -> tuple[float, ...]:
        """Positions of the axes before those of the program, which stand."""
        return self.given_standing_mm

    @property
    def events(self) -> Events:
        """The outputs that switch on the path."""
        return self.given_events

    @cached_property
    def found_spline(self) -> FoundSpline[PHSpline] | FoundSpline[SpatialPHSpline]:
        """The curve after that arc length."""
        found = super().found_spline
        if self.begin_mm <= 0.0:
            return found
        curve = curve_after(found.spline, self.begin_mm)[1]
        if isinstance(curve, PHSpline):  # two branches, so that each has the type of its curve
            return FoundSpline(curve, 0)
        return FoundSpline(curve, 0)


@dataclass(frozen=True, eq=False)
class PathChunk:
    """A path as a chunk of its job.

    before       commands at rest before it
    standing_mm  positions of the axes before those of its program, without the work offset
    """

    chunk: Chunk
    before: tuple[Command, ...]
    duration_s: float
    standing_mm: tuple[float, ...]


@dataclass(frozen=True)
class PathsJob:
    """The paths of a file as a job. Raises InputError and PlanError, which name the file and the path.

    job         number of the job in the controller, plus the number of the path that it begins with
    most_bytes  of a chunk
    """

    file: Path
    machine: Machine
    job: int
    most_bytes: int
    stops: bool

    def chunks(self, first: int, begin_q40: int) -> Iterator[PathChunk]:
        """The chunks from path number `first` on, which begins at this arc length. All chunks of a controller's job
        move the same axes: a new job begins where the paths change to rotary axes alone, and back, and where one is
        long enough.
        """
        paths = load_paths(self.file)
        if first < len(paths) and begin_q40 and self._is_done(paths[first], begin_q40):
            first, begin_q40 = first + 1, 0
        switched = SwitchedOutputs()
        for listed in paths[:first]:
            switched.act(self._events(pipeline_of(listed.file, self.machine)))
        place: JobPlace | None = None
        end_q40: Int | None = None
        begun = first
        for number in range(first, len(paths)):
            listed = paths[number]
            following = paths[number + 1] if number + 1 < len(paths) else None
            pipeline = pipeline_of(listed.file, self.machine)
            if place is None:
                pipeline, begun = self._begun(pipeline, begin_q40, switched), number
            else:
                switched.act(self._events(pipeline))
            if end_q40 is not None:
                self._require_meeting(number, pipeline, end_q40)
            arc_q40 = begin_q40 if place is None else place.arc_q40
            last = (
                following is None
                or following.file.turns_alone != listed.file.turns_alone
                or arc_q40 + nearest_q40(pipeline.curve.length_mm) >= ENOUGH_Q40
            )
            made = self._chunk(
                listed, pipeline, number, place, begin_q40, job=self.job + begun, last=last
            )
            yield made
            header, program = made.chunk.header, made.chunk.program
            end = end_point_q40(program)
            end_q40 = self._all_axes(pipeline, end)
            arc_q40 = header.job_start_q40 + program.length_q40
            place = None if last else JobPlace(Rest(), header.sequence + 1, arc_q40, end)
            begin_q40 = 0

    def _is_done(self, listed: ListedPath, begin_q40: int) -> bool:
        length_mm = pipeline_of(listed.file, self.machine).curve.length_mm
        return begin_q40 * MM_PER_Q40 > length_mm - LEAST_REST_MM

    def _chunk(
        self,
        listed: ListedPath,
        pipeline: Pipeline,
        number: int,
        place: JobPlace | None,
        begin_q40: int,
        *,
        job: int,
        last: bool,
    ) -> PathChunk:
        _ = pipeline.accepted  # raises where the controller would refuse it
        program = pipeline.program
        rest = Rest(listed.dwell_ms, listed.stop == "program", listed.stop == "optional")
        header = ChunkHeader(
            first=place is None,
            last=last,
            job=job,
            sequence=0 if place is None else place.sequence,
            job_start_q40=begin_q40 if place is None else place.arc_q40,
            line=number + 1,
            rest=None if place is None else (rest if self.stops else Rest(listed.dwell_ms)),
            joined=not last,
        )
        chunk = make(header, replace(program, compact=True))
        if chunk.size > self.most_bytes:
            raise PlanError(
                f"{self.file}: path {number + 1} takes {chunk.size} bytes with its header, and the controller takes "
                f"{self.most_bytes} at once (object 0x2060): divide the path"
            )
        duration_s = program.duration_q32_s * 2.0**-32
        return PathChunk(chunk, _commands(rest, number + 1), duration_s, pipeline.standing_mm)

    def _events(self, pipeline: Pipeline) -> Events:
        """The events of the whole path. If it has none, nothing is computed."""
        return pipeline.events if pipeline.file.outputs else no_events()

    def _begun(self, whole: Pipeline, begin_q40: int, switched: SwitchedOutputs) -> Pipeline:
        """The pipeline of the first path of a job, from an arc length on. Events at its start restore the outputs."""
        begin_mm, limits = begin_q40 * MM_PER_Q40, whole.file.limits
        events = self._events(whole)
        if begin_q40:
            passed, events = events_after(events, begin_q40)
            switched.act(passed)
            limits = replace(limits, zones=zones_after(limits.zones, begin_mm))
        begun = np.concatenate((switched.begin(), events))
        switched.act(events)
        file = replace(whole.file, limits=limits)
        return _BegunPipeline(file, whole.machine, begin_mm, begun, whole.standing_mm)

    def _all_axes(self, pipeline: Pipeline, point_q40: Int) -> Int:
        """A point of a path in machine coordinates of all axes of the machine's path."""
        stands = zip(pipeline.standing_mm, self.machine.offset_mm, strict=False)
        standing_q40 = [nearest_q40(at + offset) for at, offset in stands]
        return np.concatenate((np.array(standing_q40, dtype=np.int64), point_q40))

    def _require_meeting(self, number: int, pipeline: Pipeline, end_q40: Int) -> None:
        begin_q40 = self._all_axes(pipeline, pipeline.program.point_q40[:, 0])
        off = np.abs(begin_q40 - end_q40)
        if off.max() <= _MEETS_Q40:
            return
        axis = self.machine.path_axes[int(np.argmax(off))]
        raise InputError(
            f"{self.file}: path {number + 1} begins {off.max() * MM_PER_Q40:.6g} {axis.unit} of {axis.name} from the "
            f"end of path {number}: let it begin there; moves between paths are paths of their own"
        )


def _commands(rest: Rest, number: int) -> tuple[Command, ...]:
    """The rest before a path as toolpath commands; their line is the number of the path."""
    made: list[Command] = []
    if rest.stop or rest.optional_stop:
        made.append(ProgramStop(number, rest.optional_stop))
    if rest.dwell_ms:
        made.append(Dwell(number, 1e-3 * rest.dwell_ms))
    return tuple(made)
