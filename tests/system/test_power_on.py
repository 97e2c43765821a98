# SPDX-License-Identifier: MIT
"""Power cycles of the controller, of the drives, of both: what is restored, what has to be homed, what is refused. Run
by pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, PAPER_ALPHA
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import Process, controller_command, drive_command
from hodograph.bus.sdo.controller import OFF, connect
from hodograph.cli.main import main
from hodograph.config import Machine, load_machine
from hodograph.errors import BusError
from marks import long

HANGS_S = 600.0  # of real time: none of these takes a second
ALPHA = str(EXAMPLES / "alpha.toml")
BOOT_S = 20.0
REFUSED = 5
HERE_IS_HOME = "[axis.homing]\nmethod = 37\n"


def machine_file(folder: Path, more_of_x: str = "", name: str = "machine") -> Path:
    """The alpha's machine, with more in the table of axis x."""
    text = PAPER_ALPHA.read_text().replace("../drives", f"{EXAMPLES}/drives")
    head, x, y = text.split("[[axis]]")
    file = folder / f"{name}.toml"
    file.write_text("[[axis]]".join([head, f"{x}\n{more_of_x}\n", y]))
    return file


class PowerBench:
    """A controller with a store that outlives it, and drives: each with a switch of its own."""

    def __init__(self, hub: LocalHub, clock: VirtualClock, folder: Path) -> None:
        self._hub, self.clock, self.folder = hub, clock, folder
        self.machine: Machine = load_machine(PAPER_ALPHA)
        self._running: dict[str, Process] = {}

    def drives_on(self, rules: str = "") -> None:
        command = drive_command(self.machine, self._hub.address)
        if rules:
            file = self.folder / "rules"
            file.write_text(rules)
            command += ["--faults", str(file)]
        self._running["drives"] = Process("drives", command, self.clock)

    def controller_on(self) -> None:
        command = controller_command(self.machine, self._hub.address, "real-time")
        command += ["--store", str(self.folder / "store")]
        self._running["controller"] = Process("controller-1", command, self.clock)
        with self.controller() as controller, suppress(BusError):  # of a node that is not 1
            controller.require(1.0)

    def off(self, name: str) -> None:
        process = self._running.pop(name)
        process.kill()
        process.end()

    def until_off(self) -> None:
        with self.controller() as controller:
            controller.wait_for((OFF,), BOOT_S)

    def controller(self) -> Any:
        return connect(self._hub.address, 1, self.machine.bitrate)

    def close(self) -> None:
        for process in reversed(self._running.values()):
            process.end()


@pytest.fixture
def bench(hub: LocalHub, clock: VirtualClock, tmp_path: Path) -> Iterator[PowerBench]:
    made = PowerBench(hub, clock, tmp_path)
    try:
        made.drives_on()
        made.controller_on()
        yield made
    finally:
        made.close()


Say = Callable[..., str]


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Say:
    """Types a command that has to end with `status`; what it prints on stdout, or, where it fails, on stderr."""

    def typed(*words: str, status: int = 0) -> str:
        capsys.readouterr()
        found = main(words)
        out, err = capsys.readouterr()
        assert found == status, f"{words}: {found}, {err}"
        return out if status == 0 else err

    return typed


def status(say: Say, *more: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(say("status", "--json", *more))
    return found


def homed(say: Say) -> list[bool]:
    return [axis["homed"] for axis in status(say)["axes"]]


# --- configuration ---


def test_stored_parameters_and_program_are_there_again(bench: PowerBench, say: Say) -> None:
    assert "stored" in say("configure", ALPHA, "--store")
    say("upload", ALPHA)
    before = status(say)
    bench.off("controller")
    bench.controller_on()
    bench.until_off()
    after = status(say)
    assert after["configuration"]["state"] == "restored"
    assert after["configuration"]["stored"] == "whole"
    for key in ("crc32", "stored_crc32", "program_crc32"):
        assert after["configuration"][key] == before["configuration"]["crc32"], key
    assert after["program"] == before["program"]
    assert "restored after power-on" in say("status")
    assert say("start", "--follow") == "done\n"


def test_a_program_without_its_configuration_does_not_run(bench: PowerBench, say: Say) -> None:
    say("upload", ALPHA)
    bench.off("controller")
    bench.controller_on()
    bench.until_off()
    found = status(say)
    assert found["program"]["state"] == "ready"
    assert found["configuration"]["state"] == "none"
    for words in (["start"], ["home"]):
        assert "hodograph configure FILE" in say(*words, status=REFUSED)
    assert "none since power-on: hodograph configure FILE" in say("status")
    say("configure", ALPHA)
    assert say("start", "--follow") == "done\n"


def test_another_machine_file_holds_until_power_off(
    bench: PowerBench, say: Say, tmp_path: Path
) -> None:
    """Two in turn: the stored one comes back; a program is checked under the one that holds."""
    slow = tmp_path / "slow.toml"
    text = machine_file(tmp_path).read_text()
    slow.write_text(text.replace("feed_mm_s = 500 ", "feed_mm_s = 50 "))
    say("configure", ALPHA, "--store")
    say("upload", ALPHA)
    say("configure", str(slow))
    assert "another one is stored" in say("status")
    assert "not within the limits" in say("start", status=REFUSED)
    say("stop", "--off")
    bench.off("controller")
    bench.controller_on()
    bench.until_off()
    assert status(say)["configuration"]["state"] == "restored"
    assert say("start", "--follow") == "done\n"


def test_what_is_forgotten_does_not_come_back(bench: PowerBench, say: Say) -> None:
    say("configure", ALPHA, "--store")
    assert say("configure", "--forget") == "nothing is stored any more\n"
    found = status(say)["configuration"]
    assert (found["state"], found["stored"]) == ("confirmed", "defaults")
    bench.off("controller")
    bench.controller_on()
    assert status(say)["configuration"]["state"] == "none"


@pytest.mark.parametrize(
    ("steps", "runs", "says"),
    [
        (0, False, "hodograph configure FILE"),
        (1, False, "no program"),
        (2, True, "restored"),
        (3, True, "restored"),
        (4, False, "not within the limits"),
        (5, True, "restored"),
        (6, False, "hodograph configure FILE"),
    ],
)
def test_a_power_cycle_between_any_two_steps(
    bench: PowerBench, say: Say, tmp_path: Path, steps: int, runs: bool, says: str
) -> None:
    """What runs afterwards is a program within the limits that hold, or nothing."""
    slow = tmp_path / "slow.toml"
    slow.write_text(
        machine_file(tmp_path).read_text().replace("feed_mm_s = 500 ", "feed_mm_s = 50 ")
    )
    each = (
        ("configure", ALPHA, "--store"),
        ("upload", ALPHA),
        ("configure", str(slow)),
        ("configure", str(slow), "--store"),
        ("upload", ALPHA, "--machine", str(slow)),
        ("configure", "--forget"),
    )
    for words in each[:steps]:
        say(*words)
    bench.off("controller")
    bench.controller_on()
    bench.until_off()
    if not runs:
        assert says in say("start", status=REFUSED)
        return
    assert status(say)["configuration"]["state"] == says
    assert say("start", "--follow") == "done\n"


def test_stored_with_the_drives_off_only(bench: PowerBench, say: Say) -> None:
    say("configure", ALPHA)
    with bench.controller() as controller:
        controller.enable()
    assert "hodograph stop --off first" in say("configure", "--store", status=REFUSED)
    say("stop", "--off")
    assert say("configure", "--store") == "stored\n"


@pytest.mark.parametrize(
    "words", [["configure"], ["configure", ALPHA, "--forget"], ["configure", "--set-node", "128"]]
)
def test_configure_without_sense(bench: PowerBench, say: Say, words: list[str]) -> None:
    assert say(*words, status=2)


def test_a_stored_node_number(bench: PowerBench, say: Say) -> None:
    assert "5 after the next power-on" in say("configure", "--set-node", "5")
    assert status(say)["node"] == 1
    bench.off("controller")
    bench.controller_on()
    assert status(say, "--node", "5")["node"] == 5
    assert "the board's own after the next power-on" in say(
        "configure", "--node", "5", "--set-node", "0"
    )
    bench.off("controller")
    bench.controller_on()
    assert status(say)["node"] == 1


@pytest.mark.parametrize("file", sorted(PAPER_ALPHA.parent.glob("*.toml")), ids=lambda f: f.stem)
def test_host_and_controller_have_the_same_crc(bench: PowerBench, file: Path) -> None:
    """Whatever was configured before: from each to each, and what is there already costs no write."""
    bench.off("drives")
    with bench.controller() as controller:
        for machine in (load_machine(PAPER_ALPHA), load_machine(file)):
            controller.configure(machine, "float")
            assert controller.configuration_crc() is not None
            assert not controller.configure(machine, "float")
        assert controller.configure(load_machine(file), "fixed")


def test_a_store_file_that_is_none(bench: PowerBench, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong"
    wrong.write_text("no store")
    command = controller_command(bench.machine, bench._hub.address, "real-time")
    for file, words in (
        (wrong, "is no store of this controller"),
        (tmp_path / "store", "another controller uses this file"),
        (tmp_path / "nowhere" / "store", "No such file"),
    ):
        process = Process("controller-2", [*command, "--store", str(file)])
        process.child.wait(HANGS_S)
        assert process.child.returncode == 1
        assert words in process.text()
        process.end()
    assert wrong.read_text() == "no store"


# --- identity ---


def test_a_drive_of_another_identity(bench: PowerBench, say: Say, tmp_path: Path) -> None:
    other = machine_file(tmp_path, "[axis.identity]\nproduct = 0x15\n")
    say("upload", ALPHA, "--machine", str(other))
    bench.clock.sleep(1.0)
    trouble = status(say)["boot_trouble"]
    assert (trouble["node"], trouble["index"], trouble["sub"]) == (2, 0x1018, 2)
    for words in (trouble["text"], say("start", status=4)):
        assert (
            "the drive at node 2 has 0x2 in object 0x1018 sub 2 (identity), expected is 0x15"
            in words
        )
    right = machine_file(tmp_path, "[axis.identity]\nproduct = 2\nrevision = 0x10000\n", "right")
    say("upload", ALPHA, "--machine", str(right))
    bench.until_off()


# --- homing ---


def test_nothing_moves_before_it_is_homed(bench: PowerBench, say: Say, tmp_path: Path) -> None:
    machine = ("--machine", str(machine_file(tmp_path, HERE_IS_HOME)))
    assert "not homed" in say("goto", str(machine[1]), "--to", "1", "1", status=REFUSED)
    say("stop", "--off")
    say("upload", ALPHA, *machine)
    assert "hodograph home" in say("start", status=REFUSED)
    assert "not homed (a start needs it" in say("status")
    say("home")
    assert homed(say) == [True, False]
    assert say("start", "--follow") == "done\n"
    assert status(say)["unhomed_nodes"] == []


def test_on_purpose(bench: PowerBench, say: Say, tmp_path: Path) -> None:
    machine = ("--machine", str(machine_file(tmp_path, HERE_IS_HOME)))
    say("goto", ALPHA, *machine, "--unhomed")
    assert "not homed" in say("start", status=REFUSED)
    say("start", "--follow", "--unhomed")
    assert status(say)["unhomed_nodes"] == [2]
    assert "node 2 when this program was started (--unhomed)" in say("status")
    assert "not homed" in say("run", ALPHA, *machine, status=REFUSED)
    recording = tmp_path / "run.log"
    words = ("run", ALPHA, *machine, "--unhomed", "--record", str(recording), "--json")
    assert json.loads(say(*words))["unhomed_starts"] == 1
    replayed = json.loads(say("replay", str(recording), ALPHA, *machine, "--json"))
    assert replayed["unhomed_starts"] == 1


def test_a_fault_reset_keeps_the_zero(
    hub: LocalHub, clock: VirtualClock, tmp_path: Path, say: Say
) -> None:
    bench = PowerBench(hub, clock, tmp_path)
    machine = ("--machine", str(machine_file(tmp_path, HERE_IS_HOME)))
    try:
        bench.drives_on("fault code=0x2310 node=2 at=300\n")
        bench.controller_on()
        say("upload", ALPHA, *machine)
        say("home")
        say("start", "--follow", status=6)
        say("reset")
        assert homed(say) == [True, False]
        say("goto", ALPHA, *machine)
        assert say("start", "--follow") == "done\n"
    finally:
        bench.close()


@pytest.mark.parametrize("pause_s", [0.0, long(0.3), long(3.0)])
@pytest.mark.parametrize(
    "switched", [("drives",), ("controller",), ("drives", "controller")], ids="+".join
)
def test_power_cycles_cost_the_zero(
    bench: PowerBench, say: Say, tmp_path: Path, switched: tuple[str, ...], pause_s: float
) -> None:
    """Drives lose it; a new controller cannot know. What is stored is restored in each case."""
    file = str(machine_file(tmp_path, HERE_IS_HOME))
    say("configure", file, "--store")
    say("upload", ALPHA, "--machine", file)
    say("home")
    assert homed(say) == [True, False]
    for name in switched:
        bench.off(name)
    bench.clock.sleep(pause_s)
    if "drives" in switched:
        bench.drives_on()
    if "controller" in switched:
        bench.controller_on()
    bench.clock.sleep(1.0)
    bench.until_off()
    assert homed(say) == [False, False]
    assert "not homed" in say("start", status=REFUSED)
    say("stop", "--off")
    say("home")
    assert say("start", "--follow") == "done\n"


def test_drives_switched_while_they_run(bench: PowerBench, say: Say, tmp_path: Path) -> None:
    file = str(machine_file(tmp_path, HERE_IS_HOME))
    say("upload", ALPHA, "--machine", file)
    say("home")
    say("start")
    bench.clock.sleep(0.3)
    bench.off("drives")
    bench.clock.sleep(0.5)
    bench.drives_on()
    bench.clock.sleep(1.0)
    assert status(say)["state"] == "fault"
    say("reset")
    assert homed(say) == [False, False]
