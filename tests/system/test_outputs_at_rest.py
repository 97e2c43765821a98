# SPDX-License-Identifier: MIT
"""Outputs where no program runs: before the first move of a toolpath, at rests of a job, after its last move, and by
hand. Run by pytest; starts a controller, drives and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench import EXAMPLES, Bench, MakeBench
from commands import Command, running
from hodograph.bus.clock import VirtualClock
from hodograph.bus.sdo.controller import OFF, READY
from hodograph.bus.sdo.objects import OUTPUTS, QUICK_STOP, STOP
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.config.outputs import Outputs

SPINDLE, VALVE = 0b100, 0b001
"""Digital outputs of dispenser.toml."""
JOB = """F6000
M3 S40
G4 P1
M64 P0
G1 X6
G4 P0.5
M65 P0
G1 X12
G4 P0.5
M64 P0
G4 P0.5
M30
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dispenser, with outputs that go off at the end."""
    file = tmp_path_factory.mktemp("machine") / "machine.toml"
    text = (EXAMPLES / "machines" / "dispenser.toml").read_text()
    text = text.replace("../drives", str(EXAMPLES / "drives"))
    file.write_text(text.replace("node = 16\n", "node = 16\noff_at_end = true\n"))
    assert load_outputs(file).off_at_end
    return file


def load_outputs(file: Path) -> Outputs:
    outputs = load_machine(file).outputs
    assert outputs is not None
    return outputs


@pytest.fixture
def bench(make_bench: MakeBench, machine: Path) -> Bench:
    return make_bench(file=machine)


def job(folder: Path, text: str = JOB) -> str:
    file = folder / "part.ngc"
    file.write_text(text)
    return str(file)


def outputs_meanwhile(bench: Bench, clock: VirtualClock, command: Command) -> list[tuple[int, int]]:
    """Digital outputs and position of the first axis in um, each time one of the outputs has changed."""
    found: list[tuple[int, int]] = []
    while command.child.poll() is None:
        now = bench.controller.read(OUTPUTS, 1)
        if not found or found[-1][0] != now:
            found.append((now, bench.controller.targets(1)[0] // 1000))
        clock.sleep(0.01)
    return found


@pytest.mark.parametrize("name", ["run", "stream"])
def test_the_spindle_turns_before_the_axes_move(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path, name: str
) -> None:
    more = ("--journal", str(tmp_path / "stream.json")) if name == "stream" else ()
    words = (job(tmp_path), "--machine", str(machine), *more)
    with running(clock, name, *words, name=name) as command:
        seen = outputs_meanwhile(bench, clock, command)
        assert command.wait() == 0, command.err
    assert [one for one, _ in seen[:5]] == [0, SPINDLE, SPINDLE | VALVE, SPINDLE, SPINDLE | VALVE]
    clock.sleep(0.1)
    assert bench.controller.read(OUTPUTS, 1) == 0  # M30, then the end of the job
    places_um = [at for _, at in seen]
    assert places_um[:2] == [0, 0]
    assert places_um[4] == 12000
    assert 6000 <= places_um[3] < 7000  # with the first setpoint after the dwell
    assert bench.controller.read(OUTPUTS, 3) == 0


@pytest.mark.parametrize("command", [STOP, QUICK_STOP])
@pytest.mark.parametrize("name", ["run", "stream"])
def test_a_stop_in_the_dwell_before_the_first_move_ends_the_job(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path, name: str, command: int
) -> None:
    more = ("--journal", str(tmp_path / "stream.json")) if name == "stream" else ()
    file = job(tmp_path, JOB.replace("G4 P1", "G4 P20"))
    with running(clock, name, file, "--machine", str(machine), *more, name=name) as process:
        while not bench.controller.read(OUTPUTS, 1):
            clock.sleep(0.05)
        clock.sleep(1.0)
        bench.controller.command(command)
        clock.sleep(0.1)
        assert bench.controller.read(OUTPUTS, 1) == 0
        assert process.wait() == 6, process.err
        if command == STOP:
            assert "a stop was commanded while the axes stood: the job ends here" in process.err
            assert bench.controller.state() == READY
    assert bench.controller.targets(1) == [0]


def test_a_stop_in_a_dwell_of_a_run_ends_it(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    """The next section is not started, whenever the stop comes; `stop` reports standing axes."""
    file = job(tmp_path, JOB.replace("G4 P0.5", "G4 P20"))
    with running(clock, "run", file, "--machine", str(machine), name="run") as process:
        while bench.controller.targets(1)[0] != 6_000_000:
            clock.sleep(0.05)
        clock.sleep(2.0)
        assert bench.controller.read(OUTPUTS, 1) == SPINDLE | VALVE
        assert main(["stop"]) == 0
        clock.sleep(0.1)
        assert bench.controller.read(OUTPUTS, 1) == 0
        assert process.wait() == 6, process.err
    assert bench.controller.targets(1) == [6_000_000]


def test_switching_by_hand(
    bench: Bench,
    clock: VirtualClock,
    machine: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert bench.controller.state() == OFF
    assert main(["output", str(machine), "--json"]) == 0
    assert bench.controller.state() == OFF  # printing switches nothing on
    off = {"valve": False, "needle": False, "laser": False, "power": 0.0}
    assert json.loads(capsys.readouterr().out) == off
    assert main(["output", str(machine), "valve=on", "power=50"]) == 0
    words = capsys.readouterr().out.split()
    assert words == ["valve", "on", "needle", "off", "laser", "off", "power", "50", "%"]
    clock.sleep(0.1)
    assert (bench.controller.read(OUTPUTS, 1), bench.controller.read(OUTPUTS, 3)) == (VALVE, 16384)
    assert main(["output", str(machine), "power=0", "needle=on"]) == 0
    clock.sleep(0.1)
    assert (bench.controller.read(OUTPUTS, 1), bench.controller.read(OUTPUTS, 3)) == (0b011, 0)
    assert main(["stop"]) == 0
    clock.sleep(0.1)
    assert bench.controller.read(OUTPUTS, 1) == 0
    file = job(tmp_path, "F600\nG1 X10\nM2\n")
    with running(clock, "run", file, "--machine", str(machine), name="run"):
        while bench.controller.targets(1)[0] < 2_000_000:
            clock.sleep(0.05)
        assert main(["output", str(machine), "valve=on"]) == 5
    assert bench.controller.read(OUTPUTS, 1) == 0


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("spindle=on", 'the machine has no output "spindle"; it has valve, needle, laser, power'),
        ("valve=1", "valve is a digital output: give valve=on or valve=off"),
        ("valve", "valve is a digital output: give valve=on or valve=off"),
        ("power=on", "power is an analogue output: give power=NUMBER"),
        ("power=nan", "power is an analogue output: give power=NUMBER"),
        ("power=101", "101 % of output power is 33095 on the bus"),
    ],
)
def test_wrong_assignments(
    machine: Path, given: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["output", str(machine), "valve=on", given]) == 2
    assert text in capsys.readouterr().err


def test_a_machine_without_outputs_has_none_to_switch(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["output", str(EXAMPLES / "machines" / "mill.toml"), "valve=on"]) == 2
    assert "has no [outputs]" in capsys.readouterr().err
