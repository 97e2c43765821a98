# SPDX-License-Identifier: MIT
"""From recorded frames to ticks: setpoints and answers by SYNC. Also decodes offsets and outputs, and counts unhomed
starts. Used by bus/, faults/case_record, identify/stretches and monitor/. No I/O.

Order on the bus (docs/reference/protocol.md section 2): SYNC j, then the setpoints of tick j. The drives answer SYNC j
with TPDO1 and TPDO2. An answer may come before or after the setpoints of tick j; on a slow host even after SYNC j+1.
The answers of one drive stay in order. So the n-th answer belongs to the n-th SYNC. Where an answer lies between two
SYNCs is used only to detect lost frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...config.outputs import Outputs
from ...errors import RunError
from ...events import ANALOGUES
from .frames import Frames, when

SYNC_ID, RPDO1, RPDO2, TPDO1, TPDO2 = 0x080, 0x200, 0x300, 0x180, 0x280
SDO_REQUEST = 0x600
SYNC_OVERFLOW = 240
_UNHOMED_START = bytes([0x2F, 0x55, 0x20, 0x01, 0x01])
"""Expedited write of 1 to 0x2055 sub 1 (docs/reference/protocol.md section 3.3)."""
_LONGEST_LAG = 250
"""Greatest lateness of an answer in SYNCs: a slow host delays drives, but frames keep their order."""
_LEAD_IN = 200
"""At the start of a recording, the first so many answers show how many of them belong to earlier SYNCs. At its end, the
answers to at most so many SYNCs may be missing. The axes stand still at both ends."""

Int32 = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Ticks:
    """Rows by SYNC, columns by axis: targets sent after SYNC j, answers to SYNC j.

    `volts_mv` is None when the drives send no TPDO2. Only SYNCs with certainly complete answers are included: up to the
    last one that was answered in time, since a lost frame appears as permanent lateness.
    """

    targets: Int32
    actual: Int32
    statuswords: NDArray[np.uint16]
    volts_mv: NDArray[np.int16] | None

    @property
    def count(self) -> int:
        """Number of SYNCs."""
        return int(self.targets.shape[0])


def unhomed_starts(frames: Frames, controller_node: int | None = None) -> int:
    """Number of starts that were allowed with axes not homed, as written to this controller; None: to any."""
    low = SDO_REQUEST if controller_node is None else SDO_REQUEST + controller_node
    high = SDO_REQUEST + 0x7F if controller_node is None else low
    asked = (frames["id"] >= low) & (frames["id"] <= high)
    wanted = np.frombuffer(_UNHOMED_START, dtype=np.uint8)
    return int(np.all(frames["data"][asked][:, : wanted.size] == wanted, axis=1).sum())


def decode_ticks(frames: Frames, nodes: Sequence[int]) -> Ticks:
    """All whole ticks of a recording. Raises RunError: frames missing, doubled or out of order."""
    identifiers = frames["id"]
    sync_at = np.flatnonzero(identifiers == SYNC_ID)
    if sync_at.size < 3:
        raise RunError(f"{sync_at.size} SYNCs recorded: is the controller running?")
    _check_counters(frames, sync_at)
    targets = [_by_sync(frames, sync_at, RPDO1 + n, f"setpoints of node {n}") for n in nodes]
    answers = [_by_sync(frames, sync_at, TPDO1 + n, f"positions of node {n}") for n in nodes]
    streams = targets + answers
    with_volts = all(np.any(identifiers == TPDO2 + n) for n in nodes)
    volts = []
    if with_volts:
        volts = [_by_sync(frames, sync_at, TPDO2 + n, f"volts of node {n}") for n in nodes]
        streams = streams + volts
    count = min(len(stream) for stream in streams)
    return Ticks(
        targets=np.stack([_integers(d[:count], 2, "<i4") for d in targets], axis=1),
        actual=np.stack([_integers(d[:count], 2, "<i4") for d in answers], axis=1),
        statuswords=np.stack([_integers(d[:count], 0, "<u2") for d in answers], axis=1),
        volts_mv=np.stack([_integers(d[:count], 0, "<i2") for d in volts], axis=1)
        if with_volts
        else None,
    )


def decode_offsets(frames: Frames, node: int, count: int) -> tuple[Int32, NDArray[np.int16]]:
    """Velocity offsets (counts/s) and torque offsets (per mille) sent after each of `count` SYNCs; 0: none."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    velocity, torque = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int16)
    with_torque = (frames["id"] == RPDO1 + node) & (frames["length"] == 8)
    if np.any(with_torque):
        data = _by_sync(frames, sync_at, RPDO1 + node, f"setpoints of node {node}")[:count]
        torque[: len(data)] = _integers(data, 6, "<i2")
    if np.any(frames["id"] == RPDO2 + node):
        data = _by_sync(frames, sync_at, RPDO2 + node, f"velocity offsets of node {node}")[:count]
        velocity[: len(data)] = _integers(data, 0, "<i4")
    return velocity, torque


def decode_outputs(frames: Frames, outputs: Outputs) -> NDArray[np.void]:
    """The outputs of the I/O module from each SYNC on, by the last frame before it; records of "digital" and "analogue"
    as in `native.ROW`. All are off before the first frame.
    """
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    found = np.zeros(sync_at.size, dtype=[("digital", "<u2"), ("analogue", "<i2", (ANALOGUES,))])
    at = np.flatnonzero(frames["id"] == RPDO1 + outputs.node)
    at = at[frames["length"][at] >= outputs.frame_bytes]
    if not at.size:
        return found
    data = frames["data"][at]
    last = np.searchsorted(at, sync_at) - 1
    known = last >= 0
    first_analogue = outputs.digital_count // 8
    for byte in range(first_analogue):
        found["digital"][known] |= data[last[known], byte].astype(np.uint16) << (8 * byte)
    for i in range(outputs.analogue_count):
        found["analogue"][known, i] = _integers(data, first_analogue + 2 * i, "<i2")[last[known]]
    return found


def sync_counters(frames: Frames, sync_at: NDArray[np.intp]) -> NDArray[np.int64]:
    """Counters (n,) of the SYNCs at these places of the recording."""
    return np.asarray(frames["data"][sync_at, 0].astype(np.int64))


def missing_syncs(counters: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of SYNCs (n - 1,) that are missing after each but the last, by their counters (n,)."""
    return np.asarray((np.diff(counters) - 1) % SYNC_OVERFLOW)


def _check_counters(frames: Frames, sync_at: NDArray[np.intp]) -> None:
    counters = sync_counters(frames, sync_at)
    bad = np.flatnonzero(missing_syncs(counters))
    if bad.size or counters.min() < 1 or counters.max() > SYNC_OVERFLOW:
        at = int(bad[0]) if bad.size else 0
        raise RunError(
            f"SYNC counter jumps from {counters[at]} to {counters[at + 1]} at SYNC {at}: frames missing"
            f"{when(frames, int(sync_at[at]))}, or a second SYNC producer is on the bus"
        )


def _by_sync(
    frames: Frames, sync_at: NDArray[np.intp], identifier: int, what: str
) -> NDArray[np.uint8]:
    """Data (n, 8) of the frames with this identifier, row j belonging to SYNC j, up to the last certain one."""
    at = np.flatnonzero(frames["id"] == identifier)
    interval = np.searchsorted(sync_at, at) - 1
    at, interval = at[interval >= 0], interval[interval >= 0]
    lag = interval - np.arange(at.size)
    # Late answers to SYNCs before the recording shift all others, which becomes visible when an answer is in time.
    foreign = -int(lag[:_LEAD_IN].min(initial=0))
    at, interval = at[foreign:], interval[foreign:]
    lag = interval - np.arange(at.size)
    early = np.flatnonzero(lag < 0)
    if early.size:
        raise RunError(f"{what}: more than one frame for SYNC {int(interval[early[0]])}")
    late = np.flatnonzero(lag > _LONGEST_LAG)
    if late.size:
        raise _incomplete(frames, sync_at, int(late[0]), what)
    on_time = np.flatnonzero(lag == 0)  # after a lost frame no answer is in time
    sure = int(on_time[-1]) + 1 if on_time.size else 0
    if sure == 0 or sure < sync_at.size - _LEAD_IN:
        raise _incomplete(frames, sync_at, sure, what)
    return np.asarray(frames["data"][at[:sure]])


def _incomplete(frames: Frames, sync_at: NDArray[np.intp], sync: int, what: str) -> RunError:
    place = when(frames, int(sync_at[sync]))
    return RunError(
        f"{what}: no frame for SYNC {sync}: frames missing{place}: the recording is incomplete"
    )


def _integers(data: NDArray[np.uint8], offset: int, kind: str) -> NDArray[np.generic]:
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(data[:, offset : offset + size]).view(kind)[:, 0]
