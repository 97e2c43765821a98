# SPDX-License-Identifier: MIT
"""docs/start/first-path.md, followed to the letter but for the path of the bus: its file, its commands, its numbers."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from hodograph.bus.hub import LocalHub

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/start/first-path.md").read_text(encoding="utf-8")
FILE = re.search(r"^```toml\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
COMMANDS = re.findall(r"^    \.venv/bin/hodograph ([^#\n]*)", TEXT, re.MULTILINE)
BUS = "local:/tmp/hodograph-bus"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that has what the page uses of the tree, and the file that it writes."""
    assert FILE is not None
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "my_path.toml").write_text(FILE[1], encoding="utf-8")
    return tmp_path


def run(folder: Path, words: str, environment: Mapping[str, str] | None = None) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "hodograph", *shlex.split(words)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_the_page_leads_to_the_same_bits(folder: Path) -> None:
    without_bus = COMMANDS[: next(k for k, words in enumerate(COMMANDS) if BUS in words)]
    spline, feed, simulate, report = (run(folder, words) for words in without_bus)
    assert "98.3218 mm" in spline
    duration = re.search(r"duration +([\d.]+) s", feed)
    assert duration is not None
    assert f"({float(duration[1]):.3f} s)" in TEXT
    error = re.search(r"greatest contour error +([\d.]+) um", simulate)
    assert error is not None
    assert f"({float(error[1]):.1f} µm)" in TEXT
    assert report == "out/report.html\n"
    assert (folder / "out" / "report.html").exists()
    with LocalHub() as hub:
        on_bus = run(folder, COMMANDS[len(without_bus)].replace(BUS, str(hub.address)))
    hashes = re.findall(r"SHA-256 +(\w+)", simulate)
    assert len(hashes) == 2
    assert re.findall(r"SHA-256 +(\w+)", on_bus) == hashes
