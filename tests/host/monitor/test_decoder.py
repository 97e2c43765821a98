# SPDX-License-Identifier: MIT
"""The decoder: the samples do not depend on the parts of the stream, and missing frames do not stop it. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.bus.capture.frames import Frames
from hodograph.monitor.decoder import HELD_BACK, Decoder, Samples, nodes_in
from traffic import machine_frames

COUNT = 60


def positions(count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    targets = np.stack([np.arange(count) * 1000, -np.arange(count) * 500], axis=1)
    return targets, targets + 7


def decoded(frames: Frames, cuts: list[int] | None = None) -> Samples:
    decoder = Decoder((2, 3))
    parts = [decoder.feed(part) for part in np.split(frames, cuts or [])]
    return Samples(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("sync", "targets", "actual", "statuswords")
        )
    )


def at(frames: Frames, identifier: int, which: int) -> int:
    return int(np.flatnonzero(frames["id"] == identifier)[which])


def test_every_sync_gets_what_was_set_and_answered() -> None:
    targets, actual = positions()
    samples = decoded(machine_frames(targets, actual))
    assert samples.sync.tolist() == list(range(COUNT - HELD_BACK))
    assert np.array_equal(samples.targets, targets[:-HELD_BACK])
    assert np.array_equal(samples.actual, actual[:-HELD_BACK])
    assert set(samples.statuswords.ravel().tolist()) == {0x1237}


@settings(max_examples=60)
@given(st.lists(st.integers(0, 5 * COUNT), max_size=12))
def test_the_cuts_of_the_stream_change_nothing(cuts: list[int]) -> None:
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    samples = decoded(frames, sorted(cuts))
    assert np.array_equal(samples.targets, targets[:-HELD_BACK])
    assert np.array_equal(samples.actual, actual[:-HELD_BACK])


@pytest.mark.parametrize("cut", [0, 100, 101, 103, 104, 105, 106, 110])
def test_an_answer_after_the_next_sync_belongs_to_the_one_before(cut: int) -> None:
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    late = at(frames, 0x183, 20)  # frame 104; SYNC 21 is frame 105
    frames[[late, late + 1]] = frames[[late + 1, late]]
    samples = decoded(frames, [cut])
    assert np.array_equal(samples.actual, actual[:-HELD_BACK])


@pytest.mark.parametrize("identifier", [0x182, 0x183, 0x202, 0x203])
def test_a_lost_frame_is_one_missing_value(identifier: int) -> None:
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    samples = decoded(np.delete(frames, at(frames, identifier, 20)), [90, 101, 110])
    values, whole = (samples.targets, targets) if identifier > 0x200 else (samples.actual, actual)
    axis = identifier % 2
    assert np.flatnonzero(np.isnan(values[:, axis])).tolist() == [20]
    there = np.arange(len(values)) != 20
    assert np.array_equal(values[there, axis], whole[:-HELD_BACK][there, axis])


def test_a_doubled_frame_changes_nothing() -> None:
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    twice = at(frames, 0x182, 20)
    samples = decoded(np.insert(frames, twice, frames[twice]))
    assert np.array_equal(samples.actual, actual[:-HELD_BACK])


def test_lost_syncs_are_counted() -> None:
    targets, actual = positions()
    frames = np.delete(machine_frames(targets, actual), slice(100, 125))  # SYNCs 20 to 24
    samples = decoded(frames)
    assert samples.sync.tolist() == [i for i in range(COUNT - HELD_BACK) if not 20 <= i < 25]


def test_other_and_short_frames_are_let_pass() -> None:
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    frames["length"][at(frames, 0x182, 20)] = 3
    others = frames[:50].copy()
    others["id"] = 0x701
    samples = decoded(np.concatenate([others, frames]))
    assert np.isnan(samples.actual[20, 0])
    assert np.count_nonzero(np.isnan(samples.actual)) == 1


def test_without_syncs_memory_stays_bounded() -> None:
    decoder = Decoder((2, 3))
    frames = machine_frames(*positions(5000))
    frames["id"] = 0x701
    for _ in range(10):
        assert decoder.feed(frames).count == 0
    assert decoder._tail.size < 5000


def test_nodes_are_found() -> None:
    assert nodes_in(machine_frames(*positions())) == (2, 3)


def test_what_waits_for_a_sync_is_bounded() -> None:
    """The controller has gone: heartbeats, SDO and even answers go on, for days."""
    targets, actual = positions()
    frames = machine_frames(targets, actual)
    decoder = Decoder((2, 3))
    decoder.feed(frames)
    for identifier in (0x581, 0x702, 0x182):
        others = np.zeros(1000, dtype=frames.dtype)
        others["id"], others["length"] = identifier, 8
        for _ in range(10):
            assert decoder.feed(others).count == 0
        assert decoder._tail.size <= 4096, hex(identifier)
    again = decoder.feed(frames)  # and it goes on when there is one again
    assert np.array_equal(again.targets, targets[:-HELD_BACK])
    assert np.array_equal(again.actual, actual[:-HELD_BACK])
