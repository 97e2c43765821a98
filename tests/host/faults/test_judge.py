# SPDX-License-Identifier: MIT
"""The judge finds each kind of violation in a made-up record, and none in a good one. Run by pytest; reads
examples/faults; starts and writes nothing.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.faults.case_record import CaseRecord
from hodograph.faults.case_run import CaseRun, CleanRun, load_clean_run
from hodograph.faults.case_table import text
from hodograph.faults.judge import Verdict, judge
from hodograph.faults.scenario import Case, Expectation, Scenario

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "faults"
FOREVER = 10**9
OE = 0x1237
EXPECT = Expectation((0x8250,), False, 30, FOREVER, 90, FOREVER)
BEGAN_US = 1_000_000
INJECTED = [{"t_ns": 0, "tick": 50, "line": 1, "kind": "drop"}]


@cache
def clean_run() -> CleanRun:
    return load_clean_run(FOLDER / "path.toml")


def frames(rows: list[tuple[int, int, bytes]]) -> Frames:
    array = np.zeros(len(rows), dtype=RECORD_DTYPE)
    for i, (time_us, identifier, data) in enumerate(rows):
        array[i]["time_us"], array[i]["id"], array[i]["length"] = time_us, identifier, len(data)
        array[i]["data"][: len(data)] = list(data)
    return array


def recording(
    setpoints: NDArray[np.int32],
    emergency_tick: int | None,
    enabled_until: int,
    code: int = 0x8250,
    stands: int = 100,
) -> Frames:
    """A tick is a millisecond; the first 5 and the last stand. The drives answer with where they shall be."""
    rows: list[tuple[int, int, bytes]] = []
    path = np.concatenate(
        [np.repeat(setpoints[:1], 5, axis=0), setpoints, np.repeat(setpoints[-1:], stands, axis=0)]
    )
    for k, target in enumerate(path):
        us = BEGAN_US + 1000 * k
        rows.append((us, 0x80, bytes([k % 240 + 1])))
        if emergency_tick is not None and k == emergency_tick + 5:
            rows.append((us, 0x81, struct.pack("<H6x", code)))
        for node, counts in enumerate(target.tolist(), start=2):
            control = 0x0F if k < enabled_until + 5 else 0x06
            rows.append((us, 0x180 + node, struct.pack("<Hi", OE, counts)))
            rows.append((us, 0x200 + node, struct.pack("<Hi", control, counts)))
    return frames(rows)


def record(recorded: Frames, expect: Expectation = EXPECT, *, at: int = 50) -> CaseRun:
    scenario = Scenario(
        "made-up", "x", FOLDER / "path.toml", ("drop at=50 id=1",), {}, "none", expect
    )
    made = CaseRun(Case(scenario, 0, {"seed": 1}), clean_run())
    made.injections = list(INJECTED)
    made.evidence = CaseRecord(recorded, recorded, (2, 3))
    made.began_us = BEGAN_US + 1000 * (5 + at)
    made.again = clean_run().motion
    made.recovery_ms = 900.0
    return made


def stopped(at: int) -> NDArray[np.int32]:
    """The setpoints of a program that comes to rest on the path from tick `at` on."""
    time = np.arange(2 * len(clean_run().setpoints), dtype=np.float64)
    ahead = np.clip(time - at, 0, 60)
    tick = np.where(time < at, time, at + ahead - ahead**2 / 120)
    nominal = clean_run().setpoints.astype(np.float64)
    return np.stack(
        [np.interp(tick, np.arange(len(nominal)), nominal[:, i]) for i in range(2)], axis=1
    ).astype(np.int32)


def violations(made: CaseRun) -> list[str]:
    return list(judge(made).violations)


def test_a_tolerated_fault_has_no_violation() -> None:
    made = record(recording(clean_run().setpoints, None, FOREVER), replace(EXPECT, codes=()))
    made.finished = True
    assert violations(made) == []


def test_latencies_are_counted_in_ticks() -> None:
    verdict = judge(record(recording(stopped(60), 62, 200)))
    assert verdict.codes == (0x8250,)
    assert verdict.latency_ticks == 12
    assert verdict.rest_ticks is not None
    assert 60 < verdict.rest_ticks < 72
    # Setpoints between two nominal ones lie on the chord, beside the curve by some nanometres; and the deceleration
    # of this stop begins and ends with a step.
    known = ("away from the curve", "axis jerk")
    assert all(any(what in words for what in known) for words in verdict.violations)


def test_a_stop_has_to_be_on_the_path_and_within_its_bound() -> None:
    """A made-up stop takes 60 ticks; that of the program takes less than a tenth of a second at most."""
    expect = replace(EXPECT, on_path=True)

    def off_path(recorded: Frames) -> list[str]:
        words = ("setpoints of", "led to rest")
        return [bad for bad in violations(record(recorded, expect)) if any(w in bad for w in words)]

    assert off_path(recording(stopped(60), 62, FOREVER)) == []
    for node, words in enumerate(off_path(recording(stopped(200), 62, FOREVER)), start=2):
        assert words.startswith(f"setpoints of node {node} at rest ")
        assert 195 <= int(words.split()[6]) <= 198
    assert len(off_path(recording(stopped(200), 62, FOREVER))) == 2
    broken_off = off_path(recording(stopped(60), 62, 90))
    assert broken_off == [f"node {node} was not led to rest on the path" for node in (2, 3)]


def test_no_fault_late_fault_and_a_wrong_one() -> None:
    made = record(recording(clean_run().setpoints, None, FOREVER))
    made.finished = True
    assert violations(made) == ["no fault was raised"]
    late = violations(record(recording(stopped(100), 100, 200)))
    assert "fault raised after 50 ticks, 30 are allowed" in late
    wrong = violations(record(recording(stopped(60), 60, 200, code=0x1000)))
    assert "fault 0x1000 was raised, which is none of those expected" in wrong


def test_a_fault_beside_the_expected_one() -> None:
    both = recording(stopped(60), 60, 200)
    both = np.concatenate([both, both[-1:]])
    both[-1]["id"], both[-1]["length"] = 0x81, 8
    for code, reported in (
        (0x4210, True),
        (0x1000, False),
    ):  # the second only until a drive reports its own
        both[-1]["data"] = list(struct.pack("<H6x", code))
        words = f"fault 0x{code:04X} was raised, which is none of those expected"
        assert (words in violations(record(both))) is reported


def test_axes_that_move_on() -> None:
    found = violations(record(recording(clean_run().setpoints, 60, 60)))
    assert any(words.startswith("axes at rest after") for words in found)


def test_axes_that_move_on_to_the_end_of_the_recording() -> None:
    """However short the recording: the time to rest is measured to its end, which may be within the limit."""
    made = record(recording(clean_run().setpoints[:120], 60, 60, stands=0))
    found = violations(made)
    assert "node 2 still moves at the end of the recording" in found
    assert not any(words.startswith("axes at rest after") for words in found)
    silent = recording(clean_run().setpoints, 60, 60)
    gone = silent[(silent["id"] < 0x182) | (silent["time_us"] < BEGAN_US + 100_000)]
    assert not any("still moves" in words for words in violations(record(gone)))


def test_a_jump_and_a_way_beside_the_path() -> None:
    moved = clean_run().setpoints.copy()
    moved[300:] += 20_000
    made = record(recording(moved, None, FOREVER), replace(EXPECT, codes=()))
    made.finished = True
    found = violations(made)
    assert any(words.startswith("setpoint jump at SYNC 305") for words in found)
    assert any("away from the curve" in words for words in found)


def test_what_did_not_happen_or_not_recover() -> None:
    made = record(recording(clean_run().setpoints, None, FOREVER), replace(EXPECT, codes=()))
    made.injections = []
    made.again = None
    assert violations(made) == [
        "nothing was injected",
        "the program did not come to its end, and no fault says why",
        "no clean run afterwards",
    ]
    made.injections, made.finished = list(INJECTED), True
    made.again = replace(clean_run().motion, encoders_sha256="0", setpoints_sha256="1")
    assert violations(made) == [
        "the run afterwards has other setpoints",
        "the run afterwards has other encoder positions",
    ]


def test_a_rest_that_nobody_saw_is_no_rest() -> None:
    seen = recording(stopped(60), 62, 200)
    silent = seen[
        (seen["id"] != 0x183)
        | (seen["time_us"] < BEGAN_US + 80_000)
        | (seen["time_us"] > BEGAN_US + 400_000)
    ]
    assert "no report shows when node 3 came to rest" in violations(record(silent))
    never = seen[seen["id"] != 0x182]
    assert "no report shows when node 2 came to rest" in violations(record(never))
    reported = record(silent)
    reported.rest_us = BEGAN_US + 100_000  # somebody asked the drives
    excused = record(silent, replace(EXPECT, unseen=True))
    unlimited = record(silent, replace(EXPECT, rest_ticks=FOREVER))
    for made in (record(seen), reported, excused, unlimited):
        assert not any(words.startswith("no report shows") for words in violations(made))
    nobody = seen[(seen["id"] != 0x182) & (seen["id"] != 0x183)]
    assert len(violations(record(nobody, replace(EXPECT, unseen=True)))) >= 2


def test_an_axis_that_never_moved_is_at_rest() -> None:
    still = np.repeat(clean_run().setpoints[:1], 300, axis=0)
    verdict = judge(record(recording(still, 62, 200)))
    assert (verdict.rest_ticks, verdict.rest_ms) == (0, 0.0)


def test_a_reset_that_takes_too_long_or_that_nobody_measured() -> None:
    made = record(recording(stopped(60), 62, 200))
    made.recovery_ms = 3001.0
    assert "reset after 3001 ms, 3000 ms are allowed" in violations(made)
    made.recovery_ms = None
    assert "reset after no known time, 3000 ms are allowed" in violations(made)


def test_the_table_has_the_worst_of_each_scenario() -> None:
    one = judge(record(recording(stopped(60), 62, 200)))
    quick: Verdict = replace(one, seed=1, latency_ticks=3, violations=())
    slow: Verdict = replace(one, seed=2, latency_ticks=17, violations=("it broke",))
    lines = text([quick, slow]).splitlines()
    row = next(line for line in lines if line.startswith("made-up"))
    assert row.split()[1:6] == ["2", "2", "2", "8250", "17"]
    assert row.split()[-1] == "1"
    assert lines[-1] == "violation: made-up seed 2 (): it broke"
