# SPDX-License-Identifier: MIT
"""`hodograph status`: once, watching, as JSON; what it says when something is wrong."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bench import BUS, PAPER_ALPHA, MakeBench
from hodograph.bus.processes import controller_command
from hodograph.bus.sdo.controller import Controller, connect
from hodograph.bus.sdo.status import snapshot
from hodograph.bustime import machine_bus_time
from hodograph.cli.main import main
from hodograph.config import load_machine

pytestmark = pytest.mark.bus

COMMAND = [sys.executable, "-m", "hodograph", "status"]
KEYS = {
    "bus",
    "node",
    "state",
    "fault",
    "boot_trouble",
    "last_refusal",
    "program",
    "motion",
    "override",
    "axes",
    "statistics",
    "bus_load",
}
AXIS_KEYS = {
    "node",
    "state",
    "statusword",
    "actual_mm",
    "target_mm",
    "following_error_um",
    "missed_tpdos",
    "digital_inputs",
    "inputs_on",
    "homed",
    "error_code",
    "error",
    "remedy",
}


@pytest.fixture
def controller(make_bench: MakeBench) -> Controller:
    """A configured controller with its drives, off, in real time."""
    return make_bench("real-time").controller


def status(capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["status", "--json", *more]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_keys_and_numbers(controller: Controller, capsys: pytest.CaptureFixture[str]) -> None:
    controller.enable()
    found = status(capsys, "--machine", str(PAPER_ALPHA))
    assert set(found) == KEYS
    assert [set(axis) for axis in found["axes"]] == [AXIS_KEYS] * 2
    assert found["state"] == "ready"
    assert (found["fault"], found["boot_trouble"]) == (None, None)
    for axis, node in zip(found["axes"], (2, 3), strict=True):
        assert axis["node"] == node
        assert axis["state"] == "operation enabled"
        assert axis["statusword"] & 0x6F == 0x27
        assert (axis["error_code"], axis["error"], axis["homed"]) == (0, None, False)
        assert axis["inputs_on"] == []
    assert found["statistics"]["syncs"] > 0


def test_the_load_is_what_the_model_says(
    controller: Controller, capsys: pytest.CaptureFixture[str]
) -> None:
    """Frames of the ticks, per SYNC: so it holds however slow the host ticks."""
    model = machine_bus_time(load_machine(PAPER_ALPHA))
    assert controller.answers(1.0)
    load = status(capsys, "--machine", str(PAPER_ALPHA))["bus_load"]
    assert load["bitrate"] == 1_000_000
    assert 0.25 <= load["seconds"] < 5.0
    classes = load["classes"]
    assert {"SYNC", "TPDO1", "RPDO1", "TPDO2", "SDO"} <= set(classes)
    assert sum(c["percent"] for c in classes.values()) == pytest.approx(load["percent"])
    nominal = model.period_us / 1e6 * classes["SYNC"]["frames_per_s"]
    assert 0.01 < nominal < 1.3  # a host at its limits ticks late
    for name, kind in (("SYNC", "SYNC"), ("RPDO1", "setpoints"), ("TPDO1", "positions")):
        least, most = model.load_of(kind)
        assert 0.95 * least <= classes[name]["percent"] / nominal <= 1.05 * most, name


def test_a_snapshot_is_quick(controller: Controller) -> None:
    took_s = []
    for _ in range(5):
        begun = time.monotonic()
        snapshot(controller)
        took_s.append(time.monotonic() - begun)
    assert min(took_s) < 1.0


def test_for_people(controller: Controller, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert controller.answers(1.0)
    assert main(["status", "--machine", str(PAPER_ALPHA)]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^controller +node 1 on socketcan:vcan0: off$", out, re.M)
    assert re.search(r"^fault +none$", out, re.M)
    assert re.search(r"^axis x +node 2: switch on disabled, at ", out, re.M)
    assert re.search(r"^axis y +node 3: ", out, re.M)
    assert re.search(r"^bus load +[\d.]+ % of 1000 kbit/s, \d+ frames/s", out, re.M)
    assert re.search(r"^ticks +worst tick [\d.]+ us, .*deadline misses \d+$", out, re.M)


def test_watching_into_a_pipe(controller: Controller) -> None:
    assert controller.answers(1.0)
    lines = watched(["--watch", "--interval", "0.3"], 3)
    for line in lines:
        assert re.match(
            r"\d{4}-\d\d-\d\dT[\d:.+-]+ off, 0.000 mm, 0.0 mm/s, override 0/100 %", line
        )
        assert "\x1b" not in line


def test_watching_as_json(controller: Controller) -> None:
    assert controller.answers(1.0)
    documents = [json.loads(line) for line in watched(["--watch", "--json"], 3)]
    assert [set(d) for d in documents] == [KEYS | {"time"}] * 3
    assert documents[0]["statistics"]["syncs"] < documents[2]["statistics"]["syncs"]


def watched(options: list[str], count: int) -> list[str]:
    """The first lines of a watching command, which then ends well on Ctrl-C."""
    with subprocess.Popen([*COMMAND, *options], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        lines = [child.stdout.readline() for _ in range(count)]
        child.send_signal(signal.SIGINT)
        child.communicate(timeout=60)
        assert child.returncode == 0
    return lines


def test_watching_in_a_terminal(controller: Controller) -> None:
    assert controller.answers(1.0)
    main_end, child_end = pty.openpty()
    with subprocess.Popen([*COMMAND, "--watch"], stdout=child_end, stderr=child_end) as child:
        os.close(child_end)
        shown = until_shown(main_end, b"Ctrl-C ends")
        child.send_signal(signal.SIGINT)
        shown += until_shown(main_end, b"\x1b[?1049l")
        assert child.wait(60) == 0
    os.close(main_end)
    assert shown.startswith(b"\x1b[?1049h\x1b[?25l\x1b[H")
    assert b"node 1 on socketcan:vcan0: off\x1b[K" in shown
    assert shown.rstrip().endswith(b"\x1b[?25h\x1b[?1049l")


def until_shown(descriptor: int, words: bytes) -> bytes:
    shown = b""
    deadline = time.monotonic() + 60.0
    while words not in shown:
        assert time.monotonic() < deadline, shown
        if select.select([descriptor], [], [], 0.5)[0]:
            shown += os.read(descriptor, 4096)
    return shown


@contextlib.contextmanager
def lonely_controller() -> Iterator[Controller]:
    """A controller on vcan0 without any drive, configured."""
    machine = load_machine(PAPER_ALPHA)
    command = controller_command(machine, BUS, "real-time")
    with subprocess.Popen(command) as child:
        try:
            with connect(BUS, machine.node, machine.bitrate) as controller:
                controller.require(20.0)
                controller.configure(machine, "fixed")
                yield controller
        finally:
            child.terminate()
            child.wait(20)


def test_why_boot_does_not_end(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with lonely_controller():
        deadline = time.monotonic() + 30.0
        while (found := status(capsys))["boot_trouble"] is None:
            assert time.monotonic() < deadline
        assert found["state"] == "boot"
        trouble = found["boot_trouble"]
        assert trouble["node"] == 2
        assert trouble["text"].startswith("the drive at node 2 does not answer")
        assert "is it powered and connected" in trouble["remedy"]
        assert [axis["state"] for axis in found["axes"]] == ["not there"] * 2
        assert main(["status"]) == 0
        out = capsys.readouterr().out
        assert "boot waits" in out
        assert "the drive at node 2 does not answer" in out
