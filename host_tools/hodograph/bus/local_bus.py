# SPDX-License-Identifier: MIT
"""A local bus: what hodograph-hub (sim/hub) serves to processes of one machine, whose kernel need not have CAN.

A member is a connection of type SOCK_SEQPACKET; a message is one struct can_frame of linux/can.h, as on a raw CAN
socket.
"""

from __future__ import annotations

import select
import socket
import struct
import time
from typing import Any

import can

_FRAME = struct.Struct("=IB3x8s")
_EXTENDED, _REMOTE, _ERROR = 0x80000000, 0x40000000, 0x20000000


def connect_local(path: str) -> socket.socket:
    """A member of the bus at `path`. Raises OSError."""
    member = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        member.connect(path)
    except OSError:
        member.close()
        raise
    return member


def _message(data: bytes) -> can.Message:
    identifier, length, payload = _FRAME.unpack(data)
    return can.Message(
        timestamp=time.time(),
        arbitration_id=identifier & ~(_EXTENDED | _REMOTE | _ERROR),
        is_extended_id=bool(identifier & _EXTENDED),
        is_remote_frame=bool(identifier & _REMOTE),
        is_error_frame=bool(identifier & _ERROR),
        dlc=length,
        data=payload[:length],
        is_rx=True,
    )


class LocalBus(can.BusABC):
    """The local bus at path `channel`, for python-can and python canopen."""

    def __init__(self, channel: str, **options: Any) -> None:
        self.socket = connect_local(channel)
        self.channel_info = f"local bus {channel}"
        self._wanted: list[tuple[int, int]] = []
        super().__init__(channel=channel, **options)

    def fileno(self) -> int:
        """Becomes readable with a frame."""
        return self.socket.fileno()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Raises CanOperationError when the bus has ended."""
        del timeout
        try:
            self.socket.send(_FRAME.pack(msg.arbitration_id, msg.dlc, bytes(msg.data)))
        except OSError as error:
            raise can.CanOperationError(str(error), error.errno) from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not select.select([self.socket], [], [], timeout)[0]:
            return None, True
        data = self._next()
        return (None if data is None else _message(data)), True

    def _next(self) -> bytes | None:
        """The next frame that passes the filters; None: there is none now. No message is made of the others: a full bus
        has some thousand a second.
        """
        while True:
            try:
                data = self.socket.recv(_FRAME.size, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return None
            if len(data) < _FRAME.size:
                raise can.CanOperationError("the local bus has ended")
            identifier = int.from_bytes(data[:4], "little")
            if not self._wanted or any((identifier ^ i) & m == 0 for i, m in self._wanted):
                return data

    def _apply_filters(self, filters: can.typechecking.CanFilters | None) -> None:
        self._wanted = [(each["can_id"], each["can_mask"]) for each in filters or ()]

    def shutdown(self) -> None:
        """Leaves the bus."""
        super().shutdown()
        self.socket.close()
