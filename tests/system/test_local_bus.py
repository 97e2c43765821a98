# SPDX-License-Identifier: MIT
"""A bus of hodograph-hub, without any CAN of the kernel: the same bits, also over SLCAN in real time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TIL = [sys.executable, str(ROOT / "tools/til.py"), "--local", str(ROOT / "examples/alpha.toml")]


@pytest.mark.serial
@pytest.mark.parametrize("link", ["fifo", "slcan"])
def test_alpha_on_the_board_and_here(link: str) -> None:
    """The second run is the emulated board's; with SLCAN all that passes it is text on its UART, at 1 kHz."""
    done = subprocess.run(
        [*TIL, "--link", link], capture_output=True, text=True, timeout=120, check=False
    )
    print(done.stdout)
    assert done.returncode == 0, done.stderr + done.stdout
    assert "til: the same bits" in done.stdout


def test_a_bus_that_nobody_serves_is_said(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "hodograph", "status", "--bus", f"local:{tmp_path / 'bus'}"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 4
    assert "start hodograph-hub" in done.stderr
