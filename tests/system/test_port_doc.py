# SPDX-License-Identifier: MIT
"""docs/port-to-your-board.md, followed to the letter in a copy of the tree: its files, its commands, the same bits."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/port-to-your-board.md").read_text(encoding="utf-8")
FILES = re.findall(r"^`(firmware/[^`]+)`\n\n```\w+\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
COMMANDS = re.search(r"^```sh\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


def copied_tree(folder: Path) -> Path:
    """What the firmware is made from, with what is built of it already for a board of the same core; times kept, so
    that only the new files are compiled.
    """
    for name in ("Makefile", "requirements.lock"):
        shutil.copy2(ROOT / name, folder / name)
    for name in ("firmware", "tools", "tests/target", "tests/proofs", "build/generated"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "build/stamps", folder / "build/stamps", symlinks=True)
    shutil.copytree(ROOT / "build/firmware/an386", folder / "build/firmware/myboard")
    for left in (folder / "build/firmware/myboard").glob("*.elf"):
        left.unlink()
    (folder / ".venv").mkdir()
    (folder / ".venv/bin").symlink_to(ROOT / ".venv/bin")
    ready = folder / ".venv/.ready"
    ready.write_text(str(folder))
    made = (ROOT / ".venv/.ready").stat()
    os.utime(ready, ns=(made.st_atime_ns, made.st_mtime_ns))
    return folder


@pytest.mark.serial
def test_the_page_ends_with_the_same_bits(tmp_path: Path) -> None:
    subprocess.run(["make", "-s", "build/firmware/an386/controller.elf"], cwd=ROOT, check=True)
    tree = copied_tree(tmp_path)
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
