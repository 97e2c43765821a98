# SPDX-License-Identifier: MIT
"""A day of an operator by commands only: from upload to a fault, its text, its reset, and further programs. Run by
pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from bench import PAPER_ALPHA, MakeAlpha
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import Process, controller_command, drive_command
from hodograph.bus.sdo.controller import connect
from hodograph.cli.main import main
from hodograph.config import load_machine

LIMIT_S = 60.0
OVERLOAD = 0x2310
RULES = f"fault code=0x{OVERLOAD:04X} node=3 at=4000\n"
"""Drive y finds its motor overloaded 4000 SYNCs into the motion, as a jammed axis would make it."""


@pytest.fixture
def machine_with_a_weak_drive(hub: LocalHub, clock: VirtualClock, tmp_path: Path) -> Iterator[None]:
    """A controller and drives that nobody has spoken to; axis y will report an overload."""
    machine = load_machine(PAPER_ALPHA)
    rules = tmp_path / "rules"
    rules.write_text(RULES)
    with ExitStack() as stack:
        drives = [*drive_command(machine, hub.address), "--faults", str(rules)]
        controller = controller_command(machine, hub.address, "real-time")
        for name, command in (("drives", drives), ("controller-1", controller)):
            stack.callback(Process(name, command, clock).end)
        node = stack.enter_context(connect(hub.address, machine.node, machine.bitrate))
        node.require(5.0)
        yield


Say = Callable[..., str]


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Say:
    """Types a command that has to succeed; what it prints."""

    def typed(*words: str) -> str:
        capsys.readouterr()
        status = main(words)
        out, err = capsys.readouterr()
        assert status == 0, f"{words}: {err}"
        return out

    return typed


def status(say: Say) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(say("status", "--json"))
    return found


Until = Callable[[str], dict[str, Any]]


@pytest.fixture
def until(say: Say, clock: VirtualClock) -> Until:
    """Asks for the status until it names this state."""

    def asked(state: str) -> dict[str, Any]:
        limit_s = clock.now_s() + LIMIT_S
        while (found := status(say))["state"] != state:
            assert clock.now_s() < limit_s, found
            clock.sleep(0.1)
        return found

    return asked


@pytest.mark.usefixtures("machine_with_a_weak_drive")
def test_a_day(
    say: Say, until: Until, alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(alpha_at(10))  # 10 s
    assert "CRC-32" in say("upload", path)
    loaded = until("off")
    assert loaded["program"]["state"] == "ready"
    assert loaded["axes"][0]["state"] == "switch on disabled"

    assert say("goto", path).startswith("at (0, ")
    assert say("start") == "running\n"
    moving = until("running")
    assert [axis["state"] for axis in moving["axes"]] == ["operation enabled"] * 2

    assert say("hold") == "held\n"
    held = status(say)
    assert (held["state"], held["motion"]["feed_mm_s"]) == ("held", 0)
    assert "held" in say("status")

    assert say("override", "150") == "override 150 %\n"
    assert status(say)["override"]["wanted_percent"] == 150
    assert say("resume") == "running\n"

    failed = until("fault")
    fault = failed["fault"]
    assert (fault["code"], fault["node"]) == (OVERLOAD, 3)
    assert "overload" in fault["text"]
    assert "lower feed" in fault["remedy"]
    assert failed["axes"][1]["error_code"] == OVERLOAD
    assert failed["axes"][1]["error"] == fault["text"]
    assert 0 < failed["motion"]["arc_length_mm"] < failed["program"]["length_mm"]
    words = say("status")
    assert f"{fault['text']} (code 0x2310, node 3" in words
    assert f"{fault['remedy']}; then hodograph reset" in words

    capsys.readouterr()
    assert main(["start"]) == 5
    refused = capsys.readouterr().err
    assert "overload" in refused
    assert "hodograph reset" in refused

    say("reset")
    well = until("off")
    assert well["fault"] is None
    assert [axis["error"] for axis in well["axes"]] == [None, None]

    say("override", "200")
    say("goto", path)
    assert say("start", "--follow") == "done\n"
    done = status(say)
    assert done["state"] == "ready"
    assert done["motion"]["arc_length_mm"] == pytest.approx(done["program"]["length_mm"])
    assert say("stop", "--off").endswith("drives off\n")
    assert status(say)["state"] == "off"
