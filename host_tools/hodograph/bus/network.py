# SPDX-License-Identifier: MIT
"""The python-can and canopen side of a bus: opening it, and errors in our words."""

from __future__ import annotations

import errno
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import can
import canopen

from ..errors import BusError
from .address import BusAddress, check_socketcan

SEND_TIMEOUT_S = 1.0

logging.getLogger("canopen").addHandler(logging.NullHandler())
logging.getLogger("can").addHandler(logging.NullHandler())
for _name in ("canopen", "can"):
    logging.getLogger(_name).propagate = False


class _Network(canopen.Network):
    """canopen's network, patient when the transmit queue of a slow bus is full."""

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        deadline = time.monotonic() + SEND_TIMEOUT_S
        while True:
            try:
                super().send_message(can_id, data, remote)
                return
            except can.CanOperationError as error:
                full = error.error_code == errno.ENOBUFS or "buffer full" in str(error)
                if not full or time.monotonic() > deadline:
                    raise
                time.sleep(0.001)


def _filters(node: int) -> list[dict[str, Any]]:
    return [
        {"can_id": base + node, "can_mask": 0x7FF, "extended": False}
        for base in (0x080, 0x580, 0x700)
    ]


@contextmanager
def open_network(address: BusAddress, node: int, bitrate: int) -> Iterator[canopen.Network]:
    """A canopen network that hears what `node` says to us. Raises BusError when it can't be opened."""
    if address.is_socketcan:
        check_socketcan(address)
    options: dict[str, Any] = {} if address.is_socketcan else {"bitrate": bitrate}
    network = _Network()
    try:
        bus = can.Bus(
            channel=address.channel,
            interface=address.interface,
            can_filters=_filters(node),
            **options,
        )
    except Exception as error:
        raise BusError(f"{address}: cannot be opened: {_one_line(error)}") from error
    network.bus = bus
    network.connect()
    try:
        yield network
    finally:
        network.disconnect()


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
