# SPDX-License-Identifier: MIT
"""The commands of docs/guides/candump.md are run with Debian's can-utils, and their output is compared with the page.
Run by pytest on vcan0; starts a controller, drives and can-utils, and writes to temporary folders.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from bench import MakeBench
from hodograph.bus.sdo.controller import OFF

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 120.0

SLEEP = """\
#!/bin/sh
# The pause of 0.5 s that a person gives candump to start ends when one more listens for 581 than before the command.
if [ "$1" = 0.5 ]; then
    until [ "$(grep -c ' 581 ' /proc/net/can/rcvlist_fil)" -gt "$LISTENERS" ]; do /bin/sleep 0.02; done
else
    exec /bin/sleep "$@"
fi
"""


@dataclass(frozen=True)
class Example:
    """A command of the page, the output shown beneath, and the line where it stands."""

    line: int
    command: str
    output: tuple[str, ...]


def examples(page: Path) -> list[Example]:
    """All `$ commands` in blocks of the language console."""
    found: list[Example] = []
    inside = False
    for number, line in enumerate(page.read_text().splitlines(), start=1):
        if line.startswith("```"):
            inside = line == "```console"
        elif inside and line.startswith("$ "):
            found.append(Example(number, line[2:], ()))
        elif inside:
            last = found[-1]
            found[-1] = Example(last.line, last.command, (*last.output, line))
    return found


def pattern(output: tuple[str, ...]) -> str:
    """A regular expression: `…` is anything within a line, alone in a line any lines."""
    parts = []
    for line in output:
        if line == "…":
            parts.append(r"(?:[^\n]*\n)*?")
        else:
            parts.append(r"[^\n]*".join(re.escape(part) for part in line.split("…")) + r"[ ]*\n")
    return "".join(parts)


def listeners() -> int:
    """How many receive the answers of node 1."""
    return Path("/proc/net/can/rcvlist_fil").read_text().count(" 581 ")


@pytest.mark.bus
def test_the_page(make_bench: MakeBench, tmp_path: Path) -> None:
    for name in ("candump", "cansend"):
        assert shutil.which(name), (
            f"{name} is missing: make test installs it (tools/packages.py test)"
        )
    bench = make_bench("real-time")
    bench.controller.wait_for((OFF,), 20.0)
    sleep = tmp_path / "bin/sleep"
    sleep.parent.mkdir()
    sleep.write_text(SLEEP, encoding="utf-8")
    sleep.chmod(0o755)
    path = f"{sleep.parent}:{Path(sys.executable).parent}:{os.environ['PATH']}"
    found = examples(ROOT / "docs" / "guides" / "candump.md")
    assert len(found) > 15
    for example in found:
        done = subprocess.run(
            ["bash", "-c", example.command],
            cwd=tmp_path,
            env=os.environ | {"PATH": path, "LISTENERS": str(listeners())},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        place = f"docs/guides/candump.md, line {example.line}: {example.command}\n{done.stdout}"
        assert done.returncode == 0, place
        assert re.fullmatch(pattern(example.output), done.stdout), place


def test_how_pages_are_read(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```console\n$ a b\n x … z\n…\n$ c\n```\n```\n$ not this\n```\n")
    assert examples(page) == [Example(2, "a b", (" x … z", "…")), Example(5, "c", ())]
    shown = pattern((" x … z", "…", "end"))
    assert re.fullmatch(shown, " x y y z \nend\n")
    assert re.fullmatch(shown, " x y z\n1\n2\nend\n")
    assert not re.fullmatch(shown, " x y\nend\n")
    assert not re.fullmatch(pattern(()), "something\n")
