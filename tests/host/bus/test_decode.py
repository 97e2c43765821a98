# SPDX-License-Identifier: MIT
"""From frames to ticks: late answers are found, lost and doubled frames are never accepted. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.bus.capture.decode import Ticks, decode_ticks
from hodograph.bus.capture.recorder import FRAME_DTYPE, Frames
from hodograph.bus.run import first_tick
from hodograph.errors import RunError

NODES = (2, 3)
Frame = tuple[int, bytes]


def recording(
    count: int, late: dict[int, int] | None = None, first_counter: int = 1
) -> list[Frame]:
    """`count` SYNCs with setpoints 10 j + node and answers 1000 j + node; answer j comes `late[j]` SYNCs later."""
    late = late or {}
    due: list[int] = []
    frames: list[Frame] = []
    for j in range(count):
        frames.append((0x80, bytes([(first_counter + j - 1) % 240 + 1])))
        frames += [(0x200 + n, struct.pack("<Hi", 15, 10 * j + n)) for n in NODES]
        due.append(j)
        while due and due[0] + late.get(due[0], 0) <= j:
            k = due.pop(0)
            for n in NODES:
                frames.append((0x180 + n, struct.pack("<Hi", 0x1237, 1000 * k + n)))
                frames.append((0x280 + n, struct.pack("<h", k % 1000 - n)))
        if j % 7 == 0:
            frames.append((0x701, b"\x05"))
    return frames


def packed(frames: list[Frame]) -> Frames:
    array = np.zeros(len(frames), dtype=FRAME_DTYPE)
    for i, (identifier, data) in enumerate(frames):
        array[i]["id"], array[i]["length"] = identifier, len(data)
        array[i]["data"][: len(data)] = list(data)
    return array


def assert_right(ticks: Ticks, first: int = 0) -> None:
    j = np.arange(ticks.count)[:, None] + first
    np.testing.assert_array_equal(ticks.targets, 10 * j + NODES)
    np.testing.assert_array_equal(ticks.actual, 1000 * j + NODES)
    assert ticks.volts_mv is not None
    np.testing.assert_array_equal(ticks.volts_mv, j % 1000 - NODES)
    assert np.all(ticks.statuswords == 0x1237)


def test_plain() -> None:
    ticks = decode_ticks(packed(recording(500, first_counter=200)), NODES)
    assert ticks.count == 500
    assert_right(ticks)


@settings(deadline=None)
@given(st.dictionaries(st.integers(0, 450), st.integers(0, 40), max_size=12))
def test_late_answers(late: dict[int, int]) -> None:
    ticks = decode_ticks(packed(recording(500, late)), NODES)
    assert ticks.count >= 450
    assert_right(ticks)


@settings(deadline=None)
@given(st.integers(0, 60), st.integers(0, 12))
def test_recording_begins_anywhere(cut: int, lateness: int) -> None:
    """Also in the middle of a tick, or where answers to SYNCs before the recording are still to come."""
    frames = recording(400, dict.fromkeys(range(30), lateness))[cut:]
    first = next(i for i, frame in enumerate(frames) if frame[0] == 0x80)
    ticks = decode_ticks(packed(frames), NODES)
    assert_right(ticks, (frames[first][1][0] - 1))


def test_drives_without_volts() -> None:
    frames = [frame for frame in recording(50) if frame[0] not in (0x282, 0x283)]
    assert decode_ticks(packed(frames), NODES).volts_mv is None


@pytest.mark.parametrize("identifier", [0x80, 0x182, 0x183, 0x202, 0x203, 0x282])
@pytest.mark.parametrize("at", [0.3, 0.6, 0.9])
def test_a_lost_frame_is_found(identifier: int, at: float) -> None:
    frames = recording(1000)
    places = [i for i, frame in enumerate(frames) if frame[0] == identifier]
    lost = int(at * len(places))
    del frames[places[lost]]
    if at == 0.9 and identifier != 0x80:  # near the end it may as well be late
        ticks = decode_ticks(packed(frames), NODES)
        assert ticks.count == lost
        assert_right(ticks)
        return
    reported = "SYNC counter jumps" if identifier == 0x80 else f"no frame for SYNC {lost}: "
    with pytest.raises(RunError, match=reported):
        decode_ticks(packed(frames), NODES)


@pytest.mark.parametrize("count", [3, 100, 200])
@pytest.mark.parametrize(("identifier", "what"), [(0x183, "positions"), (0x203, "setpoints")])
def test_a_silent_node_is_found_in_a_short_recording(
    count: int, identifier: int, what: str
) -> None:
    frames = [frame for frame in recording(count) if frame[0] != identifier]
    with pytest.raises(RunError, match=f"{what} of node 3: no frame for SYNC 0: "):
        decode_ticks(packed(frames), NODES)


@pytest.mark.parametrize("identifier", [0x80, 0x182, 0x203, 0x283])
def test_a_doubled_frame_is_found(identifier: int) -> None:
    frames = recording(1000)
    places = [i for i, frame in enumerate(frames) if frame[0] == identifier]
    frames.insert(places[500], frames[places[500]])
    with pytest.raises(RunError):
        decode_ticks(packed(frames), NODES)


def test_nothing_recorded() -> None:
    with pytest.raises(RunError, match="0 SYNCs recorded: is the controller running"):
        decode_ticks(packed([(0x701, b"\x05")]), NODES)


def test_first_tick() -> None:
    """The program's tick 0 rounds to the same counts as the standstill before it."""
    program = np.array([[5, 5], [5, 5], [5, 6], [7, 9]], dtype=np.int32)
    still = np.repeat(program[:1], 20, axis=0)
    bus = np.concatenate((still, program, program[-1:]))
    assert first_tick(bus, program) == 20
    elsewhere = np.repeat(np.array([[4, 5]], dtype=np.int32), 3, axis=0)
    assert first_tick(np.concatenate((elsewhere, program)), program) == 3
    with pytest.raises(RunError, match="never move"):
        first_tick(still, program)
