# SPDX-License-Identifier: MIT
"""A simulated machine on the bus, and paths of files; fixtures that make one are in conftest.py. Used by the tests in
this folder; one function writes to a folder that it is given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hodograph.bus.address import BusAddress, parse_address
from hodograph.bus.clock import Clock
from hodograph.bus.processes import SimulatedMachine
from hodograph.bus.sdo.controller import Controller
from hodograph.config import Machine

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PAPER_ALPHA = EXAMPLES / "machines" / "paper_alpha.toml"
VCAN0 = parse_address("socketcan:vcan0")
_PATIENT = """
[supervision]
answer_wait_ms = 10000
setpoint_timeout_ms = 60000
"""


@dataclass(frozen=True)
class Bench:
    """A simulated machine on a bus and its controller: configured, drives off."""

    machine: Machine
    rig: SimulatedMachine
    controller: Controller
    bus: BusAddress

    @property
    def clock(self) -> Clock:
        """What passes on this bus."""
        return self.controller.clock


MakeBench = Callable[..., Bench]
MakeAlpha = Callable[[float], Path]


def patient_machine(file: Path, folder: Path) -> Path:
    """A copy of a machine file in `folder`, whose supervision waits longer than a busy computer pauses a process: for
    tests in real time that are about something else.
    """
    text = file.read_text().replace('"../drives/', f'"{EXAMPLES}/drives/')
    copy = folder / file.name
    copy.write_text(text.replace("\n[work]\n", f"{_PATIENT}\n[work]\n", 1))
    assert _PATIENT in copy.read_text()
    return copy
