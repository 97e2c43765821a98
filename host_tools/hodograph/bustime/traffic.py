# SPDX-License-Identifier: MIT
"""The frames of a machine in steady motion, with their senders and periods (docs/reference/protocol.md section 2). Used
by bustime/fit, bustime/model and bustime/recording. Reads the EDS of the drives; no other I/O.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..config import Machine
from ..config.outputs import Outputs
from .frame_bits import exact_bits, generic_worst_bits, plain_bits, worst_bits
from .pdos import PdoChoice, axis_choice, drive_pdos

SYNC_ID, RPDO1_ID, HEARTBEAT_ID, SDO_ID = 0x080, 0x200, 0x700, 0x580
SYNC_OVERFLOW = 240
HEARTBEAT_MS = 100
SDO_BYTES = 8

INHIBIT_US = 10_000
"""Inhibit time of TPDO3, which is sent when an input changes."""

SPORADIC = ("inputs", "outputs")
"""Kinds of frames that may be absent."""
CYCLIC = ("SYNC", "setpoints", "offsets", "positions", "volts")
"""Kinds of frames that come once a tick."""
NEEDED = ("SYNC", "setpoints", "offsets", "outputs", "positions")
"""Kinds of frames that have to end before the next SYNC: the drive latches, the controller supervises."""
_KINDS = {
    "RPDO1": "setpoints",
    "RPDO2": "offsets",
    "TPDO1": "positions",
    "TPDO2": "volts",
    "TPDO3": "inputs",
}


@dataclass(frozen=True)
class Message:
    """A frame that is sent every `period_us`, or at most so often."""

    kind: str
    identifier: int
    size: int
    period_us: int

    @property
    def plain_bits(self) -> int:
        """Length of the frame in bits without a stuff bit."""
        return plain_bits(self.size)

    @property
    def worst_bits(self) -> int:
        """Greatest length in bits; for SYNC exactly, over all values of the counter; for SDO with any identifier."""
        if self.kind == "SYNC":
            return sync_bits()[1]
        if self.kind == "SDO":
            return generic_worst_bits(self.size)
        return worst_bits(self.identifier, self.size)


@cache
def sync_bits() -> tuple[int, int]:
    """Least and greatest length of SYNC over all values of its counter."""
    frames = np.zeros(SYNC_OVERFLOW, dtype=[("id", "<u4"), ("length", "u1"), ("data", "u1", 8)])
    frames["id"], frames["length"] = SYNC_ID, 1
    frames["data"][:, 0] = np.arange(1, SYNC_OVERFLOW + 1)
    bits = exact_bits(frames)
    return int(bits.min()), int(bits.max())


def messages(
    drives: Mapping[int, PdoChoice],
    period_us: int,
    *,
    controller: int = 1,
    outputs: Outputs | None = None,
) -> tuple[Message, ...]:
    """All frames in steady motion, most urgent first; `drives` by node. Outputs may change in each tick."""
    found = [Message("SYNC", SYNC_ID, 1, period_us)]
    for node, choice in drives.items():
        for pdo in drive_pdos(node, choice):
            kind = _KINDS[pdo.name]
            least_us = INHIBIT_US if kind in SPORADIC else period_us
            found.append(Message(kind, pdo.cob_id, pdo.size, least_us))
    found += [
        Message("heartbeats", HEARTBEAT_ID + node, 1, 1000 * HEARTBEAT_MS)
        for node in (controller, *drives, *((outputs.node,) if outputs is not None else ()))
    ]
    if outputs is not None:
        found.append(Message("outputs", RPDO1_ID + outputs.node, outputs.frame_bytes, period_us))
    return tuple(sorted(found, key=lambda message: message.identifier))


def machine_drives(machine: Machine, count: int | None = None) -> dict[int, PdoChoice]:
    """The drives of a machine file, or its first `count`, for `messages`."""
    return {axis.node: axis_choice(machine, axis) for axis in machine.axes[:count]}


SDO = Message("SDO", SDO_ID, SDO_BYTES, 0)
"""An SDO frame, which may be sent at any time: the longest frame of low priority."""
