# SPDX-License-Identifier: MIT
"""docs/guides/port-to-your-board.md, followed to the letter in a copy of the tree: its files, its commands, the same
bits. Run by pytest; starts `make` and an emulated board, and writes to build/ and temporary folders.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from copied_tree import copied_tree

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/guides/port-to-your-board.md").read_text(encoding="utf-8")
FILES = re.findall(r"^`(firmware/[^`]+)`\n\n```\w+\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
COMMANDS = re.search(r"^```sh\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


@pytest.mark.serial
def test_the_page_ends_with_the_same_bits(tmp_path: Path) -> None:
    subprocess.run(["make", "-s", "build/firmware/an386/controller.elf"], cwd=ROOT, check=True)
    tree = copied_tree(tmp_path, "myboard")
    assert [Path(name).name for name, _ in FILES] == [
        *("board.mk", "myboard.ld", "store.c", "tick.h", "tick.c", "can.h", "can.c", "port.c")
    ]
    for name, text in FILES:
        (tree / name).parent.mkdir(exist_ok=True)
        (tree / name).write_text(text, encoding="utf-8")
    assert COMMANDS is not None
    make, til = (shlex.split(line) for line in COMMANDS[1].splitlines())
    assert make[:2] == ["make", "build"]  # the host's programs, which are here
    built = subprocess.run(
        ["make", *make[2:]], cwd=tree, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stdout + built.stderr
    image = str(tree / til[til.index("--image") + 1])
    til[0], til[til.index("--image") + 1] = sys.executable, image
    done = subprocess.run(til, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "til: the same bits" in done.stdout
