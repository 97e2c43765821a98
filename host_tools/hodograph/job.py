# SPDX-License-Identifier: MIT
"""A job: a toolpath as sections from rest to rest, each with its program. Used by many modules of host_tools: the
commands import and stream, the Python API, reports. Reads the toolpath file or stdin.

`load_job` divides a toolpath into sections, fits a curve to each within the tolerance, and gives it a pipeline that
makes its program. Commands at rest (dwells, spindle, outputs, tool changes) are kept with the section that follows
them. `stream` makes its sections by `SectionMaker` too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .config import Machine, PathFile, SpacePathSpec
from .config.outputs import Outputs
from .equal_sections import EqualSections, SharedPrograms
from .errors import InputError, PlanError
from .feed import FeedRequest, FeedZone, Limits
from .feed.request import GREATEST_FEED_MM_S, LEAST_FEED_MM_S, OPTIMAL
from .job_outputs import (
    SectionCommands,
    is_output,
    job_events,
    programmed_feeds,
    with_spindle_waits,
)
from .section_pipeline import SectionPipeline
from .toolpath.files import ReadOptions, is_gcode, read_toolpath, replaced_feed_mm_s
from .toolpath.fit.fitting import FittedPath, Tolerance, fit
from .toolpath.fit.sections import Section, Toolpath, cut_at, divided
from .toolpath.fit.speeds import MotionLimits
from .toolpath.fit.turning import with_turning
from .toolpath.moves import (
    AXES,
    AnalogOutput,
    Command,
    Coolant,
    DigitalOutput,
    Dwell,
    Message,
    Position,
    Spindle,
    ToolChange,
    ToolOffset,
    WorkFrame,
)

Real = NDArray[np.float64]
Int = NDArray[np.int64]

DEFAULT_TOLERANCE_MM = 0.01
GREATEST_TOLERANCE_MM = 10.0

_TOOL_OFFSET = "tool offset (G43)"
_TOOL_CHANGE = "tool change (M6)"
_IGNORED: dict[tuple[type[Command], ...], str] = {
    (Spindle,): "spindle (M3, M4, M5)",
    (Coolant,): "coolant (M7, M8, M9)",
    (ToolChange,): _TOOL_CHANGE,
    (DigitalOutput, AnalogOutput): "outputs (M62 to M65, M67, M68)",
    (ToolOffset,): _TOOL_OFFSET,
}
_LONGEST_NAME = 40
_ROUNDING_MM = 1e-9
"""Rounding that is allowed beyond the travel of an axis."""


@dataclass(frozen=True, eq=False)
class JobSection:
    """A section with its program.

    before     commands at rest, before it starts
    events     commands within it, with their arc lengths in mm
    tied       whether it begins, and whether it ends, in motion as a part of a longer section
    stands_at  of a section of rotary axes alone: position of x, y and z, mm; its lengths and feeds are in degrees.
               None: x, y and z move
    """

    fitted: FittedPath
    tolerance_mm: float
    pipeline: SectionPipeline
    before: tuple[Command, ...]
    events: tuple[tuple[float, Command], ...]
    tied: tuple[bool, bool] = (False, False)
    stands_at: tuple[float, float, float] | None = None

    @property
    def length_mm(self) -> float:
        """Length of the curve of x, y and z; 0 where they stand."""
        return self.fitted.curve.length_mm if self.stands_at is None else 0.0

    @property
    def deviation_um(self) -> float:
        """Bound of the distance of x, y and z between the programmed path and the curve, both ways."""
        return 1000.0 * self.fitted.deviation_mm if self.stands_at is None else 0.0

    @property
    def turning_summary(self) -> dict[str, object]:
        """For JSON: the deviation bound of rotary axes; where they move alone, the length of their path too. Empty:
        none moves.
        """
        turned = {} if self.stands_at is None else {"turned_deg": self.fitted.curve.length_mm}
        return turned | _turning_bound(self.deviation_deg)

    @property
    def deviation_deg(self) -> float | None:
        """Bound of the deviation of A, B and C from the program, degrees; None: none of them moves."""
        fitted = self.fitted
        return fitted.turning_deg if self.stands_at is None else fitted.deviation_mm

    def places(self, moved_mm: Real) -> Real:
        """Positions (n, axes) of the path's axes, without the work offset, from positions (n, k) of its program's
        axes.
        """
        machine = self.pipeline.machine
        own = moved_mm - np.array(machine.offset_mm)
        stands = np.broadcast_to(self.standing_mm, (len(own), machine.first_axis))
        return np.concatenate((stands, own), axis=1)

    @property
    def standing_mm(self) -> Real:
        """Positions (first_axis,) of the path's axes before those of its program, which stand; without the work
        offset.
        """
        first = self.pipeline.machine.first_axis
        return np.array((self.stands_at or ())[:first], dtype=np.float64)

    @property
    def first_line(self) -> int:
        """Source line of its first move."""
        return int(self.fitted.reference.line[0])

    @property
    def last_line(self) -> int:
        """Source line of its last move."""
        return int(self.fitted.reference.line[-1])

    def lines_summary(self) -> dict[str, object]:
        """Source lines of the section, for JSON."""
        lines: dict[str, object] = {"first_line": self.first_line, "last_line": self.last_line}
        return lines | self.turning_summary

    def line_at(self, s_mm: Real) -> Int:
        """Source lines (n,) of places of the curve at arc lengths (n,)."""
        return np.asarray(self.fitted.reference.line[self._chord_at(s_mm)])

    def is_rapid_at(self, s_mm: Real) -> NDArray[np.bool_]:
        """Whether these places (n,) belong to rapid moves (G0)."""
        return np.isinf(self.fitted.reference.feed_mm_s[self._chord_at(s_mm)])

    def _chord_at(self, s_mm: Real) -> NDArray[np.intp]:
        """Chords (n,) of the reference."""
        reference = self.fitted.reference
        starts = self.fitted.arc_length_at(reference.place_mm[:-1])
        at = np.searchsorted(starts, s_mm, side="right") - 1
        return np.clip(at, 0, reference.count - 1)


@dataclass(frozen=True, eq=False)
class Job:
    """All sections of a toolpath, on a machine.

    after  commands at rest at the end
    notes  one line for each thing that the user should know
    fit_s  wall time that reading and fitting took
    """

    file: Path
    machine: Machine
    sections: tuple[JobSection, ...]
    after: tuple[Command, ...]
    notes: tuple[str, ...]
    fit_s: float

    @property
    def deviation_um(self) -> float:
        """Bound of the distance between the programmed path and the curves, both ways."""
        return max(section.deviation_um for section in self.sections)

    @property
    def lines(self) -> int:
        """Source lines that move the machine."""
        lines = np.concatenate([section.fitted.reference.line for section in self.sections])
        return int(np.unique(lines).size)

    @property
    def segments(self) -> int:
        """PH segments of all curves."""
        return sum(section.fitted.curve.segment_count for section in self.sections)

    @property
    def length_mm(self) -> float:
        """Length of all curves of x, y and z."""
        return sum(section.length_mm for section in self.sections)

    @property
    def dwell_s(self) -> float:
        """Total time of the programmed dwells."""
        return sum(command.duration_s for command in self._at_rest if isinstance(command, Dwell))

    @property
    def _at_rest(self) -> Iterator[Command]:
        for section in self.sections:
            yield from section.before
        yield from self.after

    @property
    def deviation_deg(self) -> float | None:
        """Bound of the deviation of A, B and C from the program, degrees; None: none of them moves."""
        bounds = (section.deviation_deg for section in self.sections)
        return max((bound for bound in bounds if bound is not None), default=None)

    def summary(self) -> dict[str, object]:
        """Counts, lengths and deviation bounds of all sections, for JSON."""
        return _turning_bound(self.deviation_deg) | {
            "lines": self.lines,
            "sections": len(self.sections),
            "segments": self.segments,
            "length_mm": self.length_mm,
            "dwell_s": self.dwell_s,
            "deviation_bound_um": self.deviation_um,
        }

    def only_section(self, command: str) -> JobSection:
        """The section of a job that has only one. Raises PlanError: it has several, or rotary axes move alone.

        command  name for the message
        """
        if len(self.sections) != 1:
            second = self.sections[1].first_line
            raise PlanError(
                f"{self.file}: has {len(self.sections)} sections from rest to rest (the second from line {second}), "
                f"but {command} takes one program: simulate and run take them all"
            )
        if self.sections[0].stands_at is not None:
            raise PlanError(
                f"{self.file}: moves rotary axes alone, while x, y and z stand: simulate and run take it, not {command}"
            )
        return self.sections[0]


def load_job(
    file: Path,
    machine: Machine,
    tolerance_mm: float = DEFAULT_TOLERANCE_MM,
    reading: ReadOptions | None = None,
) -> Job:
    """The job of a toolpath file.

    tolerance_mm  greatest distance between programmed path and curve; 0: stop at the end of each move
    reading       how the file is read; its feed replaces those of the file, rapid moves keep theirs
    Raises InputError (naming file and line) and PlanError.
    """
    begin = perf_counter()
    if not 0.0 <= tolerance_mm <= GREATEST_TOLERANCE_MM:
        raise InputError(
            f"--tolerance {tolerance_mm:g}: must be from 0 to {GREATEST_TOLERANCE_MM:g} mm"
        )
    reading, notes = reading or ReadOptions(), list[str]()
    commands, start = toolpath_commands(file, machine, reading, notes), work_frame(machine).start
    path = divided(commands, tolerance_mm, str(file), start, laser_mode=in_laser_mode(machine))
    if not path.sections:
        raise InputError(f"{file}: moves nothing: a job needs a move of 2 um at least")
    maker = SectionMaker(file, machine, replaced_feed_mm_s(file, reading), notes, EqualSections())
    sections = tuple(made for section in path.sections for made in maker.made(section))
    notes += _ignored_commands(path, file, machine.outputs)
    after = path.after
    if machine.outputs is not None:
        sections, after = _with_outputs(sections, after, machine.outputs, file, notes)
    return Job(file, machine, sections, after, tuple(notes), perf_counter() - begin)


def work_frame(machine: Machine) -> WorkFrame:
    """Where a toolpath lies in a machine, and where it starts."""
    return WorkFrame(_position(machine, machine.offset_mm), _position(machine, machine.start_mm))


def _position(machine: Machine, numbers: Sequence[float]) -> Position:
    """A position from one number for each axis of the path. The first three axes are x, y and z whatever their names;
    the numbers of axes after them count if their names are a, b and c.
    """
    drawn, names = numbers[:3], [axis.name.lower() for axis in machine.path_axes[3:]]
    by_letter = dict(zip(names, numbers[3:], strict=False)) | dict(zip(AXES, drawn, strict=False))
    x, y, z, a, b, c = (by_letter.get(letter, 0.0) for letter in AXES)
    return (x, y, z, a, b, c)


def toolpath_commands(
    file: Path, machine: Machine, reading: ReadOptions, notes: list[str]
) -> Iterator[Command]:
    """The commands of a file; notes of the reader of a drawing or of points are added to `notes`. Raises InputError."""
    commands = read_toolpath(file, reading, work_frame(machine))
    for command in with_spindle_waits(commands, machine.outputs):
        if isinstance(command, Message) and not is_gcode(file):
            place = f"{file}:{command.line}" if command.line else str(file)
            notes.append(f"{place}: {command.text}")
        else:
            yield command


def _with_outputs(
    sections: tuple[JobSection, ...],
    after: tuple[Command, ...],
    outputs: Outputs,
    file: Path,
    notes: list[str],
) -> tuple[tuple[JobSection, ...], tuple[Command, ...]]:
    """The sections, with the switched outputs as events of their programs, and the commands after them."""
    made = job_events([section_commands(one) for one in sections], after, outputs, file, notes)
    switching = [
        replace(one, pipeline=replace(one.pipeline, given_events=events))
        for one, events in zip(sections, made.events, strict=True)
    ]
    switching[0] = replace(switching[0], before=made.before)
    return tuple(switching), made.after


def _turning_bound(bound_deg: float | None) -> dict[str, object]:
    """The deviation bound of rotary axes, for JSON; empty where none moves."""
    return {} if bound_deg is None else {"deviation_bound_deg": bound_deg}


def missing_axes(machine: Machine) -> str:
    """The letters of a, b and c that are no axes of the machine's path."""
    names = [axis.name.lower() for axis in machine.path_axes[3:]]
    return "".join(name for name in AXES[3:] if name not in names)


def no_such_axis(file: Path, line: int, name: str, machine: Machine) -> InputError:
    """The error for a move of a, b or c, which is no axis of the machine's path."""
    return InputError(
        f"{file}:{line}: the move turns {name.upper()}, but no axis {name} of {machine.file.name} follows the path: "
        'name it after "z" in path = [...] at its top, or leave it out'
    )


def section_commands(section: JobSection) -> SectionCommands:
    """The commands and programmed feeds of a section that may switch outputs."""
    fitted, machine = section.fitted, section.pipeline.machine
    feeds = programmed_feeds(fitted) if in_laser_mode(machine) else ()
    return SectionCommands(section.before, section.events, fitted.curve.length_mm, feeds)


def in_laser_mode(machine: Machine) -> bool:
    """Whether the output for S follows the feed after M4."""
    return machine.outputs is not None and machine.outputs.codes.laser_mode


def ignored_kind(command: Command, outputs: Outputs | None) -> str | None:
    """The kind of a command that the machine does not execute, in words; None: it executes it, or it is a motion
    command.
    """
    if is_output(command, outputs):
        return None
    return next((text for kinds, text in _IGNORED.items() if isinstance(command, kinds)), None)


def ignored_note(file: Path, kind: str, lines: Sequence[int]) -> str:
    """The note on all commands of a kind that the machine does not execute."""
    more = f" and {len(lines) - 1} more" if len(lines) > 1 else ""
    effect = "the machine file has no output for it, the motion goes on without"
    if kind == _TOOL_CHANGE:
        effect = "done by hand: run and stream wait there for Enter"
    elif kind == _TOOL_OFFSET:
        effect = (
            "there is no tool table, 0 is added: give the offset with G43.1, or in [work] offset_mm"
        )
    return f"{file}:{min(lines)}: {kind}{more}: {effect}"


def _ignored_commands(path: Toolpath, file: Path, outputs: Outputs | None) -> Iterator[str]:
    """Notes on commands that the machine does not execute, one for each kind."""
    at_rest = [command for section in path.sections for command in section.before]
    within = [event.command for section in path.sections for event in section.events]
    lines: dict[str, list[int]] = {}
    for command in [*at_rest, *path.after, *within]:
        kind = ignored_kind(command, outputs)
        if kind is not None:
            lines.setdefault(kind, []).append(command.line)
    for kind, where in lines.items():
        yield ignored_note(file, kind, where)


@dataclass(frozen=True, eq=False)
class SectionMaker:
    """Makes the sections of a job: fits them and gives them their pipelines.

    feed_mm_s  replaces the programmed feed; None: it stays
    notes      grows by one line for each thing that the user should know
    known      sections made before, which share curves and programs with equal ones; None: nothing is shared
    """

    file: Path
    machine: Machine
    feed_mm_s: float | None
    notes: list[str]
    known: EqualSections | None = None

    def made(self, section: Section) -> Iterator[JobSection]:
        """The fitted section; where no curve was found within the tolerance, its parts with exact stops between
        them.
        """
        if self.feed_mm_s is not None:
            reference = section.reference
            feed = np.where(reference.feed_mm_s < inf, self.feed_mm_s, inf)
            section = replace(section, reference=replace(reference, feed_mm_s=feed))
        if section.stands_at is not None:
            yield from self._parts(self._on_turning_axes(section))
            return
        self._check_plane(section)
        yield from self._parts(section)

    def _parts(self, section: Section) -> Iterator[JobSection]:
        equal = None if self.known is None else self.known.find(section)
        if equal is not None:
            yield self._section(section, equal.fitted, equal.shared)
            return
        limits = _motion_limits(self._moving(section))
        found = fit(section.reference, Tolerance(section.tolerance_mm, limits), section.tied)
        if isinstance(found, FittedPath):
            found = self._turned(section, found)
            shared = SharedPrograms() if self.known is None else self.known.add(section, found)
            yield self._section(section, found, shared)
            return
        reference, chord = section.reference, found.chord
        first, last = (int(reference.line[chord[k]]) for k in (0, -1))
        self.notes.append(
            f"{self.file}:{first}: no curve was found within the tolerance"
            + (f" up to line {last}" if last != first else "")
            + ": exact stops there"
        )
        if reference.count == 1:
            raise PlanError(
                f"{self.file}:{first}: a straight line could not be fitted: please report this file"
            )
        places = np.union1d(reference.place_mm[chord], reference.place_mm[chord + 1])
        for part in cut_at(section, places):
            yield from self._parts(part)

    def _moving(self, section: Section) -> Machine:
        """The machine, with the axes that the section's program moves."""
        return self.machine if section.stands_at is None else self.machine.turning

    def _on_turning_axes(self, section: Section) -> Section:
        """A section of rotary axes alone, with the coordinates of its program's axes as points. Raises InputError: one
        of them is no axis of the machine's path.
        """
        assert section.stands_at is not None
        reference = section.reference
        self._check_turning(reference.point, reference.line)
        point = np.zeros_like(reference.point)
        for k, axis in enumerate(self.machine.turning.path_axes):
            name = axis.name.lower()
            if name in AXES[3:]:
                point[:, k] = reference.point[:, AXES.index(name) - 3]
            elif k < len(AXES) - 3 and self.machine.turning.first_axis + k < 3:
                point[:, k] = section.stands_at[self.machine.turning.first_axis + k]
        return replace(section, reference=replace(reference, point=point))

    def _check_plane(self, section: Section) -> None:
        if len(self.machine.path_axes) > 2:
            return
        height = section.reference.point[:, 2]
        moved = np.flatnonzero(height[1:] != height[:-1])
        if moved.size:
            raise InputError(
                f"{self.file}:{section.reference.line[moved[0]]}: the move changes Z, but only two axes of "
                f'{self.machine.file.name} follow a path: name three of them, path = ["x", "y", "z"], at its top'
            )

    def _turned(self, section: Section, fitted: FittedPath) -> FittedPath:
        """The fitted path with the machine's rotary axes added. Raises InputError and PlanError, naming file and
        line.
        """
        angles = section.reference.turn_deg
        if angles is None:
            return fitted
        self._check_turning(angles, section.reference.line)
        names = [axis.name.lower() for axis in self.machine.path_axes[3:]]
        columns = [AXES.index(name) - 3 if name in AXES[3:] else None for name in names]
        try:
            return with_turning(fitted, columns, section.tolerance_mm, section.tied)
        except PlanError as error:
            raise PlanError(f"{self.file}: {error}") from None

    def _check_turning(self, angles: Real, lines: Int) -> None:
        """Raises InputError, naming the line, where a, b or c moves and is no axis of the machine's path."""
        missing = missing_axes(self.machine)
        for k, name in enumerate(AXES[3:]):
            if name in missing and angles[:, k].any():
                line = lines[max(int(np.argmax(angles[:, k] != 0.0)) - 1, 0)]
                raise no_such_axis(self.file, int(line), name, self.machine)

    def _section(self, section: Section, fitted: FittedPath, shared: SharedPrograms) -> JobSection:
        machine = self._moving(section)
        nominal, zones = _feeds(fitted)
        first = int(section.reference.line[0])
        nodes = np.asarray(fitted.curve.nodal_points)
        file = PathFile(
            file=Path(f"{self.file}:{first}"),
            name=self.file.stem[:_LONGEST_NAME],
            given_path=SpacePathSpec(False, nodes, True, "natural", None, None, "chord"),
            feed=FeedRequest(OPTIMAL, nominal),
            limits=Limits(zones=zones),
            machine_file=None,
        )
        self._check_standing(section, machine)
        self._check_travel(section, fitted, machine)
        places = fitted.arc_length_at(np.array([event.place_mm for event in section.events]))
        events = tuple(
            (float(s), event.command) for s, event in zip(places, section.events, strict=True)
        )
        pipeline = SectionPipeline(file, machine, fitted, shared=shared)
        return JobSection(
            *(fitted, section.tolerance_mm, pipeline, section.before, events, section.tied),
            section.stands_at,
        )

    def _check_travel(self, section: Section, fitted: FittedPath, machine: Machine) -> None:
        """Raises PlanError, naming the line, where the curve leaves the travel of an axis."""
        curve, reference = fitted.curve, section.reference
        coefficients, given = curve.position_coefficients, reference.point
        if curve.extra_axes:
            coefficients = np.concatenate((coefficients, curve.extra), axis=1)
            starts = np.clip(fitted.arc_length_at(reference.place_mm), 0.0, curve.length_mm)
            given = np.concatenate((given, curve.extra_point(starts)), axis=1)
        for k, axis in enumerate(machine.path_axes[: coefficients.shape[1]]):
            offset = machine.offset_mm[k]
            low = coefficients[:, k].min(axis=1) + offset
            high = coefficients[:, k].max(axis=1) + offset
            out = (low < axis.travel_min_mm - _ROUNDING_MM) | (
                high > axis.travel_max_mm + _ROUNDING_MM
            )
            if not out.any():
                continue
            programmed = given[:, k] + offset
            beyond = (programmed < axis.travel_min_mm) | (programmed > axis.travel_max_mm)
            keys = "offset_mm or start_mm" if beyond[0] else "offset_mm"
            ends_beyond = beyond[1:]
            chord = int(np.argmax(ends_beyond))
            if not ends_beyond.any():
                chord = _chord_of(fitted, int(np.argmax(out)))
            line = section.reference.line[chord]
            raise PlanError(
                f"{self.file}:{line}: {axis.name} goes to {low.min():.6g} … {high.max():.6g} {axis.unit} with the work "
                f"offset, its travel is {axis.travel_min_mm:g} … {axis.travel_max_mm:g} {axis.unit}: "
                f"change [work] {keys}, or the program"
            )

    def _check_standing(self, section: Section, machine: Machine) -> None:
        """Raises PlanError, naming the line, where axes before those of the program stand outside their travel: the
        toolpath starts there.
        """
        axes = self.machine.path_axes[: machine.first_axis]
        for axis, own, offset in zip(
            axes, section.stands_at or (), self.machine.offset_mm, strict=False
        ):
            at = own + offset
            if not axis.travel_min_mm - _ROUNDING_MM <= at <= axis.travel_max_mm + _ROUNDING_MM:
                raise PlanError(
                    f"{self.file}:{section.reference.line[0]}: {axis.name} stands at {at:.6g} {axis.unit} with the "
                    f"work offset, its travel is {axis.travel_min_mm:g} … {axis.travel_max_mm:g} {axis.unit}: change "
                    "[work] start_mm or offset_mm"
                )


def _motion_limits(machine: Machine) -> MotionLimits:
    axes = machine.path_axes[:3]
    return MotionLimits(
        min(machine.feed_mm_s, *(axis.velocity_mm_s for axis in axes)),
        min(machine.acceleration_mm_s2, *(axis.acceleration_mm_s2 for axis in axes)),
        min(machine.jerk_mm_s3, *(axis.jerk_mm_s3 for axis in axes)),
    )


def _chord_of(fitted: FittedPath, segment: int) -> int:
    """The chord of the reference where a segment of the curve begins."""
    reference = fitted.reference
    at = int(np.searchsorted(reference.place_mm, fitted.place_mm[segment], side="right")) - 1
    return min(at, reference.count - 1)


def _feeds(fitted: FittedPath) -> tuple[float, tuple[FeedZone, ...]]:
    """The nominal feed and the feed zones of a section."""
    reference = fitted.reference
    feed = np.where(reference.feed_mm_s <= GREATEST_FEED_MM_S, reference.feed_mm_s, inf)
    feed = np.maximum(feed, LEAST_FEED_MM_S)
    nominal = float(feed.max())
    edges = np.flatnonzero(np.append(True, feed[1:] != feed[:-1]))
    ends = np.append(edges[1:], reference.count)
    zones = []
    for first, last in zip(edges.tolist(), ends.tolist(), strict=True):
        value = float(feed[first])
        low, high = fitted.arc_length_at(reference.place_mm[[first, last]]).tolist()
        if value < nominal and high > low:
            zones.append(FeedZone(low, high, value))
    return nominal, tuple(zones)
