# SPDX-License-Identifier: MIT
"""Images for microcontrollers have the same bytes from the same tree, wherever they are built. Run by pytest; starts
`make`, and writes to temporary folders.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HANGS_S = 850.0
BOARD = "nucleo_g474re"


def image(target: str, build: Path) -> bytes:
    """The controller's image with all that a debugger reads, built from nothing in a folder of its own."""
    hidden = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    environment = {name: text for name, text in os.environ.items() if name not in hidden}
    file = build / f"firmware/{target}/controller.elf"
    done = subprocess.run(
        ["make", "--no-print-directory", f"BUILD={build}", str(file)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return file.read_bytes()


def check(target: str, folder: Path) -> None:
    first = image(target, folder / "a")
    second = image(target, folder / "another/folder")
    assert first == second
    assert str(ROOT).encode() not in first
    assert str(folder).encode() not in first


def test_of_the_board(tmp_path: Path) -> None:
    check(BOARD, tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("target", ["an385", "an386", "an500", "an505", "microbit"])
def test_of_every_target(target: str, tmp_path: Path) -> None:
    check(target, tmp_path)
