# SPDX-License-Identifier: MIT
"""Rules for the frames of one drive: statuswords and transitions of CiA 402, setpoints within the feed limit. Used by
tools/bus_checker.py. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.capture.frames import Frames
from pdo_sequence_check import Stream

_TPDO1, _RPDO1 = 0x180, 0x200
_FOLLOWING_ERROR, _WARNING = 0x2000, 0x0080
_NAMES = {
    0x40: "switch on disabled",
    0x21: "ready to switch on",
    0x23: "switched on",
    0x27: "operation enabled",
    0x07: "quick stop active",
}
"""Statusword bits 0 to 3, 5 and 6 of the states without a fault."""
_FROM_TO = {
    (0x40, 0x21),
    (0x21, 0x40),
    (0x21, 0x23),
    (0x23, 0x21),
    (0x23, 0x40),
    (0x23, 0x27),
    (0x27, 0x23),
    (0x27, 0x21),
    (0x27, 0x40),
}


@dataclass
class Drive:
    """The state of one drive."""

    node: int
    streams: dict[int, Stream]
    operational: bool = False
    statusword: int | None = None
    target: int | None = None

    def statuswords(self, frames: Frames) -> Iterator[str]:
        """Findings about its statuswords in these frames."""
        words = field_of(frames, _TPDO1 + self.node, 0, "<u2").astype(np.int64)
        if not words.size:
            return
        states = words & 0x6F
        states[words & 0x4F == 0x40] = 0x40
        for state in np.unique(states):
            if int(state) not in _NAMES:
                yield f"node {self.node}: statusword 0x{int(words[states == state][0]):04X}"
        flagged = np.flatnonzero(words & (_FOLLOWING_ERROR | _WARNING))
        if flagged.size:
            word = int(words[flagged[0]])
            yield f"node {self.node}: statusword 0x{word:04X}: warning or error"
        before = states if self.statusword is None else np.concatenate([[self.statusword], states])
        for i in np.flatnonzero(np.diff(before)):
            if (int(before[i]), int(before[i + 1])) not in _FROM_TO:
                names = [_NAMES.get(int(state), hex(int(state))) for state in before[i : i + 2]]
                yield f"node {self.node}: from {names[0]} to {names[1]}"
        self.statusword = int(states[-1])

    def setpoints(self, frames: Frames, most_counts: int) -> Iterator[str]:
        """Findings about its targets; `most_counts`: greatest step."""
        targets = field_of(frames, _RPDO1 + self.node, 2, "<i4").astype(np.int64)
        if not targets.size:
            return
        if self.target is not None:
            targets = np.concatenate([[self.target], targets])
        self.target = int(targets[-1])
        steps = np.abs(np.diff(targets))
        if steps.size and steps.max() > most_counts:
            yield f"node {self.node}: the setpoint jumps by {int(steps.max())} counts"


def field_of(frames: Frames, identifier: int, offset: int, kind: str) -> NDArray[np.generic]:
    """A number at one place in all frames of an identifier."""
    data = frames["data"][frames["id"] == identifier]
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(data[:, offset : offset + size]).view(kind)[:, 0]
