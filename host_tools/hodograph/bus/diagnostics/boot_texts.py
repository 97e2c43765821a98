# SPDX-License-Identifier: MIT
"""Texts for the reason why the configuration of the drives does not end (object 0x2025). Used by sdo/controller and
sdo/status. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

from canopen.sdo.exceptions import SdoAbortedError

_NO_ANSWER = 0x0504_0000
_NO_OBJECT, _NO_SUB = 0x0602_0000, 0x0609_0011
_RETRY = "the controller tries again by itself"

_OBJECTS = {
    0x2101: (
        "set-up of the simulated drive",
        "drives and controller are of different versions: make build",
    ),
    0x1000: (
        "device type",
        "node {node} is no CiA 402 drive: correct the node numbers in the machine file",
    ),
    0x1005: ("COB-ID SYNC", "the drive must listen to SYNC 0x080"),
    0x1006: ("SYNC period", "choose a period that the drive can keep"),
    0x100C: ("guard time", "the drive must let node guarding be switched off: see its manual"),
    0x100D: (
        "life time factor",
        "the drive must let node guarding be switched off: see its manual",
    ),
    0x1016: (
        "heartbeat consumer",
        "the drive takes no heartbeat of the controller: see its manual",
    ),
    0x1017: ("heartbeat producer", "the drive must send heartbeats: see its manual"),
    0x1018: (
        "identity",
        "another device than the machine file names in [axis.identity]: correct cabling, node numbers or machine file",
    ),
    0x1019: ("SYNC counter", "the drive must accept a SYNC with counter"),
    0x1029: ("error behaviour", "see the drive's manual"),
    0x2005: ("axis node", "correct the node numbers in the machine file"),
    0x2035: ("I/O module", "correct the node numbers in the machine file"),
    0x6200: ("digital outputs", "the I/O module has too few digital outputs: correct [outputs]"),
    0x6411: ("analogue outputs", "the I/O module has too few analogue outputs: correct [outputs]"),
    0x6007: ("reaction to lost communication", "see the drive's manual"),
    0x605A: ("quick stop reaction", "see the drive's manual"),
    0x605E: ("fault reaction", "see the drive's manual"),
    0x6040: ("controlword", "see the drive's manual"),
    0x6060: (
        "mode of operation",
        "the drive takes no cyclic synchronous position mode: see its manual",
    ),
    0x6061: (
        "mode of operation",
        "the drive stays in another mode: switch its local operation off",
    ),
    0x6064: ("position", "see the drive's manual"),
    0x6065: ("following error window", "correct following_error_mm in the machine file"),
    0x6066: ("following error time-out", "correct the time-out in the machine file"),
    0x607C: ("home offset", "correct the home offset in the machine file"),
    0x607D: ("travel limits", "correct the travel in the machine file"),
    0x6085: ("quick stop deceleration", "correct it in the machine file to what the drive can do"),
    0x608F: (
        "encoder resolution",
        "correct the encoder increments in the machine file, or leave them out",
    ),
    0x6091: ("gear ratio", "correct the gear in the machine file, or leave it out"),
    0x6092: ("feed constant", "correct the feed constant in the machine file, or leave it out"),
    0x6098: ("homing method", "choose a homing method that the drive has"),
    0x6099: ("homing speed", "correct the homing speeds in the machine file"),
    0x609A: ("homing acceleration", "correct the homing acceleration in the machine file"),
    0x60B1: ("velocity offset", "see the drive's manual"),
    0x60B2: ("torque offset", "see the drive's manual"),
    0x60C2: ("interpolation period", "choose a period that the drive has ([bus] period_us)"),
    0x60FD: ("digital inputs", "see the drive's manual"),
    0x6206: ("error mode of the digital outputs", "see the I/O module's manual"),
    0x6207: ("error values of the digital outputs", "see the I/O module's manual"),
    0x6443: ("error mode of the analogue outputs", "see the I/O module's manual"),
    0x6444: ("error values of the analogue outputs", "see the I/O module's manual"),
    0x6502: (
        "supported modes",
        "the drive has no cyclic synchronous position mode: use another drive",
    ),
}
_PDO_RANGES = (
    (0x1400, "setpoint PDO"),
    (0x1600, "mapping of the setpoint PDO"),
    (0x1800, "position PDO"),
    (0x1A00, "mapping of the position PDO"),
)
_PDO_REMEDY = (
    "the drive cannot map the requested objects: switch feedforward off, or see its manual"
)


@dataclass(frozen=True)
class BootTrouble:
    """The reason why the controller stays in boot."""

    node: int
    index: int
    sub: int
    abort_code: int
    value: int
    text: str
    remedy: str


def boot_trouble(
    node: int, place: int, abort_code: int, value: int, expected: int | None = None
) -> BootTrouble | None:
    """The content of 0x2025 with its text; None: there is no trouble.

    `place` is index << 8 + sub; `expected`: the right value, if known.
    """
    if node == 0:
        return None
    index, sub = place >> 8, place & 0xFF
    name, remedy = _object(index, node)
    where = f"object 0x{index:04X} sub {sub} ({name})"
    if abort_code == _NO_ANSWER:
        at = f" (requested: {where})" if index else ""
        text = f"the drive at node {node} does not answer{at}"
        remedy = f"is it powered and connected, is its node number {node}, is its bit rate that of the bus? {_RETRY}"
    elif index == 0x2005:
        text = f"axis {sub} has node {node}, which another axis or the controller has too"
    elif index == 0x2035:
        text = f"the I/O module has node {node}, which an axis or the controller has too"
    elif abort_code == 0:
        wanted = "which was not expected" if expected is None else f"expected is 0x{expected:X}"
        text = f"the drive at node {node} has 0x{value:X} in {where}, {wanted}"
    else:
        text = f"the drive at node {node} refused {where}: {abort_words(abort_code)}"
    return BootTrouble(node, index, sub, abort_code, value, text, remedy)


def abort_words(code: int) -> str:
    """An SDO abort code (CiA 301 table 22) in words."""
    text = SdoAbortedError.CODES.get(code, "unknown abort code")
    return f"{text[:1].lower()}{text[1:]} (0x{code:08X})"


def _object(index: int, node: int) -> tuple[str, str]:
    if index in _OBJECTS:
        name, remedy = _OBJECTS[index]
        return name, remedy.format(node=node)
    for start, name in _PDO_RANGES:
        if start <= index < start + 4:
            return f"{name} {index - start + 1}", _PDO_REMEDY
    return "no name here", f"see the manual of the drive at node {node}"
