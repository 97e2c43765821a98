# SPDX-License-Identifier: MIT
"""A bus of hodograph-hub, without any CAN of the kernel: the same bits, also over SLCAN in real time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


def in_the_loop(file: Path, link: str, *boards: str) -> None:
    words = [sys.executable, str(ROOT / "tools/til.py"), "--local", str(file), "--link", link]
    words += [f"--target={board}" for board in boards]
    done = subprocess.run(words, capture_output=True, text=True, timeout=240, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stderr + done.stdout
    assert "til: the same bits" in done.stdout


@pytest.mark.serial
@pytest.mark.parametrize("link", ["fifo", "slcan"])
def test_alpha_on_the_board_and_here(link: str) -> None:
    """The second run is the emulated board's; with SLCAN all that passes it is text on its UART, at 1 kHz."""
    in_the_loop(EXAMPLES / "alpha.toml", link)


@pytest.mark.serial
def test_alpha_on_the_other_cores() -> None:
    """Cortex-M3, -M7, -M33, -M0: the whole controller, from the upload to standstill, with two drives on the bus."""
    in_the_loop(EXAMPLES / "alpha.toml", "fifo", "an385", "an500", "an505", "microbit")


@pytest.mark.serial
def test_the_float_kernel_in_the_interrupt_of_the_boards(tmp_path: Path) -> None:
    """The FPU's registers are stacked and restored around each tick: any that was not would change a bit."""
    machine = (EXAMPLES / "machines/paper_alpha.toml").read_text()
    machine = machine.replace('kernel = "fixed"', 'kernel = "float"')
    (tmp_path / "machine.toml").write_text(machine.replace("../drives", str(EXAMPLES / "drives")))
    path = (EXAMPLES / "alpha.toml").read_text().replace("machines/paper_alpha", "machine")
    (tmp_path / "alpha.toml").write_text(path)
    in_the_loop(tmp_path / "alpha.toml", "fifo", "an386", "an500", "an505")


def test_a_bus_that_nobody_serves_is_said(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "hodograph", "status", "--bus", f"local:{tmp_path / 'bus'}"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 4
    assert "start hodograph-hub" in done.stderr
