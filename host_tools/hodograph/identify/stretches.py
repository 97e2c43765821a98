# SPDX-License-Identifier: MIT
"""The motions in a recording: setpoints and reported positions of an axis, from standstill to standstill or to the
first missing frame. Used by cli/identify_command and identify/plant_fit. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bus.analysis import REACHED_AFTER, complete_ticks, runs_of
from ..bus.capture.decode import (
    RPDO1,
    SYNC_ID,
    SYNC_OVERFLOW,
    TPDO1,
    TPDO2,
    Ticks,
    decode_offsets,
    decode_ticks,
)
from ..bus.capture.frames import Frames
from ..errors import RunError
from ..native import AxisInputs

LATE_SYNCS = 100
"""SYNCs within which late answers have to arrive; otherwise a frame was lost."""

Flags = NDArray[np.bool_]


def without_gaps(frames: Frames) -> list[Frames]:
    """The recording in parts of which no SYNC is missing, each but the first from a SYNC on; empty without SYNCs."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    counters = frames["data"][sync_at, 0].astype(np.int64)
    breaks = np.flatnonzero((np.diff(counters) - 1) % SYNC_OVERFLOW) + 1
    return list(np.split(frames, sync_at[breaks])) if sync_at.size else []


def answered(frames: Frames, sync_at: NDArray[np.intp], identifier: int) -> Flags:
    """For each SYNC but the last: whether one frame with this identifier belongs to it.

    Frames keep their order, so a later interval with two frames compensates for an interval without one. If two come
    and none is due, frames since the last loss belong to earlier SYNCs and are not used.
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


PARK_PERIODS = 250
"""Periods with one target after which a simulated drive is in standstill lock (docs/reference/protocol.md section
3).
"""

_FOLLOWS = 0x1027
"""A statusword of a following drive, masked: Operation enabled, and bit 12, drive follows the command value."""
_FOLLOWS_MASK = 0x106F
"""Bits of the state, and bit 12; CiA 402."""
_STILL = 3
"""Least SYNCs with one target before a motion that begins at rest; a run's recording begins a few before its start."""
_REST = PARK_PERIODS + REACHED_AFTER
"""Ticks of constant setpoints after which an axis counts as parked."""

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stretch:
    """One motion, from rest to its last setpoint: inputs; position and volts as reported at the end of each period."""

    inputs: AxisInputs
    position_counts: NDArray[np.int32]
    volts_mv: NDArray[np.int16]


def stretches(frames: Frames, node: int) -> list[Stretch]:
    """All motions of a drive in cyclic synchronous position mode, in order.

    Raises RunError: the drive does not report volts, or never moves.
    """
    parts = without_gaps(frames)
    if not parts:
        raise RunError("no SYNCs in it: record while the controller runs")
    if not np.any(frames["id"] == TPDO2 + node):
        raise RunError(
            f"node {node} sends no volts (TPDO2): only simulated drives do, and where the controller has set them up"
        )
    found = [motion for part in parts for motion in _in_part(part, node)]
    if not found:
        raise RunError(
            f"node {node} follows no motion in it that begins at rest: record a run from before its start"
        )
    return found


def _in_part(frames: Frames, node: int) -> list[Stretch]:
    """The motions of a part without a missing SYNC."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    whole = complete_ticks(frames, sync_at, RPDO1 + node)
    for function in (TPDO1, TPDO2):
        whole &= answered(frames, sync_at, function + node)
    found = []
    for begin, end in runs_of(whole):
        if end - begin > _REST:
            part = frames[sync_at[begin] : sync_at[end]]
            ticks = decode_ticks(part, (node,))
            found += _motions(ticks, *decode_offsets(part, node, ticks.count))
    return found


def _motions(ticks: Ticks, speeds: NDArray[np.int32], torques: NDArray[np.int16]) -> list[Stretch]:
    """The motion of one change of targets. Period i, from SYNC i+1 to SYNC i+2, leads to the target sent after SYNC
    i.
    """
    assert ticks.volts_mv is not None
    follows = (ticks.statuswords[:, 0] & _FOLLOWS_MASK) == _FOLLOWS
    targets = ticks.targets[:, 0]
    found = []
    for first, last in runs_of(follows[1:-1] & follows[2:]):
        changes = first + 1 + np.flatnonzero(np.diff(targets[first:last]))
        for begin, end in _groups(changes):
            if begin - first < _STILL:
                continue
            stop = min(end + 1, last)
            span, reached = slice(begin - 1, stop), slice(begin + 1, stop + REACHED_AFTER)
            inputs = AxisInputs(int(targets[begin - 1]), targets[span], speeds[span], torques[span])
            found.append(Stretch(inputs, ticks.actual[reached, 0], ticks.volts_mv[reached, 0]))
    return found


def _groups(changes: NDArray[np.intp]) -> list[tuple[int, int]]:
    """Groups of target changes without a rest between them: first and last of each group."""
    if not changes.size:
        return []
    cuts = np.flatnonzero(np.diff(changes) > _REST)
    firsts = np.concatenate([[0], cuts + 1])
    lasts = np.concatenate([cuts, [changes.size - 1]])
    return [(int(changes[a]), int(changes[b])) for a, b in zip(firsts, lasts, strict=True)]
