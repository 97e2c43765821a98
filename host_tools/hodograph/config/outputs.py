# SPDX-License-Identifier: MIT
"""Outputs: the channels of an I/O module in a machine file, and the places at which a path file switches them. Used by
all modules that handle outputs. No I/O.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, log10, nan

from ..errors import InputError
from ..events import (
    ANALOGUE,
    ANALOGUES,
    DIGITAL,
    DIGITALS,
    PROPORTIONAL,
    VALUE_HIGH,
    VALUE_LOW,
    Event,
    Events,
    OutputValues,
)
from ..fixed_point import MM_PER_Q40
from .table import Table

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_GAIN_HIGH_Q16 = 2**31 - 1


@dataclass(frozen=True)
class Channel:
    """One output: digital output `number`, or analogue output `number`, to which `scale` times a value is sent."""

    name: str
    digital: bool
    number: int
    scale: float = 1.0
    unit: str = ""

    def switched(self, place_q40: int, on: bool) -> Event:
        """The event that switches a digital output."""
        return Event(place_q40, DIGITAL, 0, 1 << self.number, int(on) << self.number)

    def valued(self, place_q40: int, value: float, where: str) -> Event:
        """The event that gives an analogue output a value. Raises InputError: too large."""
        raw = round(value * self.scale)
        if not VALUE_LOW <= raw <= VALUE_HIGH:
            raise InputError(
                f"{where}: {value:g} {self.unit} of output {self.name} is {raw} on the bus, outside of "
                f"{VALUE_LOW} … {VALUE_HIGH}: give less, or a smaller scale"
            )
        return Event(place_q40, ANALOGUE, self.number, 0, raw)

    def proportional(self, place_q40: int, per_mm_s: float, where: str) -> Event:
        """The event from which on an analogue output is proportional to the feed. Raises InputError: the value is too
        large.
        """
        gain = round(per_mm_s * self.scale * 65536)
        if abs(gain) > _GAIN_HIGH_Q16:
            raise InputError(
                f"{where}: {per_mm_s:g} for each mm/s of output {self.name} is above what a program holds "
                f"({_GAIN_HIGH_Q16 / 65536 / abs(self.scale):g}): give less"
            )
        return Event(place_q40, PROPORTIONAL, self.number, 0, gain)

    def level(self, values: OutputValues) -> bool | float:
        """Its present state: whether it is on, or the value of an analogue output in its unit."""
        if self.digital:
            return bool(values.digital >> self.number & 1)
        decimals = max(floor(log10(abs(self.scale))), 0)  # of one step on the bus
        return round(values.analogue[self.number] / self.scale, decimals)

    def level_text(self, values: OutputValues) -> str:
        """Its present state in words."""
        level = self.level(values)
        if isinstance(level, bool):
            return "on" if level else "off"
        return f"{level:g} {self.unit}".rstrip()


@dataclass(frozen=True)
class CodeOutputs:
    """The outputs that execute M3 to M5, S and M7 to M9 of G-code; None: the word has no output.

    spindle          on while the spindle turns, in either direction
    spindle_reverse  on while it turns counterclockwise
    speed            analogue: S while the spindle turns, else 0
    mist, flood      M7, M8
    laser_mode       after M4 `speed` is in proportion to the feed: S at the feed of the block, 0 in rapid moves. S then
                     changes in motion
    spindle_wait_s   wait at rest after the spindle is switched on, or over to its other direction
    """

    spindle: Channel | None = None
    spindle_reverse: Channel | None = None
    speed: Channel | None = None
    mist: Channel | None = None
    flood: Channel | None = None
    laser_mode: bool = False
    spindle_wait_s: float = 0.0

    @property
    def has_spindle(self) -> bool:
        """Whether M3, M4 and M5 switch an output."""
        return self.spindle is not None or self.speed is not None

    def restart_wait_s(self, values: OutputValues) -> float:
        """The wait before the axes move where a job begins with these outputs."""
        turns = self.spindle is not None and values.digital >> self.spindle.number & 1
        turns = turns or (self.speed is not None and values.analogue[self.speed.number] != 0)
        return self.spindle_wait_s if turns else 0.0

    @property
    def has_coolant(self) -> bool:
        """Whether M7, M8 and M9 switch an output."""
        return self.mist is not None or self.flood is not None


@dataclass(frozen=True)
class Outputs:
    """The I/O module of a machine (docs/reference/protocol.md 2.1), and its channels by name.

    delay_ticks  delay of the module's outputs, so that they coincide with the axes
    keep_at_stop, keep_at_fault, off_at_end, off_in_hold   whether outputs stay on, or go off, then
    vendor, product   identity of the module; 0: any
    codes  outputs that execute words of G-code
    """

    node: int
    channels: tuple[Channel, ...]
    delay_ticks: int = 1
    keep_at_stop: bool = False
    keep_at_fault: bool = False
    off_at_end: bool = False
    off_in_hold: bool = False
    vendor: int = 0
    product: int = 0
    codes: CodeOutputs = CodeOutputs()

    @property
    def digital_count(self) -> int:
        """Digital outputs that are mapped, in whole bytes."""
        highest = max((one.number for one in self.channels if one.digital), default=-1)
        return 8 * -(-(highest + 1) // 8)

    @property
    def analogue_count(self) -> int:
        """Analogue outputs that are mapped."""
        return max((one.number for one in self.channels if not one.digital), default=-1) + 1

    @property
    def frame_bytes(self) -> int:
        """Data bytes of the frame with the outputs."""
        return self.digital_count // 8 + 2 * self.analogue_count

    @property
    def behaviour(self) -> int:
        """Object 0x2035 sub 4."""
        flags = (self.keep_at_stop, self.keep_at_fault, self.off_at_end, self.off_in_hold)
        return sum(flag << bit for bit, flag in enumerate(flags))

    def channel(self, name: str, where: str) -> Channel:
        """The channel of a name; raises InputError."""
        for one in self.channels:
            if one.name == name:
                return one
        names = ", ".join(one.name for one in self.channels)
        raise InputError(f'{where}: the machine has no output "{name}"; it has {names}')


def assigned(text: str, outputs: Outputs) -> Event:
    """The event of NAME=on, NAME=off or NAME=NUMBER. Raises InputError."""
    name, _, value = text.partition("=")
    channel = outputs.channel(name, text)
    if channel.digital:
        if value not in ("on", "off"):
            raise InputError(f"{text}: {name} is a digital output: give {name}=on or {name}=off")
        return channel.switched(0, value == "on")
    try:
        number = float(value)
    except ValueError:
        number = nan
    if not isfinite(number):
        raise InputError(f"{text}: {name} is an analogue output: give {name}=NUMBER")
    return channel.valued(0, number, text)


_OUTPUTS = (
    "node",
    "delay_ticks",
    "keep_at_stop",
    "keep_at_fault",
    "off_at_end",
    "off_in_hold",
    "vendor",
    "product",
    "channel",
    "gcode",
)
_CHANNEL = ("digital", "analogue", "scale", "unit")
_CODES = ("spindle", "spindle_reverse", "speed", "mist", "flood")
_LASER_MODE, _SPINDLE_WAIT = "laser_mode", "spindle_wait_s"


def read_outputs(root: Table, taken: tuple[int, ...]) -> Outputs | None:
    """The section [outputs] of a machine file, None without one; raises InputError.

    taken  node numbers of controller and drives
    """
    if not root.has("outputs"):
        return None
    table = root.table("outputs", _OUTPUTS)
    names = tuple(table.contents("channel")) if table.is_table("channel") else ()
    if not names:
        raise table.error(
            "channel", "names no output: add [outputs.channel] laser = { digital = 0 }"
        )
    channels = table.table("channel", names)
    node = table.integer("node", low=1, high=127)
    if node in taken:
        raise table.error("node", f"is {node}, which the controller or a drive has: give another")
    found = tuple(_channel(channels, name) for name in names)
    for i, one in enumerate(found):
        for other in found[:i]:
            if (one.digital, one.number) == (other.digital, other.number):
                raise channels.error(one.name, f"is the same output as {other.name}")
    return Outputs(
        node=node,
        channels=found,
        delay_ticks=table.integer("delay_ticks", 1, low=0, high=8),
        keep_at_stop=table.flag("keep_at_stop", False),
        keep_at_fault=table.flag("keep_at_fault", False),
        off_at_end=table.flag("off_at_end", False),
        off_in_hold=table.flag("off_in_hold", False),
        vendor=table.integer("vendor", 0, low=0, high=2**32 - 1),
        product=table.integer("product", 0, low=0, high=2**32 - 1),
        codes=_codes(
            table.table("gcode", (*_CODES, _LASER_MODE, _SPINDLE_WAIT), required=False), found
        ),
    )


def _codes(table: Table, channels: tuple[Channel, ...]) -> CodeOutputs:
    found: dict[str, Channel] = {}
    by_name = {one.name: one for one in channels}
    for key in _CODES:
        if not table.has(key):
            continue
        name = table.choice(key, tuple(by_name))
        if by_name[name].digital == (key == "speed"):
            kind = "an analogue" if key == "speed" else "a digital"
            raise table.error(key, f'is "{name}": it takes {kind} output')
        found[key] = by_name[name]
    laser_mode = table.flag(_LASER_MODE, False)
    if laser_mode and "speed" not in found:
        raise table.error(_LASER_MODE, 'needs an analogue output for the power: add speed = "NAME"')
    wait_s = table.number(_SPINDLE_WAIT, 0.0, low=0.0, high=600.0)
    if wait_s and laser_mode:
        raise table.error(_SPINDLE_WAIT, "is for spindles, and laser_mode is on: remove one")
    if wait_s and not found.keys() & {"spindle", "speed"}:
        raise table.error(_SPINDLE_WAIT, 'needs an output of the spindle: add spindle = "NAME"')
    return CodeOutputs(**found, laser_mode=laser_mode, spindle_wait_s=wait_s)


def _channel(channels: Table, name: str) -> Channel:
    if not _NAME.fullmatch(name):
        raise channels.error(name, "is no name for an output: letters, digits and _ only")
    table = channels.table(name, _CHANNEL)
    if table.has("digital") == table.has("analogue"):
        raise channels.error(name, "must be { digital = 0 } or { analogue = 0, scale = 1.0 }")
    if table.has("digital"):
        for key in ("scale", "unit"):
            if table.has(key):
                raise table.error(key, "applies to analogue outputs only: remove it")
        return Channel(name, True, table.integer("digital", low=0, high=DIGITALS - 1))
    scale = table.number("scale", 1.0, low=-1e9, high=1e9)
    if scale == 0:
        raise table.error("scale", "must not be 0")
    number = table.integer("analogue", low=0, high=ANALOGUES - 1)
    return Channel(name, False, number, scale, table.text("unit") if table.has("unit") else "")


@dataclass(frozen=True)
class PathOutput:
    """One [[output]] of a path file: it switches the output `name`, at a place of one of three kinds.

    at_mm        arc length
    at_point     number of a point of `through`, from 0
    at_fraction  of the path's length
    on           of a digital output; value, per_mm_s: of an analogue one
    where        for messages
    """

    name: str
    where: str
    at_mm: float | None = None
    at_point: int | None = None
    at_fraction: float | None = None
    on: bool | None = None
    value: float | None = None
    per_mm_s: float | None = None

    def event(self, channel: Channel, place_q40: int) -> Event:
        """The event on a channel. Raises InputError: it is of the other kind, or the value does not fit."""
        if channel.digital:
            if self.on is None:
                raise InputError(
                    f"{self.where}: output {self.name} is digital: give on = true or false"
                )
            return channel.switched(place_q40, self.on)
        if self.value is not None:
            return channel.valued(place_q40, self.value, self.where)
        if self.per_mm_s is not None:
            return channel.proportional(place_q40, self.per_mm_s, self.where)
        raise InputError(f"{self.where}: output {self.name} is analogue: give value or per_mm_s")


PATH_OUTPUT = ("name", "at_mm", "at_point", "at_fraction", "on", "value", "per_mm_s")
_PLACES = ("at_mm", "at_point", "at_fraction")
_LEVELS = ("on", "value", "per_mm_s")


def read_path_outputs(
    tables: list[Table], where: str, through_points: int | None
) -> tuple[PathOutput, ...]:
    """The tables of outputs of a path, which messages call `where`; raises InputError. `through_points`: how many
    points of `through` there are, None: none.
    """
    return tuple(_path_output(one, f"{where} {i}", through_points) for i, one in enumerate(tables))


def _path_output(table: Table, where: str, through_points: int | None) -> PathOutput:
    for keys in (_PLACES, _LEVELS):
        given = [key for key in keys if table.has(key)]
        if len(given) != 1:
            raise InputError(
                f"{where}: give one of {', '.join(keys)}, not {' and '.join(given) or 'none'}"
            )
    if table.has("at_point") and through_points is None:
        raise InputError(f"{where}: at_point needs points of `through`: give at_mm or at_fraction")
    highest = (through_points or 1) - 1
    return PathOutput(
        name=table.text("name"),
        where=where,
        at_mm=table.optional_number("at_mm", low=0.0, high=2.0**22),
        at_point=table.integer("at_point", low=0, high=highest) if table.has("at_point") else None,
        at_fraction=table.optional_number("at_fraction", low=0.0, high=1.0),
        on=table.flag("on") if table.has("on") else None,
        value=table.optional_number("value", low=-1e12, high=1e12),
        per_mm_s=table.optional_number("per_mm_s", low=-1e12, high=1e12),
    )


@dataclass(frozen=True, kw_only=True)
class PlacedOutput:
    """One output that switches at a place of a path.

    value  true or false for a digital output; for an analogue one in its own unit; `per_mm_s`: factor by which it is
           proportional to the feed from there on
    """

    name: str
    place_mm: float
    value: float | bool | None
    per_mm_s: float | None = None

    @property
    def words(self) -> str:
        """The switched state in short."""
        if isinstance(self.value, bool):
            return "on" if self.value else "off"
        return f"{self.value:g}" if self.per_mm_s is None else f"{self.per_mm_s:g} by mm/s"


def words_of(placed: Sequence[PlacedOutput]) -> str:
    """A line for each output that switches at a place."""
    return "\n".join(f"{one.name} {one.words}" for one in placed)


def placed_outputs(outputs: Outputs | None, events: Events) -> list[PlacedOutput]:
    """The outputs that the events of a path switch, in their order; empty if the machine has none."""
    if outputs is None:
        return []
    return [one for event in events.tolist() for one in placed_by(outputs, Event(*event))]


def placed_by(outputs: Outputs, event: Event) -> list[PlacedOutput]:
    """The outputs that one event switches."""
    out = []
    place_mm = event.place_q40 * MM_PER_Q40
    for one in outputs.channels:
        value: float | bool | None
        gain = None
        if one.digital and event.kind == DIGITAL and event.mask >> one.number & 1:
            value = bool(event.value >> one.number & 1)
        elif not one.digital and event.kind != DIGITAL and event.channel == one.number:
            if event.kind == PROPORTIONAL:
                value, gain = None, event.value / 65536 / one.scale
            else:
                value = event.value / one.scale
        else:
            continue
        out.append(PlacedOutput(name=one.name, place_mm=place_mm, value=value, per_mm_s=gain))
    return out
