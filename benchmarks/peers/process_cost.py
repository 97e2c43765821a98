# SPDX-License-Identifier: MIT
"""Processor time and memory of a command, in addition to its output. Used by peers/compare, peers/klipper and
peers/plan_alone.

    process_cost.py OUT COMMAND ...

As a script it runs a command. It writes to OUT the command's processor time in seconds and the peak resident size of
its largest process in KiB. `run_measured` starts this script as a process of its own, because the peak that Linux
reports of a child is at least the size of its parent, and this one is small. Other work on the computer changes
processor time less than wall time. Standard library only.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

_WITH_US = ("setpriv", "--pdeathsig", "KILL", "--")
"""A command that ends when the process that started it ends."""


@dataclass(frozen=True)
class Cost:
    """What a process took."""

    processor_s: float | None
    """None: it plans while it moves."""
    memory_mib: float


def run_measured(
    command: Sequence[object], limit_s: float, environment: Mapping[str, str] | None = None
) -> tuple[subprocess.CompletedProcess[str], Cost]:
    """How a command ended, and what it took."""
    with tempfile.TemporaryDirectory(prefix="peer-") as folder:
        report = Path(folder, "cost")
        done = subprocess.run(
            [*_WITH_US, sys.executable, "-I", __file__, str(report), *map(str, command)],
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
        processor_s, memory_kib = report.read_text().split()
        return done, Cost(float(processor_s), int(memory_kib) / 1024.0)


def main() -> int:
    """The exit status of the command."""
    status = subprocess.run([*_WITH_US, *sys.argv[2:]], check=False).returncode
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    Path(sys.argv[1]).write_text(f"{used.ru_utime + used.ru_stime} {used.ru_maxrss}")
    return status


if __name__ == "__main__":
    sys.exit(main())
