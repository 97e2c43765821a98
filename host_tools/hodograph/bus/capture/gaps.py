# SPDX-License-Identifier: MIT
"""Frames that a recording lacks: SYNCs by their counter, and setpoints after a SYNC between others that have some. A
step of the setpoints beside such a gap says nothing about the motion. Used by setpoint_check. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .decode import RPDO1, SYNC_ID, SYNC_OVERFLOW
from .frames import Frames, when

_DIFFERENCES = 3
"""SYNCs before a step that its check takes into account: it forms differences up to the third."""


def gap_text(frames: Frames, nodes: Sequence[int], sync: int) -> str | None:
    """Which frames are missing beside the step at a SYNC of the recording, and when; None: none."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    first, last = max(0, sync - _DIFFERENCES - 1), min(sync + 1, sync_at.size - 1)
    return _without_syncs(frames, sync_at, range(first, last)) or next(
        filter(None, (_without_setpoint(frames, sync_at, n, first, last) for n in nodes)), None
    )


def _without_syncs(frames: Frames, sync_at: NDArray[np.intp], syncs: range) -> str | None:
    """The first place where the counters of a SYNC among these and of the next one are not consecutive."""
    counters = frames["data"][sync_at, 0].astype(np.int64)
    for k in syncs:
        lost = int(counters[k + 1] - counters[k] - 1) % SYNC_OVERFLOW
        if lost:
            place = (
                f"{when(frames, int(sync_at[k]))}, the next one{when(frames, int(sync_at[k + 1]))}"
            )
            return f"SYNC {k}{place}, and their counters are {counters[k]} and {counters[k + 1]}"
    return None


def _without_setpoint(
    frames: Frames, sync_at: NDArray[np.intp], node: int, first: int, last: int
) -> str | None:
    """The first of these SYNCs after which a node gets no setpoint, although it gets some before and later."""
    at = np.flatnonzero(frames["id"] == RPDO1 + node)
    interval = np.searchsorted(sync_at, at) - 1
    begun = interval[interval >= 0]
    if not begun.size:
        return None
    among = range(max(first, int(begun[0])), min(last + 1, int(begun[-1])))
    missing = sorted(set(among).difference(begun.tolist()))
    if not missing:
        return None
    return f"no setpoint of node {node} after SYNC {missing[0]}{when(frames, int(sync_at[missing[0]]))}"
