# SPDX-License-Identifier: MIT
"""What system tests share: where the tree is, and the bus that tests marked `bus` need."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bench import BUS, EXAMPLES, PAPER_ALPHA, Bench, MakeAlpha, MakeBench
from hodograph.bus.processes import Rig
from hodograph.bus.sdo.controller import connect
from hodograph.config import load_machine

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def make_bench() -> Iterator[MakeBench]:
    """Starts the machine of a machine file at a pace; ended with the test."""
    with ExitStack() as stack:

        def make(pace: str, file: Path = PAPER_ALPHA) -> Bench:
            machine = load_machine(file)
            rig = stack.enter_context(Rig(machine, BUS, pace))
            controller = stack.enter_context(connect(BUS, machine.node, machine.bitrate))
            controller.require(20.0)
            controller.configure(machine, "fixed")
            return Bench(machine, rig, controller)

        yield make


@pytest.fixture
def alpha_at(tmp_path: Path) -> MakeAlpha:
    """Makes a path file of the alpha at another feed: mm/s, about 100 mm of way."""

    def make(nominal_mm_s: float) -> Path:
        text = (EXAMPLES / "alpha.toml").read_text()
        text = text.replace("nominal_mm_s = 100", f"nominal_mm_s = {nominal_mm_s:g}")
        text = text.replace('"exponential"', '"quintic"')
        file = tmp_path / f"alpha_{nominal_mm_s:g}.toml"
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
