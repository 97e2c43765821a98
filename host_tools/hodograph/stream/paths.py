# SPDX-License-Identifier: MIT
"""Path files with several paths as one job: each path is a program, with what happens at rest before it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ..config import ListedPath, Machine, load_paths
from ..errors import InputError, PlanError
from ..events import Events, SwitchedOutputs, events_behind, no_events
from ..pipeline import Pipeline
from ..program.image import Program
from ..program.inspection import end_point_q40
from ..spline import PHSpline
from ..spline.build import FoundSpline
from ..spline.spatial.curve import SpatialPHSpline
from ..toolpath.moves import Command, Dwell, ProgramStop
from .chunk import Chunk, ChunkHeader, Rest
from .chunks import JobPlace, zones_behind
from .geometry import LEAST_REST_MM, curve_behind

_MEETS_Q40 = 1 << 16
"""2^-24 mm: how far a path may begin from the end of the one before (docs/reference/protocol.md 1.7)."""


@dataclass(frozen=True, eq=False)
class _BegunPipeline(Pipeline):
    """The pipeline of the path that a job begins with: from an arc length on, with these events."""

    begin_mm: float = 0.0
    given_events: Events = field(default_factory=no_events)

    @property
    def events(self) -> Events:
        """The outputs that switch on the path."""
        return self.given_events

    @cached_property
    def found_spline(self) -> FoundSpline[PHSpline] | FoundSpline[SpatialPHSpline]:
        """The curve behind that place."""
        found = super().found_spline
        if self.begin_mm <= 0.0:
            return found
        curve = curve_behind(found.spline, self.begin_mm)[1]
        if isinstance(curve, PHSpline):  # two branches, so that each has the type of its curve
            return FoundSpline(curve, 0)
        return FoundSpline(curve, 0)


@dataclass(frozen=True, eq=False)
class PathChunk:
    """A path as a chunk of its job, and what is at rest before it."""

    chunk: Chunk
    before: tuple[Command, ...]
    duration_s: float


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
        """From path number `first` on, from this arc length of it."""
        paths = load_paths(self.file)
        if any(one.file.turns_alone for one in paths):
            raise InputError(
                f"{self.file}: axes turn alone, which no chunk does: use hodograph run"
            )
        if first < len(paths) and begin_q40 and self._is_done(paths[first], begin_q40):
            first, begin_q40 = first + 1, 0
        place: JobPlace | None = None
        switched = SwitchedOutputs()
        for number, listed in enumerate(paths):
            if number < first:
                switched.act(self._events(listed))
                continue
            last = number + 1 == len(paths)
            if number == first:
                pipeline = self._begun(listed, begin_q40, switched)
            else:
                pipeline, begin_q40 = Pipeline(listed.file, self.machine), 0
            made = self._chunk(
                listed, pipeline, number, place, begin_q40, job=self.job + first, last=last
            )
            yield made
            header = made.chunk.header
            program = made.chunk.program
            arc_q40 = header.job_start_q40 + program.length_q40
            place = JobPlace(Rest(), header.sequence + 1, arc_q40, end_point_q40(program))

    def _is_done(self, listed: ListedPath, begin_q40: int) -> bool:
        length_mm = Pipeline(listed.file, self.machine).curve.length_mm
        return begin_q40 * 2.0**-40 > length_mm - LEAST_REST_MM

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
        if place is not None:
            self._require_meeting(number, program, place)
        chunk = Chunk(header, pipeline.image)
        if chunk.size > self.most_bytes:
            raise PlanError(
                f"{self.file}: path {number + 1} takes {chunk.size} bytes with its header, and the controller takes "
                f"{self.most_bytes} at once (object 0x2060): divide the path"
            )
        return PathChunk(chunk, _commands(rest, number + 1), program.duration_q32_s * 2.0**-32)

    def _events(self, listed: ListedPath) -> Events:
        """Of the whole path; a path without any is not computed for them."""
        return Pipeline(listed.file, self.machine).events if listed.file.outputs else no_events()

    def _begun(self, listed: ListedPath, begin_q40: int, switched: SwitchedOutputs) -> Pipeline:
        """Of the first path, from an arc length on; at its start the outputs become what all events before made."""
        begin_mm, limits = begin_q40 * 2.0**-40, listed.file.limits
        events = self._events(listed)
        if begin_q40:
            passed, events = events_behind(events, begin_q40)
            switched.act(passed)
            limits = replace(limits, zones=zones_behind(limits.zones, begin_mm))
        file = replace(listed.file, limits=limits)
        begun = np.concatenate((switched.begin(), events))
        return _BegunPipeline(file, self.machine, begin_mm, begun)

    def _require_meeting(self, number: int, program: Program, place: JobPlace) -> None:
        off = np.abs(program.point_q40[:, 0] - place.point_q40)
        if off.max() > _MEETS_Q40:
            raise InputError(
                f"{self.file}: path {number + 1} begins {off.max() * 2.0**-40:.6g} mm from the end of path {number}: "
                "let it begin there; moves between paths are paths of their own"
            )


def _commands(rest: Rest, number: int) -> tuple[Command, ...]:
    """What a rest before a path is, as commands of a toolpath; their line is the number of the path."""
    made: list[Command] = []
    if rest.stop or rest.optional_stop:
        made.append(ProgramStop(number, rest.optional_stop))
    if rest.dwell_ms:
        made.append(Dwell(number, 1e-3 * rest.dwell_ms))
    return tuple(made)
