# SPDX-License-Identifier: MIT
"""A SocketCAN interface that takes no frames, as an adapter that is bus-off has it: the way out."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bench import MakeAlpha, MakeBench
from hodograph.bus.sdo.controller import FAULT_STATE, OFF, RUNNING
from hodograph.cli.main import main

pytestmark = pytest.mark.bus

NOT_SENT = 0xFF07
LIMIT_S = 60.0


def tc(*words: str) -> None:
    subprocess.run(["tc", "qdisc", *words], check=True)


@contextmanager
def no_room() -> Iterator[None]:
    """The interface's queue takes nothing: every send gives ENOBUFS, whoever tries."""
    tc("replace", "dev", "vcan0", "root", "pfifo", "limit", "0")
    try:
        yield
    finally:
        tc("del", "dev", "vcan0", "root")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may change the interface's queue")
def test_frames_that_the_port_refuses_are_a_fault(
    make_bench: MakeBench, alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = str(alpha_at(40))
    controller = make_bench("real-time").controller
    assert main(["goto", slow]) == 0
    assert main(["start"]) == 0
    assert controller.state() == RUNNING
    with no_room():
        time.sleep(0.3)  # of real time, as the interface is: some hundred ticks
    assert controller.wait_for((FAULT_STATE,), LIMIT_S) == FAULT_STATE
    assert controller.read(0x2003, 1) == NOT_SENT
    assert controller.program_crc() is not None
    capsys.readouterr()
    assert main(["reset"]) == 0
    assert controller.state() == OFF
    crc = controller.program_crc()
    assert main(["run", slow, "--json"]) == 0
    assert controller.program_crc() == crc
