#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""run_parts.py [--step NAME COMMAND | --tests NAME COMMAND]...: runs commands one after the other and sums them up.

Run by `make test-all` and .ci/run. Used by tools/repeat_tests. Starts processes.

The output of a part passes through. A part given by --tests has to end with a line `N passed, N failed`, with or
without `, N skipped`. A part fails if its exit status is not 0; a part of --tests also if it has no such line or counts
a failure. After a failure the other parts still run. At the end there is a table of how long each part took, and as the
last line the sum: `N passed, N failed`. A part that fails without having counted a failure is one failure. Exit status
1 when there is any. Standard library only: it runs before anything is installed.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_COUNT = re.compile(r"(\d+) passed, (\d+) failed(?:, (\d+) skipped)?")
_LAST = 50  # lines that may follow a count: make's messages about an error


@dataclass(frozen=True)
class Part:
    """A command with its name; `is_counted`: it ends with a count."""

    name: str
    command: str
    is_counted: bool


@dataclass(frozen=True)
class Result:
    """How a part ended."""

    name: str
    seconds: float
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    has_count: bool = False

    @property
    def count(self) -> str:
        """For the table and the last line."""
        skipped = f", {self.skipped} skipped" if self.skipped else ""
        return f"{self.passed} passed, {self.failed} failed{skipped}"


def judge(part: Part, status: int, last: Iterable[str], seconds: float) -> Result:
    """The result of a part from its exit status and its last lines."""
    if not part.is_counted:
        return Result(part.name, seconds, failed=int(status != 0))
    counts = [found for line in last if (found := _COUNT.fullmatch(line.strip()))]
    if not counts:
        return Result(part.name, seconds, failed=1)
    passed, failed, skipped = (int(number or 0) for number in counts[-1].groups())
    if status != 0:
        failed = max(failed, 1)
    return Result(part.name, seconds, passed, failed, skipped, has_count=True)


def run(part: Part) -> Result:
    """Runs a part; its output passes through."""
    print(f"\n==== {part.name}: {part.command}", flush=True)
    began_s = time.monotonic()
    last: deque[str] = deque(maxlen=_LAST)
    with subprocess.Popen(
        ["bash", "-c", part.command],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            sys.stdout.write(line)
            sys.stdout.flush()
            last.append(line)
    return judge(part, process.returncode, last, time.monotonic() - began_s)


def summary(results: Sequence[Result]) -> str:
    """The table and the last line."""
    whole = Result(
        "all",
        sum(result.seconds for result in results),
        sum(result.passed for result in results),
        sum(result.failed for result in results),
        sum(result.skipped for result in results),
        has_count=True,
    )
    lines = ["", "parts:"]
    for result in (*results, whole):
        said = result.count if result.has_count else "FAILED" if result.failed else ""
        minutes, seconds = divmod(round(result.seconds), 60)
        lines.append(f"  {minutes:3} min {seconds:2} s  {result.name:8} {said}".rstrip())
    return "\n".join([*lines, whole.count])


class _Add(argparse.Action):
    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option: str | None = None,
    ) -> None:
        assert isinstance(values, list)
        name, command = values
        namespace.parts = [*namespace.parts, Part(name, command, option == "--tests")]


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.set_defaults(parts=[])
    for option in ("--step", "--tests"):
        parser.add_argument(option, nargs=2, action=_Add, metavar=("NAME", "COMMAND"))
    parts = parser.parse_args().parts
    if not parts:
        parser.error("no parts are given")
    results = [run(part) for part in parts]
    print(summary(results), flush=True)
    return 1 if any(result.failed for result in results) else 0


if __name__ == "__main__":
    sys.exit(main())
