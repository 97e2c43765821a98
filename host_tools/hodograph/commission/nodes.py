# SPDX-License-Identifier: MIT
"""Finds the nodes on a bus and reads their objects by SDO, where no controller sends SYNC. Used by
cli/commission_commands and commission/. Sends, receives, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ..bus.address import BusAddress
from ..bus.sdo.network import Network, open_network
from ..errors import BusError

NODES = range(1, 128)
LISTEN_S = 0.1
"""Longer than the slowest period of SYNC."""
_SYNC = 0x080
_ANSWERS = 0x580
"""COB-ID of SDO answers, less the node number."""
_ANSWER_S = 1.0
_NOT_THERE = (0x06020000, 0x06090011)
"""Abort codes: no such object, no such sub-index."""


@contextmanager
def opened_bus(address: BusAddress, bitrate: int) -> Iterator[Network]:
    """A network that receives the frames of all nodes. Raises BusError."""
    with open_network(address, None, bitrate) as network:
        yield network


def require_no_controller(network: Network, address: BusAddress) -> None:
    """Raises BusError: a node sends SYNC. A controller uses the same SDO channels of its drives."""
    heard: list[int] = []
    network.subscribe(_SYNC, lambda cob, data, time_s: heard.append(cob))
    pass_time(network, LISTEN_S)
    if heard:
        raise BusError(
            f"{address}: a controller sends SYNC, and asks the drives by the same SDO channel: end it first"
        )


def found_nodes(network: Network, wait_s: float, nodes: Collection[int] = NODES) -> list[int]:
    """Numbers of the nodes that answer a request for their device type within `wait_s`.

    Other frames of a node do not count: a node that sends only heartbeats cannot be read.
    """
    heard: set[int] = set()

    def answered(cob: int, data: bytearray, time_s: float) -> None:
        del data, time_s
        heard.add(cob - _ANSWERS)

    for node in nodes:
        network.subscribe(_ANSWERS + node, answered)
    for node in nodes:
        request = bytes((0x40, 0x00, 0x10, 0, 0, 0, 0, 0))
        network.send_message(0x600 + node, request)
    pass_time(network, wait_s)
    for node in nodes:
        network.unsubscribe(_ANSWERS + node, answered)
    return sorted(heard)


def pass_time(network: Network, seconds: float) -> None:
    """Receives from the bus for a time."""
    if network.clock.is_virtual:
        network.wait_until(lambda: False, seconds)
    else:
        network.clock.sleep(seconds)


class NodeReader:
    """Reads objects of one node."""

    def __init__(self, network: Network, node: int) -> None:
        self.node = node
        dictionary: Any = canopen.ObjectDictionary
        self._sdo = network.add_node(node, dictionary()).sdo
        self._sdo.RESPONSE_TIMEOUT = _ANSWER_S

    def data(self, index: int, sub: int = 0) -> bytes | None:
        """The bytes of an object; None: the node does not have it; empty: the node has it but does not report it.

        Raises BusError: the node does not answer.
        """
        try:
            return bytes(self._sdo.upload(index, sub))
        except SdoAbortedError as error:
            return None if error.code in _NOT_THERE else b""
        except SdoCommunicationError as error:
            raise BusError(
                f"node {self.node}: no answer about object 0x{index:04X} sub {sub}: is its power gone?"
            ) from error

    def number(self, index: int, sub: int = 0, *, signed: bool = False) -> int | None:
        """The object as a whole number; None: there is none."""
        data = self.data(index, sub)
        return int.from_bytes(data[:8], "little", signed=signed) if data else None

    def text(self, index: int) -> str | None:
        """The object as a text, without unprintable characters."""
        data = self.data(index)
        if not data:
            return None
        text = data.split(b"\0")[0].decode("utf-8", errors="replace")
        return "".join(letter if letter.isprintable() else "?" for letter in text).strip()
