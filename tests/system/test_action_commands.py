# SPDX-License-Identifier: MIT
"""Home, quick stop, reset; what commands say while they wait."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from bench import EXAMPLES, PAPER_ALPHA, Bench, MakeAlpha, MakeBench
from hodograph.bus.sdo.controller import FAULT_STATE, HELD, OFF, READY, RUNNING, Controller
from hodograph.bus.sdo.objects import ACTUAL, HOMED
from hodograph.cli.main import main

pytestmark = pytest.mark.bus

LIMIT_S = 240.0
HOLD, OVERRIDE_0, OVERRIDE_100 = ["hold"], ["override", "0"], ["override", "100"]


def command(arguments: list[str]) -> int:
    """With more patience than people have: the machine may be busy with other tests."""
    return main([*arguments, "--wait", "20"])


def until(controller: Controller, state: int, limit_s: float = LIMIT_S) -> None:
    deadline = time.monotonic() + limit_s
    while controller.state() != state:
        assert time.monotonic() < deadline, f"state {controller.state()}, not {state}"
        time.sleep(0.05)


def homing_machine(folder: Path, *methods: str) -> Path:
    text = PAPER_ALPHA.read_text().replace("../drives", f"{EXAMPLES}/drives")
    head, *axes = text.split("[[axis]]")
    file = folder / "machine.toml"
    tables = [f"{axis}\n{method}\n" for axis, method in zip(axes, methods, strict=True)]
    file.write_text("[[axis]]".join([head, *tables]))
    return file


def test_home_without_a_method(make_bench: MakeBench, capsys: pytest.CaptureFixture[str]) -> None:
    controller = make_bench("fast").controller
    assert command(["home"]) == 5
    assert "refused" in capsys.readouterr().err
    assert controller.state() == OFF


def test_home_at_a_switch(
    make_bench: MakeBench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Method 17: towards the negative limit switch 2 mm away, home where it goes off again."""
    drive = tmp_path / "x.toml"
    text = (EXAMPLES / "drives" / "alpha_x.toml").read_text()
    drive.write_text(f"{text}\n[equipment]\nlimit_negative_mm = -2\n")
    file = homing_machine(tmp_path, "[axis.homing]\nmethod = 17\nspeed_mm_s = 50", "")
    file.write_text(file.read_text().replace(f"{EXAMPLES}/drives/alpha_x.toml", str(drive)))
    controller = make_bench("real-time", file).controller
    assert command(["home", str(file)]) == 0
    assert capsys.readouterr().out == "homed: node 2; drives off\n"
    assert abs(controller.read(ACTUAL, 1)) < 200_000  # it passed home slowly
    assert controller.read(HOMED, 1) == 1
    assert controller.read(HOMED, 2) == 0


def _settled(controller: Controller) -> None:
    """Waits until the axes rest: homing where they stand counts what they still moved."""
    before: list[int] = []
    for _ in range(50):
        actual = [controller.read(ACTUAL, axis) for axis in (1, 2)]
        if actual == before:
            return
        before = actual
        time.sleep(0.2)
    raise AssertionError(f"the axes do not come to rest: {before}")


def test_home_here(
    make_bench: MakeBench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Methods 37 and 35: where the axes stand is the home offset; the drives are switched off for it."""
    controller = make_bench("real-time").controller
    assert command(["goto", str(EXAMPLES / "alpha.toml"), "--to", "3", "4"]) == 0
    assert controller.state() == READY
    _settled(controller)
    file = homing_machine(
        tmp_path,
        "[axis.homing]\nmethod = 37\noffset_mm = -12.5",
        "[axis.homing]\nmethod = 35\noffset_mm = 0.25",
    )
    capsys.readouterr()
    assert command(["home", str(file)]) == 0
    assert capsys.readouterr().out == "homed: nodes 2, 3; drives off\n"
    assert controller.state() == OFF
    assert [controller.read(HOMED, axis) for axis in (1, 2)] == [1, 1]
    actual = [controller.read(ACTUAL, axis) for axis in (1, 2)]
    # Two increments of 9.5 nm: between two readings it is never quite at rest, and it coasts when switched off.
    assert actual == pytest.approx([-12_500_000, 250_000], abs=20)
    assert command(["goto", str(EXAMPLES / "alpha.toml"), "--machine", str(file)]) == 0


def test_quick_stop(
    make_bench: MakeBench, alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str]
) -> None:
    controller = make_bench("real-time").controller
    slow = str(alpha_at(10))
    assert command(["goto", slow]) == 0
    assert command(["start"]) == 0
    time.sleep(1.0)
    assert command(["quick-stop"]) == 0
    assert capsys.readouterr().out.endswith("stopped by the drives, drives off\n")
    assert controller.state() == OFF
    assert command(["start"]) == 5  # away from the start
    assert command(["goto", slow]) == 0


@pytest.fixture
def faulty(make_bench: MakeBench, alpha_at: MakeAlpha) -> Bench:
    """A machine whose drives fell silent in motion, and speak again."""
    bench = make_bench("real-time")
    slow = str(alpha_at(10))
    assert command(["goto", slow]) == 0
    assert command(["start"]) == 0
    time.sleep(0.5)
    drives = bench.rig.process_ids[0]
    os.kill(drives, signal.SIGSTOP)
    try:
        until(bench.controller, FAULT_STATE)
    finally:
        os.kill(drives, signal.SIGCONT)
    return bench


def test_reset(faulty: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["start"]) in (5, 6)
    capsys.readouterr()
    assert command(["reset"]) == 0
    assert capsys.readouterr().out == "ready to be started\n"
    assert faulty.controller.state() == OFF
    assert command(["reset"]) == 0
    assert "no fault was present" in capsys.readouterr().err
    assert command(["goto", str(EXAMPLES / "alpha.toml")]) == 0


def test_start_with_reset(faulty: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["start", "--reset"]) == 5
    assert "away from the program's start" in capsys.readouterr().err
    assert faulty.controller.state() == READY


def test_hold_waits_as_long_as_braking_takes(
    make_bench: MakeBench, alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str]
) -> None:
    controller = make_bench("real-time").controller
    assert command(["goto", str(alpha_at(10))]) == 0
    assert command(["start"]) == 0
    assert command(["hold", "--timeout", "0.000001"]) in (0, 4)
    err = capsys.readouterr().err
    assert not err or "it goes on braking" in err
    assert command(["hold"]) == 0
    assert controller.state() == HELD
    assert command(["hold", "--timeout", "-1"]) == 2


def test_follow_says_why_nothing_moves(make_bench: MakeBench, alpha_at: MakeAlpha) -> None:
    controller = make_bench("real-time").controller
    assert command(["goto", str(alpha_at(20))]) == 0
    assert command(OVERRIDE_0) == 0
    with subprocess.Popen(
        [sys.executable, "-m", "hodograph", "start", "--follow"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        assert child.stderr is not None
        killer = threading.Timer(LIMIT_S, child.kill)
        killer.start()
        said = child.stderr.readline()
        assert "the feed override is 0 %, nothing moves: hodograph override PERCENT" in said
        assert command(OVERRIDE_100) == 0
        until(controller, RUNNING)
        time.sleep(1.0)
        assert command(HOLD) == 0
        assert "held: hodograph resume goes on" in child.stderr.readline()
        assert command(["resume"]) == 0
        assert child.wait(LIMIT_S) == 0
        killer.cancel()
        assert child.stdout is not None
        assert child.stdout.read() == "done\n"
