# SPDX-License-Identifier: MIT
"""Sources of frames: a live bus, or a recording at the rate of the machine or a multiple of it. Used by pump, session
and cli/monitor_command. Receives frames from the bus in a thread of its own, or reads the file that it is given.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import can
import numpy as np

from ..bus.address import BusAddress, check_raw
from ..bus.capture.decode import SYNC_ID, SYNC_OVERFLOW
from ..bus.capture.frame_batch import BATCH, FrameBatch, open_socket
from ..bus.capture.frames import RECORD_DTYPE, Frames
from ..bus.capture.recordings import read_recording
from ..bus.clock import has_virtual_time
from ..errors import BusError, InputError, one_line

MOST_FRAMES = 65536
"""Most frames taken at once, and most frames queued on interfaces without a queue in the Linux kernel."""


@dataclass(frozen=True, eq=False)
class Taken:
    """The frames since the last poll."""

    frames: Frames
    """`RECORD_DTYPE`, with the time stamps of the bus; in a recording those of the machine."""
    now_us: int | None = None
    """The present by that clock; None: not known, since this process is no participant in virtual time."""
    dropped: int = 0
    """Frames lost since the start, because they were not taken in time."""
    ended: bool = False
    """A recording is at its end."""


NO_FRAMES = np.empty(0, dtype=RECORD_DTYPE)


class Source(Protocol):
    """Frames in the order of the bus."""

    def take(self) -> Taken:
        """The frames since the last call; never waits. Raises BusError: the bus has ended."""
        ...

    def close(self) -> None:
        """Closes the bus."""
        ...


def open_source(address: BusAddress, bitrate: int) -> Source:
    """Receives from a bus. Raises BusError with the remedy."""
    if address.is_raw:
        check_raw(address)
        return SocketSource(address)
    return PythonCanSource(address, bitrate)


class SocketSource:
    """SocketCAN, where the Linux kernel queues frames and counts dropped ones; or a local bus.

    It is no participant in virtual time: time does not wait for a process that only receives.
    """

    def __init__(self, address: BusAddress) -> None:
        self._address = address
        try:
            self._is_virtual = address.is_local and has_virtual_time(address.channel)
        except OSError as error:
            raise BusError(f"{address}: {one_line(error)}: is hodograph-hub gone?") from error
        self._socket = open_socket(address, timestamps=True)
        self._batch = FrameBatch(address)
        self._dropped = 0

    def take(self) -> Taken:
        """See Source."""
        chunks: list[Frames] = []
        count = BATCH
        try:
            while count == BATCH and sum(chunk.size for chunk in chunks) < MOST_FRAMES:
                count = self._batch.receive(self._socket.fileno())
                if count:
                    chunks.append(self._batch.records(count))
                    self._dropped = self._batch.dropped(count - 1) or self._dropped
                    self._batch.rearm(count)
        except OSError as error:
            raise BusError(
                f"{self._address}: {error.strerror}: did the interface go down?"
            ) from error
        frames = np.concatenate(chunks) if chunks else NO_FRAMES
        return Taken(frames, None if self._is_virtual else _now_us(), self._dropped)

    def close(self) -> None:
        """See Source."""
        self._socket.close()


class PythonCanSource:
    """Any other interface of python-can: a thread receives, the oldest frames are dropped."""

    def __init__(self, address: BusAddress, bitrate: int) -> None:
        self._address = address
        try:
            self._bus = can.Bus(
                channel=address.channel, interface=address.interface, bitrate=bitrate
            )
        except Exception as error:
            raise BusError(f"{address}: cannot be opened: {one_line(error)}") from error
        self._waiting: deque[tuple[int, int, bytes]] = deque(maxlen=MOST_FRAMES)
        self._came = 0
        self._given = 0
        self._lock = threading.Lock()
        self._error: Exception | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="monitor-bus", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not self._ending.is_set():
            try:
                message = self._bus.recv(0.1)
            except (can.CanError, OSError) as error:
                self._error = error
                return
            if message is None or message.is_error_frame or message.is_extended_id:
                continue
            with self._lock:
                self._waiting.append((_now_us(), message.arbitration_id, bytes(message.data)))
                self._came += 1

    def take(self) -> Taken:
        """See Source."""
        if self._error is not None:
            raise BusError(f"{self._address}: {one_line(self._error)}: is the adapter still there?")
        with self._lock:
            waiting = list(self._waiting)
            self._waiting.clear()
            dropped = self._came - self._given - len(waiting)
            self._given += len(waiting)
        frames = np.zeros(len(waiting), dtype=RECORD_DTYPE)
        for row, (time_us, identifier, data) in zip(frames, waiting, strict=True):
            _fill(row, time_us, identifier, data)
        return Taken(frames, _now_us(), dropped)

    def close(self) -> None:
        """See Source."""
        self._ending.set()
        self._thread.join()
        with suppress(can.CanError, OSError):
            self._bus.shutdown()


def _now_us() -> int:
    return time.time_ns() // 1000


def _fill(row: Any, time_us: int, identifier: int, data: bytes) -> None:
    row["time_us"], row["id"], row["length"] = time_us, identifier, len(data)
    row["data"][: len(data)] = np.frombuffer(data, dtype=np.uint8)


def load_recording(file: Path) -> Frames:
    """The frames of a recording. Raises InputError: not readable, or nothing to show in it."""
    frames = read_recording(file)
    if np.count_nonzero(frames["id"] == SYNC_ID) < 2:
        raise InputError(f"{file}: has no SYNCs (0x080): is it a recording of a running machine?")
    return frames


class ReplaySource:
    """A recording by its SYNCs: one each period, `speed` times as fast. Time stamps follow the SYNCs, not the file."""

    def __init__(self, frames: Frames, period_us: int, speed: float) -> None:
        self._frames = frames.copy()
        self._sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
        counters = frames["data"][self._sync_at, 0].astype(np.int64)
        steps = (np.diff(counters, prepend=counters[0]) - 1) % SYNC_OVERFLOW + 1
        steps[0] = 0
        sync_us = np.cumsum(steps) * period_us
        before = np.searchsorted(self._sync_at, np.arange(frames.size), side="right") - 1
        self._frames["time_us"] = sync_us[np.maximum(before, 0)]
        self._time_s = sync_us / (1e6 * speed)
        self._begun_s = time.monotonic()
        self._given = 0

    def take(self) -> Taken:
        """See Source."""
        now_s = time.monotonic() - self._begun_s
        syncs = int(np.searchsorted(self._time_s, now_s, side="right"))
        ended = syncs >= self._sync_at.size
        end = self._frames.size if ended else int(self._sync_at[syncs])
        if end == self._given:
            return Taken(NO_FRAMES, ended=ended)
        frames = self._frames[self._given : end]
        self._given = end
        return Taken(frames, int(frames["time_us"][-1]), ended=ended)

    def close(self) -> None:
        """See Source."""
