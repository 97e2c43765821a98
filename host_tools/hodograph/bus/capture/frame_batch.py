# SPDX-License-Identifier: MIT
"""Receives frames from the socket of a bus in batches: recvmmsg, outside Python's interpreter lock. Used by
capture/recorder and monitor/source. Opens the socket and receives; sends no frames.

One system call takes up to about a thousand frames. The frames stay raw structures of linux/can.h, which numpy reads.
Each frame has the time at which the Linux kernel received it (SO_TIMESTAMP) and the number of frames that it dropped
for this socket (SO_RXQ_OVFL). A local bus sends the time with each frame.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import BusError
from ..address import BusAddress
from ..clock import MOST_FRAMES, member_connection
from .frames import FRAME_DTYPE, RECORD_DTYPE, Frames

__all__ = ["BATCH", "FRAME_DTYPE", "RECORD_DTYPE", "FrameBatch", "Frames", "open_socket"]

BATCH = 1024
"""Most packets of a call. A packet has one frame, on a local bus up to MOST_FRAMES."""
_LOCAL_DTYPE = np.dtype([*FRAME_DTYPE.descr, ("time_ns", "<u8")])
_CONTROL_BYTES = 64
"""Room for the control messages of a frame: its time and the number of lost frames."""
_BUFFER_BYTES = 64 * 2**20
"""Receive buffer of the socket."""
_SO_RCVBUFFORCE = 33
_SO_TIMESTAMP = 29
_SO_RXQ_OVFL = 40
_MSG_DONTWAIT = 0x40
_CMSG = struct.Struct("<Qii")
_STAMP = np.dtype(
    {
        "names": ["level", "kind", "seconds", "microseconds"],
        "formats": ["<i4", "<i4", "<i8", "<i8"],
        "offsets": [8, 12, 16, 24],
        "itemsize": _CONTROL_BYTES,
    }
)
"""The first control message, which is the time stamp where the socket has them."""


def open_socket(address: BusAddress, *, timestamps: bool = False) -> socket.socket:
    """A socket that receives every frame, with a large buffer; frames queue up from here on. Raises BusError."""
    listener: socket.socket | None = None
    try:
        if address.is_local:
            listener = member_connection(address.channel, 0)
        else:
            listener = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        _enlarge(listener)
        listener.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        if timestamps:
            listener.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMP, 1)
        if not address.is_local:
            listener.bind((address.channel,))
    except OSError as error:
        if listener is not None:
            listener.close()
        raise BusError(f"{address}: cannot record: {error.strerror}: is the bus up?") from None
    return listener


def _enlarge(listener: socket.socket) -> None:
    try:
        listener.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER_BYTES)
    except OSError:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)


class _IoVec(ctypes.Structure):
    _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))


class _MsgHdr(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_length", ctypes.c_uint32),
        ("vectors", ctypes.POINTER(_IoVec)),
        ("vector_count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_length", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _MMsgHdr(ctypes.Structure):
    _fields_ = (("header", _MsgHdr), ("length", ctypes.c_uint32))


class FrameBatch:
    """Buffers of one recvmmsg call and the call itself, for a socket of this bus."""

    def __init__(self, address: BusAddress) -> None:
        dtype = _LOCAL_DTYPE if address.is_local else FRAME_DTYPE
        most = MOST_FRAMES if address.is_local else 1
        packet_bytes = most * dtype.itemsize
        self.frames = bytearray(BATCH * packet_bytes)
        self._rows = np.frombuffer(self.frames, dtype=dtype).reshape(BATCH, most)
        self._control = bytearray(BATCH * _CONTROL_BYTES)
        frames = (ctypes.c_char * len(self.frames)).from_buffer(self.frames)
        control = (ctypes.c_char * len(self._control)).from_buffer(self._control)
        self._vectors = (_IoVec * BATCH)()
        self._messages = (_MMsgHdr * BATCH)()
        control_base = ctypes.addressof(control)
        self._stamps = np.frombuffer(self._control, dtype=_STAMP)
        self._control_lengths = self._field(_MsgHdr.control_length.offset, np.dtype(np.uint64))
        self._lengths = self._field(_MMsgHdr.length.offset, np.dtype(np.uint32))
        for i in range(BATCH):
            self._vectors[i].base = ctypes.addressof(frames) + i * packet_bytes
            self._vectors[i].length = packet_bytes
            header = self._messages[i].header
            header.vectors = ctypes.pointer(self._vectors[i])
            header.vector_count = 1
            header.control = control_base + i * _CONTROL_BYTES
            header.control_length = _CONTROL_BYTES
        self._call = ctypes.CDLL(None, use_errno=True).recvmmsg

    def _field(self, offset: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """A field (BATCH,) of all messages, in place."""
        return np.ndarray(
            BATCH,
            dtype=dtype,
            buffer=memoryview(self._messages).cast("B"),
            offset=offset,
            strides=(ctypes.sizeof(_MMsgHdr),),
        )

    def receive(self, descriptor: int) -> int:
        """Fills the buffers with the waiting packets; returns their number. Raises OSError."""
        count = int(self._call(descriptor, self._messages, BATCH, _MSG_DONTWAIT, None))
        if count < 0:
            error = ctypes.get_errno()
            if error in (11, 4):
                return 0
            raise OSError(error, os.strerror(error))
        if count > 0 and self._messages[0].length == 0:  # how a local bus ends
            raise OSError(errno.ENETDOWN, os.strerror(errno.ENETDOWN))
        return count

    def records(self, count: int) -> Frames:
        """The frames of the first `count` packets and when they came (`RECORD_DTYPE`); 0 where the socket has no time
        stamps.
        """
        filled = self._lengths[:count, None] // self._rows.dtype.itemsize
        rows = self._rows[:count][np.arange(self._rows.shape[1]) < filled]
        records = np.zeros(rows.size, dtype=RECORD_DTYPE)
        for name in ("id", "length", "data"):
            records[name] = rows[name]
        if rows.dtype == _LOCAL_DTYPE:
            records["time_us"] = rows["time_ns"] // 1000
        else:
            records["time_us"] = self._stamps_us(count)
        return records

    def dropped(self, last: int) -> int | None:
        """The drop count of the Linux kernel that came with packet `last`; None: none came."""
        for kind, data in self._words_beside(last):
            if kind == _SO_RXQ_OVFL:
                return int(struct.unpack_from("<I", data)[0])
        return None

    def _stamps_us(self, count: int) -> NDArray[np.int64]:
        """The times at which the Linux kernel received the first `count` frames."""
        stamps = self._stamps[:count]
        times = stamps["seconds"] * 1_000_000 + stamps["microseconds"]
        is_stamp = (stamps["level"] == socket.SOL_SOCKET) & (stamps["kind"] == _SO_TIMESTAMP)
        return np.where(is_stamp, times, 0)

    def _words_beside(self, last: int) -> Iterator[tuple[int, bytes]]:
        """Kind and data of each control message (cmsg(3)) of level SOL_SOCKET."""
        start = last * _CONTROL_BYTES
        end = start + int(self._messages[last].header.control_length)
        while start + _CMSG.size <= end:
            length, level, kind = _CMSG.unpack_from(self._control, start)
            if length < _CMSG.size:
                return
            if level == socket.SOL_SOCKET:
                yield kind, bytes(self._control[start + _CMSG.size : start + length])
            start += (length + 7) & ~7

    def rearm(self, count: int) -> None:
        """Restores the control buffers of the first `count` messages."""
        self._control_lengths[:count] = _CONTROL_BYTES
