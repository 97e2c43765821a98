# SPDX-License-Identifier: MIT
"""Divides a toolpath into sections from rest to rest, with the commands at the rests between them. Used by job,
equal_sections and stream/reading. Takes commands from an iterator that may read the toolpath; no other I/O.

docs/theory/toolpath-fitting.md section 1.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..moves import (
    ORIGIN,
    AnalogOutput,
    ArcMove,
    Blending,
    Command,
    Coolant,
    DigitalOutput,
    Dwell,
    FeedMode,
    Message,
    Move,
    OverrideSwitch,
    PathMode,
    Position,
    ProgramEnd,
    ProgramStop,
    Rotation,
    Spindle,
    SplineMove,
    StraightMove,
    ToolChange,
    ToolOffset,
    ToolSelect,
)
from .corners import SHARPEST_RAD
from .reference import Reference, ReferenceBuilder
from .stations import SHORTEST_MM, outline

Real = NDArray[np.float64]

SAG_SHARE = 0.01
"""Share of the tolerance for the error of chords of an arc or a spline."""

EXACT_MM = 1e-3
"""Error of chords of arcs and splines where the tolerance is 0."""

_STRAIGHT_RAD = 1e-6
"""Greatest change of direction between moves of G61 that is no corner."""

_STOPS = (Dwell, Spindle, Coolant, ToolChange, ProgramStop)

_LONG_TOLERANCES = 10.0
"""Length of a path that is always a section, wherever it ends."""


@dataclass(frozen=True, eq=False)
class PathEvent:
    """A command that happens in motion, where the programmed path has the place `place_mm`."""

    place_mm: float
    command: Command


@dataclass(frozen=True, eq=False)
class Section:
    """Moves from rest to rest.

    reference     the programmed path
    tolerance_mm  how far the curve may be from it
    before        commands at rest, before the section starts
    events        commands within it
    tied          whether start and end are no rests, but in the middle of a chord of a longer section: the curve is
                  straight there, in the direction of the chord
    stands_at     of a section that turns a, b and c alone: where x, y and z stand, mm. The points of its reference are
                  (a, b, c), and degrees take the place of mm. None: x, y or z move
    """

    reference: Reference
    tolerance_mm: float
    before: tuple[Command, ...] = ()
    events: tuple[PathEvent, ...] = ()
    tied: tuple[bool, bool] = (False, False)
    stands_at: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Toolpath:
    """All sections, and the commands at rest at the end."""

    sections: tuple[Section, ...]
    after: tuple[Command, ...]


@dataclass
class Divider:
    """Collects moves until a command or a corner needs a stop."""

    file: str
    asked_mm: float
    builder: ReferenceBuilder
    sections: list[Section] = field(default_factory=list)
    before: list[Command] = field(default_factory=list)
    events: list[PathEvent] = field(default_factory=list)
    blending: Blending = Blending.CONTINUOUS
    tolerance_mm: float = 0.0
    moved: bool = False
    direction: Real | None = None
    tied: bool = False
    stands_at: tuple[float, float, float] | None = None
    laser_mode: bool = False
    rotation: Rotation = Rotation.STOPPED

    def take(self, command: Command) -> None:
        """The next command."""
        if isinstance(command, StraightMove | ArcMove | SplineMove):
            self._move(command)
        elif isinstance(command, PathMode):
            self._mode(command)
        elif isinstance(command, Spindle):
            self._spindle(command)
        elif isinstance(command, _STOPS):
            self._stopped_for(command)
        elif isinstance(command, DigitalOutput | AnalogOutput):
            self._output(command)
        elif isinstance(command, ToolSelect | ToolOffset | OverrideSwitch | Message):
            self._without_stop(command)
        elif isinstance(command, ProgramEnd):
            self._stopped_for(command)

    def _stopped_for(self, command: Command) -> None:
        self.stop()
        self.before.append(command)

    def _without_stop(self, command: Command) -> None:
        if self.moved:
            self._within(command)
        else:
            self.before.append(command)

    def _spindle(self, command: Spindle) -> None:
        """A command at rest. If it only changes S of a laser that follows the feed, the axes do not stop."""
        before, self.rotation = self.rotation, command.rotation
        dynamic = before is command.rotation is Rotation.COUNTERCLOCKWISE
        if self.laser_mode and dynamic:
            self._without_stop(command)
        else:
            self._stopped_for(command)

    def _move(self, move: Move) -> None:
        turned = self._turned_alone(move)
        if turned is None and self.stands_at is not None:
            self._go_from_turning()
        elif turned is not None:
            if self.stands_at is None:
                self._go_to_turning()
            move = turned
        if self.blending is Blending.EXACT_PATH and not self._goes_straight_on(move):
            self.stop()
        self._add(move)
        if self.blending is Blending.EXACT_STOP or self.tolerance_mm == 0.0:
            self.stop()

    def _turned_alone(self, move: Move) -> StraightMove | None:
        """The move with (a, b, c) in place of x, y, z, if it moves rotary axes alone: x, y and z move less than a path
        needs. None: x, y and z move.
        """
        if not isinstance(move, StraightMove):
            return None
        here = self._place
        turns = move.end[3:] != here[3:]
        if not turns and self.stands_at is None:
            return None
        length = float(np.linalg.norm(np.subtract(move.end[:3], here[:3])))
        if length >= SHORTEST_MM or (not turns and length):
            return None
        feed = move.feed
        if feed is not None and feed.mode is not FeedMode.INVERSE_TIME:
            feed = replace(feed, feed_mm_s=feed.feed_deg_s)
        return StraightMove(move.line, (*move.end[3:], 0.0, 0.0, 0.0), feed)

    @property
    def _place(self) -> Position:
        """The end of the moves so far. Shorter moves of x, y and z than a path needs are added to the next one."""
        own = self.builder.position
        return own if self.stands_at is None else (*self.stands_at, *own[:3])

    def _go_to_turning(self) -> None:
        """Ends the section. The next one moves a, b and c alone."""
        self.stop()
        here = self.builder.position
        self.stands_at = here[:3]
        self._begin_at((*here[3:], 0.0, 0.0, 0.0))

    def _go_from_turning(self) -> None:
        """Ends the section of a, b and c alone."""
        self.stop()
        here = self._place
        self.stands_at = None
        self._begin_at(here)

    def _begin_at(self, start: Position) -> None:
        self.builder = ReferenceBuilder(start, SAG_SHARE * self.section_tolerance)
        self.direction = None

    def _add(self, move: Move) -> None:
        before = self.builder.position
        self.builder.add(move)
        self.moved = True
        if self.blending is not Blending.EXACT_PATH:
            return
        if isinstance(move, StraightMove):
            leg = np.subtract(move.end[:3], before[:3])
            length = float(np.linalg.norm(leg))
            self.direction = leg / length if length > 0.0 else self.direction
        else:
            self.direction = None

    def _goes_straight_on(self, move: Move) -> bool:
        """Whether a straight move has the direction of the straight move before it."""
        if self.direction is None or not isinstance(move, StraightMove):
            return False
        leg = np.subtract(move.end[:3], self.builder.position[:3])
        along = float(leg @ self.direction)
        aside = float(np.linalg.norm(leg - along * self.direction))
        return along >= 0.0 and aside <= _STRAIGHT_RAD * along

    def _mode(self, mode: PathMode) -> None:
        own = [self.asked_mm]
        own += [
            one
            for one in (mode.tolerance_mm, mode.fit_tolerance_mm)
            if one is not None and one > 0.0
        ]
        tolerance = min(own)
        if mode.blending is self.blending and tolerance == self.tolerance_mm:
            return
        self.stop()
        self.blending = mode.blending
        self.tolerance_mm = tolerance
        self.builder = ReferenceBuilder(self.builder.position, SAG_SHARE * self.section_tolerance)

    @property
    def section_tolerance(self) -> float:
        """Tolerance of the section."""
        if self.blending is Blending.CONTINUOUS and self.tolerance_mm > 0.0:
            return self.tolerance_mm
        return min(self.tolerance_mm or EXACT_MM, EXACT_MM)

    def _output(self, command: DigitalOutput | AnalogOutput) -> None:
        if command.synchronised:
            self._within(command)
        else:
            self._stopped_for(command)

    def _within(self, command: Command) -> None:
        self.events.append(PathEvent(self.builder.length_mm, command))

    def add(self, reference: Reference, *, ends_tied: bool) -> None:
        """Adds the collected moves as sections; `ends_tied`: the last one continues in motion."""
        whole = Section(
            reference,
            self.section_tolerance,
            tuple(self.before),
            tuple(self.events),
            (self.tied, ends_tied),
            self.stands_at,
        )
        self.sections.extend(_without_reversals(whole))
        self.before, self.events, self.tied = [], [], ends_tied

    def stop(self) -> None:
        """Ends the section: the next move starts from rest."""
        if not self.moved:
            return
        reference = self.builder.reference()
        if reference.count and float(reference.place_mm[-1]) >= SHORTEST_MM:
            self.add(reference, ends_tied=False)
            begin = self.builder.position
        else:  # too short for a section: the next section includes it
            begin = self.builder.start
        self.builder = ReferenceBuilder(begin, SAG_SHARE * self.section_tolerance)
        self.moved = False


def divided(
    commands: Iterable[Command],
    tolerance_mm: float,
    file: str,
    start: Position = ORIGIN,
    *,
    laser_mode: bool = False,
) -> Toolpath:
    """The sections of a toolpath.

    tolerance_mm  greatest distance of curves from the programmed path; 0: exact stops everywhere. A lower tolerance in
                  the toolpath (G64 P) counts
    laser_mode    whether S after M4 changes in motion
    Raises InputError, naming file and line: moves that have no path.
    """
    divider = Divider(
        file,
        tolerance_mm,
        ReferenceBuilder(start, SAG_SHARE * (tolerance_mm or EXACT_MM)),
        laser_mode=laser_mode,
    )
    divider.tolerance_mm = tolerance_mm
    for command in commands:
        divider.take(command)
    divider.stop()
    return Toolpath(tuple(divider.sections), tuple(divider.before))


def _without_reversals(section: Section) -> Iterator[Section]:
    """The section cut where it turns so sharply that a stop costs no more than a curve."""
    if section.reference.count == 1:
        yield section
        return
    path = outline(section.reference, section.tolerance_mm, section.tied)
    sharp = path.place_mm[path.turn_rad > SHARPEST_RAD]
    yield from cut_at(section, sharp)


def _far_apart(section: Section, inner: list[int]) -> list[int]:
    """The inner points at which the section may be cut: the ends of each part are as far apart as a section has to be
    long, or the part is longer than any curve within the tolerance could shorten. A smaller hook stays inside a part.
    All points, if none would remain.
    """
    reference, last = section.reference, section.reference.count
    long_mm = max(SHORTEST_MM, _LONG_TOLERANCES * section.tolerance_mm)

    def is_far(begin: int, end: int) -> bool:
        distance_mm = np.linalg.norm(reference.point[end] - reference.point[begin])
        length_mm = reference.place_mm[end] - reference.place_mm[begin]
        return bool(distance_mm >= SHORTEST_MM or length_mm >= long_mm)

    kept = [0]
    for k in inner:
        if is_far(kept[-1], k):
            kept.append(k)
    while len(kept) > 1 and not is_far(kept[-1], last):
        kept.pop()
    return kept[1:] or inner


def cut_at(section: Section, places: np.ndarray) -> Iterator[Section]:
    """The section in parts, with stops at points of the reference that have these places."""
    own = section.reference.place_mm
    at = np.unique(np.searchsorted(own, places))
    inner = [int(k) for k in at if 0 < k < section.reference.count]
    edges = [0, *_far_apart(section, inner), section.reference.count]
    before = section.before
    for first, last in itertools.pairwise(edges):
        low, high = float(own[first]), float(own[last])
        final = last == edges[-1]
        events = tuple(
            PathEvent(event.place_mm - low, event.command)
            for event in section.events
            if low <= event.place_mm < high or (final and event.place_mm == high)
        )
        tied = (first == 0 and section.tied[0], final and section.tied[1])
        part = section.reference.part(first, last)
        yield replace(section, reference=part, before=before, events=events, tied=tied)
        before = ()
