# SPDX-License-Identifier: MIT
"""Whether a drive can do what an axis of a machine needs, object by object. Used by cli/commission_commands.

The objects are those that the controller reads and writes before it switches a drive on (firmware/app/drives), in the
same order. Objects that the controller writes need not be set. If the controller writes an object only to drives that
have it, its absence is a note with the lost function. The check reads the drive by SDO, and writes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ..config import Machine
from ..config.axis_table import Axis
from .drive_properties import CSP, HOMING, MODES, PROFILE, supported_modes
from .nodes import NodeReader

_SCREW_SHARE = 1e-3
"""Greatest difference between the scaling of drive and drive file, for rounding."""
OK, NOTE, FAULT = "ok", "note", "fault"


@dataclass(frozen=True)
class Finding:
    """One object of a drive.

    verdict  "ok"; "note": the machine runs, with the restriction in `text`; "fault": it does not run
    """

    index: int
    sub: int
    verdict: str
    text: str
    value: int | None = None

    def json(self) -> dict[str, object]:
        """Ready for JSON."""
        return {
            "index": self.index,
            "sub": self.sub,
            "verdict": self.verdict,
            "text": self.text,
            "value": self.value,
        }

    @property
    def name(self) -> str:
        """As "0x607D sub 1"."""
        return f"0x{self.index:04X}" + (f" sub {self.sub}" if self.sub else "")


def check_axis(reader: NodeReader, axis: Axis, machine: Machine) -> list[Finding]:
    """All objects that an axis needs. Raises BusError: the drive does not answer."""
    found = list(_is_drive(reader))
    if found[0].verdict == FAULT:
        return found
    return [
        *found,
        *_identity(reader, axis),
        *_modes(reader, axis),
        *_communication(reader),
        *_process_data(reader, machine),
        *_scaling(reader, axis),
        *_limits(reader, axis),
        *_stops(reader),
        *_homing(reader, axis),
        *_present(reader),
    ]


def _is_drive(reader: NodeReader) -> Iterator[Finding]:
    value = reader.number(0x1000)
    if value is None or value & 0xFFFF != PROFILE:
        yield Finding(0x1000, 0, FAULT, "is no drive by CiA 402: choose another node", value)
    else:
        yield Finding(0x1000, 0, OK, "a drive by CiA 402", value)


def _identity(reader: NodeReader, axis: Axis) -> Iterator[Finding]:
    expected = axis.identity.vendor, axis.identity.product, axis.identity.revision
    names = "vendor", "product code", "revision"
    for sub, (name, wanted) in enumerate(zip(names, expected, strict=True), start=1):
        value = reader.number(0x1018, sub)
        if wanted and value != wanted:
            reported = "none" if value is None else f"0x{value:08X}"
            yield Finding(
                0x1018,
                sub,
                FAULT,
                f"{name} is {reported}, the machine file has 0x{wanted:08X}: correct [axis.identity], or connect "
                "the right drive",
                value,
            )
        elif wanted:
            yield Finding(0x1018, sub, OK, f"{name} as in the machine file", value)
        elif sub < 3:
            yield Finding(0x1018, sub, OK, f"{name}; any will do", value)


def _modes(reader: NodeReader, axis: Axis) -> Iterator[Finding]:
    value = reader.number(0x6502)
    modes = supported_modes(value or 0)
    if CSP in modes:
        yield Finding(0x6502, 0, OK, f"has the mode {MODES[CSP]}", value)
    else:
        yield Finding(
            0x6502,
            0,
            FAULT,
            f"does not name the mode {MODES[CSP]}: this drive, or its firmware, cannot be used",
            value,
        )
    if axis.homing.method and HOMING not in modes:
        yield Finding(
            0x6502,
            0,
            FAULT,
            "has no mode homing, but the machine file has [axis.homing]: take that out, or set the zero with "
            "the drive's own tool",
            value,
        )
    yield from _must(reader, 0x6060, 0, "mode of operation; the controller writes it")
    yield from _must(reader, 0x6061, 0, "present mode of operation")
    yield from _must(reader, 0x60C2, 1, "time between setpoints; the controller writes it")
    yield from _must(reader, 0x60C2, 2, "its power of ten; the controller writes it")


def _communication(reader: NodeReader) -> Iterator[Finding]:
    yield from _must(reader, 0x1017, 0, "heartbeat of the drive; the controller writes it")
    for index, sub, text, without in (
        (0x1016, 1, "heartbeat of the controller", "the drive does not notice that it is silent"),
        (0x1005, 0, "COB-ID of SYNC", "it has to be 0x80"),
        (0x1006, 0, "period of SYNC", "the drive does not notice that SYNC is missing"),
        (
            0x1029,
            1,
            "state after a communication error",
            "it may go pre-operational and send nothing",
        ),
        (0x6007, 0, "reaction to it", "set quick stop with the drive's own tool"),
    ):
        yield from _may(reader, index, sub, f"{text}; the controller writes it", without)


_PDOS = (
    (0x1400, "RPDO1", ((0x6040, "controlword"), (0x607A, "target position"))),
    (0x1800, "TPDO1", ((0x6041, "statusword"), (0x6064, "position"))),
)


def _process_data(reader: NodeReader, machine: Machine) -> Iterator[Finding]:
    for communication, name, objects in _PDOS:
        yield from _must(reader, communication, 1, f"{name}: COB-ID; the controller writes it")
        yield from _must(reader, communication, 2, f"{name}: type; the controller writes it")
        yield from _must(
            reader, communication + 0x200, 0, f"{name}: mapping; the controller writes it"
        )
        for index, text in objects:
            yield from _must(reader, index, 0, f"{text}, in {name}")
    text = "event timer of RPDO1; the controller writes it"
    without = "the drive stops late without setpoints: at the loss of SYNC or heartbeat"
    yield from _may(reader, 0x1400, 5, text, without)
    if machine.torque_feedforward:
        text, without = "torque offset, in RPDO1", "this axis gets no torque feedforward"
        yield from _may(reader, 0x60B2, 0, text, without)
    if machine.velocity_feedforward:
        yield from _may(reader, 0x1401, 1, "RPDO2", "this axis gets no velocity feedforward")
        text, without = "velocity offset, in RPDO2", "this axis gets no velocity feedforward"
        yield from _may(reader, 0x60B1, 0, text, without)
    yield from _may(reader, 0x60FD, 0, "digital inputs", "status shows no switches")


def _scaling(reader: NodeReader, axis: Axis) -> Iterator[Finding]:
    wanted = axis.scaling
    written = "; the controller writes it"
    if wanted.encoder_increments_per_rev:
        for sub in (1, 2):
            yield from _must(reader, 0x608F, sub, f"encoder increments{written}")
    if wanted.gear_motor_revolutions:
        for sub in (1, 2):
            yield from _must(reader, 0x6091, sub, f"gear{written}")
    if wanted.feed_counts_per_rev:
        for sub in (1, 2):
            yield from _must(reader, 0x6092, sub, f"counts for a turn of the shaft{written}")
        return
    feed, turns = reader.number(0x6092, 1), reader.number(0x6092, 2)
    unit, key = axis.unit, f"counts_per_{axis.unit}"
    if not feed or not turns:
        text = f"counts for a turn are not reported: check in the drive's tool that 1 {unit} is {axis.counts_per_unit}"
        yield Finding(0x6092, 1, NOTE, text, feed)
        return
    gear = _gear(reader, axis)
    distance = feed / turns / gear / axis.counts_per_unit
    turned = "shaft" if gear == 1.0 else f"motor, with its gear of {gear:g} to 1 (0x6091),"
    text = f"a turn of the {turned} is {distance:g} {unit} by {key}"
    if axis.drive is None:
        text += f": if that is not so, add [axis.scaling] or correct {key}"
        yield Finding(0x6092, 1, NOTE, text, feed)
        return
    screw = 2.0 * math.pi * axis.drive.screw_mm_rad
    if abs(distance - screw) <= _SCREW_SHARE * screw:
        yield Finding(0x6092, 1, OK, f"{text}, as in the drive file", feed)
    else:
        text += f", but {screw:g} in the drive file: add [axis.scaling], or correct {key} or the drive file"
        yield Finding(0x6092, 1, NOTE, text, feed)


def _gear(reader: NodeReader, axis: Axis) -> float:
    """Turns of the motor for one of the shaft: as the controller writes them, else those of the drive, else 1."""
    wanted = axis.scaling
    if wanted.gear_motor_revolutions:
        return wanted.gear_motor_revolutions / wanted.gear_shaft_revolutions
    return (reader.number(0x6091, 1) or 1) / (reader.number(0x6091, 2) or 1)


def _limits(reader: NodeReader, axis: Axis) -> Iterator[Finding]:
    yield from _must(reader, 0x607D, 1, "least position; the controller writes travel there")
    yield from _must(reader, 0x607D, 2, "greatest position; the controller writes travel there")
    if axis.following_window_mm is None:
        value = reader.number(0x6065)
        text = f"following error window; the drive keeps its own, add following_window_{axis.unit} for another"
        if value in (None, 0xFFFFFFFF):
            text = (
                f"no following error window: add following_window_{axis.unit} to the machine file"
            )
        yield Finding(0x6065, 0, NOTE, text, value)
    else:
        yield from _must(reader, 0x6065, 0, "following error window; the controller writes it")
        text, without = "its time; the controller writes it", "the drive has its own"
        yield from _may(reader, 0x6066, 0, text, without)
    for limit, what, most in (
        (0x607F, "velocity", axis.velocity_mm_s),
        (0x60C5, "acceleration", axis.acceleration_mm_s2),
        (0x60C6, "deceleration", axis.acceleration_mm_s2),
    ):
        yield from _at_least(reader, limit, what, most * axis.counts_per_unit, axis)


def _at_least(
    reader: NodeReader, index: int, what: str, needed: float, axis: Axis
) -> Iterator[Finding]:
    """Checks a limit of the drive that the controller does not write."""
    value = reader.number(index)
    if value is None or value == 0:
        return
    if value < needed:
        unit = f"{axis.unit}/s" if what == "velocity" else f"{axis.unit}/s^2"
        yield Finding(
            index,
            0,
            FAULT,
            f"the drive limits {what} to {value / axis.counts_per_unit:g} {unit}, less than the machine "
            f"file's {needed / axis.counts_per_unit:g}: raise it with the drive's own tool, or lower that of the "
            "axis",
            value,
        )
    else:
        yield Finding(
            index, 0, OK, f"the drive's own limit of {what} is not below the axis'", value
        )


def _stops(reader: NodeReader) -> Iterator[Finding]:
    own = "set it with the drive's own tool"
    for index, text in (
        (0x6085, "deceleration of a quick stop"),
        (0x605A, "what a quick stop does"),
        (0x605E, "what a fault does"),
    ):
        yield from _may(reader, index, 0, f"{text}; the controller writes it", own)


def _homing(reader: NodeReader, axis: Axis) -> Iterator[Finding]:
    if not axis.homing.method:
        return
    yield from _must(reader, 0x6098, 0, "homing method; the controller writes it")
    yield from _must(reader, 0x607C, 0, "home offset; the controller writes it")
    for index, sub, text in (
        (0x6099, 1, "speed towards the switch"),
        (0x6099, 2, "speed away from it"),
        (0x609A, 0, "acceleration of homing"),
    ):
        without = "set it with the drive's own tool"
        yield from _may(reader, index, sub, f"{text}; the controller writes it", without)
    count = reader.number(0x60E3, 0)
    if count is None:
        return
    methods = [reader.number(0x60E3, sub, signed=True) for sub in range(1, min(count, 254) + 1)]
    if axis.homing.method in methods:
        yield Finding(0x60E3, 0, OK, f"knows homing method {axis.homing.method}", count)
    else:
        known = ", ".join(str(method) for method in methods)
        yield Finding(
            0x60E3, 0, FAULT, f"knows homing methods {known}, not {axis.homing.method}", count
        )


def _present(reader: NodeReader) -> Iterator[Finding]:
    status = reader.number(0x6041)
    if status is not None and status & 0x4F in (0x08, 0x0F):  # fault, fault reaction active
        code = reader.number(0x603F)
        reported = "" if code is None else f" (error code 0x{code:04X})"
        yield Finding(0x6041, 0, NOTE, f"the drive is in fault{reported}: see its manual", status)
    else:
        yield Finding(0x6041, 0, OK, "the drive is not in fault", status)


def _must(reader: NodeReader, index: int, sub: int, text: str) -> Iterator[Finding]:
    yield _present_or(reader, index, sub, text, FAULT, "is needed")


def _may(reader: NodeReader, index: int, sub: int, text: str, without: str) -> Iterator[Finding]:
    yield _present_or(reader, index, sub, text, NOTE, without)


def _present_or(
    reader: NodeReader, index: int, sub: int, text: str, verdict: str, without: str
) -> Finding:
    data = reader.data(index, sub)
    if data is None:
        return Finding(index, sub, verdict, f"is not there: {text.split(';')[0]}; {without}")
    value = int.from_bytes(data[:8], "little") if data else None
    return Finding(index, sub, OK, text, value)
