# SPDX-License-Identifier: MIT
"""Outputs of a toolpath (M62 to M65, M67, M68, and spindle and coolant where the machine file maps them) as events of
its sections' programs.

A command on the way acts where the curve has its place. One at rest acts with the first setpoint of the section that
follows it. One at rest that is followed by a dwell, a tool change or a program stop acts with the last setpoint of the
section before it, so that it is done when the dwell begins. The end of the program switches spindle and coolant off
with the last setpoint, as M5 and M9 do; other outputs stay. Each program begins with all outputs off, so each section
first repeats what is on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .config.outputs import Channel, Outputs
from .errors import InputError
from .events import DIGITAL, Event, Events, events_of
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
    ToolChange,
)

WAITS = (Dwell, ProgramStop, ToolChange)
"""What a machine waits for at rest."""


@dataclass(frozen=True)
class SectionCommands:
    """What happens at rest before a section, and on its way: arc length in mm and command; its length in mm."""

    before: tuple[Command, ...]
    on_the_way: tuple[tuple[float, Command], ...]
    length_mm: float


def is_output(command: Command, outputs: Outputs | None) -> bool:
    """Whether the machine carries the command out by its outputs."""
    if outputs is None:
        return False
    if isinstance(command, Spindle):
        return outputs.codes.has_spindle
    if isinstance(command, Coolant):
        return outputs.codes.has_coolant
    return isinstance(command, DigitalOutput | AnalogOutput)


def section_events(
    sections: Sequence[SectionCommands],
    after: tuple[Command, ...],
    outputs: Outputs,
    file: Path,
) -> list[Events]:
    """The events of each section's program. Raises InputError: an output that the machine does not have, or a value
    that is too large.
    """
    maker = EventMaker(outputs, file)
    found = []
    for i, section in enumerate(sections):
        last = i + 1 == len(sections)
        behind = after if last else sections[i + 1].before
        own = maker.section(section, behind, is_first=i == 0, is_last=last)
        found.append(events_of([*own.repeated, *own.events]))
    return found


@dataclass(frozen=True)
class SectionEvents:
    """Events of a section: those at its start that repeat what is on, and its own."""

    repeated: list[Event]
    events: list[Event]


def _split(commands: tuple[Command, ...], *, is_first: bool) -> tuple[list[Command], list[Command]]:
    """Commands up to the first wait, and those behind it; before the first section all are behind it."""
    waits = [i for i, command in enumerate(commands) if isinstance(command, WAITS)]
    at = 0 if is_first or not waits else waits[0]
    return list(commands[:at]), list(commands[at:])


@dataclass
class EventMaker:
    """Makes the events of the sections of a toolpath, one after the other, and knows what is on."""

    outputs: Outputs
    file: Path
    last: dict[str, Event] = field(default_factory=dict)

    def section(
        self,
        section: SectionCommands,
        behind: tuple[Command, ...],
        *,
        is_first: bool = False,
        is_last: bool = False,
    ) -> SectionEvents:
        """Of the next section, or part of one; `behind`: the commands at rest behind it. Raises InputError: an output
        that the machine does not have, or a value that is too large.
        """
        repeated = self._repeated()
        _, rest = _split(section.before, is_first=is_first)
        begin = self.changed(0, rest)
        way = [
            event
            for s_mm, command in section.on_the_way
            for event in self.changed(round(s_mm * 2**40), [command])
        ]
        end_q40 = round(section.length_mm * 2**40)
        early = list(behind) if is_last else _split(behind, is_first=False)[0]
        return SectionEvents(repeated, [*begin, *way, *self.changed(end_q40, early)])

    def _repeated(self) -> list[Event]:
        """Events at the start of a program that make the outputs what they were."""
        digital = [event for event in self.last.values() if event.kind == DIGITAL]
        mask, levels = 0, 0
        for event in digital:
            mask, levels = mask | event.mask, levels | event.value
        found = [Event(0, DIGITAL, 0, mask, levels)] if levels else []
        analogue = [event for event in self.last.values() if event.kind != DIGITAL and event.value]
        return found + [event._replace(place_q40=0) for event in analogue]

    def changed(self, place_q40: int, commands: Iterable[Command]) -> list[Event]:
        """Events of commands at one place; of several for one output the last."""
        found: dict[str, Event] = {}
        for command in commands:
            for channel, event in self._events(place_q40, command):
                found.pop(channel.name, None)
                found[channel.name] = event
        self.last |= found
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
            speed = command.speed_rev_min if turns else 0.0
            found.append((codes.speed, codes.speed.valued(place_q40, speed, where)))
        return found

    def _ended(self, place_q40: int, line: int) -> list[tuple[Channel, Event]]:
        """What M5 and M9 do, of outputs that are on."""
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
