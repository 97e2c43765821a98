# SPDX-License-Identifier: MIT
"""The client of a local bus, which hodograph-hub (sim/hub) serves to processes of one computer without CAN in the Linux
kernel. Used by sdo/network. Sends and receives frames, and waits by the clock of the bus, real or virtual.

A member sends struct can_frame of linux/can.h and receives the same with a time stamp, in virtual time several in a
packet (firmware/port/linux/local_bus.h).
"""

from __future__ import annotations

import select
import socket
import struct
from collections import deque
from typing import Any

import can

from .clock import (
    MOST_FRAMES,
    REAL_CLOCK,
    Clock,
    VirtualClock,
    filter_message,
    hub_clock,
    member_connection,
)

_FRAME = struct.Struct("=IB3x8s")
_STAMPED = struct.Struct("=IB3x8sQ")
_EXTENDED, _REMOTE, _ERROR = 0x80000000, 0x40000000, 0x20000000
_MOST_FILTERS = 48


def _message(data: bytes) -> can.Message:
    identifier, length, payload, time_ns = _STAMPED.unpack(data)
    return can.Message(
        timestamp=time_ns * 1e-9,
        arbitration_id=identifier & ~(_EXTENDED | _REMOTE | _ERROR),
        is_extended_id=bool(identifier & _EXTENDED),
        is_remote_frame=bool(identifier & _REMOTE),
        is_error_frame=bool(identifier & _ERROR),
        dlc=length,
        data=payload[:length],
        is_rx=True,
    )


class LocalBus(can.BusABC):
    """The local bus at path `channel`, for python-can and python canopen.

    In virtual time a bus belongs to the thread that opened it: `clock` is its part in that time.
    """

    def __init__(self, channel: str, **options: Any) -> None:
        """Raises OSError: no hub serves the path."""
        self._virtual: VirtualClock | None = hub_clock(channel)
        self.clock: Clock = self._virtual or REAL_CLOCK
        try:
            number = self._virtual.number if self._virtual is not None else 0
            self.socket = member_connection(channel, number)
        except OSError:
            self._release()
            raise
        self.channel_info = f"local bus {channel}"
        self._wanted: list[tuple[int, int]] = []
        self._waiting: deque[bytes] = deque()
        super().__init__(channel=channel, **options)
        if self._virtual is not None:
            self._virtual.attach(self)

    def fileno(self) -> int:
        """Becomes readable with a frame, in real time."""
        return self.socket.fileno()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Raises CanOperationError when the bus has ended."""
        del timeout
        flags = (
            _EXTENDED * msg.is_extended_id
            | _REMOTE * msg.is_remote_frame
            | _ERROR * msg.is_error_frame
        )
        self.send_raw(_FRAME.pack(msg.arbitration_id | flags, msg.dlc, bytes(msg.data)))

    def send_raw(self, frame: bytes) -> None:
        """A struct can_frame. Raises CanOperationError when the bus has ended."""
        if self._virtual is not None:
            self._virtual.activate()
        try:
            self.socket.send(frame)
        except OSError as error:
            raise can.CanOperationError(str(error), error.errno) from error

    def fill(self) -> None:
        """Takes the received frames from the socket: in virtual time the hub waits until they are taken."""
        while self._take_packet():
            pass

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """See can.BusABC, which counts the time-out by this computer's clock."""
        return super().recv(timeout) if self._virtual is None else self._recv_internal(timeout)[0]

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._virtual is not None:
            data = self._await_virtually(self._virtual, timeout)
        else:
            if not self._waiting:
                select.select([self.socket], [], [], timeout)
            while not self._waiting and self._take_packet():
                pass
            data = self._waiting.popleft() if self._waiting else None
        return (None if data is None else _message(data)), True

    def _await_virtually(self, clock: VirtualClock, timeout: float | None) -> bytes | None:
        limit_s = None if timeout is None else clock.now_s() + timeout
        self.fill()
        while not self._waiting and (limit_s is None or clock.now_s() < limit_s):
            clock.wait(limit_s)
        return self._waiting.popleft() if self._waiting else None

    def _take_packet(self) -> bool:
        """Keeps the frames of the next packet that pass the filters; False: there is no packet. No message object is
        made of the others, since a full bus has some thousand frames a second.
        """
        try:
            packet = self.socket.recv(MOST_FRAMES * _STAMPED.size, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError as error:
            raise can.CanOperationError(str(error), error.errno) from error
        if len(packet) < _STAMPED.size:
            raise can.CanOperationError("the local bus has ended")
        for start in range(0, len(packet), _STAMPED.size):
            identifier = int.from_bytes(packet[start : start + 4], "little")
            if not self._wanted or any((identifier ^ i) & m == 0 for i, m in self._wanted):
                self._waiting.append(packet[start : start + _STAMPED.size])
        return True

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        self._wanted = [(each["can_id"], each["can_mask"]) for each in filters or ()]
        if (
            len(self._wanted) <= _MOST_FILTERS
        ):  # else the hub sends more frames, and the filters choose
            self.socket.send(filter_message(self._wanted))

    def _release(self) -> None:
        if self._virtual is not None:
            self._virtual.detach(self)
            self._virtual.release()
            self._virtual = None

    def shutdown(self) -> None:
        """Leaves the bus."""
        super().shutdown()
        self.socket.close()
        self._release()
