# SPDX-License-Identifier: MIT
"""Layer setting services (CiA 305): finds drives without a node number by Fastscan, and gives them one. Used by
cli/commission_commands. Sends and receives frames, and waits by the clock of the bus, real or virtual.

Fastscan reads the identities of all unconfigured nodes, bit by bit. A found node is then in the configuration state and
takes no further part. Some devices do not follow this, so that an identity comes twice and hides later ones.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from canopen.lss import CS_FAST_SCAN, CS_IDENTIFY_SLAVE, LssError, LssMaster

from ..bus.sdo.network import Network
from ..errors import BusError, InputError
from .nodes import NODES, pass_time

ANSWER_S = 0.1
"""Wait for an LSS answer. A bit of an identity that is 1 takes this long, since no node answers."""
_SETTLE_S = 0.01
"""Pause between two requests, for the answers of further nodes."""
_LOOK_S = 0.001
_ANYBODY = 0x80
"""Bit number of a question that all nodes without a number answer (CiA 305)."""
_FASTSCAN = struct.Struct("<BIBBB")
BOOT_S = 0.5
"""Wait for the boot-up of nodes after they got their number."""


@dataclass(frozen=True, order=True)
class Identity:
    """Identity of a node without number: 0x1018 subs 1 to 4."""

    vendor: int
    product: int
    revision: int
    serial: int

    def __str__(self) -> str:
        fields = (f"{name} 0x{value:08X}" for name, value in asdict(self).items())
        return ", ".join(fields)


@dataclass(frozen=True)
class Assignment:
    """A node number to give. `serial` None: to the only unconfigured node."""

    serial: int | None
    node: int


@dataclass(frozen=True)
class Unconfigured:
    """The nodes without number.

    hidden  why there may be more that could not be identified; None: these are all
    """

    identities: tuple[Identity, ...]
    hidden: str | None = None


def find_unconfigured(network: Network) -> Unconfigured:
    """Finds the identities of all nodes without number. No node stores anything. Raises BusError."""
    scan, found = _Fastscan(network), list[Identity]()
    with _waiting_after(network):
        while (answer := scan.next_identity()) is not None:
            if isinstance(answer, str):
                return Unconfigured(tuple(found), answer)
            if answer in found:
                doubt = (
                    f"{answer}: answers twice, and may hide nodes without number: give it its number and "
                    "scan again"
                )
                return Unconfigured(tuple(found), doubt)
            found.append(answer)
    return Unconfigured(tuple(found))


def matched(
    wanted: Sequence[Assignment], found: Sequence[Identity], taken: Mapping[int, Identity]
) -> list[tuple[Identity, int]]:
    """The identity for each node number. Raises InputError: the assignment is not unique, or a number is taken.

    taken  identities of the nodes that have a number
    """
    pairs: list[tuple[Identity, int]] = []
    for one in wanted:
        fitting = [each for each in found if one.serial in (None, each.serial)]
        which = "" if one.serial is None else f" with serial number 0x{one.serial:08X}"
        if len(fitting) != 1:
            count = len(fitting) or "no"
            raise InputError(
                f"--assign: {count} unconfigured node{'s' if len(fitting) > 1 else ''}{which}: "
                f"{'give SERIAL=NODE' if fitting and one.serial is None else 'connect just that one, and scan again'}"
            )
        if one.node in taken or one.node in [node for _, node in pairs]:
            raise InputError(f"--assign: node number {one.node} is taken: choose another")
        if fitting[0] in [identity for identity, _ in pairs]:
            raise InputError(f"--assign: two numbers for {fitting[0]}: give one")
        for node, identity in taken.items():
            if identity == fitting[0]:
                raise InputError(
                    f"--assign: node {node} has the same identity ({identity}), and would get the number too: "
                    "connect one of them at a time"
                )
        pairs.append((fitting[0], one.node))
    return pairs


def assign(network: Network, identity: Identity, node: int, *, store: bool) -> None:
    """Gives a node its number, which it takes at once. Raises BusError.

    store  the node keeps the number without power
    """
    if node not in NODES:
        raise ValueError(f"node number {node}")
    with _waiting_after(network) as master:
        try:
            selected = master.send_switch_state_selective(*asdict(identity).values())
        except LssError:
            selected = False
        if not selected:
            raise BusError(f"{identity}: does not answer any more: is its power gone?")
        try:
            master.configure_node_id(node)
        except LssError as error:
            raise BusError(f"{identity}: refuses node number {node}: {error}") from None
        if store:
            try:
                master.store_configuration()
            except LssError as error:
                raise BusError(
                    f"{identity}: is node {node} now, but cannot store that ({error}): it forgets it without power"
                ) from None
    pass_time(network, BOOT_S)


@contextmanager
def _waiting_after(network: Network) -> Iterator[Any]:
    """The master; all nodes are in the waiting state before and after, in which a new number becomes valid."""
    master: Any = network.lss
    master.RESPONSE_TIMEOUT = ANSWER_S
    master.send_switch_state_global(LssMaster.WAITING_STATE)
    try:
        yield master
    finally:
        master.send_switch_state_global(LssMaster.WAITING_STATE)


class _Fastscan:
    """The master's side of Fastscan. Own code: that of canopen counts simultaneous answers wrongly, and sleeps in real
    time.
    """

    def __init__(self, network: Network) -> None:
        self._network, self._answers = network, 0
        network.subscribe(LssMaster.LSS_RX_COBID, self._heard)

    def next_identity(self) -> Identity | str | None:
        """The lowest identity that takes part; its node is in the configuration state then.

        None: no node takes part. A text: a node does, but cannot be identified.
        """
        if not self._asked(0, _ANYBODY, 0, 0):
            return None
        numbers = [0, 0, 0, 0]
        for sub in range(4):
            for bit in range(31, -1, -1):
                if not self._asked(numbers[sub], bit, sub, sub):
                    numbers[sub] |= 1 << bit
            if not self._asked(numbers[sub], 0, sub, (sub + 1) % 4):
                return "a node without number answers LSS, but not with one identity: scan again, or one by one"
        return Identity(*numbers)

    def _heard(self, cob: int, data: bytearray, time_s: float) -> None:
        del cob, time_s
        self._answers += data[0] == CS_IDENTIFY_SLAVE

    def _asked(self, number: int, bit: int, sub: int, then: int) -> bool:
        """Whether any node answers. Several nodes send equal answers, one after the other."""
        pass_time(self._network, _SETTLE_S)
        self._answers = 0
        self._network.send_message(
            LssMaster.LSS_TX_COBID, _FASTSCAN.pack(CS_FAST_SCAN, number, bit, sub, then)
        )
        clock = self._network.clock
        if clock.is_virtual:
            return self._network.wait_until(lambda: self._answers > 0, ANSWER_S)
        end_s = clock.now_s() + ANSWER_S
        while not self._answers and clock.now_s() < end_s:
            clock.sleep(_LOOK_S)
        return self._answers > 0
