# SPDX-License-Identifier: MIT
"""Commands on the bus: refusals leave everything as it was, Ctrl-C leaves the axes standing."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bench import BUS, EXAMPLES, MakeAlpha, MakeBench
from hodograph.bus.sdo.controller import BOOT, READY, RUNNING, Controller, connect
from hodograph.chain import load_chain
from hodograph.cli.main import main
from hodograph.errors import BusError, RefusedError

pytestmark = pytest.mark.bus

ALPHA = EXAMPLES / "alpha.toml"
LIMIT_S = 120.0
Start = Callable[[], subprocess.Popen[str]]


@pytest.fixture
def controller(make_bench: MakeBench) -> Controller:
    """A configured controller with its drives, off, at full pace."""
    return make_bench("fast").controller


@pytest.fixture
def slow_file(alpha_at: MakeAlpha) -> Path:
    """The alpha at 2 mm/s: nearly a minute of motion, some seconds at full pace."""
    return alpha_at(2)


def until(controller: Controller, state: int, limit_s: float = LIMIT_S) -> None:
    deadline = time.monotonic() + limit_s
    while controller.state() != state:
        assert time.monotonic() < deadline, f"state {controller.state()}, not {state}"
        time.sleep(0.05)


def status_line(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    status = main(arguments)
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return status, err.splitlines()[-1] if err else ""


def test_no_node(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = status_line(capsys, "status", "--wait", "0.5")
    assert status == 4
    assert "no answer from node 1 on socketcan:vcan0 in 0.5 s: start the controller" in line


def test_refusals(controller: Controller, capsys: pytest.CaptureFixture[str]) -> None:
    status, line = status_line(capsys, "start")
    assert (status, "no program is loaded" in line) == (5, True), line
    assert main(["goto", str(ALPHA), "--to", "5", "5"]) == 0
    capsys.readouterr()
    assert main(["upload", str(ALPHA), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert main(["status", "--json"]) == 0
    assert told["program"] == json.loads(capsys.readouterr().out)["program"]
    assert (told["node"], told["bytes"]) == (1, told["program"]["size"])
    status, line = status_line(capsys, "start")
    assert (status, "away from the program's start: hodograph goto" in line) == (5, True), line
    status, line = status_line(capsys, "goto", str(ALPHA), "--to", "500", "0")
    assert (status, "outside the travel" in line) == (2, True), line
    assert controller.state() == READY


@pytest.mark.parametrize("spoil", ["cut", "bit", "limits", "empty header"])
def test_spoilt_upload_keeps_the_old_program(controller: Controller, spoil: str) -> None:
    image = load_chain(ALPHA).image
    controller.upload(image)
    crc = controller.program_crc()
    spoilt = {
        "cut": image[: len(image) // 2],
        "bit": image[:1000] + bytes([image[1000] ^ 4]) + image[1001:],
        "limits": load_chain(EXAMPLES / "heart.toml").image,
        "empty header": bytes(128),
    }[spoil]
    if spoil == "limits":
        controller.write(0x2004, 2, 50_000)  # 50 mm/s: below the program's feed
    with pytest.raises(RefusedError, match=r"refused the program: .*the old program stays"):
        controller.upload(spoilt)
    assert controller.program_crc() == crc
    assert controller.read(0x2000, 6) == len(image)


def test_broken_off_upload_keeps_the_old_program(controller: Controller) -> None:
    image = load_chain(ALPHA).image
    controller.upload(image)
    crc = controller.program_crc()

    def interrupt(sent: int) -> None:
        if sent > len(image) // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        controller.upload(load_chain(EXAMPLES / "heart.toml").image, interrupt)
    assert controller.program_crc() == crc
    controller.upload(image)
    assert controller.program_crc() == crc


def test_upload_while_moving(
    controller: Controller, slow_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    until(controller, RUNNING, 5.0)
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
def slow_run(slow_file: Path) -> Iterator[Start]:
    """Starts `hodograph run` of the slow file; ends it whatever happens."""
    with contextlib.ExitStack() as stack:

        def start() -> subprocess.Popen[str]:
            child = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-m", "hodograph", "run", str(slow_file)],
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                )
            )
            stack.callback(child.kill)
            return child

        yield start


def children_of(process: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(stat.read_text().rpartition(")")[2].split()[1]) == process:
                found.append(int(stat.parent.name))
    return found


def test_interrupt_stops_the_axes_of_others(controller: Controller, slow_run: Start) -> None:
    child = slow_run()
    until(controller, RUNNING)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=LIMIT_S)
    assert (child.returncode, out) == (130, ""), err
    assert err.splitlines()[-1] == "hodograph: interrupted"
    assert controller.state() == READY
    assert controller.read(0x2009, 1) < controller.read(0x2000, 11)


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)]
)
def test_nothing_is_left_running(slow_run: Start, number: signal.Signals, status: int) -> None:
    child = slow_run()
    with connect(BUS, 1, 1_000_000) as controller:
        deadline = time.monotonic() + LIMIT_S
        while not controller.answers(0.5):
            assert child.poll() is None
            assert time.monotonic() < deadline
        until(controller, RUNNING)
        started = children_of(child.pid)
        assert len(started) == 2
        child.send_signal(number)
        _, err = child.communicate(timeout=LIMIT_S)
        assert child.returncode == status, err
        deadline = time.monotonic() + 10.0
        while any(map(alive, started)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not any(map(alive, started))
        assert not controller.answers(0.5)


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    return state != "Z"


def test_tiny_goto_is_exact(controller: Controller) -> None:
    """Ways below what the format can hold go by a detour, and end at the very count."""
    for x in ("1", "1.0000001", "1.000001", "1.0003"):
        assert main(["goto", str(ALPHA), "--to", x, "0"]) == 0
        assert controller.targets(2) == [round(float(x) * 1e6), 0]


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
    assert controller.state() != BOOT


def test_dead_drives_are_a_clear_error(make_bench: MakeBench, slow_run: Start) -> None:
    bench = make_bench("fast")
    child = slow_run()
    until(bench.controller, RUNNING)
    os.kill(bench.rig.process_ids[0], signal.SIGKILL)
    _, err = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 6, err
    assert "is in fault" in err.splitlines()[-1]
    with pytest.raises(BusError, match="hodograph-drive ended by itself"):
        bench.rig.check()
