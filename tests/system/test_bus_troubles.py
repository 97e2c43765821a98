# SPDX-License-Identifier: MIT
"""A bus that takes no frames, as an adapter that is bus-off has it, and drives that slept: the way out of both."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from bench import MakeAlpha, MakeBench
from hodograph.bus.sdo.controller import FAULT_STATE, OFF, RUNNING
from hodograph.chain import load_chain
from hodograph.cli.main import main

pytestmark = pytest.mark.bus

NOT_SENT = 0xFF07


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
    slow: Path = alpha_at(40)
    bench = make_bench("real-time")
    controller = bench.controller
    assert main(["goto", str(slow)]) == 0
    assert main(["start"]) == 0
    assert controller.state() == RUNNING
    with no_room():
        time.sleep(0.3)
    deadline = time.monotonic() + 20.0
    while controller.state() != FAULT_STATE:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert controller.read(0x2003, 1) == NOT_SENT
    assert controller.program_crc() != 0
    capsys.readouterr()
    assert main(["reset"]) == 0
    assert controller.state() == OFF
    crc = controller.program_crc()
    assert main(["run", str(load_chain(slow).file.file), "--json"]) == 0
    assert controller.program_crc() == crc


def test_drives_that_slept_are_back_at_once(
    make_bench: MakeBench, alpha_at: MakeAlpha, capsys: pytest.CaptureFixture[str]
) -> None:
    """What piled up for them meanwhile is not worked off: SYNCs of seconds ago, each a period of servo loops."""
    bench = make_bench("real-time")
    controller = bench.controller
    assert main(["goto", str(alpha_at(20))]) == 0
    assert main(["start"]) == 0
    drives = int(subprocess.check_output(["pidof", "hodograph-drive"]))
    os.kill(drives, signal.SIGSTOP)
    try:
        time.sleep(6.0)
        assert controller.state() == FAULT_STATE
    finally:
        os.kill(drives, signal.SIGCONT)
    capsys.readouterr()
    assert main(["reset", "--timeout", "20"]) == 0
    assert controller.state() == OFF
    told = controller.read(0x2024, 1)
    time.sleep(1.0)
    assert controller.read(0x2024, 1) - told < 5
