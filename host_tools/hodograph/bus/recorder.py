# SPDX-License-Identifier: MIT
"""Recording every frame of a SocketCAN bus, fast enough for a bus at full pace.

A thread takes frames in batches with recvmmsg (about one system call per thousand frames, outside Python's
interpreter lock) and keeps the raw 16-byte structures of linux/can.h. They are looked at afterwards, with numpy.
The kernel's count of frames it had to drop for this socket comes along (SO_RXQ_OVFL).
"""

from __future__ import annotations

import ctypes
import os
import socket
import struct
import threading
import time
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from ..errors import BusError
from .address import BusAddress

FRAME_DTYPE = np.dtype(
    [("id", "<u4"), ("length", "u1"), ("padding", "u1", 3), ("data", "u1", 8)], align=False
)
"""struct can_frame of linux/can.h on a little-endian machine."""

Frames = NDArray[np.void]

_FRAME_BYTES = 16
_BATCH = 1024
_CONTROL_BYTES = 32
_PAUSE_S = 0.002
_BUFFER_BYTES = 64 * 2**20
_SO_RCVBUFFORCE = 33
_SO_RXQ_OVFL = 40
_MSG_DONTWAIT = 0x40


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


class _Batch:
    """Buffers of one recvmmsg call and the call itself."""

    def __init__(self) -> None:
        self.frames = bytearray(_BATCH * _FRAME_BYTES)
        self.control = bytearray(_BATCH * _CONTROL_BYTES)
        frames = (ctypes.c_char * len(self.frames)).from_buffer(self.frames)
        control = (ctypes.c_char * len(self.control)).from_buffer(self.control)
        self.vectors = (_IoVec * _BATCH)()
        self.messages = (_MMsgHdr * _BATCH)()
        self._control_base = ctypes.addressof(control)
        for i in range(_BATCH):
            self.vectors[i].base = ctypes.addressof(frames) + i * _FRAME_BYTES
            self.vectors[i].length = _FRAME_BYTES
            header = self.messages[i].header
            header.vectors = ctypes.pointer(self.vectors[i])
            header.vector_count = 1
            header.control = self._control_base + i * _CONTROL_BYTES
            header.control_length = _CONTROL_BYTES
        self._call = ctypes.CDLL(None, use_errno=True).recvmmsg

    def receive(self, descriptor: int) -> int:
        """Fills the buffers with what is there; the number of frames, 0 when there is none."""
        count = int(self._call(descriptor, self.messages, _BATCH, _MSG_DONTWAIT, None))
        if count < 0:
            error = ctypes.get_errno()
            if error in (11, 4):
                return 0
            raise OSError(error, os.strerror(error))
        return count

    def dropped(self, last: int) -> int | None:
        """The kernel's drop count that came with frame `last`; None when none did."""
        header = self.messages[last].header
        start = last * _CONTROL_BYTES
        found = None
        if header.control_length >= 20:
            _, level, kind, count = struct.unpack_from("<QiiI", self.control, start)
            if level == socket.SOL_SOCKET and kind == _SO_RXQ_OVFL:
                found = int(count)
        return found

    def rearm(self, count: int) -> None:
        """Makes the control buffers of the first `count` messages whole again."""
        for i in range(count):
            self.messages[i].header.control_length = _CONTROL_BYTES


class Recorder:
    """Records all frames from `start` to `stop`; a context manager."""

    def __init__(self, address: BusAddress) -> None:
        """Opens the socket; frames queue up from here on. Raises BusError."""
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            self._enlarge()
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
            self._socket.bind((address.channel,))
        except OSError as error:
            raise BusError(f"{address}: cannot record: {error.strerror}: is the bus up?") from None
        self._chunks: list[bytes] = []
        self._bytes = 0
        self._dropped = 0
        self._error: OSError | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()
        self.started_s = time.monotonic()

    def _enlarge(self) -> None:
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER_BYTES)
        except OSError:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _work(self) -> None:
        batch = _Batch()
        descriptor = self._socket.fileno()
        try:
            while True:
                ending = self._ending.is_set()
                count = batch.receive(descriptor)
                if count:
                    self._chunks.append(bytes(batch.frames[: count * _FRAME_BYTES]))
                    self._bytes += count * _FRAME_BYTES
                    self._dropped = batch.dropped(count - 1) or self._dropped
                    batch.rearm(count)
                if count < _BATCH:
                    if ending:
                        return
                    time.sleep(_PAUSE_S)
        except OSError as error:
            self._error = error

    @property
    def frame_count(self) -> int:
        """Frames recorded so far."""
        return self._bytes // _FRAME_BYTES

    @property
    def dropped(self) -> int:
        """Frames that the kernel dropped because nobody took them in time."""
        return self._dropped

    def stop(self) -> None:
        """Takes what is still queued and ends the recording. May be called again."""
        self._ending.set()
        self._thread.join()
        self._socket.close()

    def frames(self) -> Frames:
        """Everything recorded, in the order of the bus. Raises BusError when the bus went away."""
        if self._error is not None:
            raise BusError(f"recording ended: {self._error.strerror}: did the interface go down?")
        return np.frombuffer(b"".join(list(self._chunks)), dtype=FRAME_DTYPE)
