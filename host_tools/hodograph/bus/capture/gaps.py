# SPDX-License-Identifier: MIT
"""Frames that a recording lacks: SYNCs by their counter, and setpoints after a SYNC between others that have some. A
step of the setpoints beside such a gap says nothing about the motion. Used by setpoint_check. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .decode import RPDO1, SYNC_ID, missing_syncs, sync_counters
from .frames import Frames, when

_DIFFERENCES = 3
"""SYNCs before a step that its check takes into account: it forms differences up to the third."""


class Gaps:
    """The gaps of a recording, with the setpoints of these nodes."""

    def __init__(self, frames: Frames, nodes: Sequence[int]) -> None:
        self._frames = frames
        self._sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
        self._counters = sync_counters(frames, self._sync_at)
        self._missing = missing_syncs(self._counters)
        self._lacking = [(node, self._without_setpoint(node)) for node in nodes]

    def text(self, sync: int) -> str | None:
        """Which frames are missing beside the step at this SYNC, and when; None: none."""
        first, last = max(0, sync - _DIFFERENCES - 1), min(sync + 1, self._sync_at.size - 1)
        jumping = np.flatnonzero(self._missing[first:last])
        if jumping.size:
            k = first + int(jumping[0])
            next_one = f"the next one{self._when(k + 1)}"
            counters = f"{self._counters[k]} and {self._counters[k + 1]}"
            return f"SYNC {k}{self._when(k)}, {next_one}, and their counters are {counters}"
        for node, lacking in self._lacking:
            without = np.flatnonzero(lacking[first : last + 1])
            if without.size:
                k = first + int(without[0])
                return f"no setpoint of node {node} after SYNC {k}{self._when(k)}"
        return None

    def _when(self, sync: int) -> str:
        return when(self._frames, int(self._sync_at[sync]))

    def _without_setpoint(self, node: int) -> NDArray[np.bool_]:
        """SYNCs (n,) after which a node gets no setpoint, although it gets some before and later."""
        at = np.flatnonzero(self._frames["id"] == RPDO1 + node)
        interval = np.searchsorted(self._sync_at, at) - 1
        begun = interval[interval >= 0]
        lacking = np.zeros(self._sync_at.size, dtype=np.bool_)
        if begun.size:
            lacking[begun[0] : begun[-1]] = True
            lacking[begun] = False
        return lacking
