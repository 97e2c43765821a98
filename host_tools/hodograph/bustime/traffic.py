# SPDX-License-Identifier: MIT
"""The frames of a machine in steady motion: who sends what, how often (docs/protocol.md section 2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..config import Machine
from .frame_bits import exact_bits, generic_worst_bits, plain_bits, worst_bits
from .pdos import drive_pdos

SYNC_ID, HEARTBEAT_ID, SDO_ID = 0x080, 0x700, 0x580
SYNC_OVERFLOW = 240
HEARTBEAT_MS = 100
SDO_BYTES = 8

CYCLIC = ("SYNC", "setpoints", "positions", "other PDOs")
"""Kinds of frames that come once a tick."""
NEEDED = ("SYNC", "setpoints", "positions")
"""Those that must be through before the next SYNC: the drive latches, the controller supervises."""


@dataclass(frozen=True)
class Message:
    """A frame that comes every `period_us`."""

    kind: str
    identifier: int
    size: int
    period_us: int

    @property
    def plain_bits(self) -> int:
        """Its length without a stuff bit."""
        return plain_bits(self.size)

    @property
    def worst_bits(self) -> int:
        """Its greatest length; for SYNC exactly, over all values of the counter; for SDO with any identifier."""
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


def kind_of_pdo(name: str) -> str:
    """The kind of traffic that a PDO of a drive is."""
    return {"RPDO1": "setpoints", "TPDO1": "positions"}.get(name, "other PDOs")


def messages(
    nodes: Sequence[int], period_us: int, *, controller: int = 1, only_first_pdos: bool = False
) -> tuple[Message, ...]:
    """All periodic frames, most urgent first.

    `only_first_pdos`: RPDO1 and TPDO1 only, as most real drives; otherwise all that the EDS has.
    """
    found = [Message("SYNC", SYNC_ID, 1, period_us)]
    for node in nodes:
        for pdo in drive_pdos(node):
            kind = kind_of_pdo(pdo.name)
            if kind != "other PDOs" or not only_first_pdos:
                found.append(Message(kind, pdo.cob_id, pdo.size, period_us))
    found += [
        Message("heartbeats", HEARTBEAT_ID + node, 1, 1000 * HEARTBEAT_MS)
        for node in (controller, *nodes)
    ]
    return tuple(sorted(found, key=lambda message: message.identifier))


def machine_messages(machine: Machine, *, only_first_pdos: bool = False) -> tuple[Message, ...]:
    """The periodic frames of a machine file."""
    return messages(
        machine.nodes, machine.period_us, controller=machine.node, only_first_pdos=only_first_pdos
    )


SDO = Message("SDO", SDO_ID, SDO_BYTES, 0)
"""An SDO frame, as it may come at any time: the longest that can be in the way."""
