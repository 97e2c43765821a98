# SPDX-License-Identifier: MIT
"""The python-can and canopen side of a bus: opening it, and errors in our words."""

from __future__ import annotations

import errno
import logging
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import can
import canopen
from can.interfaces.socketcan import SocketcanBus

from ...errors import BusError, one_line
from ..address import BusAddress, check_raw
from ..local_bus import LocalBus

SEND_TIMEOUT_S = 1.0
_FRAME = struct.Struct("=IB3x8s")  # struct can_frame of linux/can.h

logging.getLogger("canopen").addHandler(logging.NullHandler())
logging.getLogger("can").addHandler(logging.NullHandler())
for _name in ("canopen", "can"):
    logging.getLogger(_name).propagate = False


class _Network(canopen.Network):
    """canopen's network, patient when the transmit queue of a slow bus is full.

    On SocketCAN it writes to the socket itself: on a busy single core python-can's way takes ten times as long, and
    an upload is some thousand frames.
    """

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        deadline = time.monotonic() + SEND_TIMEOUT_S
        while True:
            try:
                self._send_once(can_id, data, remote)
                return
            except (can.CanOperationError, OSError) as error:
                code = error.errno if isinstance(error, OSError) else error.error_code
                if code != errno.ENOBUFS or time.monotonic() > deadline:
                    raise
                time.sleep(0.001)

    def _send_once(self, can_id: int, data: bytes, remote: bool) -> None:
        if remote or not isinstance(self.bus, (SocketcanBus, LocalBus)):
            super().send_message(can_id, data, remote)
        else:
            self.bus.socket.send(_FRAME.pack(can_id, len(data), bytes(data)))


def _filters(node: int) -> list[dict[str, Any]]:
    return [
        {"can_id": base + node, "can_mask": 0x7FF, "extended": False}
        for base in (0x080, 0x580, 0x700)
    ]


def _open(address: BusAddress, node: int, bitrate: int) -> can.BusABC:
    if address.is_local:
        return LocalBus(address.channel, can_filters=_filters(node))
    options: dict[str, Any] = {} if address.is_socketcan else {"bitrate": bitrate}
    return can.Bus(
        channel=address.channel,
        interface=address.interface,
        can_filters=_filters(node),
        **options,
    )


@contextmanager
def open_network(address: BusAddress, node: int, bitrate: int) -> Iterator[canopen.Network]:
    """A canopen network that hears what `node` says to us. Raises BusError when it can't be opened."""
    if address.is_raw:
        check_raw(address)
    network = _Network()
    try:
        bus = _open(address, node, bitrate)
    except Exception as error:
        raise BusError(f"{address}: cannot be opened: {one_line(error)}") from error
    network.bus = bus
    network.connect()
    try:
        yield network
    finally:
        network.disconnect()
