# SPDX-License-Identifier: MIT
"""Frames of a recording, at the pace of the machine or a multiple of it."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from ..bus.capture.decode import SYNC_ID, SYNC_OVERFLOW
from ..bus.capture.frames import Frames
from ..bus.capture.recordings import read_recording
from ..errors import InputError
from .source import NO_FRAMES, Taken


def load_recording(file: Path) -> Frames:
    """The frames of a recording. Raises InputError: not readable, or nothing to show in it."""
    frames = read_recording(file)
    if np.count_nonzero(frames["id"] == SYNC_ID) < 2:
        raise InputError(f"{file}: has no SYNCs (0x080): is it a recording of a running machine?")
    return frames


class ReplaySource:
    """A recording by its SYNCs: one a period, `speed` times as fast; frames are stamped so, too, not as in the file."""

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
