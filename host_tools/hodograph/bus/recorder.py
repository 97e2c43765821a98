# SPDX-License-Identifier: MIT
"""Recording every frame of a SocketCAN bus, fast enough for a bus at full pace.

A thread takes frames in batches (frame_batch) and keeps the raw 16-byte structures of linux/can.h. They are looked at
afterwards, with numpy.
"""

from __future__ import annotations

import threading
import time
from types import TracebackType

import numpy as np

from ..errors import BusError
from .address import BusAddress
from .frame_batch import BATCH, FRAME_BYTES, FRAME_DTYPE, FrameBatch, Frames, open_socket

__all__ = ["FRAME_DTYPE", "Frames", "Recorder"]

_PAUSE_S = 0.002


class Recorder:
    """Records all frames from `start` to `stop`; a context manager."""

    def __init__(self, address: BusAddress) -> None:
        """Opens the socket; frames queue up from here on. Raises BusError."""
        self._socket = open_socket(address)
        self._chunks: list[bytes] = []
        self._bytes = 0
        self._dropped = 0
        self._error: OSError | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()
        self.started_s = time.monotonic()

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
        batch = FrameBatch()
        descriptor = self._socket.fileno()
        try:
            while True:
                ending = self._ending.is_set()
                count = batch.receive(descriptor)
                if count:
                    self._chunks.append(batch.taken(count))
                    self._bytes += count * FRAME_BYTES
                    self._dropped = batch.dropped(count - 1) or self._dropped
                    batch.rearm(count)
                if count < BATCH:
                    if ending:
                        return
                    time.sleep(_PAUSE_S)
        except OSError as error:
            self._error = error

    @property
    def frame_count(self) -> int:
        """Frames recorded so far."""
        return self._bytes // FRAME_BYTES

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
