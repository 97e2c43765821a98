# SPDX-License-Identifier: MIT
"""A bus of hodograph-hub, without any CAN of the kernel: the same bits on all boards, also over SLCAN in real time. Run
by pytest; starts emulated boards, `hodograph-hub` and `hodograph`, and writes to temporary folders.
"""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

from hodograph.bus.processes import find_program
from lateness import Lateness
from marks import long

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
HANGS_S = 600.0
REAL_TIME_TRIES = 3
LATE_S = 0.02
"""The host kept a thread that comes before the board's from its core for so long: twenty ticks of the board's."""
WAITED_S = 0.3
"""A thread of the board, or of what serves it, was ready to run for so long in all and had no core. A board whose main
loop has no time for 1 s ends the motion.
"""


def in_the_loop(file: Path, link: str, *boards: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, str(ROOT / "tools/til.py"), "--local", str(file), "--link", link]
    words += [f"--target={board}" for board in boards]
    done = subprocess.run(words, capture_output=True, text=True, timeout=HANGS_S, check=False)
    print(done.stdout)
    return done


def same_bits(done: subprocess.CompletedProcess[str]) -> bool:
    return done.returncode == 0 and "til: the same bits" in done.stdout


def test_alpha_on_the_board_and_here(one_core: None) -> None:
    """The second run is the emulated board's: the whole controller, from the upload to standstill."""
    done = in_the_loop(EXAMPLES / "alpha.toml", "fifo", "an386")
    assert same_bits(done), done.stderr


@pytest.mark.long
def test_alpha_on_the_other_cores(one_core: None) -> None:
    """Cortex-M3, -M7, -M33, -M0."""
    done = in_the_loop(EXAMPLES / "alpha.toml", "fifo", "an385", "an500", "an505", "microbit")
    assert same_bits(done), done.stderr


@pytest.mark.parametrize("boards", [("an386",), long(("an500", "an505"))])
def test_the_float_kernel_in_the_interrupt_of_the_boards(
    one_core: None, tmp_path: Path, boards: tuple[str, ...]
) -> None:
    """The FPU's registers are stacked and restored around each tick: any that was not would change a bit."""
    machine = (EXAMPLES / "machines/paper_alpha.toml").read_text()
    machine = machine.replace('kernel = "fixed"', 'kernel = "float"')
    (tmp_path / "machine.toml").write_text(machine.replace("../drives", str(EXAMPLES / "drives")))
    path = (EXAMPLES / "alpha.toml").read_text().replace("machines/paper_alpha", "machine")
    (tmp_path / "alpha.toml").write_text(path)
    done = in_the_loop(tmp_path / "alpha.toml", "fifo", *boards)
    assert same_bits(done), done.stderr


@pytest.mark.serial
def test_alpha_over_slcan_in_real_time() -> None:
    """All that passes the board is text on its UART, at 1 kHz. It fails where the host gave the board its time."""
    for _ in range(REAL_TIME_TRIES):
        with Lateness() as host:
            done = in_the_loop(EXAMPLES / "alpha.toml", "slcan")
        late = f"late by {1000 * host.worst_s:.1f} ms at worst; a thread waited for {host.waited_s:.2f} s for a core"
        print(f"the host was {late}")
        if same_bits(done):
            return
        assert host.worst_s > LATE_S or host.waited_s > WAITED_S, done.stderr + done.stdout
    pytest.skip(f"the host was {late}, and as late in each of several runs")


def test_a_bus_that_nobody_serves_is_said(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "hodograph", "status", "--bus", f"local:{tmp_path / 'bus'}"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=HANGS_S, check=False)
    assert done.returncode == 4
    assert "start hodograph-hub" in done.stderr


@pytest.mark.parametrize("time", ["real", "virtual"])
def test_a_bus_that_ends_under_a_machine_is_said(tmp_path: Path, time: str) -> None:
    """Status 4 and one line: it is no error of ours, and no thread prints a traceback."""
    bus, machine = tmp_path / "bus", str(EXAMPLES / "machines" / "paper_alpha.toml")
    hub = subprocess.Popen([find_program("hodograph-hub"), "--time", time, bus])
    words = [sys.executable, "-m", "hodograph", "rig", machine, "--bus", f"local:{bus}"]
    try:
        await_bus(bus)
        with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as rig:
            assert rig.stderr is not None
            assert "are on local:" in rig.stderr.readline()
            hub.kill()
            said = rig.stderr.read()
            assert rig.wait(HANGS_S) == 4, said
    finally:
        hub.kill()
        hub.wait()
    assert " bus" in said
    assert "Traceback" not in said
    assert "internal error" not in said


def await_bus(path: Path) -> None:
    """Until somebody serves it."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        while probe.connect_ex(str(path)) != 0:
            pass
