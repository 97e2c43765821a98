# SPDX-License-Identifier: MIT
"""Records each frame of a bus, fast enough for a full bus. Used by bus/, faults/ and latency. A thread receives;
nothing is sent.

A thread takes frames in batches (frame_batch). On a local bus it is no participant in virtual time (docs/glossary.md).
A call returns all frames that were sent up to the present instant of the caller.
"""

from __future__ import annotations

import threading
import time

import numpy as np

from ...errors import BusError
from ..address import BusAddress
from .frame_batch import BATCH, FrameBatch, open_socket
from .frames import FRAME_DTYPE, RECORD_DTYPE, Frames

__all__ = ["FRAME_DTYPE", "RECORD_DTYPE", "Frames", "Recorder"]

_PAUSE_S = 0.002


class Recorder:
    """Records all frames from `start` to `stop`; a context manager."""

    def __init__(self, address: BusAddress, pause_s: float = _PAUSE_S) -> None:
        """Opens the socket; frames queue up from here on, and are taken every `pause_s`. Raises BusError."""
        self._pause_s = pause_s
        self._socket = open_socket(address, timestamps=True)
        self._chunks: list[Frames] = []
        self._count = 0
        self._dropped = 0
        self._error: OSError | None = None
        self._ending = threading.Event()
        self._emptied = 0
        self._batch = FrameBatch(address)
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _work(self) -> None:
        batch = self._batch
        descriptor = self._socket.fileno()
        try:
            while True:
                ending = self._ending.is_set()
                count = batch.receive(descriptor)
                if count:
                    records = batch.records(count)
                    self._chunks.append(records)
                    self._count += records.size
                    self._dropped = batch.dropped(count - 1) or self._dropped
                    batch.rearm(count)
                if count < BATCH:
                    self._emptied += 1
                    if ending:
                        return
                    time.sleep(self._pause_s)
        except OSError as error:
            self._error = error

    @property
    def frame_count(self) -> int:
        """Frames recorded so far."""
        return self._count

    @property
    def dropped(self) -> int:
        """Number of frames that the Linux kernel dropped because they were not taken in time."""
        return self._dropped

    def stop(self) -> None:
        """Takes what is still queued and ends the recording. May be called again."""
        self._ending.set()
        self._thread.join()
        self._socket.close()

    def frames(self) -> Frames:
        """All recorded frames (`RECORD_DTYPE`), in the order of the bus, without those that `take` returned. Raises
        BusError: the bus has ended.
        """
        self._check()
        return _joined(list(self._chunks))

    def so_far(self) -> Frames:
        """All frames up to now, as `frames`; the recording continues."""
        self._catch_up()
        return self.frames()

    def take(self) -> Frames:
        """The frames since the last call, which are then not kept here. Raises BusError as `frames`."""
        self._catch_up()
        self._check()
        chunks = self._chunks[: len(self._chunks)]  # the thread appends only
        del self._chunks[: len(chunks)]
        return _joined(chunks)

    def _catch_up(self) -> None:
        """Waits until the thread has found the socket empty in a check that began after this call."""
        wanted = self._emptied + 2
        while self._emptied < wanted and self._thread.is_alive():
            time.sleep(_PAUSE_S / 2)

    def _check(self) -> None:
        if self._error is not None:
            raise BusError(f"recording ended: {self._error.strerror}: did the interface go down?")


def _joined(chunks: list[Frames]) -> Frames:
    return np.concatenate(chunks) if chunks else np.zeros(0, dtype=RECORD_DTYPE)
