# SPDX-License-Identifier: MIT
"""Commands on the bus: refusals leave everything as it was, Ctrl-C leaves the axes standing. Run by pytest; starts a
controller, drives and `hodograph` on a local bus.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
from collections.abc import Callable, Iterator
from dataclasses import astuple
from pathlib import Path
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoCommunicationError
from canopen_bench import program

from bench import EXAMPLES, MakeBench
from commands import Command, running
from hodograph.bus.clock import VirtualClock
from hodograph.bus.goto import line_image
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import END_S
from hodograph.bus.sdo import actions
from hodograph.bus.sdo.controller import OFF, READY, RUNNING, Controller, connect
from hodograph.bus.sdo.objects import HOLD, PROGRAM_MEMORY
from hodograph.cli.main import main
from hodograph.errors import BusError, RefusedError
from hodograph.pipeline import load_pipeline
from hodograph.program.image import LARGEST_BANK, RECORD_BYTES
from marks import long

ALPHA = EXAMPLES / "alpha.toml"
LIMIT_S = 60.0
Start = Callable[[], Command]


def status_line(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    status = main(arguments)
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return status, err.splitlines()[-1] if err else ""


def test_no_node(hub: LocalHub, clock: VirtualClock, capsys: pytest.CaptureFixture[str]) -> None:
    begun_s = clock.now_s()
    status, line = status_line(capsys, "status", "--wait", "0.5")
    assert status == 4
    assert f"no answer from node 1 on {hub.address} in 0.5 s: start the controller" in line
    assert clock.now_s() - begun_s == pytest.approx(0.5, abs=0.001)


def test_refusals(controller: Controller, capsys: pytest.CaptureFixture[str]) -> None:
    status, line = status_line(capsys, "start")
    assert (status, "no program is loaded" in line) == (5, True), line
    assert main(["goto", str(ALPHA), "--to", "5", "5"]) == 0
    capsys.readouterr()
    assert main(["upload", str(ALPHA), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert main(["status", "--json"]) == 0
    assert reported["program"] == json.loads(capsys.readouterr().out)["program"]
    assert (reported["node"], reported["bytes"]) == (1, reported["program"]["size"])
    status, line = status_line(capsys, "start")
    assert (status, "away from the program's start: hodograph goto" in line) == (5, True), line
    status, line = status_line(capsys, "goto", str(ALPHA), "--to", "500", "0")
    assert (status, "outside the travel" in line) == (2, True), line
    assert controller.state() == READY


@pytest.mark.parametrize("spoil", ["cut", "bit", "limits", "empty header"])
def test_spoilt_upload_keeps_the_old_program(controller: Controller, spoil: str) -> None:
    image = load_pipeline(ALPHA).image
    controller.upload(image)
    crc = controller.program_crc()
    spoilt = {
        "cut": image[: len(image) // 2],
        "bit": image[:1000] + bytes([image[1000] ^ 4]) + image[1001:],
        "limits": load_pipeline(EXAMPLES / "heart.toml").image,
        "empty header": bytes(128),
    }[spoil]
    if spoil == "limits":
        controller.write(0x2004, 2, 50_000)  # 50 mm/s: below the program's feed
    with pytest.raises(RefusedError, match=r"refused the program: .*the old program stays"):
        controller.upload(spoilt)
    assert controller.program_crc() == crc
    assert controller.read(0x2000, 6) == len(image)


def test_broken_off_upload_keeps_the_old_program(controller: Controller) -> None:
    image = load_pipeline(ALPHA).image
    controller.upload(image)
    crc = controller.program_crc()

    def interrupt(sent: int) -> None:
        if sent > len(image) // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        controller.upload(load_pipeline(EXAMPLES / "heart.toml").image, interrupt)
    assert controller.program_crc() == crc
    controller.upload(image)
    assert controller.program_crc() == crc


def test_upload_while_moving(
    controller: Controller, slow_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    assert controller.state() == RUNNING
    crc = controller.program_crc()
    status, line = status_line(capsys, "upload", str(ALPHA))
    assert (status, "takes no program now" in line) == (5, True), line
    assert controller.program_crc() == crc
    for command in ("goto", "run"):
        status, line = status_line(capsys, command, str(ALPHA))
        assert (status, "wait until the axes stand" in line) == (5, True), line
        assert controller.state() == RUNNING
    assert main(["stop"]) == 0
    assert controller.state() == READY
    assert 0 < controller.read(0x2009, 1) < controller.read(0x2000, 11)


@pytest.fixture
def slow_run(clock: VirtualClock, slow_file: Path) -> Iterator[Start]:
    """Starts `hodograph run` of the slow file; ends it whatever happens."""
    with contextlib.ExitStack() as stack:

        def start() -> Command:
            return stack.enter_context(running(clock, "run", str(slow_file)))

        yield start


def children_of(process: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(stat.read_text().rpartition(")")[2].split()[1]) == process:
                found.append(int(stat.parent.name))
    return found


@pytest.mark.parametrize("after_s", [0.0, 0.1, 1.0, long(20.0)])
def test_interrupt_stops_the_axes_of_others(
    controller: Controller, slow_run: Start, clock: VirtualClock, after_s: float
) -> None:
    child = slow_run()
    controller.wait_for((RUNNING,), LIMIT_S)
    clock.sleep(after_s)
    child.signal(signal.SIGINT)
    status = child.wait(LIMIT_S)
    assert (status, child.out) == (130, ""), child.err
    assert child.err.splitlines()[-1] == "hodograph: interrupted"
    assert controller.state() == READY
    assert controller.read(0x2009, 1) < controller.read(0x2000, 11)


@pytest.mark.parametrize("after_s", [0.0, 1.0])
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)]
)
def test_nothing_is_left_running(
    hub: LocalHub,
    clock: VirtualClock,
    slow_run: Start,
    number: signal.Signals,
    status: int,
    after_s: float,
) -> None:
    child = slow_run()
    with connect(hub.address, 1, 1_000_000) as controller:
        controller.require(LIMIT_S)
        controller.wait_for((RUNNING,), LIMIT_S)
        clock.sleep(after_s)
        started = [os.pidfd_open(process) for process in children_of(child.child.pid)]
        assert len(started) == 2
        if number == signal.SIGKILL:
            child.kill()
            clock.sleep(END_S)  # the system reports them, and the controller stops the axes first
        else:
            child.signal(number)
        assert child.wait(LIMIT_S) == status, child.err
        for process in started:
            assert has_ended(process)
            os.close(process)
        assert not controller.answers(0.5)


def has_ended(process: int) -> bool:
    """Of a process that has left virtual time: the system may still be busy with its end."""
    return bool(select.select([process], [], [], 30.0)[0])


@pytest.mark.parametrize("command", ["goto", "run"])
def test_a_command_starts_no_program_of_another_one(
    controller: Controller,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
) -> None:
    """Another one is uploaded, with the same start, before the command starts its own."""
    assert main(["goto", str(ALPHA)]) == 0
    at = controller.targets(2)
    place = at[0] / 1e6, at[1] / 1e6
    other = line_image(place, (place[0] + 1.0, place[1]), load_pipeline(ALPHA).machine)
    upload = Controller.upload

    def overtaken(self: Controller, image: bytes, *more: Any) -> None:
        upload(self, image, *more)
        upload(controller, other)

    monkeypatch.setattr(Controller, "upload", overtaken)
    words = ("goto", str(ALPHA), "--to", "5", "5") if command == "goto" else ("run", str(ALPHA))
    status, line = status_line(capsys, *words)
    assert controller.targets(2) == at
    assert (status, "another command has loaded another program" in line) == (5, True), line


@pytest.mark.parametrize("command", [("goto", str(ALPHA), "--to", "5", "5"), ("run", str(ALPHA))])
def test_a_command_that_comes_too_late_leaves_the_motion_of_another_one_alone(
    controller: Controller,
    slow_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: tuple[str, ...],
) -> None:
    """The axes stood when it began."""
    assert main(["goto", str(slow_file)]) == 0
    enable = Controller.enable

    def overtaken(self: Controller) -> None:
        enable(self)
        monkeypatch.undo()
        controller.start()

    monkeypatch.setattr(Controller, "enable", overtaken)
    status, line = status_line(capsys, *command)
    assert (status, "takes no program now (running)" in line) == (5, True), line
    assert controller.state() == RUNNING


def test_a_second_start_leaves_the_motion_alone(
    controller: Controller, slow_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    status, line = status_line(capsys, "start")
    assert (status, "the program goes on" in line) == (4, True), line
    assert controller.state() == RUNNING


def test_tiny_goto_is_exact(controller: Controller) -> None:
    """Ways below what the format can hold go by a detour, and end at the very count."""
    for x in ("1", "1.0000001", "1.000001", "1.0003"):
        assert main(["goto", str(ALPHA), "--to", x, "0"]) == 0
        assert controller.targets(2) == [round(float(x) * 1e6), 0]


def test_a_goto_that_another_command_stops_is_not_said_to_have_arrived(
    controller: Controller, clock: VirtualClock
) -> None:
    with running(clock, "goto", str(ALPHA), "--to", "100", "0") as child:
        controller.wait_for((RUNNING,), LIMIT_S)
        clock.sleep(0.2)
        assert main(["stop"]) == 0
        assert (child.wait(LIMIT_S), child.out) == (6, ""), child.err
        assert "the move was stopped on its way, the axes rest at x " in child.err.splitlines()[-1]
    assert 0 < controller.targets(1)[0] < 100_000_000


@pytest.mark.parametrize(
    "command", [("goto", str(ALPHA), "--to", "100", "0"), ("start", "--follow")]
)
def test_a_command_ends_when_a_quick_stop_switches_the_drives_off(
    controller: Controller, slow_file: Path, clock: VirtualClock, command: tuple[str, ...]
) -> None:
    if command[0] == "start":
        assert main(["goto", str(slow_file)]) == 0
    with running(clock, *command) as child:
        controller.wait_for((RUNNING,), LIMIT_S)
        clock.sleep(0.2)
        assert main(["quick-stop"]) == 0
        assert (child.wait(LIMIT_S), child.out) == (6, ""), child.err
        assert "the drives were switched off on the way" in child.err.splitlines()[-1]


def test_a_hold_ends_when_a_quick_stop_switches_the_drives_off(
    controller: Controller, slow_file: Path
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    controller.command(HOLD)
    assert main(["quick-stop"]) == 0
    assert not actions.hold_reached(controller, 5.0)


def test_configuration_is_refused_while_moving(
    controller: Controller, slow_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    status, line = status_line(capsys, "upload", str(EXAMPLES / "star.toml"), "--kernel", "double")
    assert (status, "with another configuration: hodograph stop first" in line) == (5, True), line
    with pytest.raises(RefusedError):
        controller.write(0x2004, 5, 2)
    assert main(["stop", "--off"]) == 0
    assert controller.read(0x2004, 5) == 0


def test_rig_refuses_a_second_controller(
    controller: Controller, capsys: pytest.CaptureFixture[str]
) -> None:
    status, line = status_line(capsys, "rig", str(ALPHA))
    assert (status, "node 1 is there already" in line) == (4, True), line
    assert controller.state() == OFF


def test_dead_drives_are_a_clear_error(make_bench: MakeBench, slow_run: Start) -> None:
    bench = make_bench()
    child = slow_run()
    bench.controller.wait_for((RUNNING,), LIMIT_S)
    bench.rig.processes[0].kill()
    assert child.wait(LIMIT_S) == 6, child.err
    assert "is in fault" in child.err.splitlines()[-1]
    with pytest.raises(BusError, match="hodograph-drive ended by itself"):
        bench.rig.check()


def test_a_program_that_no_bank_can_hold_is_refused_before_it_is_sent(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not after the last of its bytes."""
    image = bytearray(program("alpha_quintic"))
    image[24:28] = (2**20).to_bytes(4, "little")  # pieces: 268 MB of records
    sent: list[int] = []
    with pytest.raises(RefusedError, match=r"takes 268.* with its precomputed coefficients"):
        controller.upload(bytes(image), sent.append)
    assert sent == []


def test_the_sizes_of_records_are_those_of_the_controller(controller: Controller) -> None:
    found = tuple(controller.read(PROGRAM_MEMORY, sub) for sub in range(1, 6))
    assert found == (LARGEST_BANK, *astuple(RECORD_BYTES["fixed"]))


def test_nothing_is_said_of_the_old_program_that_is_not_known(
    controller: Controller, clock: VirtualClock
) -> None:
    """The controller is gone in the middle of an upload: nobody knows what it has."""
    image = program("alpha_quintic")

    def progress(sent: int) -> None:
        if sent > len(image) // 2:
            clock.suspend("controller-1")

    with pytest.raises(BusError, match="is not known"):
        controller.upload(image, progress)
    clock.resume("controller-1")


def test_what_is_known_of_the_old_program_is_said(
    controller: Controller, clock: VirtualClock
) -> None:
    """It comes back in time to be asked."""
    controller.upload(program("line_tiny"))
    image = program("alpha_quintic")

    def progress(sent: int) -> None:
        if sent > len(image) // 2:
            raise SdoCommunicationError("made up")

    with pytest.raises(BusError, match="the old program is unharmed"):
        controller.upload(image, progress)
