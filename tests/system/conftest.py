# SPDX-License-Identifier: MIT
"""Fixtures of system tests: the bus that they run on.

A test runs in virtual time on a local bus of its own (fixtures `hub`, `make_bench`); one that needs the CAN of the
kernel is marked `bus`, and has vcan0. `make_bench` starts the controller and the drives as processes, and ends them;
`one_core`, which `hub` uses, sets the processor core of pytest and its children. Loaded by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from bench import EXAMPLES, PAPER_ALPHA, VCAN0, Bench, MakeAlpha, MakeBench
from hodograph.bus.address import BUS_VARIABLE
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import SimulatedMachine, virtual_clock
from hodograph.bus.sdo.controller import OFF, Controller, connect
from hodograph.config import load_machine
from shared_programs import share_programs, stops_planned_once

__all__ = ["stops_planned_once"]

ROOT = Path(__file__).resolve().parents[2]
OFF_WAIT_S = 60.0
"""Longest wait until the drives are configured."""


@pytest.fixture
def one_core() -> Iterator[None]:
    """This process and its children share a core: a simulation runs one process at a time, and waking across cores
    costs more than it gains.
    """
    cores = sorted(os.sched_getaffinity(0))
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")
    os.sched_setaffinity(0, {cores[int(worker) % len(cores)]})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


@pytest.fixture
def hub(one_core: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalHub]:
    """A local bus in virtual time, which commands use by default."""
    with LocalHub() as served:
        monkeypatch.setenv(BUS_VARIABLE, str(served.address))
        yield served


@pytest.fixture
def clock(hub: LocalHub) -> Iterator[VirtualClock]:
    """The test's part in the time of `hub`: it stands still unless the test waits."""
    held = virtual_clock(hub.address)
    assert held is not None
    yield held
    with suppress(Exception):
        held.release()


def _benches(stack: ExitStack, request: pytest.FixtureRequest) -> MakeBench:
    on_vcan = request.node.get_closest_marker("bus") is not None
    bus = VCAN0 if on_vcan else request.getfixturevalue("hub").address
    if not on_vcan:
        request.getfixturevalue("clock")

    def make(pace: str = "real-time", file: Path = PAPER_ALPHA) -> Bench:
        machine = load_machine(file)
        rig = stack.enter_context(SimulatedMachine(machine, bus, pace))
        controller = stack.enter_context(connect(bus, machine.node, machine.bitrate))
        controller.require(20.0)
        controller.configure(machine, "fixed")
        controller.wait_for((OFF,), 20.0)
        return Bench(machine, rig, controller, bus)

    return make


@pytest.fixture
def make_bench(request: pytest.FixtureRequest) -> Iterator[MakeBench]:
    """Starts the machine of a machine file, on vcan0 in a test marked `bus`; ended with the test."""
    with ExitStack() as stack:
        yield _benches(stack, request)


@pytest.fixture(autouse=True)
def _shared_programs(monkeypatch: pytest.MonkeyPatch, stops_planned_once: None) -> None:
    share_programs(monkeypatch)


@pytest.fixture(scope="session")
def alpha_at(tmp_path_factory: pytest.TempPathFactory) -> MakeAlpha:
    """Makes a path file of the alpha at another feed: mm/s, about 100 mm of distance. One file for each feed, so that
    tests share its program.
    """
    folder = tmp_path_factory.mktemp("alpha")

    def make(nominal_mm_s: float) -> Path:
        text = (EXAMPLES / "alpha.toml").read_text()
        text = text.replace("nominal_mm_s = 100", f"nominal_mm_s = {nominal_mm_s:g}")
        text = text.replace('"exponential"', '"quintic"')
        file = folder / f"alpha_{nominal_mm_s:g}.toml"
        file.write_text(text.replace("machines/", f"{EXAMPLES}/machines/"))
        return file

    return make


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the source tree."""
    return ROOT


@pytest.fixture(autouse=True)
def _bus_is_there(request: pytest.FixtureRequest) -> None:
    """A test marked `bus` fails, and does not skip, where it is run without one."""
    if request.node.get_closest_marker("bus") is None:
        return
    try:
        socket.if_nametoindex("vcan0")
    except OSError:
        pytest.fail("no vcan0: run it as `tools/with-vcan .venv/bin/pytest ...`", pytrace=False)


@pytest.fixture
def controller(make_bench: MakeBench) -> Controller:
    """A configured controller with its drives, off."""
    found: Controller = make_bench().controller
    assert found.wait_for((OFF,), OFF_WAIT_S) == OFF
    return found


@pytest.fixture
def slow_file(alpha_at: MakeAlpha) -> Path:
    """The alpha at 2 mm/s: nearly a minute of motion."""
    return alpha_at(2)
