# SPDX-License-Identifier: MIT
"""docs/start/first-path.md, followed to the letter: its file, its commands, its numbers. Run by pytest; starts
`hodograph` as a process, and writes to temporary folders.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/start/first-path.md").read_text(encoding="utf-8")
FILE = re.search(r"^```toml\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
COMMANDS = re.findall(r"^    \.venv/bin/hodograph ([^#\n]*)", TEXT, re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that has what the page uses of the tree, and the file that it writes."""
    assert FILE is not None
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "my_path.toml").write_text(FILE[1], encoding="utf-8")
    return tmp_path


def run(folder: Path, words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "hodograph", *shlex.split(words)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_the_page_leads_to_the_same_bits(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`run` serves a local bus, in a folder of its own, where the kernel has no vcan0."""
    monkeypatch.delenv("HODOGRAPH_BUS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    spline, feed, simulate, report, on_bus = (run(folder, words) for words in COMMANDS[:5])
    assert COMMANDS[4].startswith("run ")
    assert re.search(r"length +\d+\.\d+ mm", spline)
    duration = re.search(r"duration +([\d.]+) s", feed)
    assert duration is not None
    assert f"({float(duration[1]):.3f} s)" in TEXT
    error = re.search(r"greatest contour error +([\d.]+) um", simulate)
    assert error is not None
    assert f"({float(error[1]):.1f} µm)" in TEXT
    assert report == "out/report.html\n"
    assert (folder / "out" / "report.html").exists()
    hashes = re.findall(r"SHA-256 +(\w+)", simulate)
    assert len(hashes) == 2
    assert re.findall(r"SHA-256 +(\w+)", on_bus) == hashes
