# SPDX-License-Identifier: MIT
"""The measured load of a bus: bits over time, sorted by COB-ID. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.bus.capture.load import LONGEST_S, LoadCapture, bus_load
from hodograph.bustime.frame_bits import EXTENDED, exact_bits


def frames_of(identifiers: list[int], length: int) -> Frames:
    frames = np.zeros(len(identifiers), dtype=RECORD_DTYPE)
    frames["id"], frames["length"] = identifiers, length
    frames["data"][:, :length] = 0x55
    return frames


def test_percent_is_bits_over_time() -> None:
    frames = frames_of([0x182] * 1000, 6)  # 0x55: no stuff bits in the data
    each = int(exact_bits(frames)[0])
    load = bus_load(frames, 0.5, 500_000)
    assert load.percent == pytest.approx(100 * 1000 * each / 250_000)
    assert load.frames_per_s == 2000
    assert list(load.classes) == ["TPDO1"]
    assert load.classes["TPDO1"].percent == load.percent


@pytest.mark.parametrize(
    ("identifier", "name"),
    [
        (0x000, "NMT"),
        (0x080, "SYNC"),
        (0x081, "EMCY"),
        (0x0FF, "EMCY"),
        (0x183, "TPDO1"),
        (0x203, "RPDO1"),
        (0x282, "TPDO2"),
        (0x302, "RPDO2"),
        (0x386, "TPDO3"),
        (0x582, "SDO"),
        (0x602, "SDO"),
        (0x701, "heartbeat"),
        (0x7E5, "other"),
        (0x001, "other"),
        (0x182 | EXTENDED, "other"),
    ],
)
def test_classes(identifier: int, name: str) -> None:
    assert list(bus_load(frames_of([identifier], 2), 1.0, 1_000_000).classes) == [name]


def test_classes_add_up_and_silence_is_zero() -> None:
    rng = np.random.default_rng(3)
    frames = frames_of(rng.integers(0, 0x800, 5000).tolist(), 8)
    load = bus_load(frames, 1.25, 1_000_000)
    assert sum(k.percent for k in load.classes.values()) == pytest.approx(load.percent)
    assert sum(k.frames_per_s for k in load.classes.values()) == pytest.approx(4000)
    silent = bus_load(frames[:0], 0.25, 1_000_000)
    assert (silent.percent, silent.frames_per_s, silent.classes) == (0, 0, {})


def test_a_listener_measures_from_one_question_to_the_next() -> None:
    frames = frames_of([0x182] * 100, 6)
    capture = LoadCapture(1_000_000)
    assert capture.measure() is None
    capture.feed(frames, 10.0)  # when the first of these came nobody knows
    assert capture.measure() is None
    capture.feed(frames, 10.1)
    capture.feed(frames, 10.2)
    found = capture.measure()
    assert found is not None
    assert found.seconds == pytest.approx(0.2)
    assert found.percent == pytest.approx(bus_load(frames, 0.1, 1_000_000).percent)
    assert capture.measure() is None
    for k in range(100):  # nobody asks
        capture.feed(frames, 11.0 + 0.1 * k)
    found = capture.measure()
    assert found is not None
    assert found.seconds <= LONGEST_S + 0.1
    assert found.frames_per_s == pytest.approx(1000)
    capture.feed(frames, 21.0)
    capture.feed(frames, 3.0)  # a recording begins anew: what was received before does not count
    assert capture.measure() is None
    capture.feed(frames, 3.1)
    found = capture.measure()
    assert found is not None
    assert found.frames_per_s == pytest.approx(1000)
