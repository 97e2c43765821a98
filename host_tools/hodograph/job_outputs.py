# SPDX-License-Identifier: MIT
"""Outputs of a toolpath (M62 to M65, M67, M68, and spindle and coolant where the machine file maps them) as events of
its sections' programs. Used by job, job_run and stream/. No I/O.

A command within a section acts at its place on the curve. A command at rest acts with the first setpoint of the next
section. If a dwell, a tool change or a program stop follows it at the same rest, it acts with the last setpoint of the
section before, so that it has acted when the wait begins. Before the first section, and after the first wait at the end
of the toolpath, no program is there to do so: the host switches these outputs at standstill (`SwitchedAtRest`). The end
of the program switches spindle and coolant off, as M5 and M9 do; other outputs stay. Each program begins with all
outputs off, so each section first repeats what is on.

In laser mode after M4, the output for S is proportional to the feed. Wherever the programmed feed changes, an event
sets the factor that gives S at that feed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path

import numpy as np

from .config.outputs import Channel, Outputs
from .errors import InputError
from .events import DIGITAL, Event, Events, SwitchedOutputs, events_of
from .fixed_point import nearest_q40
from .toolpath.fit.fitting import FittedPath
from .toolpath.moves import (
    AnalogOutput,
    Command,
    Coolant,
    DigitalOutput,
    Dwell,
    ProgramEnd,
    ProgramStop,
    Rotation,
    Spindle,
    SwitchedAtRest,
    ToolChange,
)

Commands = tuple[Command, ...]

WAITS = (Dwell, ProgramStop, ToolChange)
"""Commands at which a machine waits at rest."""


def acts_at_rest(commands: Iterable[Command]) -> bool:
    """Whether the host waits at some of the commands, or switches outputs."""
    return any(isinstance(command, (*WAITS, SwitchedAtRest)) for command in commands)


@dataclass(frozen=True)
class ProgrammedFeed:
    """The programmed feed from an arc length on, mm/s (inf: a rapid move), and its source line."""

    s_mm: float
    feed_mm_s: float
    line: int


@dataclass(frozen=True)
class SectionCommands:
    """Commands and feeds of a section.

    before      commands at rest before it
    within  commands within it, with their arc lengths in mm
    length_mm   its length
    feeds       its programmed feeds; the first one from its start"""

    before: tuple[Command, ...]
    within: tuple[tuple[float, Command], ...]
    length_mm: float
    feeds: tuple[ProgrammedFeed, ...] = ()


def programmed_feeds(fitted: FittedPath) -> tuple[ProgrammedFeed, ...]:
    """The programmed feeds of a section: one at its start, then one at each change."""
    reference = fitted.reference
    feed = reference.feed_mm_s
    first = np.flatnonzero(np.append(True, feed[1:] != feed[:-1]))
    places_mm = np.maximum(fitted.arc_length_at(reference.place_mm[first]), 0.0)
    rows = zip(
        places_mm.tolist(), feed[first].tolist(), reference.line[first].tolist(), strict=True
    )
    return tuple(ProgrammedFeed(*row) for row in rows)


def is_output(command: Command, outputs: Outputs | None) -> bool:
    """Whether the machine carries the command out by its outputs."""
    if outputs is None:
        return False
    if isinstance(command, Spindle):
        return outputs.codes.has_spindle
    if isinstance(command, Coolant):
        return outputs.codes.has_coolant
    return isinstance(command, DigitalOutput | AnalogOutput)


def with_spindle_waits(commands: Iterable[Command], outputs: Outputs | None) -> Iterable[Command]:
    """The commands, with the wait of the machine file (`spindle_wait_s`) where the spindle starts or turns over."""
    wait_s = 0.0 if outputs is None else outputs.codes.spindle_wait_s
    return _with_waits(commands, wait_s) if wait_s else commands


def _with_waits(commands: Iterable[Command], wait_s: float) -> Iterator[Command]:
    turns = Rotation.STOPPED
    for command in commands:
        yield command
        if isinstance(command, Spindle):
            if command.rotation not in (Rotation.STOPPED, turns):
                yield Dwell(command.line, wait_s)
            turns = command.rotation


@dataclass(frozen=True)
class JobEvents:
    """Outputs of a whole toolpath.

    events  of each section's program
    before  commands at rest before the first section, with what the host switches
    after   the same at the end of the toolpath
    """

    events: list[Events]
    before: Commands
    after: Commands


def job_events(
    sections: Sequence[SectionCommands],
    after: Commands,
    outputs: Outputs,
    file: Path,
    notes: list[str],
) -> JobEvents:
    """The outputs of a toolpath of at least one section; `notes` grows by one line if outputs are switched and then
    switched again after a wait, before the axes move. Raises InputError: the machine lacks an output, or a value is too
    large.
    """
    maker = EventMaker(outputs, file)
    begin = maker.before_first(sections[0].before)
    found = []
    for i, section in enumerate(sections):
        last = i + 1 == len(sections)
        following = after if last else sections[i + 1].before
        own = maker.section(section, following, is_first=i == 0, is_last=last)
        found.append(events_of([*own.repeated, *own.events]))
    end = maker.after_last(after)
    if maker.lost:
        notes.append(without_effect(file, maker.lost[0], len(maker.lost) - 1))
    return JobEvents(found, begin, end)


def without_effect(file: Path, line: int, others: int = 0) -> str:
    """The note on a switch that has no effect, and on `others` like it."""
    more = f" and {others} more" if others else ""
    return (
        f"{file}:{line}: output switched without effect{more}: it is switched again after a wait, "
        "with no move between"
    )


@dataclass(frozen=True)
class SectionEvents:
    """Events of a section: those at its start that repeat which outputs are on, and its own."""

    repeated: list[Event]
    events: list[Event]


def _at_first_wait(commands: Commands, *, is_last: bool = False) -> tuple[Commands, Commands]:
    """Commands before the first wait, which act at the end of the section before them, and those from it on. Without a
    wait all act at the start of the next section, or at the end if there is none.
    """
    waits = [i for i, command in enumerate(commands) if isinstance(command, WAITS)]
    at = waits[0] if waits else len(commands) if is_last else 0
    return commands[:at], commands[at:]


def _after_last_wait(commands: Commands) -> tuple[Commands, Commands]:
    """Commands up to the last wait, and those after it."""
    waits = [i + 1 for i, command in enumerate(commands) if isinstance(command, WAITS)]
    at = waits[-1] if waits else 0
    return commands[:at], commands[at:]


@dataclass
class EventMaker:
    """Makes the events of the sections of a toolpath, one after the other, and keeps the state of the outputs."""

    outputs: Outputs
    file: Path
    last: dict[str, Event] = field(default_factory=dict)
    feed: ProgrammedFeed | None = None
    power: float | None = None
    """S while its output follows the feed; None: it does not."""
    lost: list[int] = field(default_factory=list)
    """Lines of commands that have no effect, since another one after a wait takes their place."""

    def section(
        self,
        section: SectionCommands,
        after: Commands,
        *,
        is_first: bool = False,
        is_last: bool = False,
    ) -> SectionEvents:
        """The events of the next section, or part of one. Before the first one call `before_first`, after the last one
        `after_last`.

        after  the commands at rest after it

        Raises InputError: the machine lacks an output, or a value is too large.
        """
        repeated = self._repeated()
        late = (_after_last_wait if is_first else _at_first_wait)(section.before)[1]
        begin = [*self._at_feeds(section.feeds[:1]), *self.changed(0, late)]
        moving = self._within(section)
        end_q40 = nearest_q40(section.length_mm)
        early = _at_first_wait(after, is_last=is_last)[0]
        return SectionEvents(repeated, [*begin, *moving, *self.changed(end_q40, early)])

    def before_first(self, commands: Commands) -> Commands:
        """Commands at rest before the first section, with what the host switches before the waits."""
        waited, late = _after_last_wait(commands)
        return (*self._at_rest(waited), *late)

    def after_last(self, commands: Commands) -> Commands:
        """Commands at rest after the last section, with what the host switches from the first wait on."""
        early, late = _at_first_wait(commands, is_last=True)
        return (*early, *self._at_rest(late))

    def _at_rest(self, commands: Commands) -> Iterator[Command]:
        """The commands, each that switches outputs followed by the outputs from there on."""
        for command in commands:
            yield command
            if self.changed(0, [command]):
                state = SwitchedOutputs()
                state.act(events_of(self._repeated()))
                yield SwitchedAtRest(command.line, state.at_rest)

    def _within(self, section: SectionCommands) -> list[Event]:
        """Events of commands and of changes of the feed, in the order of their places."""
        found: list[Event] = []
        feeds = list(section.feeds[1:])
        for s_mm, command in section.within:
            passed = [feed for feed in feeds if feed.s_mm <= s_mm]
            del feeds[: len(passed)]
            found += [*self._at_feeds(passed), *self.changed(nearest_q40(s_mm), [command])]
        return found + self._at_feeds(feeds)

    def _at_feeds(self, feeds: Iterable[ProgrammedFeed]) -> list[Event]:
        """Events for changes of the programmed feed; none unless S follows the feed."""
        found = []
        channel = self.outputs.codes.speed
        for feed in feeds:
            self.feed = feed
            if self.power is None or channel is None:
                continue
            event = self._power(channel, nearest_q40(feed.s_mm), feed.line)
            if self.last[channel.name][1:] != event[1:]:
                self.last[channel.name] = event
                found.append(event)
        return found

    def _power(self, channel: Channel, place_q40: int, line: int) -> Event:
        """The event that makes the output proportional to the feed, with value S at the programmed feed."""
        assert self.power is not None
        feed_mm_s = inf if self.feed is None else self.feed.feed_mm_s
        per_mm_s = self.power / feed_mm_s if feed_mm_s > 0.0 else 0.0
        return channel.proportional(place_q40, per_mm_s, f"{self.file}:{line}")

    def _repeated(self) -> list[Event]:
        """Events at the start of a program that restore the outputs."""
        digital = [event for event in self.last.values() if event.kind == DIGITAL]
        mask, levels = 0, 0
        for event in digital:
            mask, levels = mask | event.mask, levels | event.value
        found = [Event(0, DIGITAL, 0, mask, levels)] if levels else []
        analogue = [event for event in self.last.values() if event.kind != DIGITAL and event.value]
        return found + [event._replace(place_q40=0) for event in analogue]

    def changed(self, place_q40: int, commands: Iterable[Command]) -> list[Event]:
        """Events of commands at one place; if several switch one output, the last one counts."""
        found: dict[str, Event] = {}
        since: dict[str, tuple[int, int]] = {}
        waits = 0
        for command in commands:
            waits += isinstance(command, WAITS)
            for channel, event in self._events(place_q40, command):
                found.pop(channel.name, None)
                passed, line = since.pop(channel.name, (waits, 0))
                state = self.last.get(channel.name)
                if passed < waits and state is not None and state[1:] != event[1:]:
                    self.lost.append(line)
                if event.value if state is None else state[1:] != event[1:]:
                    since[channel.name] = waits, command.line
                found[channel.name] = self.last[channel.name] = event
        return list(found.values())

    def _events(self, place_q40: int, command: Command) -> list[tuple[Channel, Event]]:
        where = f"{self.file}:{command.line}"
        if isinstance(command, DigitalOutput):
            channel = self._numbered(command.output, where, digital=True)
            return [(channel, channel.switched(place_q40, command.on))]
        if isinstance(command, AnalogOutput):
            channel = self._numbered(command.output, where, digital=False)
            return [(channel, channel.valued(place_q40, command.value, where))]
        codes = self.outputs.codes
        if isinstance(command, ProgramEnd):
            return self._ended(place_q40, command.line)
        if isinstance(command, Coolant):
            switches = ((codes.mist, command.mist), (codes.flood, command.flood))
        elif isinstance(command, Spindle):
            turns = command.rotation is not Rotation.STOPPED
            reverse = command.rotation is Rotation.COUNTERCLOCKWISE
            switches = ((codes.spindle, turns), (codes.spindle_reverse, reverse))
        else:
            return []
        found = [(one, one.switched(place_q40, on)) for one, on in switches if one is not None]
        if isinstance(command, Spindle) and codes.speed is not None:
            self.power = command.speed_rev_min if reverse and codes.laser_mode else None
            speed = command.speed_rev_min if turns else 0.0
            event = codes.speed.valued(place_q40, speed, where)
            if self.power is not None:
                event = self._power(codes.speed, place_q40, command.line)
            found.append((codes.speed, event))
        return found

    def _ended(self, place_q40: int, line: int) -> list[tuple[Channel, Event]]:
        """The events of M5 and M9, for outputs that are on."""
        codes = (Spindle(line, Rotation.STOPPED, 0.0), Coolant(line, mist=False, flood=False))
        return [
            (channel, event)
            for code in codes
            for channel, event in self._events(place_q40, code)
            if channel.name in self.last and self.last[channel.name].value
        ]

    def _numbered(self, number: int, where: str, *, digital: bool) -> Channel:
        for one in self.outputs.channels:
            if (one.digital, one.number) == (digital, number):
                return one
        kind = "digital" if digital else "analogue"
        raise InputError(
            f"{where}: the machine has no {kind} output {number}: "
            f"add it to [outputs.channel], name = {{ {kind} = {number} }}"
        )
