# SPDX-License-Identifier: MIT
"""Jumps are found in a stream that comes in pieces, wherever the pieces are cut. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

import struct

import numpy as np
import pytest

from hodograph.bus.capture.frames import FRAME_DTYPE, Frames
from hodograph.bus.capture.setpoint_check import StepLimits, find_jumps
from hodograph.bus.capture.setpoint_watch import WINDOW, SetpointWatch, jumps

LIMITS = StepLimits(speed=1000.0, acceleration=100.0)
NODES = (2, 3)


def stream(syncs: int, *steps: tuple[int, int]) -> Frames:
    """Standing axes; at SYNC k the first one is set off by so many counts, for good."""
    rows: list[tuple[int, bytes]] = []
    x = 0
    for k in range(syncs):
        x += sum(counts for at, counts in steps if at == k)
        rows.append((0x80, bytes([k % 240 + 1])))
        for node, target in ((2, x), (3, 0)):
            rows.append((0x180 + node, struct.pack("<Hi", 0x1237, target)))
            rows.append((0x200 + node, struct.pack("<Hi", 0x0F, target)))
        rows.append((0x582, bytes(8)))
    frames = np.zeros(len(rows), dtype=FRAME_DTYPE)
    for row, (identifier, data) in zip(frames, rows, strict=True):
        row["id"], row["length"] = identifier, len(data)
        row["data"][: len(data)] = list(data)
    return frames


def watched(frames: Frames, piece: int, nodes: tuple[int, ...] | None = NODES) -> list[str]:
    watch = SetpointWatch(nodes)
    found = []
    for start in range(0, frames.size, piece):
        found += jumps(watch.feed(frames[start : start + piece]), LIMITS)
    found += jumps(watch.close(), LIMITS)
    assert watch.seen == NODES
    return [f"{jump.rule}@{jump.sync}" for jump in found]


@pytest.mark.parametrize("piece", [7, 240, 5999, 10**6])
@pytest.mark.parametrize("nodes", [NODES, None])
def test_each_jump_is_found_at_its_place(piece: int, nodes: tuple[int, ...] | None) -> None:
    places = (1, 249, 250, 749, 750, 751, WINDOW, 1600, 2999)
    for place in places:
        found = watched(stream(3000, (place, 5000)), piece, nodes)
        assert found.count(f"speed@{place}") == 1, (place, found)
    assert watched(stream(3000), piece, nodes) == []


def test_the_worst_step_of_a_window_is_one_of_those_in_the_whole_recording() -> None:
    frames = stream(600, (100, 90), (300, 110), (301, 250))
    whole = {f"{jump.rule}@{jump.sync}" for jump in find_jumps(frames, NODES, LIMITS)}
    assert whole == {"acceleration@300", "acceleration@301", "acceleration@302"}
    assert watched(frames, 50) == ["acceleration@302"]
    assert watched(stream(600, (100, 90), (300, 110)), 50) == ["acceleration@300"]
    assert watched(stream(600, (100, 90)), 50) == []


def test_homing_that_begins_in_one_piece_and_shows_in_the_next() -> None:
    frames = stream(900, (448, 5000), (455, 5000))
    homing = np.flatnonzero(frames["id"] == 0x202)[460:]
    frames["data"][homing, 0] = 0x1F
    assert watched(frames, 6 * 450) == []


def test_traffic_without_a_machine_is_not_kept() -> None:
    watch = SetpointWatch(None)
    noise = np.zeros(60_000, dtype=FRAME_DTYPE)
    noise["id"], noise["length"] = 0x202, 6
    for _ in range(10):
        assert watch.feed(noise) == []
    assert watch._frame_count <= 100_000
    assert watch.close() == []
    assert SetpointWatch(None).close() == []
