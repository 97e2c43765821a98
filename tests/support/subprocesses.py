# SPDX-License-Identifier: MIT
"""Runs a program to its end, with a time limit, and compares its exit status with the expected one. Used by the tests
of packages and of the library. Starts processes.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def run(
    *command: object, cwd: Path = ROOT, status: int = 0, limit_s: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """Runs a program in a folder.

    Raises AssertionError, with the end of the output, if the exit status differs, and subprocess.TimeoutExpired after
    limit_s.
    """
    done = subprocess.run(
        list(map(str, command)),
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=limit_s,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == status, (done.stdout + done.stderr)[-4000:]
    return done
