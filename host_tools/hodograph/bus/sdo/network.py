# SPDX-License-Identifier: MIT
"""Opens a bus by python-can and canopen; their errors become BusError. Used by sdo/controller, commission/,
faults/fault_actions and monitor/link. Sends and receives frames, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

import errno
import logging
import queue
import struct
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import can
import canopen
from can.interfaces.socketcan import SocketcanBus

from ...errors import BusError, one_line
from ..address import BusAddress, check_raw
from ..clock import REAL_CLOCK, Clock
from ..local_bus import LocalBus

SEND_TIMEOUT_S = 1.0
_SEND_PAUSE_S = 0.001
_FRAME = struct.Struct("=IB3x8s")  # struct can_frame of linux/can.h

logging.getLogger("canopen").addHandler(logging.NullHandler())
logging.getLogger("can").addHandler(logging.NullHandler())
for _name in ("canopen", "can"):
    logging.getLogger(_name).propagate = False


class _Answers:
    """Replaces the queue of answers of an SDO client or an LSS master, which in virtual time no thread fills."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._answers: deque[bytes] = deque()

    def put(self, answer: bytes) -> None:
        """An answer has come."""
        self._answers.append(answer)

    def empty(self) -> bool:
        """Always True: answers from before a request do not belong to it."""
        self._network.take_waiting()
        self._answers.clear()
        return True

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        """The next answer. Raises queue.Empty."""
        if not self._network.wait_until(lambda: bool(self._answers), timeout if block else 0.0):
            raise queue.Empty
        return self._answers.popleft()


class Network(canopen.Network):
    """canopen's network, which waits if the transmit queue of a slow bus is full, and can run in virtual time.

    On SocketCAN it writes to the socket itself: on a busy single core python-can's way takes ten times as long, and
    an upload is some thousand frames. In virtual time no thread receives: frames are taken while something is waited
    for.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self._frames = bus
        self.clock: Clock = bus.clock if isinstance(bus, LocalBus) else REAL_CLOCK
        if not self.clock.is_virtual:
            # Callers that send or wait get the end of a bus as an error; its thread would print a traceback in
            # addition.
            listeners: list[Any] = self.listeners
            listeners.insert(0, _Ended())
            self.connect()
        else:
            answers: Any = _Answers(self)
            self.lss.responses = answers

    def add_node(self, node: Any, *arguments: Any, **options: Any) -> Any:
        """See canopen.Network."""
        added = super().add_node(node, *arguments, **options)
        if self.clock.is_virtual and isinstance(added, canopen.RemoteNode):
            added.sdo.responses = _Answers(self)
        return added

    def take_waiting(self) -> None:
        """Virtual time: passes on the received frames."""
        while (message := self._frames.recv(0)) is not None:
            self.notify(message.arbitration_id, message.data, message.timestamp)

    def wait_until(self, happened: Callable[[], bool], timeout_s: float | None) -> bool:
        """Virtual time: takes frames until the event is set; False: it is not after `timeout_s`."""
        limit_s = None if timeout_s is None else self.clock.now_s() + timeout_s
        self.take_waiting()
        while not happened():
            left_s = None if limit_s is None else limit_s - self.clock.now_s()
            if left_s is not None and left_s <= 0:
                return False
            message = self._frames.recv(left_s)
            if message is not None:
                self.notify(message.arbitration_id, message.data, message.timestamp)
        return True

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """See canopen.Network."""
        deadline = self.clock.now_s() + SEND_TIMEOUT_S
        while True:
            try:
                self._send_once(can_id, data, remote)
                return
            except (can.CanOperationError, OSError) as error:
                code = error.errno if isinstance(error, OSError) else error.error_code
                if code != errno.ENOBUFS or self.clock.now_s() > deadline:
                    raise
                self.clock.sleep(_SEND_PAUSE_S)

    def _send_once(self, can_id: int, data: bytes, remote: bool) -> None:
        if remote or not isinstance(self.bus, (SocketcanBus, LocalBus)):
            super().send_message(can_id, data, remote)
            return
        frame = _FRAME.pack(can_id, len(data), bytes(data))
        if isinstance(self.bus, LocalBus):
            self.bus.send_raw(frame)
        else:
            self.bus.socket.send(frame)


class _Ended(can.Listener):
    """Ignores the report of the receiving thread that the bus has ended: callers get it as an error of their own."""

    def on_message_received(self, msg: can.Message) -> None:
        """See can.Listener."""

    def on_error(self, exc: Exception) -> None:
        """See can.Listener."""


_ALL = 0x780
"""Mask of a service, whatever the node."""


def _filters(node: int | None) -> list[dict[str, Any]]:
    if node is None:
        return [
            {"can_id": base, "can_mask": _ALL, "extended": False}
            for base in (0x080, 0x580, 0x700, 0x780)
        ]
    return [
        {"can_id": base + node, "can_mask": 0x7FF, "extended": False}
        for base in (0x080, 0x580, 0x700)
    ]


def _open(address: BusAddress, node: int | None, bitrate: int) -> can.BusABC:
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
def open_network(address: BusAddress, node: int | None, bitrate: int) -> Iterator[Network]:
    """A canopen network that receives the answers of `node`, None: of all nodes and of LSS, and SYNC.

    Raises BusError when it can't be opened.
    """
    if address.is_raw:
        check_raw(address)
    try:
        bus = _open(address, node, bitrate)
    except Exception as error:
        raise BusError(f"{address}: cannot be opened: {one_line(error)}") from error
    network = Network(bus)
    try:
        yield network
    except can.CanError as error:
        raise BusError(f"{address}: {one_line(error)}: did it go down?") from error
    finally:
        with suppress(
            can.CanError
        ):  # errors of its thread: callers that waited for an answer have their own
            network.disconnect()
