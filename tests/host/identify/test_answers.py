# SPDX-License-Identifier: MIT
"""Answers that come after the next SYNC, as on a host that other work keeps busy; and answers that are lost. Run by
pytest; starts and writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.errors import RunError
from hodograph.identify import identify_axis, stretches
from hodograph.identify.stretches import LATE_SYNCS, answered

from .recorded import REST, chain_of, drives_of, packed, recording

SYNC, VOLTS = 0x80, 0x282


def flags(counts: list[int]) -> str:
    """Of a recording with so many answers after each SYNC, and one SYNC more."""
    frames = []
    for j, count in enumerate(counts):
        frames += [(SYNC, bytes([j % 240 + 1])), *[(VOLTS, b"\0\0")] * count]
    found = packed([*frames, (SYNC, b"\1")])
    return "".join(str(int(f)) for f in answered(found, np.flatnonzero(found["id"] == SYNC), VOLTS))


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ([1, 1, 1], "111"),
        ([1, 0, 2, 1], "1111"),
        ([0, 0, 3, 0, 1, 2], "111111"),
        ([1, 0, 1, 1, 1], "10111"),  # lost
        ([1, 0, 1, 0, 1, 2], "101111"),  # one lost, one late
        ([1, 1, 2, 1], "0001"),  # those before are answers to SYNCs before
        ([1, 0, 3, 1], "0001"),
        ([1, 0, 1, 2, 2, 1], "000001"),
        ([0, *[1] * LATE_SYNCS, 2, 1], "0" * (LATE_SYNCS + 2) + "1"),
        ([], ""),
    ],
)
def test_what_is_surely_answered(counts: list[int], expected: str) -> None:
    assert flags(counts) == expected


def test_late_volts_give_the_same_plant() -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    frames = recording(pipeline, drives, 1)
    late = frames.copy()
    syncs = np.flatnonzero(late["id"] == SYNC)
    for sync in syncs[
        [40, REST + 100, REST + 101, REST + 500]
    ]:  # it swaps places with the last answer before
        assert late[sync - 1]["id"] == 0x283
        late[[sync - 1, sync]] = late[[sync, sync - 1]]
    plants = [identify_axis(stretches(f, 3), drives[1], 1_000_000, 1000) for f in (frames, late)]
    assert plants[0] == plants[1]
    lost = np.delete(frames, syncs[[REST + 100]] - 1)
    (motion,) = stretches(lost, 3)
    assert len(motion.position_counts) < 100


def test_a_lost_sync_ends_a_motion_and_spoils_no_other() -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    frames = recording(pipeline, drives, 1)
    sync = np.flatnonzero(frames["id"] == SYNC)[REST + 700]
    (motion,) = stretches(np.delete(frames, [sync]), 3)
    assert 690 < len(motion.position_counts) < 701
    whole = identify_axis(stretches(frames, 3), drives[1], 1_000_000, 1000)
    part = identify_axis([motion], drives[1], 1_000_000, 1000)
    assert part.gain_rad_s_v.value == pytest.approx(whole.gain_rad_s_v.value, rel=0.005)
    with pytest.raises(RunError, match="no SYNCs in it"):
        stretches(frames[:0], 3)
