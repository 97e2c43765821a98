# SPDX-License-Identifier: MIT
"""Target in the loop: the controller on an emulated board, on a bus in virtual time, against the simulated drives.

Starts the emulator, the gateway and the drives as processes. Uses local buses only, no kernel CAN. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from boards import BRIDGE, EMULATE, QEMU, board, children, stop_for
from commands import result
from hodograph.bus.address import BusAddress
from hodograph.bus.capture.recorder import Frames, Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import Process
from hodograph.bus.run import BusRun, run_program, run_session
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.objects import BOOT
from hodograph.pipeline import load_pipeline
from marks import long

ROOT = Path(__file__).resolve().parents[2]
FILES = [str(ROOT / "examples" / f"{name}.toml") for name in ("heart", "five_axes")]
ALPHA = ROOT / "examples" / "alpha.toml"
HASHES = ("setpoints_sha256", "encoders_sha256")
BITRATE = 1_000_000
MIDWAY_TICKS = 500  # of 1101


def test_the_m4f_runs_in_the_plane_and_with_five_axes(
    hub: LocalHub, clock: VirtualClock, capsys: pytest.CaptureFixture[str]
) -> None:
    """`simulate` gives the hashes of `run` with the Linux controller (test_bus_run)."""
    controller = ("--controller", f"{EMULATE} an386")
    runs = result(capsys, "run", *FILES, "--json", *controller)
    for run, file in zip(runs, FILES, strict=True):
        simulated = result(capsys, "simulate", file, "--json")
        assert [run[key] for key in HASHES] == [simulated[key] for key in HASHES]
        assert run["deadline_misses"] == 0


def _recorded_run(target: str, stopped: str | None = None) -> tuple[Frames, BusRun]:
    """The alpha at the board; `stopped`: a program of it that stands still for a second on the way."""
    pipeline = load_pipeline(ALPHA)
    victims: list[int] = []

    def progress(tick: int) -> None:
        if tick >= MIDWAY_TICKS and victims:
            stop_for(victims.pop(), 1.0)

    with (
        LocalHub() as hub,
        Recorder(hub.address) as recorder,
        run_session(
            pipeline.machine, hub.address, "fast", 15.0, print, f"{EMULATE} {target}"
        ) as at,
    ):
        assert at.rig is not None
        if stopped is not None:
            victims += children(at.rig.processes[1].child.pid, stopped)
        run = run_program(at, pipeline.machine, pipeline.image, pipeline.machine.kernel, progress)
        assert not victims
        return recorder.so_far(), run


@pytest.mark.parametrize("target", ["an386", long("microbit")])
def test_the_same_frames_at_the_same_times(one_core: None, target: str) -> None:
    """Each bit of a run, though the emulator or the bridge stands still for a second in the middle of it."""
    frames, run = _recorded_run(target)
    assert frames.size > 10 * run.motion.ticks
    for stopped in (QEMU, BRIDGE):
        again, other = _recorded_run(target, stopped)
        assert np.array_equal(frames, again), stopped
        assert other.motion.encoders_sha256 == run.motion.encoders_sha256


@pytest.mark.parametrize("target", ["an385", "an505", "microbit"])
def test_the_other_boards_answer_and_end(hub: LocalHub, clock: VirtualClock, target: str) -> None:
    process = board(target, hub.address, 9, clock)
    _answers_and_ends(hub.address, process)


@pytest.mark.parametrize("target", ["an500", "an505"])
def test_boards_answer_and_end_in_real_time(one_core: None, target: str) -> None:
    with LocalHub(virtual=False) as hub:
        process = board(target, hub.address, 9, None, "--link", "slcan")
        _answers_and_ends(hub.address, process)


def _answers_and_ends(address: BusAddress, process: Process) -> None:
    with connect(address, 9, BITRATE) as controller:
        controller.require(300.0)
        assert controller.state() == BOOT
        process.end(300.0)
        assert process.child.returncode == 0
        assert not controller.answers(0.5)


def test_without_its_bridge_the_board_ends(hub: LocalHub, clock: VirtualClock) -> None:
    process = board("an386", hub.address, 9, clock, "--verbose")
    (bridge,) = children(process.child.pid, BRIDGE)
    clock.sleep(1.0)
    os.kill(bridge, signal.SIGKILL)
    assert process.child.wait() == 4
    begin, *_, last = process.text().splitlines()
    assert "this board is node 9" in begin
    assert "the bridge is gone" in last
    process.end()


def test_a_board_whose_emulator_dies_ends(hub: LocalHub, clock: VirtualClock) -> None:
    process = board("an386", hub.address, 9, clock)
    (qemu,) = children(process.child.pid, QEMU)
    clock.sleep(1.0)
    os.kill(qemu, signal.SIGKILL)
    assert clock.await_end(process.name, process.child) == 1
    assert "the emulated board is gone" in process.text()
    process.end()


def test_no_bus_is_said(tmp_path: Path) -> None:
    words = [sys.executable, str(EMULATE), "an386", "--bus", str(tmp_path / "bus")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 4
    assert "start one there with hodograph-hub" in done.stderr
