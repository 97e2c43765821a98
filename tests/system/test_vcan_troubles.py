# SPDX-License-Identifier: MIT
"""A SocketCAN interface that takes no frames, as an adapter that is bus-off has it: the recovery. Run by pytest on
vcan0; starts a controller, drives and `hodograph`, and changes vcan0 by `tc` and `ip`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bench import PAPER_ALPHA, VCAN0, MakeAlpha, MakeBench
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


@contextmanager
def taken_down() -> Iterator[None]:
    """The interface is down inside, as after `ip link set vcan0 down`."""
    subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
    try:
        yield
    finally:
        subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may take the interface down")
@pytest.mark.parametrize("moving", [pytest.param(False, marks=pytest.mark.long), True])
def test_an_interface_that_is_taken_down_and_up(
    alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str], moving: bool
) -> None:
    """Controller and drives cannot speak any more: they end with status 4 and say why. With the interface up again a
    new start is all that it takes.
    """
    slow, bus = str(alpha_at(40)), str(VCAN0)
    words = [sys.executable, "-m", "hodograph", "rig", str(PAPER_ALPHA), "--bus", bus]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as rig:
        assert rig.stderr is not None
        assert "are on " in rig.stderr.readline()
        if moving:
            assert main(["goto", slow, "--bus", bus]) == 0
            assert main(["start", "--bus", bus]) == 0
        with taken_down():
            said = rig.stderr.read()
            status = rig.wait(LIMIT_S)
            capsys.readouterr()
            assert main(["status", "--bus", bus]) == 4
            assert "vcan0" in capsys.readouterr().err
    assert status == 4, said
    assert "Network is down: check the interface and start again" in said
    assert said.count("\n") == 1
    assert main(["run", slow, "--json", "--bus", bus]) == 0
