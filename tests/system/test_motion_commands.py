# SPDX-License-Identifier: MIT
"""Hold, resume, override and start from a position, by the command on the bus. Run by pytest; starts a controller and
drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, PAPER_ALPHA, MakeAlpha, MakeBench
from hodograph.bus.clock import VirtualClock
from hodograph.bus.goto import require_inside_travel
from hodograph.bus.sdo.controller import (
    HELD,
    OFF,
    READY,
    RUNNING,
    CommandRefusedError,
    Controller,
)
from hodograph.bus.sdo.objects import ACTUAL, DISABLE, ENABLE, REFUSED_OUTSIDE_TRAVEL
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.errors import RefusedError


@pytest.fixture
def controller(make_bench: MakeBench) -> Controller:
    """A configured controller with its drives, off."""
    return make_bench().controller


@pytest.fixture
def slow(alpha_at: MakeAlpha) -> str:
    """The alpha at 10 mm/s: about 10 s."""
    return str(alpha_at(10))


def status(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["status", "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_hold_override_resume(
    controller: Controller, clock: VirtualClock, slow: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["hold"]) == 5
    assert main(["goto", slow]) == 0
    assert main(["start"]) == 0
    clock.sleep(1.0)
    assert main(["hold"]) == 0
    assert controller.state() == HELD
    held = status(capsys)
    assert held["state"] == "held"
    assert held["motion"]["feed_mm_s"] == 0
    assert held["override"] == {"wanted_percent": 100, "actual_percent": 0, "saturated": False}
    clock.sleep(0.3)
    assert status(capsys)["motion"]["arc_length_mm"] == held["motion"]["arc_length_mm"]
    assert main(["override", "50"]) == 0
    assert controller.state() == HELD
    assert main(["resume"]) == 0
    clock.sleep(1.0)
    half = status(capsys)
    assert half["override"]["actual_percent"] == 50
    assert math.isclose(half["motion"]["feed_mm_s"], 5, rel_tol=1e-3)
    assert main(["override", "201"]) == 2
    assert main(["override", "200"]) == 0
    assert controller.wait_for((READY,), 60.0) == READY
    assert math.isclose(
        status(capsys)["motion"]["arc_length_mm"], half["program"]["length_mm"], abs_tol=1e-9
    )


@pytest.mark.parametrize("after_s", [0.2, 1.5, 9.0])
def test_goes_on_where_it_was_stopped(
    controller: Controller,
    clock: VirtualClock,
    slow: str,
    capsys: pytest.CaptureFixture[str],
    after_s: float,
) -> None:
    assert main(["goto", slow]) == 0
    assert main(["start"]) == 0
    clock.sleep(after_s)
    assert main(["stop"]) == 0
    arc_mm = status(capsys)["motion"]["arc_length_mm"]
    assert arc_mm == pytest.approx(10 * after_s, rel=0.2)
    assert main(["start", "--from", f"{arc_mm + 1.0}"]) == 5
    assert main(["start", "--from", f"{arc_mm!r}"]) == 0
    assert controller.state() == RUNNING
    clock.sleep(0.1)
    assert main(["stop"]) == 0
    assert status(capsys)["motion"]["arc_length_mm"] > arc_mm


def test_no_drive_is_switched_on_outside_of_its_travel(
    make_bench: MakeBench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It would move to its software limit at once. An axis may stand there after a limit switch."""
    bench = make_bench()
    assert main(["goto", "--to", "40", "-30", str(PAPER_ALPHA)]) == 0
    assert main(["stop", "--off"]) == 0
    stands = bench.controller.targets(2)
    text = PAPER_ALPHA.read_text().replace('"../drives/', f'"{EXAMPLES}/drives/')
    narrow = tmp_path / "narrow.toml"
    narrow.write_text(text.replace("travel_mm = [-200, 200]", "travel_mm = [-35, 35]", 1))
    assert narrow.read_text() != text
    for words in (
        ["goto", "--to", "0", "0", str(narrow)],
        ["run", str(EXAMPLES / "alpha.toml"), "--machine", str(narrow)],
    ):
        capsys.readouterr()
        assert main(words) == 5
        assert re.search(
            r"axis x stands at (40|39\.9999|40\.0000)\d* mm, outside of its travel -35 to 35 mm by more than "
            r"start_tolerance_mm \(0\.005 mm\)",
            capsys.readouterr().err,
        )
        assert bench.controller.state() == OFF
        assert bench.controller.targets(2) == pytest.approx(stands, abs=1000)
    assert main(["goto", "--to", "0", "0", str(PAPER_ALPHA)]) == 0, "travel_mm is enlarged"


@pytest.mark.parametrize("side", [-1, 1])
def test_host_and_controller_have_one_tolerance(make_bench: MakeBench, side: int) -> None:
    """They agree to the count on the axes that may be switched on."""
    controller = make_bench().controller
    machine = load_machine(PAPER_ALPHA)
    first, *others = machine.axes
    tolerance = machine.start_tolerance_counts
    for beyond, allowed in ((tolerance - 1, True), (tolerance, True), (tolerance + 1, False)):
        at = controller.read(ACTUAL, 1)
        edge_mm = (at - side * beyond) / first.counts_per_unit
        low, high = (edge_mm, 300.0) if side < 0 else (-300.0, edge_mm)
        near = replace(first, travel_min_mm=low, travel_max_mm=high)
        moved = replace(machine, axes=(near, *others))
        controller.configure(moved, machine.kernel)
        assert controller.state_after_boot() == OFF
        assert controller.read(ACTUAL, 1) == at
        if allowed:
            require_inside_travel(controller, moved)
            controller.command(ENABLE)
            controller.wait_for((READY,), 5.0)
            controller.command(DISABLE)
            controller.wait_for((OFF,), 5.0)
            continue
        with pytest.raises(RefusedError, match=r"axis x stands at .* by more than start_tolerance"):
            require_inside_travel(controller, moved)
        with pytest.raises(CommandRefusedError) as refused:
            controller.enable()
        assert refused.value.reason == REFUSED_OUTSIDE_TRAVEL
        assert controller.state() == OFF
