# SPDX-License-Identifier: MIT
"""The observer of the bus: content with a bus as it should be, and finds each thing that should not be there. Run by
pytest; reads machine files.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bus_checker import BusChecker
from hodograph.bus.capture.frames import RECORD_DTYPE
from hodograph.config import load_machine

MACHINE = Path(__file__).resolve().parents[2] / "examples" / "machines" / "paper_alpha.toml"
Frame = tuple[int, bytes]
DISABLED, READY, SWITCHED_ON, ENABLED = 0x0250, 0x0231, 0x0233, 0x1237


def sync(number: int) -> Frame:
    return 0x080, bytes([number % 240 + 1])


def tick(number: int, statusword: int = DISABLED, target: int = 1000) -> list[Frame]:
    """A whole tick of two drives."""
    frames = [sync(number)]
    for node in (2, 3):
        frames.append((0x200 + node, struct.pack("<Hi", 6, target)))
        frames.append((0x180 + node, struct.pack("<Hi", statusword, 1000)))
        frames.append((0x280 + node, b"\0\0"))
    return frames


def good() -> list[Frame]:
    """Boot, start, 600 ticks with all states of enabling."""
    frames: list[Frame] = [(0x700 + node, b"\0") for node in (2, 3, 1)]
    frames += [(0x602, bytes(8)), (0x582, bytes(8)), (0x000, b"\x01\x02"), (0x000, b"\x01\x03")]
    for number in range(600):
        state = (DISABLED, READY, SWITCHED_ON, ENABLED)[min(number // 50, 3)]
        frames += tick(number, state)
        if number % 100 == 99:
            frames += [(0x700 + node, b"\x05") for node in (1, 2, 3)]
    return frames


def seen(frames: list[Frame], times_s: list[float] | None = None, parts: int = 1) -> BusChecker:
    made = np.zeros(len(frames), dtype=RECORD_DTYPE)
    for i, (identifier, data) in enumerate(frames):
        made[i]["id"], made[i]["length"] = identifier, len(data)
        made[i]["data"][: len(data)] = np.frombuffer(data, dtype=np.uint8)
    when = np.array(times_s) if times_s is not None else np.linspace(0, 0.6, len(frames))
    made["time_us"] = np.round(1e6 * when)
    checker = BusChecker(load_machine(MACHINE))
    for part in np.array_split(np.arange(len(frames)), parts):
        checker.take(made[part])
    return checker


@pytest.mark.parametrize("parts", [1, 2, 7, 100])
def test_a_good_bus_in_any_number_of_parts(parts: int) -> None:
    checker = seen(good(), parts=parts)
    assert checker.findings == []
    assert (checker.syncs, checker.frames, checker.late) == (600, len(good()), 0)
    assert checker.kinds["Drive2_TPDO1"] == 600
    assert checker.worst_heartbeat_s == pytest.approx(0.1, abs=0.02)


def put(at_tick: int, *frames: Frame) -> Callable[[list[Frame]], None]:
    """Adds frames after the SYNC of a tick."""

    def change(bus: list[Frame]) -> None:
        at = [i for i, frame in enumerate(bus) if frame[0] == 0x080][at_tick] + 1
        bus[at:at] = frames

    return change


def replace(identifier: int, which: int, *frames: Frame) -> Callable[[list[Frame]], None]:
    """Other frames in the place of one."""

    def change(bus: list[Frame]) -> None:
        at = [i for i, frame in enumerate(bus) if frame[0] == identifier][which]
        bus[at : at + 1] = frames

    return change


WORD = struct.Struct("<Hi")
FAULTS = [
    (put(300, (0x123, b"")), "identifier 0x123"),
    (put(300, (0x184, bytes(6))), "identifier 0x184"),
    (put(300, (0x80000182, bytes(6))), "identifier 0x80000182"),
    (put(300, (0x40000702, b"")), "identifier 0x40000702"),
    (put(300, (0x082, struct.pack("<HB5x", 0x8130, 0x11))), "EMCY 0x8130 from node 2"),
    (put(300, (0x582, struct.pack("<BHBI", 0x80, 0x6060, 0, 0x06090030))), "abort 0x06090030"),
    (put(300, (0x603, struct.pack("<BHBI", 0x80, 0x60F4, 0, 0x05040000))), "abort 0x05040000"),
    (put(300, (0x602, bytes(7))), "SDO request of node 2 with 7 bytes"),
    (put(300, (0x702, b"\0")), "node 2 booted"),
    (put(300, (0x702, b"\x7f")), "heartbeat of node 2 with state 127"),
    (put(300, (0x703, b"\x04")), "heartbeat of node 3 with state 4"),
    (put(300, (0x000, b"\x05\x02")), "NMT command 5"),
    (put(300, (0x000, b"\x01\x07")), "to node 7, which is no drive"),
    (put(300, (0x000, b"\x80\x02")), "while the drive is not operational"),
    (put(300, (0x182, WORD.pack(ENABLED, 0))), "Drive2_TPDO1: more than one"),
    (put(300, (0x203, WORD.pack(15, 1000))), "Drive3_RPDO1: more than one"),
    (replace(0x182, 100), "Drive2_TPDO1: 1 frames missing"),
    (replace(0x283, 100), "Drive3_TPDO2: 1 frames missing"),
    (replace(0x202, 100), "Drive2_RPDO1: 1 frames missing"),
    (replace(0x080, 300), "SYNC counter"),
    (replace(0x080, 300, (0x080, b"\0")), "SYNC counter"),
    (replace(0x080, 300, (0x080, b"")), "SYNC with 0 bytes"),
    (replace(0x182, 300, (0x182, WORD.pack(0x0218, 0))), "statusword 0x0218"),
    (replace(0x182, 300, (0x182, WORD.pack(0x3237, 0))), "warning or error"),
    (replace(0x182, 300, (0x182, WORD.pack(0x1217, 0))), "from operation enabled to quick stop"),
    (replace(0x182, 20, (0x182, WORD.pack(ENABLED, 0))), "from switch on disabled to operation"),
    (replace(0x182, 300, (0x182, bytes(5))), "Drive2_TPDO1 with 5 bytes"),
    (replace(0x202, 300, (0x202, WORD.pack(15, 502_000))), "setpoint jumps by 501000"),
]


@pytest.mark.parametrize(("change", "part"), FAULTS, ids=[part for _, part in FAULTS])
def test_what_should_not_be_there_is_found(
    change: Callable[[list[Frame]], None], part: str
) -> None:
    frames = good()
    change(frames)
    found = seen(frames).findings
    assert any(part in finding for finding in found), found


def test_a_heartbeat_that_is_late_or_stays_away() -> None:
    frames = good()
    times = [0.0] * len(frames)
    beats = [i for i, frame in enumerate(frames) if frame == (0x703, b"\x05")]
    for i in range(len(frames)):
        times[i] = 0.1 * sum(beat < i for beat in beats) + (1.0 if i >= beats[3] else 0.0)
    found = seen(frames, times).findings
    assert any("heartbeat of node 3 after" in finding for finding in found), found


def test_a_heartbeat_that_never_comes_again() -> None:
    frames = [frame for frame in good() if frame != (0x703, b"\x05")]
    found = seen(frames, [0.005 * i for i in range(len(frames))]).findings
    assert any("no heartbeat of node 3 for" in finding for finding in found), found


def test_a_start_that_is_refused_for_now_is_no_fault() -> None:
    refused = (0x581, struct.pack("<BHBI", 0x80, 0x2001, 0, 0x08000022))
    other = (0x581, struct.pack("<BHBI", 0x80, 0x2000, 1, 0x08000022))
    assert seen([*good(), refused]).findings == []
    assert any(
        "abort 0x08000022 of 0x2000" in finding for finding in seen([*good(), other]).findings
    )


def test_a_channel_that_is_handed_over_is_no_fault() -> None:
    nowhere = (0x581, struct.pack("<BHBI", 0x80, 0x5123, 0, 0x06020000))
    missing = (0x581, struct.pack("<BHBI", 0x80, 0x2123, 0, 0x06020000))
    assert seen([*good(), nowhere]).findings == []
    assert any("of 0x2123" in finding for finding in seen([*good(), missing]).findings)


def test_a_reset_that_was_asked_for_is_no_fault() -> None:
    frames = good()
    frames += [(0x000, b"\x81\x02"), (0x702, b"\0"), (0x000, b"\x01\x02")]
    for number in range(600, 700):
        frames += tick(number, DISABLED)
    assert seen(frames).findings == []


def test_a_drive_may_refuse_what_it_has_not_while_it_is_configured() -> None:
    refused = (0x582, struct.pack("<BHBI", 0x80, 0x100C, 0, 0x06020000))
    frames = good()
    checker = seen([*frames[:5], refused, *frames[5:]])
    assert checker.findings == []
    assert checker.kinds["SDO refused by a drive while it was configured"] == 1
    assert len(seen([*frames, refused]).findings) == 1


def test_a_host_that_waits_for_the_controller_is_no_fault() -> None:
    abort = struct.pack("<BHBI", 0x80, 0, 0, 0x05040000)
    asked = [(0x601, bytes(8)), (0x601, abort)]
    frames = good()
    checker = seen([*frames[:3], *asked, *frames[3:]])
    assert checker.findings == []
    assert checker.kinds["SDO asked in vain"] == 1
    checker = seen([*frames[:3], (0x581, bytes(8)), *asked, *frames[3:]])
    assert len(checker.findings) == 1
