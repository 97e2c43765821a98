# SPDX-License-Identifier: MIT
"""Commands without a bus run where Python lacks what only Linux has (docs/guides/windows-macos.md). Run by pytest;
starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hodograph.bus import processes
from hodograph.errors import BusError

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
LIKE_WINDOWS = """
import os, socket, sys
for name in ("AF_CAN", "PF_CAN", "CAN_RAW", "AF_UNIX"):
    delattr(socket, name)
for name in ("sched_getaffinity", "sched_setaffinity", "fork"):
    delattr(os, name)
LACKING = {"fcntl", "termios", "resource", "pwd", "grp", "tty", "pty"}
class Lacking:
    def find_spec(self, name, path=None, target=None):
        if name in LACKING:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Lacking())
for name in LACKING:
    sys.modules.pop(name, None)
from hodograph.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def called(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", LIKE_WINDOWS, *words]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=600, check=False
    )


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", str(EXAMPLES / "star.toml"), "--json"),
        ("schema", "machine"),
        ("init", "part"),
        ("monitor", "--help"),
    ],
)
def test_commands_without_a_bus(words: tuple[str, ...], tmp_path: Path) -> None:
    done = called(tmp_path, *words)
    assert done.returncode == 0, done.stderr


def test_adapters_are_asked_and_socketcan_is_refused_by_name(tmp_path: Path) -> None:
    asked = called(tmp_path, "scan", "--bus", "virtual:x", "--no-lss", "--wait", "0.1")
    assert (asked.returncode, asked.stderr.count("\n")) == (4, 1)
    assert "virtual:x: no node answers" in asked.stderr
    refused = called(tmp_path, "scan", "--bus", "socketcan:can0")
    assert refused.returncode == 4
    assert "only Linux has SocketCAN" in refused.stderr


def test_programs_are_for_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    """Elsewhere the installation leaves them out, and commands that need them say so."""
    monkeypatch.setattr(processes.platform, "system", lambda: "Darwin")
    monkeypatch.setattr(processes, "_PACKAGE", Path("/nowhere"))
    monkeypatch.setattr(processes, "_REPOSITORY", Path("/nowhere"))
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(BusError, match=r"hodograph-hub runs on Linux only: .*container"):
        processes.find_program("hodograph-hub")
