# SPDX-License-Identifier: MIT
"""Outputs where no program runs: before the first move of a toolpath, at rests of a job, after its last move, and by
hand. Run by pytest; starts a controller, drives and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError

from bench import EXAMPLES, Bench, MakeBench
from commands import Command, running
from hodograph.bus.capture.decode import decode_outputs
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.run import RunSession, bring_up
from hodograph.bus.sdo.controller import OFF, READY, RUNNING
from hodograph.bus.sdo.node import IDENTITY_OBJECT, Node
from hodograph.bus.sdo.objects import (
    DISABLE,
    ENABLING,
    OUTPUTS,
    QUICK_STOP,
    STANDSTILL_OUTPUTS,
    STOP,
)
from hodograph.cli.bus_commands import stopping
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.config.outputs import Outputs
from hodograph.errors import RunError
from hodograph.events import OutputValues
from hodograph.job_run import BusCheck, execute_at_rest
from hodograph.toolpath.moves import SwitchedAtRest
from marks import long

SPINDLE, NEEDLE, VALVE = 0b100, 0b010, 0b001
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


def words(folder: Path, machine: Path, file: str, name: str = "stream") -> tuple[str, ...]:
    """The arguments of `run`, or of `stream` with a journal of its own."""
    more = ("--journal", str(folder / "stream.json")) if name == "stream" else ()
    return (file, "--machine", str(machine), *more)


def await_state(bench: Bench, state: int) -> None:
    while bench.controller.state() != state:
        bench.clock.sleep(0.001)


def ends_at_once(clock: VirtualClock, command: Command, text: str) -> None:
    """Within a second, with this in its message."""
    begun_s = clock.now_s()
    assert command.wait() == 6, command.err
    assert text in command.err
    assert clock.now_s() < begun_s + 1.0


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
    given = words(tmp_path, machine, job(tmp_path), name)
    with running(clock, name, *given, name=name) as command:
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
    file = job(tmp_path, JOB.replace("G4 P1", "G4 P20"))
    given = words(tmp_path, machine, file, name)
    with running(clock, name, *given, name=name) as process:
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


def test_an_error_before_the_first_move_switches_the_outputs_off(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    """Here standard input ends at a program stop. No axis has moved."""
    file = job(tmp_path, "F6000\nM3 S40\nM0\nG1 X6\nM30\n")
    with running(clock, "stream", *words(tmp_path, machine, file), name="stream") as command:
        assert SPINDLE in [one for one, _ in outputs_meanwhile(bench, clock, command)]
        assert command.wait() == 2, command.err
    clock.sleep(0.1)
    assert bench.controller.read(OUTPUTS, 1) == 0


def test_outputs_that_are_on_at_the_start_of_a_short_section_are_recorded(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    """The frame of the outputs is sent once in 64 ticks while they stay as they are."""
    file = job(tmp_path, "F6000\nM3 S40\nG4 P0.2\nG1 X0.01\nG4 P0.2\nG1 X0\nM30\n")
    assert main(["run", file, "--machine", str(machine)]) == 0


@pytest.mark.parametrize("command", [STOP, QUICK_STOP, DISABLE])
def test_a_stop_just_before_outputs_are_switched_ends_the_job(
    bench: Bench, command: int, machine: Path
) -> None:
    """The outputs that were switched on after it go off with the job."""
    at = RunSession(bench.controller, None, None)
    on = SwitchedAtRest(3, OutputValues(VALVE))

    def no_operator(_: str, __: BusCheck) -> None: ...

    def stopped() -> None:
        with stopping(at.controller), at.controller.ending_at_stops():
            bring_up(at, bench.machine, "fixed")
            at.controller.command(command)
            execute_at_rest(at, machine, [on], no_operator)

    with pytest.raises(RunError, match="a stop was commanded"):
        stopped()
    bench.clock.sleep(0.1)
    assert bench.controller.read(OUTPUTS, 1) == 0


def test_a_stop_while_the_drives_are_switched_on_ends_the_job(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    with running(clock, "run", job(tmp_path), "--machine", str(machine), name="run") as command:
        await_state(bench, ENABLING)
        bench.controller.command(STOP)
        ends_at_once(clock, command, "a stop was commanded")


def test_outputs_go_off_at_the_end_without_the_host(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    """It is killed when the controller has the whole job."""
    file = job(tmp_path, "F6000\nM64 P0\nG1 X2\nG4 P1\nG1 X4\nM30\n")
    with running(clock, "stream", *words(tmp_path, machine, file), name="stream") as command:
        while bench.controller.targets(1)[0] != 2_000_000:
            clock.sleep(0.05)
        clock.sleep(0.5)
        assert bench.controller.read(OUTPUTS, 1) == VALVE
        command.kill()
    await_state(bench, READY)
    clock.sleep(0.1)
    assert bench.controller.targets(1) == [4_000_000]
    assert bench.controller.read(OUTPUTS, 1) == 0


def test_drives_off_just_after_the_motion_end_a_stream_at_once(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    file = job(tmp_path, "F6000\nM64 P0\nG1 X2\nG4 P1\nM30\n")
    with running(clock, "stream", *words(tmp_path, machine, file), name="stream") as command:
        await_state(bench, RUNNING)
        await_state(bench, READY)
        bench.controller.command(DISABLE)
        ends_at_once(clock, command, "the drives")


def test_the_end_of_a_file_is_executed_where_it_ends(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path
) -> None:
    """Not at the start of the next one; its messages name its own file."""
    first, second = tmp_path / "first.ngc", tmp_path / "second.ngc"
    first.write_text("F6000\nG1 X6\nG4 P0.3\n(MSG,glue)\nM64 P0\nG4 P0.3\nM65 P0\nM30\n")
    second.write_text("F6000\nG4 P0.3\nG1 X2\nM30\n")
    given = words(tmp_path, machine, str(second))
    with running(clock, "stream", str(first), *given, name="stream") as command:
        seen = outputs_meanwhile(bench, clock, command)
        assert command.wait() == 0, command.err
        assert f"{first}:4: glue" in command.err
    assert seen == [(0, 0), (VALVE, 6000), (0, 6000)]
    assert bench.controller.targets(1) == [2_000_000]


@pytest.fixture
def old_firmware(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The controller is of minor version 1, which has no object 0x2058."""
    plain = Node._variable

    def variable(self: Node, index: int, sub: int | None) -> Any:
        if index == STANDSTILL_OUTPUTS:
            raise SdoAbortedError(0x06020000)
        if (index, sub) == (IDENTITY_OBJECT, 3):
            return SimpleNamespace(raw=0x00010001)
        return plain(self, index, sub)

    monkeypatch.setattr(Node, "_variable", variable)


@pytest.mark.usefixtures("old_firmware")
@pytest.mark.parametrize("off_at_end", [True, False])
def test_older_firmware_is_named_before_anything_moves(
    bench: Bench,
    machine: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    off_at_end: bool,
) -> None:
    """With both versions, and what to do."""
    other = tmp_path / "machine.toml"
    other.write_text(machine.read_text().replace("off_at_end = true", ""))
    own = machine if off_at_end else other
    commands = [
        ("run", job(tmp_path), "--machine", str(own)),
        ("stream", *words(tmp_path, own, job(tmp_path))),
        ("output", str(own), "valve=on"),
    ]
    for command in commands:
        assert main(command) == 5
        err = capsys.readouterr().err.splitlines()[-1]
        assert "has firmware version 1.1, and outputs that are switched or kept on" in err
        assert "need 1.2 or later: install the firmware of these host tools" in err
        assert bench.controller.targets(1) == [0]


ENDING = "F6000\nM64 P0\nG1 X6\nG4 P3\nM64 P1\nG4 P1\nM65 P0\nG4 P1\nM30\n"
"""With a dwell after the last move, and outputs after the dwell."""


@pytest.mark.parametrize(("files", "times"), [long(1, 1), (2, 2)])
def test_after_a_stop_in_the_last_dwell_the_rest_of_the_file_is_executed(
    bench: Bench, clock: VirtualClock, machine: Path, tmp_path: Path, files: int, times: int
) -> None:
    """Also after a second stop in it; of the last file, and of one that another one follows."""
    first, second = tmp_path / "first.ngc", tmp_path / "second.ngc"
    first.write_text(ENDING)
    second.write_text("F6000\nG1 X2\nM30\n")
    given = words(tmp_path, machine, str(second))[files == 1 :]
    arguments = (str(first), *given)
    for _ in range(times):
        with running(clock, "stream", *arguments, name="stream") as command:
            while not bench.controller.read(OUTPUTS, 1):
                assert command.child.poll() is None, command.err
                clock.sleep(0.01)
            clock.sleep(1.5)  # in the dwell
            assert bench.controller.targets(1) == [6_000_000]
            bench.controller.command(STOP)
            assert command.wait() == 6, command.err
        clock.sleep(0.1)
        assert bench.controller.read(OUTPUTS, 1) == 0
        arguments = ("--continue", *given[-2:])
    with running(clock, "stream", *arguments, name="stream") as command:
        seen = outputs_meanwhile(bench, clock, command)
        assert command.wait() == 0, command.err
    assert seen[:-1] == [(state, 6000) for state in (0, VALVE, VALVE | NEEDLE, NEEDLE)]
    assert seen[-1][0] == 0  # at the end of the job, or with the move to the second file
    assert bench.controller.targets(1) == [2_000_000 if files == 2 else 6_000_000]


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
    printed = capsys.readouterr().out.split()
    assert printed == ["valve", "on", "needle", "off", "laser", "off", "power", "50", "%"]
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


@pytest.fixture
def two_bytes(machine: Path, tmp_path: Path) -> Path:
    """The machine with a module of 16 digital outputs, the needle in the second byte."""
    file = tmp_path / "two_bytes.toml"
    file.write_text(
        machine.read_text().replace("needle = { digital = 1 }", "needle = { digital = 9 }")
    )
    return file


@pytest.mark.parametrize("minor", [2, 3])
def test_outputs_of_one_command_switch_in_one_frame(
    make_bench: MakeBench,
    two_bytes: Path,
    monkeypatch: pytest.MonkeyPatch,
    minor: int,
) -> None:
    """Firmware of minor version 2 takes them one by one, the analogue one first."""
    bench = make_bench(file=two_bytes)
    if minor == 2:
        plain = Node._put

        def put(self: Node, index: int, sub: int | None, value: int) -> None:
            if (index, sub) == (STANDSTILL_OUTPUTS, 7):
                raise SdoAbortedError(0x06090011)
            plain(self, index, sub, value)

        monkeypatch.setattr(Node, "_put", put)
    outputs = load_outputs(two_bytes)
    with Recorder(bench.bus) as recorder:
        assert main(["output", str(two_bytes), "valve=on", "needle=on", "power=50"]) == 0
        bench.clock.sleep(0.2)
    rows = decode_outputs(recorder.frames(), outputs)
    found = list(zip(rows["digital"].tolist(), rows["analogue"][:, 0].tolist(), strict=True))
    states = [one for i, one in enumerate(found) if i == 0 or found[i - 1] != one]
    last = (VALVE | 1 << 9, 16384)
    assert states == ([(0, 0), last] if minor == 3 else [(0, 0), (0, 16384), (VALVE, 16384), last])


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
