# SPDX-License-Identifier: MIT
"""Rules for heartbeats of all nodes: in time, in the state that NMT commanded, no boot-up that was not requested. Used
by tools/bus_checker.py. No I/O.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.capture.frames import Frames

START, STOP, PRE_OPERATIONAL, RESET, RESET_COMMUNICATION = 1, 2, 128, 129, 130
_HEARTBEAT = 0x700
_BOOT_UP, _STOPPED, _OPERATIONAL, _PRE = 0, 4, 5, 127
AFTER = {
    START: _OPERATIONAL,
    STOP: _STOPPED,
    PRE_OPERATIONAL: _PRE,
    RESET: _PRE,
    RESET_COMMUNICATION: _PRE,
}
"""NMT commands, and the state that each leads to."""
_LATEST_S = 1.0
"""The shortest heartbeat time of all monitors: the controller's, if 0x1016 has no entry."""


class Beats:
    """The state of the heartbeats of controller and drives."""

    def __init__(self, controller: int, drives: Collection[int]) -> None:
        self._controller, self._drives = controller, tuple(drives)
        self._last_s: dict[int, float] = {}
        self._commanded: dict[int, set[int]] = {}
        self._boots: Counter[int] = Counter()
        self.worst_s = 0.0
        """The longest time between two of a node."""

    def commanded(self, drive: int, command: int) -> None:
        """A heartbeat in transmission may still have the state before."""
        self._commanded.setdefault(drive, {_PRE}).add(AFTER[command])
        if command in (RESET, RESET_COMMUNICATION):
            self._boots[drive] -= 1
            self._last_s.pop(drive, None)

    def take(
        self, frames: Frames, times_s: NDArray[np.float64], operational: Collection[int]
    ) -> Iterator[str]:
        """Findings about the heartbeats in these frames; `operational` are the drives that were started."""
        for node in (self._controller, *self._drives):
            yield from self._heartbeats(node, frames, times_s, operational)
            if times_s.size and node in self._last_s:
                silent_s = float(times_s[-1]) - self._last_s[node]
                if silent_s > _LATEST_S:
                    yield f"no heartbeat of node {node} for {silent_s * 1000:.0f} ms"

    def _heartbeats(
        self,
        node: int,
        frames: Frames,
        times_s: NDArray[np.float64],
        operational: Collection[int],
    ) -> Iterator[str]:
        at = np.flatnonzero(frames["id"] == _HEARTBEAT + node)
        for state, time_s in zip(frames["data"][at, 0].tolist(), times_s[at].tolist(), strict=True):
            if state == _BOOT_UP:
                self._boots[node] += 1
                if self._boots[node] > 1:
                    yield f"node {node} booted without a command"
                self._last_s[node] = time_s
                self._commanded[node] = {_PRE}
                continue
            yield from self._state(node, state, operational)
            gap_s = time_s - self._last_s.get(node, time_s)
            self._last_s[node] = time_s
            self.worst_s = max(self.worst_s, gap_s)
            if gap_s > _LATEST_S:
                yield f"heartbeat of node {node} after {gap_s * 1000:.0f} ms"

    def _state(self, node: int, state: int, operational: Collection[int]) -> Iterator[str]:
        if node == self._controller:
            allowed = {_PRE, _OPERATIONAL}
        else:
            allowed = self._commanded.get(node, {_PRE})
        if state not in allowed:
            yield f"heartbeat of node {node} with state {state}"
        elif state == _OPERATIONAL and node in operational:
            self._commanded[node] = {_OPERATIONAL}
