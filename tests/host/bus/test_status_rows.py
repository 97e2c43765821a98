# SPDX-License-Identifier: MIT
"""Output of `hodograph status` for a snapshot, as text and as JSON. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from hodograph.bus.capture.load import BusLoad, ClassLoad
from hodograph.bus.diagnostics.boot_texts import boot_trouble
from hodograph.bus.diagnostics.fault_texts import fault_words
from hodograph.bus.sdo.status import (
    AxisStatus,
    Configured,
    Fault,
    LoadedProgram,
    LongestStop,
    LongestStops,
    Override,
    PathPosition,
    Statistics,
    Status,
)
from hodograph.bus.sdo.stream_channel import OPEN, StreamStatus
from hodograph.bus.status_text import status_line, status_rows

ROOT = Path(__file__).resolve().parents[3]

AXIS = AxisStatus(
    node=2,
    state="operation enabled",
    statusword=0x1637,
    actual_mm=1.25,
    target_mm=1.5,
    following_error_um=250.0,
    missed_tpdos=3,
    digital_inputs=4,
    inputs_on=("home switch",),
    homed=True,
    homing_method=37,
    error_code=0,
    error=None,
    remedy=None,
)
WORDS = fault_words(0x8250)
FAULT = Fault(0x8250, WORDS.text, WORDS.remedy, 2, 2, "2 positions missed in a row")
LOAD = BusLoad(500_000, 0.25, 4000.0, 61.25, {"SYNC": ClassLoad(1000.0, 12.5)})
RUNNING = Status(
    bus="socketcan:can0",
    node=1,
    state="running",
    fault=None,
    boot_trouble=None,
    last_refusal=None,
    configuration=Configured("confirmed", 0xA1, "whole", 0xA1, 0xA1),
    program=LoadedProgram(
        *("ready", None, 0, 0, 0xABCD, 6600, 8, 67, 1101, 1.1, 99.9, 0, 0, 1, 2),
        LongestStops(LongestStop(0.14, 8.5, 12.0, 7), LongestStop(0.07, 4.25, 30.5, 11)),
    ),
    motion=PathPosition(45.0, 100.0, 0.5),
    override=Override(150, 120.0, True),
    unhomed_nodes=(),
    axes=(AXIS, replace(AXIS, node=3, homed=False, inputs_on=())),
    timing="kept",
    statistics=Statistics(5000, 500, 2, 130, 12_345, 3, 0),
)


def shown(status: Status, load: BusLoad | None = None) -> str:
    return "\n".join(f"{name}: {value}" for name, value in status_rows(status, load, ("x", "y")))


def test_a_run() -> None:
    text = shown(RUNNING, LOAD)
    for line in (
        "controller: node 1 on socketcan:can0: running",
        "fault: none",
        "hold, stop: at most 0.14 s and 8.5 mm to rest, longest from arc length 12 mm (piece 7)",
        "fault stop: at most 0.07 s and 4.25 mm to rest, longest from arc length 30.5 mm (piece 11)",
        "position: 45.000000 of 99.900000 mm, 0.500 of 1.100 s, tick 500",
        "feed: 100.000 mm/s",
        "override: 150 % commanded, 120.0 % now, as much as the program allows here",
        "bus load: 61.2 % of 500 kbit/s, 4000 frames/s, over 0.25 s",
        "ticks: worst tick 12.3 us, worst lateness 130 us, deadline misses 2",
        "frames: SYNCs 5000, missed TPDOs 3, not sent 0",
    ):
        assert line in text.splitlines()
    assert "axis x: node 2: operation enabled, at 1.250000 mm, target 1.500000 mm" in text
    assert "following error 250.000 um, homed, 3 TPDOs missed, home switch on" in text
    assert "axis y: node 3: " in text
    assert "not homed (a start needs it: hodograph home)" in text
    assert status_line(RUNNING, LOAD) == (
        "running, 45.000 mm, 100.0 mm/s, override 120/150 %, missed ticks 2, bus 61.3 %"
    ).replace("61.3", f"{61.25:.1f}")


def test_a_streamed_job_has_its_own_place() -> None:
    """The program in the bank is another one: its length is not that of the job."""
    stream = StreamStatus(OPEN, 7, 5, 4096, 2.5, 4, 31, 28.87, 12.0, 0)
    text = shown(replace(RUNNING, stream=stream))
    assert "stream: open, line 31, 28.870 mm, 2.5 s ahead in the controller, 12 s left" in text
    assert "position: " not in text


def test_an_axis_without_a_homing_method_needs_no_homing() -> None:
    axis = replace(AXIS, homed=False, homing_method=0)
    text = shown(replace(RUNNING, axes=(axis, axis)))
    assert text.count("needs no homing") == 2
    assert "not homed" not in text


def test_troubles() -> None:
    faulty = replace(
        RUNNING,
        state="fault",
        fault=FAULT,
        axes=(replace(AXIS, error_code=0x3220, error="low", remedy="feed it"),),
    )
    text = shown(faulty)
    assert "fault: expected PDOs were not received (code 0x8250, node 2, 2 positions missed" in text
    assert f"remedy: {WORDS.remedy}; then hodograph reset" in text
    assert "error: low (0x3220)" in text
    assert "fault 0x8250: expected PDOs were not received" in status_line(faulty)
    waiting = replace(RUNNING, state="boot", boot_trouble=boot_trouble(3, 0x100000, 0x05040000, 0))
    assert "boot waits: the drive at node 3 does not answer" in shown(waiting)
    assert "node 3 does not answer" in status_line(waiting)


def test_every_key_is_documented() -> None:
    """docs/reference/cli.md names each key of the JSON document within its item."""
    items = (ROOT / "docs" / "reference" / "cli.md").read_text().split("\n- ")
    words = next(item for item in items if item.startswith("`status`"))
    documented = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]*)`", words))))
    faulty = replace(RUNNING, fault=FAULT, boot_trouble=boot_trouble(2, 0x100000, 0, 0))
    document = json.loads(json.dumps(faulty.json() | {"bus_load": LOAD.json()}))
    del document["bus_load"]["classes"]["SYNC"]
    missing = keys(document) - documented
    assert not missing


def keys(value: Any) -> set[str]:
    if isinstance(value, dict):
        return set(value).union(*(keys(inner) for inner in value.values()))
    if isinstance(value, list):
        return set().union(*(keys(inner) for inner in value))
    return set()
