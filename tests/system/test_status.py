# SPDX-License-Identifier: MIT
"""`hodograph status`: once, watching, as JSON; its messages on faults. Run by pytest; starts a controller, drives and
`hodograph` on a local bus.
"""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from datetime import datetime
from itertools import pairwise
from typing import Any

import pytest

from bench import PAPER_ALPHA
from commands import running
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import Process, controller_command
from hodograph.bus.sdo.controller import Controller, connect
from hodograph.bus.sdo.status import snapshot
from hodograph.bustime import machine_bus_time
from hodograph.bustime.frame_bits import exact_bits
from hodograph.cli.main import main
from hodograph.config import load_machine

LIMIT_S = 30.0
KEYS = {
    "bus",
    "node",
    "state",
    "fault",
    "boot_trouble",
    "last_refusal",
    "configuration",
    "program",
    "motion",
    "override",
    "unhomed_nodes",
    "axes",
    "timing",
    "statistics",
    "stream",
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
    "homing_method",
    "error_code",
    "error",
    "remedy",
}


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
    model = machine_bus_time(load_machine(PAPER_ALPHA))
    load = status(capsys, "--machine", str(PAPER_ALPHA))["bus_load"]
    assert load["bitrate"] == 1_000_000
    assert load["seconds"] == 0.25
    classes = load["classes"]
    assert {"SYNC", "TPDO1", "RPDO1", "TPDO2", "SDO"} <= set(classes)
    assert sum(c["percent"] for c in classes.values()) == pytest.approx(load["percent"])
    assert classes["SYNC"]["frames_per_s"] == 1000
    for name, kind in (("SYNC", "SYNC"), ("RPDO1", "setpoints"), ("TPDO1", "positions")):
        least, most = model.load_of(kind)
        assert least <= classes[name]["percent"] <= most, name


def test_a_snapshot_takes_only_what_others_leave(controller: Controller) -> None:
    """One SDO transfer at once after the other fills the bus: no frame of the ticks or of monitoring waits for them."""
    controller.enable()
    with Recorder(controller.address) as recorder:
        begun_s = controller.clock.now_s()
        found = [snapshot(controller) for _ in range(30)]
        took_s = controller.clock.now_s() - begun_s
        frames = recorder.so_far()
    ticks = round(took_s * 1000)
    cyclic = (0x080, 0x182, 0x183, 0x202, 0x203, 0x282, 0x283)
    assert [int((frames["id"] == i).sum()) for i in cyclic] == [pytest.approx(ticks, abs=1)] * 7
    beats = [int((frames["id"] == 0x700 + node).sum()) for node in (1, 2, 3)]
    assert beats == [pytest.approx(took_s / 0.1, abs=1)] * 3
    assert exact_bits(frames).sum() == pytest.approx(
        1e6 * took_s, rel=0.01
    )  # the bus is never idle
    assert {one.state for one in found} == {"ready"}
    assert found[-1].statistics.missed_tpdos == found[0].statistics.missed_tpdos


def test_for_people(controller: Controller, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["status", "--machine", str(PAPER_ALPHA)]) == 0
    out = capsys.readouterr().out
    assert re.search(
        rf"^controller +node 1 on {re.escape(str(controller.address))}: off$", out, re.M
    )
    assert re.search(r"^fault +none$", out, re.M)
    assert re.search(r"^axis x +node 2: switch on disabled, at ", out, re.M)
    assert re.search(r"^axis y +node 3: ", out, re.M)
    assert re.search(r"^bus load +[\d.]+ % of 1000 kbit/s, \d+ frames/s", out, re.M)
    assert re.search(r"^ticks +worst tick [\d.]+ us, .*deadline misses \d+$", out, re.M)


def test_watching_into_a_pipe(controller: Controller, clock: VirtualClock) -> None:
    lines = watched(clock, ["--watch", "--interval", "1"], 4)
    for line in lines:
        assert re.match(
            r"\d{4}-\d\d-\d\dT[\d:.+-]+ off, 0.000 mm, 0.0 mm/s, override 0/100 %", line
        )
        assert "\x1b" not in line
    times = [datetime.fromisoformat(line.split()[0]) for line in lines]
    assert times[0].year == 2000
    gaps_s = [(b - a).total_seconds() for a, b in pairwise(times)]
    assert gaps_s == pytest.approx([1.0, 1.0, 1.0], abs=0.002)


def test_watching_as_json(controller: Controller, clock: VirtualClock) -> None:
    documents = [json.loads(line) for line in watched(clock, ["--watch", "--json"], 3)]
    assert [set(d) for d in documents] == [KEYS | {"time"}] * 3
    syncs = [d["statistics"]["syncs"] for d in documents]
    assert [b - a for a, b in pairwise(syncs)] == pytest.approx([500, 500], abs=1)


@pytest.mark.parametrize("interval_ms", [250, 300, 1000])
def test_looks_are_an_interval_apart_from_the_first_on(
    controller: Controller, clock: VirtualClock, interval_ms: int
) -> None:
    words = ["--watch", "--json", "--interval", str(interval_ms / 1000)]
    documents = [json.loads(line) for line in watched(clock, words, 5)]
    times = [datetime.fromisoformat(document["time"]) for document in documents]
    gaps = [(b - a).total_seconds() for a, b in pairwise(times)]
    assert gaps == pytest.approx([interval_ms / 1000] * 4, abs=0.005)


def watched(clock: VirtualClock, options: list[str], count: int) -> list[str]:
    """The first lines of a watching command, which then ends well on Ctrl-C."""
    with running(clock, "status", *options) as child:
        limit_s = clock.now_s() + LIMIT_S
        while child.out.count("\n") < count:
            assert clock.now_s() < limit_s, child.out + child.err
            clock.sleep(0.01)
        child.signal(signal.SIGINT)
        assert child.wait(LIMIT_S) == 0
        assert child.err == ""
        return child.out.splitlines()


def test_watching_in_a_terminal(controller: Controller, clock: VirtualClock) -> None:
    main_end, child_end = pty.openpty()
    os.set_blocking(main_end, False)

    def start(environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "hodograph", "status", "--watch"],
            stdout=child_end,
            stderr=child_end,
            env={**os.environ, **environment},
        )

    child = clock.spawn("status", start)
    os.close(child_end)
    try:
        shown = until_shown(clock, main_end, b"Ctrl-C ends")
        clock.signal("status", child, signal.SIGINT)
        shown += until_shown(clock, main_end, b"\x1b[?1049l")
        assert clock.await_end("status", child, LIMIT_S) == 0
    finally:
        child.kill()
        child.wait()
        os.close(main_end)
    assert shown.startswith(b"\x1b[?1049h\x1b[?25l\x1b[H")
    assert f"node 1 on {controller.address}: off\x1b[K".encode() in shown
    assert shown.rstrip().endswith(b"\x1b[?25h\x1b[?1049l")


def until_shown(clock: VirtualClock, descriptor: int, words: bytes) -> bytes:
    shown = b""
    limit_s = clock.now_s() + LIMIT_S
    while words not in shown:
        assert clock.now_s() < limit_s, shown
        try:
            shown += os.read(descriptor, 4096)
        except BlockingIOError:
            clock.sleep(0.01)
    return shown


@pytest.fixture
def lonely_controller(hub: LocalHub, clock: VirtualClock) -> Iterator[Controller]:
    """A controller without any drive, configured."""
    machine = load_machine(PAPER_ALPHA)
    child = Process("controller-1", controller_command(machine, hub.address, "real-time"), clock)
    try:
        with connect(hub.address, machine.node, machine.bitrate) as controller:
            controller.require(5.0)
            controller.configure(machine, "fixed")
            yield controller
    finally:
        child.end()


def test_why_boot_does_not_end(
    lonely_controller: Controller, clock: VirtualClock, capsys: pytest.CaptureFixture[str]
) -> None:
    begun_s = clock.now_s()
    while (found := status(capsys))["boot_trouble"] is None:
        assert clock.now_s() < begun_s + LIMIT_S
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
