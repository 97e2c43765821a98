# SPDX-License-Identifier: MIT
"""A DBC of a machine's bus for cantools, SavvyCAN and others, from the EDS of its drives. Used by cli/dbc_command.
Reads the EDS file; no other I/O.

SYNC, NMT commands, EMCY, heartbeats and every PDO that the controller maps. Positions are in mm, voltages in V, torque
offsets in per cent through the signals' factors. SDO is left out: DBC cannot express bytes whose meaning depends on the
transfer.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from pathlib import Path

from cantools import Error as DbcError
from cantools.database import Database, Message, Node, Signal
from cantools.database.conversion import BaseConversion
from cantools.typechecking import Choices

from .bustime import Pdo, axis_choice, drive_pdos
from .config import Axis, Machine
from .data import DRIVE_EDS
from .errors import InputError

CONTROLLER = "Controller"

_NMT_COMMANDS: Choices = OrderedDict(
    {
        1: "start",
        2: "stop",
        128: "enter pre-operational",
        129: "reset node",
        130: "reset communication",
    }
)
_NMT_STATES: Choices = OrderedDict(
    {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
)
_POSITIONS = (0x6064, 0x607A)
_VELOCITIES = (0x60B1,)
_PER_MILLE = (0x60B2,)
_MILLIVOLTS = (0x2100,)
_INPUTS = 0x60FD
_INPUT_BITS = (("NegativeLimit", 1), ("PositiveLimit", 1), ("HomeSwitch", 1), ("OtherInputs", 29))
_HEARTBEAT_MS = 100
_LIMIT_DIGITS = 9  # of a signal's least and greatest value: 0.1 is no sum of powers of two


def dbc_text(machine: Machine, eds: Path = DRIVE_EDS) -> str:
    """The DBC of a machine with drives by `eds`, with CR LF.

    Raises InputError: the EDS cannot be read, or gives two objects of a PDO the same name.
    """
    try:
        messages = sorted(_messages(machine, eds), key=lambda message: message.frame_id)
    except DbcError as error:
        raise InputError(f"{eds}: its PDOs give no DBC: {error}") from error
    nodes = [Node(name) for name in (CONTROLLER, *map(_node_name, machine.axes))]
    database = Database(messages, nodes, version="", sort_signals=None)
    return database.as_dbc_string(sort_signals=None, sort_attribute_signals=None)


def _node_name(axis: Axis) -> str:
    return f"Drive{axis.node}"


def _messages(machine: Machine, eds: Path) -> Iterator[Message]:
    drives = list(map(_node_name, machine.axes))
    period_ms = machine.period_us / 1000
    command = _signal("NMT_Command", 0, 8, choices=_NMT_COMMANDS)
    yield _message(0, "NMT", 2, CONTROLLER, drives, (command, _signal("NMT_Node", 8, 8)))
    counter = _signal("SYNC_Counter", 0, 8, comment="1 to 240, then 1 again")
    yield _message(0x80, "SYNC", 1, CONTROLLER, drives, (counter,), period_ms)
    yield from _node_messages(CONTROLLER, machine.node, drives)
    for axis in machine.axes:
        name = _node_name(axis)
        yield from _node_messages(name, axis.node, [CONTROLLER])
        for pdo in drive_pdos(axis.node, axis_choice(machine, axis), eds):
            sender, receiver = (CONTROLLER, name) if pdo.received else (name, CONTROLLER)
            signals = _pdo_signals(pdo, name, machine.counts_per_mm, axis)
            cyclic_ms = 0 if pdo.name == "TPDO3" else period_ms
            title = f"{name}_{pdo.name}"
            yield _message(pdo.cob_id, title, pdo.size, sender, [receiver], signals, cyclic_ms)


def _node_messages(name: str, node: int, receivers: list[str]) -> Iterator[Message]:
    emergency = (
        _signal(f"{name}_EMCY_Code", 0, 16, comment="CiA 301 and CiA 402 error code; 0: reset"),
        _signal(f"{name}_EMCY_Register", 16, 8, comment="error register 0x1001"),
        _signal(f"{name}_EMCY_Detail", 24, 40, comment="manufacturer's"),
    )
    yield _message(0x80 + node, f"{name}_EMCY", 8, name, receivers, emergency)
    state = _signal(f"{name}_NMT_State", 0, 8, choices=_NMT_STATES)
    yield _message(0x700 + node, f"{name}_Heartbeat", 1, name, receivers, (state,), _HEARTBEAT_MS)


def _pdo_signals(pdo: Pdo, drive: str, counts_per_mm: int, axis: Axis) -> Iterator[Signal]:
    start = 0
    for entry in pdo.entries:
        comment = f"0x{entry.index:04X} sub {entry.sub}, axis {axis.name}"
        if entry.index == _INPUTS:
            for name, bits in _INPUT_BITS:
                yield _signal(f"{drive}_{name}", start, bits, comment=comment)
                start += bits
            continue
        factor, unit = _scale(entry.index, counts_per_mm)
        name = _identifier(f"{drive}_{entry.name}")
        signed = entry.signed
        yield _signal(
            name, start, entry.bits, signed=signed, factor=factor, unit=unit, comment=comment
        )
        start += entry.bits


def _message(
    identifier: int,
    name: str,
    size: int,
    sender: str,
    receivers: list[str],
    signals: Iterable[Signal],
    period_ms: float = 0,
) -> Message:
    of_message = list(signals)
    for signal in of_message:
        signal.receivers = receivers
    return Message(
        identifier, name, size, of_message, senders=[sender], cycle_time=round(period_ms) or None
    )


def _signal(
    name: str,
    start: int,
    bits: int,
    *,
    signed: bool = False,
    factor: float = 1,
    unit: str = "",
    choices: Choices | None = None,
    comment: str | None = None,
) -> Signal:
    low = -(2 ** (bits - 1)) if signed else 0
    high = 2 ** (bits - signed) - 1
    return Signal(
        name,
        start,
        bits,
        is_signed=signed,
        conversion=BaseConversion.factory(factor, 0, choices),
        minimum=round(low * factor, _LIMIT_DIGITS),
        maximum=round(high * factor, _LIMIT_DIGITS),
        unit=unit,
        comment=comment,
    )


def _scale(index: int, counts_per_mm: int) -> tuple[float, str]:
    if index in _POSITIONS:
        return 1 / counts_per_mm, "mm"
    if index in _VELOCITIES:
        return 1 / counts_per_mm, "mm/s"
    if index in _PER_MILLE:
        return 0.1, "%"
    if index in _MILLIVOLTS:
        return 0.001, "V"
    return 1, ""


def _identifier(text: str) -> str:
    words = re.findall(r"[A-Za-z0-9_]+", text)
    return "".join(word[0].upper() + word[1:] for word in words)
