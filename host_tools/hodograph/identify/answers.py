# SPDX-License-Identifier: MIT
"""Which SYNCs of a recording a drive surely answered: answers may be late, on a slow host, and frames may be lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..bus.capture.decode import SYNC_ID, SYNC_OVERFLOW
from ..bus.capture.frames import Frames

LATE_SYNCS = 100
"""Answers that are late are made up for within so many SYNCs; else a frame was lost."""

Flags = NDArray[np.bool_]


def unbroken(frames: Frames) -> list[Frames]:
    """The recording in parts of which no SYNC is missing, each but the first from a SYNC on; empty without SYNCs."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    counters = frames["data"][sync_at, 0].astype(np.int64)
    breaks = np.flatnonzero((np.diff(counters) - 1) % SYNC_OVERFLOW) + 1
    return list(np.split(frames, sync_at[breaks])) if sync_at.size else []


def answered(frames: Frames, sync_at: NDArray[np.intp], identifier: int) -> Flags:
    """For each SYNC but the last: whether one frame with this identifier belongs to it.

    Frames keep their order, so an interval without one is made up for by a later one with two. Where two come and none
    is due, what came since the last loss belongs to SYNCs before, and is not taken.
    """
    at = np.flatnonzero(frames["id"] == identifier)
    interval = np.searchsorted(sync_at, at) - 1
    counts = np.bincount(interval[interval >= 0], minlength=sync_at.size)
    due = 1 - counts[: max(0, sync_at.size - 1)]
    flags: Flags = due == 0
    begin = 0
    for odd in np.flatnonzero(due).tolist():
        if flags[odd]:
            continue
        still_due = np.cumsum(due[odd : odd + LATE_SYNCS])
        closed = np.flatnonzero(still_due <= 0)
        if not closed.size:
            begin = odd + 1
        elif still_due[closed[0]] == 0:
            flags[odd : odd + closed[0] + 1] = True
        else:
            end = odd + int(closed[0]) + 1
            flags[begin:end], begin = False, end
    return flags
