# SPDX-License-Identifier: MIT
"""Decodes a stream of frames to samples, one for each SYNC: setpoints and answers.

`bus.capture.decode` requires a complete recording. This decoder continues if frames are missing: the value is NaN then.
An answer may come after the next SYNC (docs/reference/protocol.md section 2), so the decoder waits HELD_BACK SYNCs
before it gives samples. If a drive has two answers between two SYNCs, the first belongs to the SYNC before.

Used by monitor/ and cli/monitor_command. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bus.capture.decode import RPDO1, SYNC_ID, SYNC_OVERFLOW, TPDO1
from ..bus.capture.frames import Frames

HELD_BACK = 3
"""SYNCs for which samples are not given yet, since answers may come."""
_MOST_TAIL = 4096
"""Most setpoints and answers kept without a SYNC; if there are more, they are dropped."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Samples:
    """Rows by SYNC, columns by axis: targets sent after it and positions answered to it, in counts.

    `sync` counts SYNCs from the first one received, including lost ones; the first has the decoder's `first_sync`. NaN
    in targets and actual, -1 in statuswords: no frame came.
    """

    sync: NDArray[np.int64]
    targets: Floats
    actual: Floats
    statuswords: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of SYNCs."""
        return int(self.sync.size)


def nodes_in(frames: Frames) -> tuple[int, ...]:
    """The drives that send positions, by node number."""
    identifiers = np.unique(frames["id"])
    return tuple(int(i) - TPDO1 for i in identifiers if TPDO1 < i < TPDO1 + 0x80)


class Decoder:
    """Decodes frames; keeps incomplete ticks between two calls of `feed`."""

    def __init__(self, nodes: Sequence[int], first_sync: int = 0) -> None:
        self._nodes = tuple(nodes)
        self._tail: Frames | None = None
        self._wanted = np.array([SYNC_ID, *self._identifiers()])
        self._used = dict.fromkeys(
            self._identifiers(), 0
        )  # frames of the tail that are samples already
        self._sync = first_sync
        self._counter: int | None = None

    def _identifiers(self) -> list[int]:
        return [base + n for base in (RPDO1, TPDO1) for n in self._nodes]

    def feed(self, frames: Frames) -> Samples:
        """The samples that are complete with these frames."""
        frames = frames[np.isin(frames["id"], self._wanted)]
        if self._tail is not None:
            frames = np.concatenate([self._tail, frames])
        sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
        done = max(0, sync_at.size - HELD_BACK)
        if done == 0:
            self._keep(frames)
            return self._samples(np.empty(0, dtype=np.int64), frames, sync_at, 0)
        samples = self._samples(self._count(frames, sync_at[:done]), frames, sync_at, done)
        self._tail = frames[sync_at[done] :].copy()
        return samples

    def _keep(self, frames: Frames) -> None:
        """The frames to keep until more SYNCs come, bounded since they may never come."""
        if frames.size > _MOST_TAIL:
            frames = frames[:0]
            self._used = dict.fromkeys(self._used, 0)
        self._tail = frames

    def _count(self, frames: Frames, sync_at: NDArray[np.intp]) -> NDArray[np.int64]:
        """Running numbers of these SYNCs; their counter reveals lost ones."""
        counters = frames["data"][sync_at, 0].astype(np.int64)
        before = counters[0] - 1 if self._counter is None else self._counter
        steps = (np.diff(counters, prepend=before) - 1) % SYNC_OVERFLOW + 1
        without_counter = frames["length"][sync_at] == 0
        steps[without_counter] = 1
        numbers = self._sync + np.cumsum(steps)
        self._counter, self._sync = int(counters[-1]), int(numbers[-1])
        return np.asarray(numbers - 1, dtype=np.int64)

    def _samples(
        self, sync: NDArray[np.int64], frames: Frames, sync_at: NDArray[np.intp], done: int
    ) -> Samples:
        targets = np.full((done, len(self._nodes)), np.nan)
        actual = np.full((done, len(self._nodes)), np.nan)
        statuswords = np.full((done, len(self._nodes)), -1, dtype=np.int64)
        if done:
            for axis, node in enumerate(self._nodes):
                rows, data = self._stream(frames, sync_at, done, RPDO1 + node)
                targets[rows, axis] = _integers(data, 2, "<i4")
                rows, data = self._stream(frames, sync_at, done, TPDO1 + node)
                actual[rows, axis] = _integers(data, 2, "<i4")
                statuswords[rows, axis] = _integers(data, 0, "<u2")
        return Samples(sync, targets, actual, statuswords)

    def _stream(
        self, frames: Frames, sync_at: NDArray[np.intp], done: int, identifier: int
    ) -> tuple[NDArray[np.intp], NDArray[np.uint8]]:
        """Row and data of the frames with this identifier, for complete SYNCs."""
        at = np.flatnonzero((frames["id"] == identifier) & (frames["length"] >= 6))
        interval = np.searchsorted(sync_at, at) - 1
        data = frames["data"][at]
        again = (np.diff(interval, prepend=-2) == 0) & np.all(
            np.diff(data.astype(np.int16), axis=0, prepend=-1) == 0, axis=1
        )
        used = self._used[identifier]
        keep = (interval >= 0) & ~again
        keep[:used] = False
        interval, data = interval[keep], data[keep]
        order = np.arange(interval.size)
        # The last of several in one interval belongs there, those before it to the intervals before.
        row = np.minimum.accumulate((interval - order)[::-1])[::-1] + order
        inside = (row >= 0) & (row < done)
        early = at[keep][inside & (interval >= done)]
        self._used[identifier] = int(
            np.count_nonzero((at <= early[-1]) & (at >= sync_at[done])) if early.size else 0
        )
        return row[inside], data[inside]


def _integers(data: NDArray[np.uint8], offset: int, kind: str) -> NDArray[np.generic]:
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(data[:, offset : offset + size]).view(kind)[:, 0]
