# SPDX-License-Identifier: MIT
"""The case record: evidence about one fault case from the recordings of the two buses. Used by faults/case_run,
faults/case_runner and faults/judge. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bus.capture.decode import RPDO1, SYNC_ID, TPDO1
from ..bus.capture.frames import Frames

_ENABLED = 0x0F
_EMCY = 0x080
_GAP_US = 150_000
"""More than answer_wait_ms, for which lock step waits for a lost answer."""
_LAST_LOOK_US = 50_000
"""Time at the end of a recording from which `still_moving` judges."""


@dataclass(frozen=True)
class Emergency:
    """An EMCY frame with a code: of which node, when."""

    node: int
    code: int
    time_us: int


class CaseRecord:
    """A recording of the controller's bus and one of the drives' bus, over the same time."""

    def __init__(self, control: Frames, drives: Frames, nodes: Sequence[int]) -> None:
        self.control, self.drives, self.nodes = control, drives, tuple(nodes)
        self._sync_at = np.flatnonzero(control["id"] == SYNC_ID)
        self._sync_us = control["time_us"][self._sync_at]
        self._first = self._first_sync()

    def _first_sync(self) -> int | None:
        """The SYNC that is tick 0 (docs/reference/protocol.md section 4)."""
        begins = []
        for node in self.nodes:
            at, control, target = _setpoints(self.control, node)
            enabled = (control & _ENABLED) == _ENABLED
            moved = np.flatnonzero(enabled[1:] & enabled[:-1] & (np.diff(target) != 0))
            if moved.size:
                begins.append(int(at[moved[0] + 1]))
        if not begins:
            return None
        return int(np.searchsorted(self._sync_at, min(begins)))

    @property
    def moved(self) -> bool:
        """Whether there was a motion at all."""
        return self._first is not None

    def tick_at(self, time_us: float) -> int:
        """The tick of an instant: that of the last SYNC before it."""
        return int(np.searchsorted(self._sync_us, time_us, side="right")) - 1 - (self._first or 0)

    def emergencies(self, frames: Frames, nodes: Sequence[int]) -> list[Emergency]:
        """EMCY frames of these nodes, without those that report the end of an error."""
        found = []
        for node in nodes:
            for at in np.flatnonzero((frames["id"] == _EMCY + node) & (frames["length"] >= 2)):
                code = int(frames["data"][at, 0]) | int(frames["data"][at, 1]) << 8
                if code:
                    found.append(Emergency(node, code, int(frames["time_us"][at])))
        return sorted(found, key=lambda emergency: emergency.time_us)

    def last_motions_us(self, tolerance_counts: int) -> dict[int, int | None]:
        """By node: the last time at which the drive reported a position away from its last one; 0: never.

        None: not known, since the drive sent nothing at all, nothing for a while after that time, or nothing at the
        end.
        """
        return {node: self._last_motion_us(node, tolerance_counts) for node in self.nodes}

    def _last_motion_us(self, node: int, tolerance_counts: int) -> int | None:
        at = np.flatnonzero((self.drives["id"] == TPDO1 + node) & (self.drives["length"] >= 6))
        if not at.size:
            return None
        place, time_us = _integers(self.drives["data"][at]), self.drives["time_us"][at]
        if int(self.drives["time_us"][-1]) - int(time_us[-1]) > _GAP_US:
            return None
        away = np.flatnonzero(np.abs(place - place[-1]) > tolerance_counts)
        if not away.size:
            return 0
        if time_us[away[-1] + 1] - time_us[away[-1]] > _GAP_US:
            return None
        return int(time_us[away[-1]])

    def still_moving(self, tolerance_counts: int) -> tuple[int, ...]:
        """Nodes that moved until the end of the recording, by their own reports. Nodes that sent nothing are not
        included.
        """
        if not self.drives.size:
            return ()
        begin_us = int(self.drives["time_us"][-1]) - _LAST_LOOK_US
        last = self.drives[self.drives["time_us"] >= begin_us]
        found = []
        for node in self.nodes:
            data = last["data"][(last["id"] == TPDO1 + node) & (last["length"] >= 6)]
            if data.size and np.ptp(_integers(data)) > tolerance_counts:
                found.append(node)
        return tuple(found)

    def setpoints(self) -> list[tuple[NDArray[np.int64], NDArray[np.bool_]]]:
        """By axis: the targets by SYNC from tick 0 on, and whether the drive was commanded to follow each."""
        count = max(0, self._sync_at.size - (self._first or 0))
        rows = []
        for node in self.nodes:
            at, control, target = _setpoints(self.control, node)
            tick = np.searchsorted(self._sync_at, at) - 1 - (self._first or 0)
            there = (tick >= 0) & (tick < count)
            targets = np.zeros(count, dtype=np.int64)
            sent = np.zeros(count, dtype=np.bool_)
            targets[tick[there]] = target[there]
            sent[tick[there]] = (control[there] & _ENABLED) == _ENABLED
            rows.append((targets, sent))
        return rows


def _setpoints(
    frames: Frames, node: int
) -> tuple[NDArray[np.intp], NDArray[np.uint16], NDArray[np.int64]]:
    at = np.flatnonzero((frames["id"] == RPDO1 + node) & (frames["length"] >= 6))
    data = frames["data"][at]
    control = np.ascontiguousarray(data[:, 0:2]).view("<u2")[:, 0]
    return at, control, _integers(data)


def _integers(data: NDArray[np.uint8]) -> NDArray[np.int64]:
    return np.ascontiguousarray(data[:, 2:6]).view("<i4")[:, 0].astype(np.int64)
