#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""run_faults.py [--seeds N] [--jobs N] [SCENARIO...]: the whole campaign of `hodograph faults`, in parts side by side.

Run by `make faults`. Starts processes.

Each part has a core and, for each case, local buses of its own in virtual time: the table is the same each time.
Prints one table for all; build/faults.json has every case. The exit status is 0 only when there was no violation and
every part came to its end.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from hodograph.faults.case_table import text
from hodograph.faults.judge import Verdict

ROOT = Path(__file__).resolve().parent.parent
_VIOLATIONS = 6
"""Exit status of a part that found violations, and printed its cases all the same."""


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--output", type=Path, default=ROOT / "build" / "faults.json")
    parser.add_argument("scenarios", nargs="*")
    options = parser.parse_args()
    cases, sound = _run_parts(options)
    options.output.write_text(json.dumps(cases, indent=1) + "\n")
    verdicts = [Verdict.of(case) for case in cases]
    print(text(verdicts))
    violations = sum(len(verdict.violations) for verdict in verdicts)
    print(f"{len(verdicts)} cases, {violations} violations")
    return 0 if sound and verdicts and violations == 0 else 1


def _run_parts(options: argparse.Namespace) -> tuple[list[dict[str, object]], bool]:
    """Cases of all parts by scenario, and whether each part came to its end."""
    with tempfile.TemporaryDirectory() as folder:
        parts = [
            (_start(options, k, Path(folder) / f"{k}.json"), Path(folder) / f"{k}.json")
            for k in range(1, options.jobs + 1)
        ]
        statuses = [part.wait() for part, _ in parts]
        cases = [case for _, file in parts if file.stat().st_size for case in _cases(file)]
    for k, status in enumerate(statuses, start=1):
        if status not in (0, _VIOLATIONS):
            print(f"part {k} ended with status {status}", file=sys.stderr)
    cases.sort(key=lambda case: (str(case["scenario"]), int(str(case["seed"]))))
    return cases, all(status in (0, _VIOLATIONS) for status in statuses)


def _start(options: argparse.Namespace, part: int, file: Path) -> subprocess.Popen[bytes]:
    command = [
        sys.executable,
        "-m",
        "hodograph",
        "faults",
        *options.scenarios,
        "--seeds",
        str(options.seeds),
        "--json",
    ]
    command += ["--part", f"{part}/{options.jobs}"]
    if part > 1:  # the first shows how far all are
        command.append("--no-progress")
    cores = sorted(os.sched_getaffinity(0))
    core = cores[part % len(cores)]

    def on_one_core() -> None:
        """The processes of a simulation take turns: waking across cores costs more than it gains."""
        os.sched_setaffinity(0, {core})

    with file.open("wb") as output:
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, preexec_fn=on_one_core
        )


def _cases(file: Path) -> list[dict[str, object]]:
    found: list[dict[str, object]] = json.loads(file.read_text())["cases"]
    return found


if __name__ == "__main__":
    sys.exit(main())
