# SPDX-License-Identifier: MIT
"""Checks that each PDO comes once for each SYNC. Used by tools/bus_checker.py and tools/bus_drives.py. No I/O."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_LONGEST_LAG = 250
"""SYNCs by which a frame may be late on a slow host; frames keep their order."""

Intervals = NDArray[np.int64]


@dataclass
class Stream:
    """One identifier. `late` counts frames that came after the next SYNC had been sent already."""

    name: str
    due: int | None = None
    late: int = 0
    frames: int = 0

    def restart(self) -> None:
        """The next frame, whenever it comes, is the first of a new count."""
        self.due = None

    def take(self, intervals: Intervals) -> Iterator[str]:
        """Takes the next frames: for each the number of the SYNC before it. Yields findings."""
        self.frames += intervals.size
        if not intervals.size:
            return
        if self.due is None:
            self.due = int(intervals[0])
        lag = intervals - (self.due + np.arange(intervals.size))
        self.due += intervals.size
        early, late = np.flatnonzero(lag < 0), np.flatnonzero(lag > _LONGEST_LAG)
        if early.size:
            yield f"{self.name}: more than one frame for SYNC {int(intervals[early[0]])}"
        elif late.size or (intervals.size > 2 * _LONGEST_LAG and lag[_LONGEST_LAG:].min() > 0):
            missing = int(lag[-1])
            yield f"{self.name}: {missing} frames missing at SYNC {int(intervals[-1])}"
        else:
            self.late += int(np.count_nonzero(lag))
            return
        self.restart()
