# SPDX-License-Identifier: MIT
"""Every frame of a bus, in parts: a thread takes them as they come, a checker asks for what there is so far."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.address import BusAddress
from hodograph.bus.listening.frame_batch import BATCH, FRAME_DTYPE, FrameBatch, Frames, open_socket

_PAUSE_S = 0.002
_AWAKE_S = 0.02
"""A longer gap between two looks is this machine standing still: it counts as so much only."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Frames in the order of the bus, and when each was taken, in seconds during which this process ran."""

    frames: Frames
    times_s: NDArray[np.float64]


class Tap:
    """Listens from its making to `close`."""

    def __init__(self, address: BusAddress) -> None:
        """Raises BusError."""
        self._socket = open_socket(address)
        self._parts: list[tuple[bytes, int, float]] = []
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._error: OSError | None = None
        self.dropped = 0
        self._thread = threading.Thread(target=self._work, name="tap", daemon=True)
        self._thread.start()

    def __enter__(self) -> Tap:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _work(self) -> None:
        batch = FrameBatch()
        descriptor = self._socket.fileno()
        awake_s, before_s = 0.0, time.monotonic()
        try:
            while not self._ending.is_set():
                count = batch.receive(descriptor)
                now_s = time.monotonic()
                awake_s += min(now_s - before_s, _AWAKE_S)
                before_s = now_s
                if count:
                    with self._lock:
                        self._parts.append((batch.taken(count), count, awake_s))
                    self.dropped = batch.dropped(count - 1) or self.dropped
                    batch.rearm(count)
                if count < BATCH:
                    time.sleep(_PAUSE_S)
        except OSError as error:
            self._error = error

    def take(self) -> Stretch:
        """All frames since the last call. Raises OSError when the bus went away."""
        if self._error is not None:
            raise self._error
        with self._lock:
            parts, self._parts = self._parts, []
        frames = np.frombuffer(b"".join(data for data, _, _ in parts), dtype=FRAME_DTYPE)
        times = [np.full(count, at) for _, count, at in parts]
        return Stretch(frames, np.concatenate(times) if times else np.zeros(0))

    def close(self) -> None:
        """Ends listening. May be called again."""
        self._ending.set()
        self._thread.join()
        self._socket.close()
