# SPDX-License-Identifier: MIT
"""Checks the setpoints of each axis while frames arrive: finds the worst steps from SYNC to SYNC by the rules of
setpoint_check, in windows that overlap. Used by bus/capture/bus_recording, cli/record_command, cli/stream_command and
monitor/pump. No I/O; changes its own object only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .decode import RPDO1, SYNC_ID, TPDO1
from .frames import Frames
from .setpoint_check import Jump, Step, StepLimits, worst_steps

WINDOW = 1000
"""SYNCs that are checked together. The first and the last quarter are context only; the adjacent windows check them."""
_STEP, _EDGE = WINDOW // 2, WINDOW // 4
_MOST_FRAMES = 100_000
"""If no SYNC comes, at most this many frames are kept."""
_NODES = 0x7F
"""Node numbers: 1 to this."""


class SetpointWatch:
    """`nodes` are those of the axes in their order; None: all that get setpoints, by node number."""

    def __init__(self, nodes: Sequence[int] | None) -> None:
        self._nodes = None if nodes is None else tuple(nodes)
        self._kept: list[Frames] = []
        self._frame_count = 0
        self._sync_count = 0
        self._before = 0
        """Number of SYNCs before those that are kept."""
        self._seen: set[int] = set()

    @property
    def seen(self) -> tuple[int, ...]:
        """Nodes that got setpoints."""
        return tuple(sorted(self._seen))

    def feed(self, frames: Frames) -> list[Step]:
        """The worst step by each rule in each complete window; SYNCs count from the first one fed."""
        relevant = frames[_is_relevant(frames)]
        self._kept.append(relevant)
        self._frame_count += relevant.size
        self._sync_count += int(np.count_nonzero(relevant["id"] == SYNC_ID))
        if self._sync_count < WINDOW:
            if self._frame_count > _MOST_FRAMES:
                self._forget()
            return []
        found = []
        kept = np.concatenate(self._kept)
        sync_at = np.flatnonzero(kept["id"] == SYNC_ID)
        while sync_at.size >= WINDOW:
            until = sync_at[WINDOW] if sync_at.size > WINDOW else kept.size
            found += self._check(kept[:until], range(self._first, _EDGE + _STEP))
            kept, sync_at = kept[sync_at[_STEP] :], sync_at[_STEP:] - sync_at[_STEP]
            self._before += _STEP
        self._kept, self._frame_count, self._sync_count = [kept], kept.size, sync_at.size
        return found

    def close(self) -> list[Step]:
        """The worst steps of the remaining frames at the end."""
        if not self._kept:
            return []
        kept = np.concatenate(self._kept)
        return self._check(kept, range(self._first, self._sync_count + 1))

    @property
    def _first(self) -> int:
        return 0 if self._before == 0 else _EDGE

    def _forget(self) -> None:
        self._before += self._sync_count
        self._kept, self._frame_count, self._sync_count = [], 0, 0

    def _check(self, frames: Frames, syncs: range) -> list[Step]:
        found = np.unique(frames["id"][_is_of(frames, RPDO1)] - RPDO1).tolist()
        self._seen |= set(found)
        nodes = found if self._nodes is None else self._nodes
        steps = worst_steps(frames, nodes, syncs)
        return [replace(step, sync=step.sync + self._before) for step in steps]


def jumps(steps: Sequence[Step], limits: StepLimits) -> list[Jump]:
    """Steps that break a limit."""
    return [step.jump(limits) for step in steps if step.needed > limits.of(step.rule, step.group)]


def _is_relevant(frames: Frames) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray(
        (frames["id"] == SYNC_ID) | _is_of(frames, RPDO1) | _is_of(frames, TPDO1), dtype=np.bool_
    )


def _is_of(frames: Frames, base: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray((frames["id"] > base) & (frames["id"] <= base + _NODES), dtype=np.bool_)
