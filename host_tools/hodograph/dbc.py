# SPDX-License-Identifier: MIT
"""A DBC of a machine's bus for cantools, SavvyCAN and others, from the EDS of its drives.

SYNC, NMT commands, EMCY, heartbeats and every PDO that the controller maps. Positions are in mm, voltages in V, torque
offsets in per cent through the signals' factors. SDO is left out: what its bytes mean depends on the transfer, which
DBC cannot say.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .bustime import Pdo, axis_choice, drive_pdos
from .config import Axis, Machine
from .data import DRIVE_EDS

CONTROLLER = "Controller"
HOST = "Vector__XXX"
"""DBC's name for no node in particular."""

_NMT_COMMANDS = {
    1: "start",
    2: "stop",
    128: "enter pre-operational",
    129: "reset node",
    130: "reset communication",
}
_NMT_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
_POSITIONS = (0x6064, 0x607A)
_VELOCITIES = (0x60B1,)
_PER_MILLE = (0x60B2,)
_MILLIVOLTS = (0x2100,)
_INPUTS = 0x60FD
_INPUT_BITS = (("NegativeLimit", 1), ("PositiveLimit", 1), ("HomeSwitch", 1), ("OtherInputs", 29))
_NAME_LENGTH = 32


@dataclass(frozen=True)
class _Signal:
    name: str
    start: int
    bits: int
    signed: bool = False
    factor: float = 1.0
    unit: str = ""
    values: dict[int, str] | None = None
    comment: str = ""


@dataclass(frozen=True)
class _Frame:
    identifier: int
    name: str
    size: int
    sender: str
    receivers: tuple[str, ...]
    signals: tuple[_Signal, ...]
    period_ms: float = 0


def dbc_text(machine: Machine, eds: Path = DRIVE_EDS) -> str:
    """The DBC of a machine whose drives are as `eds` says. Raises InputError: the EDS cannot be read."""
    frames = sorted(_frames(machine, eds), key=lambda frame: frame.identifier)
    nodes = [CONTROLLER, *map(_node_name, machine.axes)]
    lines = ['VERSION ""', "", "NS_ :", "", "BS_:", "", "BU_: " + " ".join(nodes), ""]
    for frame in frames:
        lines += [*_frame_lines(frame), ""]
    lines += _attribute_lines(frames)
    return "\n".join(lines) + "\n"


def _node_name(axis: Axis) -> str:
    return f"Drive{axis.node}"


def _frames(machine: Machine, eds: Path) -> Iterator[_Frame]:
    drives = tuple(map(_node_name, machine.axes))
    period_ms = machine.period_us / 1000
    command = _Signal("NMT_Command", 0, 8, values=_NMT_COMMANDS)
    yield _Frame(0, "NMT", 2, CONTROLLER, drives, (command, _Signal("NMT_Node", 8, 8)))
    counter = _Signal("SYNC_Counter", 0, 8, comment="1 to 240, then 1 again")
    yield _Frame(0x80, "SYNC", 1, CONTROLLER, drives, (counter,), period_ms)
    yield from _node_frames(CONTROLLER, machine.node, drives)
    for axis in machine.axes:
        name = _node_name(axis)
        yield from _node_frames(name, axis.node, (CONTROLLER,))
        for pdo in drive_pdos(axis.node, axis_choice(machine, axis), eds):
            sender, receiver = (CONTROLLER, name) if pdo.received else (name, CONTROLLER)
            signals = tuple(_pdo_signals(pdo, f"{name}_{pdo.name}", machine.counts_per_mm, axis))
            cyclic_ms = 0 if pdo.name == "TPDO3" else period_ms
            yield _Frame(
                pdo.cob_id, f"{name}_{pdo.name}", pdo.size, sender, (receiver,), signals, cyclic_ms
            )


def _node_frames(name: str, node: int, receivers: tuple[str, ...]) -> Iterator[_Frame]:
    emergency = (
        _Signal(f"{name}_EMCY_Code", 0, 16, comment="CiA 301 and CiA 402 error code; 0: reset"),
        _Signal(f"{name}_EMCY_Register", 16, 8, comment="error register 0x1001"),
        _Signal(f"{name}_EMCY_Detail", 24, 40, comment="manufacturer's"),
    )
    yield _Frame(0x80 + node, f"{name}_EMCY", 8, name, receivers, emergency)
    state = _Signal(f"{name}_NMT_State", 0, 8, values=_NMT_STATES)
    yield _Frame(0x700 + node, f"{name}_Heartbeat", 1, name, receivers, (state,), 100)


def _pdo_signals(pdo: Pdo, prefix: str, counts_per_mm: int, axis: Axis) -> Iterator[_Signal]:
    start = 0
    for entry in pdo.entries:
        drive = prefix.split("_")[0]
        comment = f"0x{entry.index:04X} sub {entry.sub}, axis {axis.name}"
        if entry.index == _INPUTS:
            for name, bits in _INPUT_BITS:
                yield _Signal(f"{drive}_{name}", start, bits, comment=comment)
                start += bits
            continue
        factor, unit = _scale(entry.index, counts_per_mm)
        name = _identifier(f"{drive}_{entry.name}")
        yield _Signal(name, start, entry.bits, entry.signed, factor, unit, comment=comment)
        start += entry.bits


def _scale(index: int, counts_per_mm: int) -> tuple[float, str]:
    if index in _POSITIONS:
        return 1 / counts_per_mm, "mm"
    if index in _VELOCITIES:
        return 1 / counts_per_mm, "mm/s"
    if index in _PER_MILLE:
        return 0.1, "%"
    if index in _MILLIVOLTS:
        return 0.001, "V"
    return 1.0, ""


def _identifier(text: str) -> str:
    words = re.findall(r"[A-Za-z0-9_]+", text)
    return "".join(word[0].upper() + word[1:] for word in words)[:_NAME_LENGTH]


def _frame_lines(frame: _Frame) -> Iterable[str]:
    yield f"BO_ {frame.identifier} {frame.name}: {frame.size} {frame.sender}"
    for signal in frame.signals:
        sign = "-" if signal.signed else "+"
        low, high = _range(signal)
        yield (
            f" SG_ {signal.name} : {signal.start}|{signal.bits}@1{sign} ({signal.factor:.15g},0) "
            f'[{low:.15g}|{high:.15g}] "{signal.unit}" {",".join(frame.receivers) or HOST}'
        )


def _range(signal: _Signal) -> tuple[float, float]:
    low = -(2 ** (signal.bits - 1)) if signal.signed else 0
    high = 2 ** (signal.bits - signal.signed) - 1
    return low * signal.factor, high * signal.factor


def _attribute_lines(frames: Sequence[_Frame]) -> Iterator[str]:
    for frame in frames:
        for signal in frame.signals:
            if signal.comment:
                yield f'CM_ SG_ {frame.identifier} {signal.name} "{_plain(signal.comment)}";'
    yield 'BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;'
    yield 'BA_DEF_DEF_ "GenMsgCycleTime" 0;'
    for frame in frames:
        if frame.period_ms:
            yield f'BA_ "GenMsgCycleTime" BO_ {frame.identifier} {round(frame.period_ms)};'
    for frame in frames:
        for signal in frame.signals:
            if signal.values:
                texts = " ".join(f'{value} "{text}"' for value, text in signal.values.items())
                yield f"VAL_ {frame.identifier} {signal.name} {texts} ;"


def _plain(text: str) -> str:
    return " ".join(text.replace('"', "'").split())
