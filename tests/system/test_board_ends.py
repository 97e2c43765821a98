# SPDX-License-Identifier: MIT
"""A board that ends in the middle of a motion: told to, it stops the axes first; its plug pulled, the drives stop."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hodograph.bus.address import BusAddress, parse_address
from hodograph.bus.goto import goto
from hodograph.bus.listening.recorder import Frames, Recorder
from hodograph.bus.listening.setpoint_check import require_no_jump, step_limits
from hodograph.bus.processes import drive_command
from hodograph.bus.sdo.controller import STATISTICS, Controller, connect
from hodograph.chain import Chain, load_chain
from hodograph.native import NativeProgram

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from til import EMULATE, local_bus  # noqa: E402

DRIVE_EDS = ROOT / "sim/node/drive.eds"
MIDWAY_TICKS = 300  # of 1101, at full feed
TICK = 2
ENABLED, STATE_MASK = 0x0F, 0x6F
OPERATION_ENABLED, QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED = 0x27, 0x07, 0x40
LOST_SIGNALS = {0x8130, 0x8250, 0x8700}  # heartbeat, setpoints, SYNC


@dataclass(frozen=True)
class Running:
    """A board in the middle of the alpha, at 100 mm/s; everything on the bus is recorded."""

    chain: Chain
    address: BusAddress
    board: subprocess.Popen[str]
    recorder: Recorder


def begin(controller: Controller, chain: Chain) -> None:
    _, setpoints = NativeProgram(chain.image).setpoints("fixed", chain.machine.counts_per_mm)
    controller.require(20.0)
    controller.configure(chain.machine, "fixed")
    controller.enable()
    goto(controller, chain.machine, (int(setpoints[0, 0]), int(setpoints[0, 1])))
    controller.upload(chain.image)


@pytest.fixture(params=["slcan", "fifo"])
def running(request: pytest.FixtureRequest) -> Iterator[Running]:
    chain = load_chain(ROOT / "examples/alpha.toml")
    with ExitStack() as stack:
        address = parse_address(stack.enter_context(local_bus()))
        words = [str(EMULATE), "an386", "--bus", address.channel, "--link", request.param]
        drives = subprocess.Popen(drive_command(chain.machine, address))
        board = subprocess.Popen([sys.executable, *words], stderr=subprocess.PIPE, text=True)
        for child in (board, drives):
            stack.enter_context(child)
            stack.callback(child.kill)
        controller = stack.enter_context(connect(address, 1, chain.machine.bitrate))
        begin(controller, chain)
        recorder = stack.enter_context(Recorder(address))
        controller.start()
        while controller.read(STATISTICS, TICK) < MIDWAY_TICKS:
            time.sleep(0.01)
        yield Running(chain, address, board, recorder)


def targets(frames: Frames, node: int) -> tuple[np.ndarray, np.ndarray]:
    """Controlwords, and what they came with in counts."""
    data = np.ascontiguousarray(frames["data"][frames["id"] == 0x200 + node][:, :6])
    return data[:, :2].copy().view("<u2")[:, 0], data[:, 2:].copy().view("<i4")[:, 0]


@pytest.mark.serial
def test_told_to_end_it_stops_the_axes_on_the_path_first(running: Running) -> None:
    running.board.send_signal(signal.SIGTERM)
    assert running.board.wait(20) == 0, running.board.communicate()[1]
    running.recorder.stop()
    frames = running.recorder.frames()
    machine = running.chain.machine
    require_no_jump(frames, machine.nodes, step_limits(machine))
    for node in machine.nodes:
        control, counts = targets(frames, node)
        on = (control & ENABLED) == ENABLED
        assert on[0]
        assert not on[-1]
        last = np.flatnonzero(on)[-1]
        assert np.abs(np.diff(counts[: last + 1])).max() > 10_000  # it was on its way
        assert np.ptp(counts[last - 100 : last + 1]) == 0  # and stood when power was taken away


@pytest.mark.serial
def test_with_its_plug_pulled_the_drives_stop_by_themselves(running: Running) -> None:
    running.board.kill()
    time.sleep(1.0)  # setpoint_timeout_ms is 200, and they brake from 100 mm/s
    running.recorder.stop()
    frames = running.recorder.frames()
    for node in running.chain.machine.nodes:
        control, _ = targets(frames, node)
        assert (control[-1] & ENABLED) == ENABLED  # nobody told them
        said = frames["data"][frames["id"] == 0x80 + node][:, :2].copy().view("<u2")[:, 0]
        assert LOST_SIGNALS & set(said.tolist())
        with connect(running.address, node, running.chain.machine.bitrate, DRIVE_EDS) as drive:
            first = drive.read(0x6064)
            assert drive.read(0x6041) & STATE_MASK in (QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED)
            assert drive.read(0x6064) == first
