# SPDX-License-Identifier: MIT
"""Home, quick stop, reset; messages of commands while they wait. Run by pytest; starts a controller, drives and
`hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bench import EXAMPLES, PAPER_ALPHA, MakeAlpha, MakeBench
from commands import running
from hodograph.bus.clock import VirtualClock
from hodograph.bus.sdo.controller import FAULT_STATE, HELD, OFF, READY, RUNNING, Controller
from hodograph.bus.sdo.objects import ACTUAL, HOMED
from hodograph.cli.main import main

ALPHA = str(EXAMPLES / "alpha.toml")
LIMIT_S = 30.0
INCREMENT_COUNTS = 10
"""An increment of the encoders, 9.5 nm, in counts of 1 nm."""


def homing_machine(folder: Path, *methods: str) -> Path:
    text = PAPER_ALPHA.read_text().replace("../drives", f"{EXAMPLES}/drives")
    head, *axes = text.split("[[axis]]")
    file = folder / "machine.toml"
    tables = [f"{axis}\n{method}\n" for axis, method in zip(axes, methods, strict=True)]
    file.write_text("[[axis]]".join([head, *tables]))
    return file


def actual_counts(controller: Controller) -> list[int]:
    return [controller.read(ACTUAL, axis) for axis in (1, 2)]


def test_home_without_a_method(make_bench: MakeBench, capsys: pytest.CaptureFixture[str]) -> None:
    controller = make_bench().controller
    assert main(["home"]) == 5
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
    controller = make_bench(file=file).controller
    assert main(["home", str(file)]) == 0
    assert capsys.readouterr().out == "homed: node 2; drives off\n"
    assert actual_counts(controller) == [0, 0]  # it passed home slowly, and rests there
    assert controller.read(HOMED, 1) == 1
    assert controller.read(HOMED, 2) == 0


def test_home_here(
    make_bench: MakeBench, clock: VirtualClock, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Methods 37 and 35: where the axes stand is the home offset; the drives are switched off for it."""
    controller = make_bench().controller
    begun_s = clock.now_s()
    assert main(["goto", ALPHA, "--to", "3", "4"]) == 0
    assert controller.state() == READY
    while actual_counts(controller) != pytest.approx([3_000_000, 4_000_000], abs=INCREMENT_COUNTS):
        assert clock.now_s() < begun_s + 10.0
        clock.sleep(0.01)
    file = homing_machine(
        tmp_path,
        "[axis.homing]\nmethod = 37\noffset_mm = -12.5",
        "[axis.homing]\nmethod = 35\noffset_mm = 0.25",
    )
    capsys.readouterr()
    assert main(["home", str(file)]) == 0
    assert capsys.readouterr().out == "homed: nodes 2, 3; drives off\n"
    assert controller.state() == OFF
    assert [controller.read(HOMED, axis) for axis in (1, 2)] == [1, 1]
    # It is never quite at rest at an increment, and coasts to another when it is switched off.
    assert actual_counts(controller) == pytest.approx(
        [-12_500_000, 250_000], abs=2 * INCREMENT_COUNTS
    )
    assert main(["goto", ALPHA, "--machine", str(file)]) == 0


@pytest.mark.parametrize("after_s", [0.1, 0.5, 1.0, 5.0, 9.5])
def test_quick_stop(
    make_bench: MakeBench,
    alpha_at: MakeAlpha,
    clock: VirtualClock,
    capsys: pytest.CaptureFixture[str],
    after_s: float,
) -> None:
    """In any part of the path: while it speeds up, at full feed, and just before its end."""
    controller = make_bench().controller
    slow = str(alpha_at(10))
    assert main(["goto", slow]) == 0
    assert main(["start"]) == 0
    clock.sleep(after_s)
    assert controller.state() == RUNNING
    assert main(["quick-stop"]) == 0
    assert capsys.readouterr().out.endswith("stopped by the drives, drives off\n")
    assert controller.state() == OFF
    assert main(["start"]) == 5
    assert "away from the program's start" in capsys.readouterr().err
    assert main(["goto", slow]) == 0


FailAfter = Callable[[float], Controller]


@pytest.fixture
def fail_after(make_bench: MakeBench, alpha_at: MakeAlpha, clock: VirtualClock) -> FailAfter:
    """Makes a machine whose drives fell silent so long after the start, and speak again."""

    def make(seconds: float) -> Controller:
        controller: Controller = make_bench().controller
        assert main(["goto", str(alpha_at(10))]) == 0
        assert main(["start"]) == 0
        clock.sleep(seconds)
        clock.suspend("drives")
        assert controller.wait_for((FAULT_STATE,), LIMIT_S) == FAULT_STATE
        clock.resume("drives")
        return controller

    return make


@pytest.mark.parametrize("after_s", [0.0, 0.5, 4.0])
def test_reset(fail_after: FailAfter, capsys: pytest.CaptureFixture[str], after_s: float) -> None:
    controller = fail_after(after_s)
    assert main(["start"]) == 5
    refused = capsys.readouterr().err
    assert "refused: expected PDOs were not received (code 0x8250, node 2," in refused
    assert refused.endswith("; then hodograph reset\n")
    assert main(["reset"]) == 0
    assert capsys.readouterr().out == "ready to be started\n"
    assert controller.state() == OFF
    assert main(["reset"]) == 0
    assert "no fault was present" in capsys.readouterr().err
    assert main(["goto", ALPHA]) == 0


@pytest.mark.parametrize("after_s", [0.5, 4.0])
def test_start_with_reset(
    fail_after: FailAfter, capsys: pytest.CaptureFixture[str], after_s: float
) -> None:
    controller = fail_after(after_s)
    assert main(["start", "--reset"]) == 5
    assert "away from the program's start" in capsys.readouterr().err
    assert controller.state() == READY


def test_start_with_reset_where_the_program_starts(fail_after: FailAfter) -> None:
    """The drives fell silent before the axes had moved."""
    controller = fail_after(0.0)
    assert main(["start", "--reset"]) == 0
    assert controller.wait_for((READY,), LIMIT_S) == READY


def test_hold_waits_as_long_as_braking_takes(
    make_bench: MakeBench,
    alpha_at: MakeAlpha,
    clock: VirtualClock,
    capsys: pytest.CaptureFixture[str],
) -> None:
    controller = make_bench().controller
    assert main(["goto", str(alpha_at(10))]) == 0
    assert main(["start"]) == 0
    clock.sleep(1.0)
    capsys.readouterr()
    assert main(["hold", "--timeout", "0.000001"]) == 4
    err = capsys.readouterr().err
    assert "is still holding after 1e-06 s" in err, err
    assert "it goes on braking" in err
    assert main(["hold"]) == 0
    assert controller.state() == HELD
    assert main(["hold", "--timeout", "-1"]) == 2


def test_follow_says_why_nothing_moves(
    make_bench: MakeBench, alpha_at: MakeAlpha, clock: VirtualClock
) -> None:
    controller = make_bench().controller
    assert main(["goto", str(alpha_at(20))]) == 0
    assert main(["override", "0"]) == 0
    with running(clock, "start", "--follow") as child:
        child.await_text(
            "the feed override is 0 %, nothing moves: hodograph override PERCENT", LIMIT_S
        )
        assert main(["override", "100"]) == 0
        assert controller.wait_for((RUNNING,), LIMIT_S) == RUNNING
        clock.sleep(1.0)
        assert main(["hold"]) == 0
        child.await_text("held: hodograph resume goes on", LIMIT_S)
        assert main(["resume"]) == 0
        assert child.wait(LIMIT_S) == 0
        assert child.out == "done\n"
        assert child.err.count("\n") == 2, child.err


def test_follow_reports_a_stop_before_the_end(
    make_bench: MakeBench, alpha_at: MakeAlpha, clock: VirtualClock
) -> None:
    controller = make_bench().controller
    assert main(["goto", str(alpha_at(20))]) == 0
    with running(clock, "start", "--follow") as child:
        assert controller.wait_for((RUNNING,), LIMIT_S) == RUNNING
        clock.sleep(1.0)
        assert main(["stop"]) == 0
        assert child.wait(LIMIT_S) == 6
        assert child.out == ""
        assert re.search(
            r"the program was stopped at \d+\.\d+ of 99\.942 mm, before its end", child.err
        )
