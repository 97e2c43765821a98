# SPDX-License-Identifier: MIT
"""Images for microcontrollers have the same bytes from the same tree, wherever they are built. Run by pytest; starts
`make`, and writes to build/ and temporary folders.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from copied_tree import copied_tree

ROOT = Path(__file__).resolve().parents[2]
HANGS_S = 850.0
BOARD = "nucleo_g474re"


def make(tree: Path, *words: str) -> None:
    hidden = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    environment = {name: text for name, text in os.environ.items() if name not in hidden}
    done = subprocess.run(
        ["make", "--no-print-directory", *words],
        cwd=tree,
        env=environment,
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]


def image(target: str, build: Path) -> bytes:
    """The controller's image with all that a debugger reads, built from nothing in a folder of its own."""
    file = build / f"firmware/{target}/controller.elf"
    make(ROOT, f"BUILD={build}", str(file))
    return file.read_bytes()


def test_of_a_copy_of_the_tree(tmp_path: Path) -> None:
    """Built from nothing in the copy, and whenever it was here: the image has the same bytes."""
    file = "build/firmware/an386/controller.elf"
    make(ROOT, file)
    tree = copied_tree(tmp_path, "an386")
    shutil.rmtree((tree / file).parent)
    make(tree, file)
    here = (ROOT / file).read_bytes()
    assert (tree / file).read_bytes() == here
    assert str(ROOT).encode() not in here
    assert str(tmp_path).encode() not in (tree / file).read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("target", ["an385", "an386", "an500", "an505", "microbit", BOARD])
def test_of_every_target(target: str, tmp_path: Path) -> None:
    first = image(target, tmp_path / "a")
    second = image(target, tmp_path / "another/folder")
    assert first == second
    assert str(ROOT).encode() not in first
    assert str(tmp_path).encode() not in first
