# SPDX-License-Identifier: MIT
"""Toolpaths of any length as sections, read and fitted part by part; the first stage of streaming. Used by stream/plan,
stream/reading_process and stream/resuming. Reads the toolpath file or stdin.

A section with more chords than are fitted at once (a fitting window) is cut in the middle of chords where the path is
nearly straight. At a cut the curves of both parts have the direction of the chord and curvature 0, so they join C2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..config import SPACE_AXES, Machine
from ..errors import InputError
from ..events import Events, events_of, no_events
from ..feed.request import GREATEST_FEED_MM_S
from ..job import (
    GREATEST_TOLERANCE_MM,
    JobSection,
    SectionMaker,
    ignored_kind,
    ignored_note,
    in_laser_mode,
    section_commands,
    toolpath_commands,
    work_frame,
)
from ..job_outputs import EventMaker, without_effect
from ..spline.spatial import sliced
from ..toolpath.files import ReadOptions, replaced_feed_mm_s
from ..toolpath.fit.reference import ReferenceBuilder
from ..toolpath.fit.sections import EXACT_MM, SAG_SHARE, Divider, Section
from ..toolpath.fit.stations import SHORTEST_MM, turns
from ..toolpath.moves import Command, Move
from .geometry import Block, Chords, with_joints

WINDOW_CHORDS = 1500
"""Chords that are fitted at once; the first window of a job is shorter, so that it starts soon."""
FIRST_CHORDS = 300
"""Chords of the first fitting window: short, so that the motion begins soon."""

_SEARCHED = 200
"""Chords after a window among which the cut is chosen; if none of them is straight, as many again are searched."""

_STRAIGHT = 5e-4
"""Greatest change of direction at both ends of a chord that counts as straight, rad. A cut in another chord costs about
30 ms of motion, since both curves are straight there.
"""

_LONGEST = 3
"""After this many lengths of a window, the straightest chord found is cut."""

_BESIDE_MM = 1e-6

_LEAST_CUT_MM = 0.05
"""A segment is not cut closer to its ends where the feed changes."""

_SHORT_SHARE = 0.5
"""Chords shorter than this share of the median length are not cut."""


@dataclass
class _Windows(Divider):
    """A divider that also cuts sections which are too long to be fitted at once, about every `window` chords."""

    window: int = field(kw_only=True)
    searched: int = 0

    @property
    def begun(self) -> bool:
        """Whether the next section has begun, so that `before` holds all commands at rest before it."""
        return self.moved and self.builder.length_mm >= SHORTEST_MM

    def _move(self, move: Move) -> None:
        super()._move(move)
        while self.builder.count > self.window + self.searched + _SEARCHED:
            chord, turn = _straightest(self.builder, self.window + self.searched, _SEARCHED)
            self.searched += _SEARCHED
            if turn > _STRAIGHT:
                if self.window + self.searched < _LONGEST * self.window:
                    continue
                chord, turn = _straightest(self.builder, self.window, self.searched)
            if not np.isfinite(turn):
                break
            self.add(self.builder.cut(chord), ends_tied=True)
            self.window, self.searched = WINDOW_CHORDS, 0


def _straightest(builder: ReferenceBuilder, first: int, count: int) -> tuple[int, float]:
    """The chord from the first one on where the path turns least, and by how much; inf: none is long enough."""
    point = builder.points(first - 1, first + count + 2)
    length = np.linalg.norm(np.diff(point, axis=0), axis=1)
    if not length.all():
        return first, 0.0
    turn = turns(point)
    if builder.turns:
        turn = _turns_of_all(np.hstack((point, builder.angles(first - 1, first + count + 2))))
    cost = turn[1:-2] + turn[2:-1]
    cost[length[1:-1] < _SHORT_SHARE * np.median(length)] = np.inf
    at = int(np.argmin(cost))
    return first + at, float(cost[at])


def _turns_of_all(point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Change of direction (n,) at points (n, 6) of all axes, 0 at the ends; rad. A degree counts as a mm, as in
    tolerances.
    """
    leg = np.diff(point, axis=0)
    leg /= np.linalg.norm(leg, axis=1)[:, None]
    apart, along = (np.linalg.norm(leg[1:] + sign * leg[:-1], axis=1) for sign in (-1.0, 1.0))
    return np.pad(2.0 * np.arctan2(apart, along), 1)


@dataclass(frozen=True, eq=False)
class StreamSection:
    """Moves from rest to rest, read as its blocks are read.

    file, first_line  where it begins
    before            commands at rest, before it starts
    blocks            its path; reading them reads the file
    next_start        start of the next section, (A,) in mm and degrees, known once all blocks are read; None: this is
                      the last one, or the next one moves other axes
    machine           with the axes that its programs move; where rotary axes move alone, without x, y and perhaps z
    standing_mm       positions of the axes before those of its programs, without the work offset
    """

    file: Path
    first_line: int
    before: tuple[Command, ...]
    blocks: Iterator[Block]
    next_start: Callable[[], NDArray[np.float64] | None]
    machine: Machine
    standing_mm: tuple[float, ...] = ()


@dataclass
class StreamReader:
    """Reads a toolpath file section by section. Each section has to be read to its end before the next.

    notes  one line for each thing that the user should know; grows while the file is read
    after  commands at rest at the end, known then
    with_chords  whether blocks have the chords of the programmed path
    """

    file: Path
    machine: Machine
    tolerance_mm: float
    reading: ReadOptions
    notes: list[str] = field(default_factory=list)
    after: tuple[Command, ...] = ()
    with_chords: bool = False

    def sections(self) -> Iterator[StreamSection]:
        """The sections in order. Raises InputError and PlanError, naming the line."""
        if not 0.0 <= self.tolerance_mm <= GREATEST_TOLERANCE_MM:
            raise InputError(
                f"--tolerance {self.tolerance_mm:g}: must be from 0 to {GREATEST_TOLERANCE_MM:g} mm"
            )
        parts = self._parts()
        part = next(parts, None)
        if part is None:
            raise InputError(f"{self.file}: moves nothing: a job needs a move of 2 um at least")
        while part is not None:
            rest = _Rest(part, parts, with_chords=self.with_chords)
            first = part.section
            yield StreamSection(
                self.file,
                first.first_line,
                first.before,
                rest.blocks(),
                rest.next_start,
                first.pipeline.machine,
                tuple(first.standing_mm.tolist()),
            )
            part = rest.next_part

    def _parts(self) -> Iterator[_Part]:
        """Fitted parts, tied to each other or from rest to rest."""
        sections = SectionMaker(
            self.file, self.machine, replaced_feed_mm_s(self.file, self.reading), self.notes
        )
        outputs = self.machine.outputs
        events = None if outputs is None else EventMaker(outputs, self.file)
        first, noted = True, False
        for divided in self._divided():
            if events is None:
                yield from (_Part(made) for made in sections.made(divided.section))
                continue
            for made, final in _with_final(sections.made(divided.section)):
                if first:
                    made = replace(made, before=events.before_first(made.before))
                own = events.section(
                    section_commands(made),
                    divided.after if final else (),
                    is_first=first,
                    is_last=divided.is_last and final,
                )
                if events.lost and not noted:  # the first one only: the axes move meanwhile
                    self.notes.append(without_effect(self.file, events.lost[0]))
                    noted = True
                if divided.is_last and final:
                    self.after = events.after_last(self.after)
                # A controller's job begins with all outputs off; the host has switched those before the first section.
                begun = own.repeated if first else []
                yield _Part(made, events_of([*begun, *own.events]))
                first = False

    def _divided(self) -> Iterator[_Divided]:
        """Sections, or parts of them, before fitting. If the machine has outputs, a section is held back until the
        commands at rest after it are known, when the next one begins.
        """
        sag = SAG_SHARE * (self.tolerance_mm or EXACT_MM)
        start = work_frame(self.machine).start
        divider = _Windows(
            str(self.file), self.tolerance_mm, ReferenceBuilder(start, sag), window=FIRST_CHORDS
        )
        divider.tolerance_mm = self.tolerance_mm
        divider.laser_mode = in_laser_mode(self.machine)
        waits = self.machine.outputs is not None
        held: Section | None = None
        for command in self._commands():
            divider.take(command)
            for section in divider.sections:
                if held is not None:
                    yield _Divided(held, section.before)
                held = section
                if section.tied[1] or not waits:
                    yield _Divided(section)
                    held = None
            divider.sections.clear()
            if held is not None and divider.begun:
                yield _Divided(held, tuple(divider.before))
                held = None
        divider.stop()
        for section in divider.sections:
            if held is not None:
                yield _Divided(held, section.before)
            held = section
        self.after = tuple(divider.before)
        if held is not None:
            yield _Divided(held, self.after, is_last=True)

    def _commands(self) -> Iterator[Command]:
        """The commands of the file. The first one of each kind that the machine does not execute is noted."""
        noted: set[str] = set()
        for command in toolpath_commands(self.file, self.machine, self.reading, self.notes):
            kind = ignored_kind(command, self.machine.outputs)
            if kind is not None and kind not in noted:
                noted.add(kind)
                self.notes.append(ignored_note(self.file, kind, [command.line]))
            yield command


@dataclass(frozen=True, eq=False)
class _Divided:
    """A section, or a part of one, with the commands at rest after it; `is_last`: the file ends there."""

    section: Section
    after: tuple[Command, ...] = ()
    is_last: bool = False


@dataclass(frozen=True, eq=False)
class _Part:
    """A fitted part with its events."""

    section: JobSection
    events: Events = field(default_factory=no_events)


def _with_final(parts: Iterator[JobSection]) -> Iterator[tuple[JobSection, bool]]:
    """Each part, and whether it is the last one of its section."""
    held = next(parts, None)
    for part in parts:
        assert held is not None
        yield held, False
        held = part
    if held is not None:
        yield held, True


class _Rest:
    """The parts of a section after its first one; `next_part` is the first of the next section once all are read."""

    def __init__(self, part: _Part, parts: Iterator[_Part], *, with_chords: bool) -> None:
        self.next_part: _Part | None = None
        self._part, self._parts, self._with_chords = part, parts, with_chords

    def next_start(self) -> NDArray[np.float64] | None:
        """Where the next section starts, if it moves the same axes."""
        if (
            self.next_part is None
            or self.next_part.section.stands_at != self._part.section.stands_at
        ):
            return None
        return np.asarray(self.next_part.section.pipeline.curve.axes_nodes[0])

    def blocks(self) -> Iterator[Block]:
        part: _Part | None = self._part
        while part is not None:
            chords = chords_of(part.section) if self._with_chords else None
            yield replace(block_of(part.section), events=part.events, chords=chords)
            tied = part.section.tied[1]
            part = next(self._parts, None)
            if part is not None and not tied:
                self.next_part = part
                return


def chords_of(section: JobSection) -> Chords:
    """The chords of a section, or of a part of one. Where rotary axes move alone, their distances are not known."""
    fitted, reference = section.fitted, section.fitted.reference
    start_mm = np.maximum(fitted.arc_length_at(reference.place_mm[:-1]), 0.0)
    off_mm = np.full(reference.count, np.inf)
    if section.stands_at is None:
        drawn = section.pipeline.curve.axes_point(start_mm)[:, :SPACE_AXES]
        programmed = reference.point[:-1, : drawn.shape[1]]
        off_mm = np.asarray(np.linalg.norm(drawn - programmed, axis=1))
    return Chords(reference.line, start_mm, off_mm)


def block_of(section: JobSection) -> Block:
    """The curve of a section, or of a part of one, with the feeds and lines of its segments. A segment ends where the
    programmed feed changes. Where its parts would be too short, it is not cut and has the lower feed.
    """
    fitted, reference = section.fitted, section.fitted.reference
    edges = fitted.place_mm
    changes = reference.place_mm[1:-1][reference.feed_mm_s[1:] != reference.feed_mm_s[:-1]]
    after = np.searchsorted(edges, changes)
    apart = np.minimum(changes - edges[after - 1], edges[after] - changes)
    cuts = changes[apart > _LEAST_CUT_MM]
    cuts = cuts[np.append(True, np.diff(cuts) > _LEAST_CUT_MM)] if cuts.size else cuts
    curve = with_joints(section.pipeline.curve, fitted.arc_length_at(cuts))
    place = np.sort(np.concatenate((edges, cuts)))
    # The feed of the next chord, which may be lower, does not count for a segment that ends where a chord does.
    low = np.searchsorted(reference.place_mm, place[:-1] + _BESIDE_MM, side="right") - 1
    high = np.searchsorted(reference.place_mm, place[1:] - _BESIDE_MM, side="left")
    low = np.clip(low, 0, reference.count - 1)
    high = np.clip(high, low + 1, reference.count)
    padded = np.append(np.minimum(reference.feed_mm_s, GREATEST_FEED_MM_S), np.inf)
    ranges = np.column_stack((low, high)).ravel()
    feed = np.minimum.reduceat(padded, ranges)[::2]
    return Block(sliced(curve, 0), feed, reference.line[low])
