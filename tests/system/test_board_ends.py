# SPDX-License-Identifier: MIT
"""A board is ended during a motion. By a signal: it stops the axes on the path first. By loss of power: the drives stop
by themselves. Run by pytest; starts an emulated board (QEMU, with the image of `make firmware`) and drives on a local
bus.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from boards import board
from hodograph.bus.address import BusAddress
from hodograph.bus.capture.recorder import Frames, Recorder
from hodograph.bus.capture.setpoint_check import require_no_jump, step_limits
from hodograph.bus.clock import REAL_CLOCK, Clock
from hodograph.bus.goto import goto
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import Process, drive_command, virtual_clock
from hodograph.bus.sdo.controller import STATISTICS, Controller, connect
from hodograph.native import NativeProgram
from hodograph.pipeline import Pipeline, load_pipeline

ROOT = Path(__file__).resolve().parents[2]
DRIVE_EDS = ROOT / "sim/node/drive.eds"
PERCENT = {"fifo": 100, "slcan": 10}
"""Feed override by link. In real time the motion must last so long that a host under load still acts during it."""
MIDWAY_TICKS = 300
"""Of 1101 at full feed."""
TICK = 2
ENABLED, STATE_MASK = 0x0F, 0x6F
OPERATION_ENABLED, QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED = 0x27, 0x07, 0x40
NO_HEARTBEAT, NO_SETPOINTS, NO_SYNC = 0x8130, 0x8250, 0x8700
END_S = 300.0
SYNC_TIMEOUT_US = 200_000
LOOK_US = 10_000
"""Interval in which a simulated drive without frames reads its clock."""


@dataclass(frozen=True)
class Running:
    """A board in the middle of the alpha; everything on the bus is recorded."""

    pipeline: Pipeline
    address: BusAddress
    clock: Clock
    board: Process
    recorder: Recorder
    percent: int
    is_virtual: bool


def begin(controller: Controller, pipeline: Pipeline, percent: int) -> None:
    _, setpoints = NativeProgram(pipeline.image).setpoints("fixed", pipeline.machine.counts_per_mm)
    controller.require(END_S)
    controller.configure(pipeline.machine, "fixed")
    controller.enable()
    goto(controller, pipeline.machine, (int(setpoints[0, 0]), int(setpoints[0, 1])))
    controller.override(percent)
    controller.upload(pipeline.image)


@pytest.fixture(params=["slcan", "fifo"])
def running(request: pytest.FixtureRequest, one_core: None) -> Iterator[Running]:
    """With FIFOs in virtual time, over SLCAN in real time."""
    pipeline, link = load_pipeline(ROOT / "examples/alpha.toml"), request.param
    with ExitStack() as stack:
        address = stack.enter_context(LocalHub(virtual=link == "fifo")).address
        clock = virtual_clock(address)
        if clock is not None:
            stack.callback(clock.release)
        drives = Process("drives", drive_command(pipeline.machine, address), clock)
        stack.callback(drives.end)
        emulated = board("an386", address, 1, clock, "--link", link)
        stack.callback(emulated.end)
        controller = stack.enter_context(connect(address, 1, pipeline.machine.bitrate))
        begin(controller, pipeline, PERCENT[link])
        recorder = stack.enter_context(Recorder(address))
        controller.start()
        while controller.read(STATISTICS, TICK) < MIDWAY_TICKS:
            controller.clock.sleep(0.01)
        at = clock or REAL_CLOCK
        yield Running(pipeline, address, at, emulated, recorder, PERCENT[link], clock is not None)


def targets(frames: Frames, node: int) -> tuple[np.ndarray, np.ndarray]:
    """Controlwords, and what they came with in counts."""
    data = np.ascontiguousarray(frames["data"][frames["id"] == 0x200 + node][:, :6])
    return data[:, :2].copy().view("<u2")[:, 0], data[:, 2:].copy().view("<i4")[:, 0]


def test_a_request_to_end_stops_the_axes_on_the_path_first(running: Running) -> None:
    running.board.end(END_S)
    assert running.board.child.returncode == 0
    frames = running.recorder.so_far()
    machine = running.pipeline.machine
    require_no_jump(frames, machine.nodes, step_limits(machine))
    for node in machine.nodes:
        control, counts = targets(frames, node)
        on = (control & ENABLED) == ENABLED
        assert on[0]
        assert not on[-1]
        last = np.flatnonzero(on)[-1]
        fastest = np.abs(np.diff(counts[: last + 1])).max()
        assert fastest > 100 * running.percent  # it was on its way
        assert np.ptp(counts[last - 100 : last + 1]) == 0  # and stood when power was taken away


def test_with_its_plug_pulled_the_drives_stop_by_themselves(running: Running) -> None:
    running.board.kill()
    machine = running.pipeline.machine
    for node in machine.nodes:
        with connect(running.address, node, machine.bitrate, DRIVE_EDS) as drive:
            while drive.read(0x6041) & STATE_MASK == OPERATION_ENABLED:
                running.clock.sleep(0.01)
            _wait_for_standstill(drive, running.clock)
            assert drive.read(0x6041) & STATE_MASK in (QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED)
            first = drive.read(0x6064)
            running.clock.sleep(0.1)
            assert drive.read(0x6064) == first
    frames = running.recorder.so_far()
    for node in machine.nodes:
        _is_reported(frames, node, running.is_virtual)


def _wait_for_standstill(drive: Controller, clock: Clock) -> None:
    """An axis that overshoots has speed 0 for an instant, too: it has come to standstill when its position stays."""
    last, same = drive.read(0x6064), 0
    while same < 10:
        clock.sleep(0.01)
        position = drive.read(0x6064)
        last, same = position, same + 1 if position == last else 0


def _is_reported(frames: Frames, node: int, is_virtual: bool) -> None:
    control, _ = targets(frames, node)
    assert (control[-1] & ENABLED) == ENABLED  # nobody commanded a stop
    said = frames[frames["id"] == 0x80 + node]
    codes = said["data"][:, :2].copy().view("<u2")[:, 0].tolist()
    if is_virtual:
        assert codes == [NO_SYNC]
        after_us = int(said["time_us"][0] - frames["time_us"][frames["id"] == 0x080][-1])
        assert SYNC_TIMEOUT_US <= after_us <= SYNC_TIMEOUT_US + LOOK_US
    else:
        assert {NO_HEARTBEAT, NO_SETPOINTS, NO_SYNC} & set(codes)
