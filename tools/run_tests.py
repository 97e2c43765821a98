#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""run_tests.py: runs every test there is, C and Python, and counts them together.

The last line of its output is `N passed, N failed` (and `, N skipped` where there are any); the exit
status is 0 only when none has failed and at least one has passed. A C test binary that crashes, or says
nothing, counts as one failed test. Three groups of Python tests run after the C tests: those that need no
bus (two at a time), those that must be alone, and those marked `bus` under tools/with-vcan.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_UNIT_LIMIT_S = 300
_RESULT = re.compile(
    r"^(?P<where>[^:\n]+:\d+):(?P<name>\w+):(?P<result>PASS|FAIL|IGNORE)(?P<why>.*)$"
)
_IN_FULL = (
    "test_override",
    "test_stm32g4_flash",
)  # optimised too, with all cases: the PLAIN_BINS of the Makefile
_SUMMARY = re.compile(r"^(\d+) Tests (\d+) Failures (\d+) Ignored", re.MULTILINE)


@dataclass
class Count:
    """Tests so far; `failures` has a line for each failed one."""

    passed: int = 0
    skipped: int = 0
    failures: list[str] = field(default_factory=list)

    def add(self, other: Count) -> None:
        """Takes the figures of another group in."""
        self.passed += other.passed
        self.skipped += other.skipped
        self.failures += other.failures

    def __str__(self) -> str:
        skipped = f", {self.skipped} skipped" if self.skipped else ""
        return f"{self.passed} passed, {len(self.failures)} failed{skipped}"


def read_unity(name: str, output: str, status: int) -> Count:
    """What a Unity binary's output and exit status mean."""
    count = Count()
    for line in output.splitlines():
        found = _RESULT.match(line)
        if found is None:
            continue
        if found["result"] == "PASS":
            count.passed += 1
        elif found["result"] == "FAIL":
            count.failures.append(f"{found['where']}: {found['name']}{found['why']}")
        else:
            count.skipped += 1
            print(f"skipped: {name}: {found['name']}{found['why']}")
    summary = _SUMMARY.search(output)
    if summary is None:
        count.failures.append(f"{name}: ended before its summary (exit status {status})")
    elif int(summary[1]) == 0:
        count.failures.append(f"{name}: has no tests")
    elif status != 0 and not count.failures:
        count.failures.append(f"{name}: exit status {status} after its tests")
    return count


def run_unit(binary: Path) -> Count:
    """Runs one Unity binary; prints what it says unless all is well."""
    try:
        done = subprocess.run(
            [binary],
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=_UNIT_LIMIT_S,
            check=False,
        )
    except OSError as error:
        return Count(failures=[f"{binary.name}: {error.strerror}"])
    except subprocess.TimeoutExpired:
        return Count(failures=[f"{binary.name}: not finished after {_UNIT_LIMIT_S} s"])
    count = read_unity(binary.name, done.stdout, done.returncode)
    print(f"{binary.name}: {count}")
    if count.failures:
        print(done.stdout)
    return count


def run_all_units(build: Path) -> Count:
    """Every C test, one binary for each tests/unit/test_*.c, and those of _IN_FULL once more."""
    total = Count()
    sources = sorted((ROOT / "tests/unit").glob("test_*.c"))
    binaries = [build / "host/tests" / name for name in _IN_FULL]
    binaries += [build / "asan/tests" / source.stem for source in sources]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for count in pool.map(run_unit, binaries):
            total.add(count)
    return total


def read_junit(path: Path, group: str, status: int) -> Count:
    """What pytest's XML report and exit status mean."""
    if not path.exists():
        return Count(failures=[f"pytest ({group}): no report, exit status {status}"])
    count = Count()
    for case in ElementTree.parse(path).iter("testcase"):
        name = f"{case.get('classname')}::{case.get('name')}"
        if any(case.find(tag) is not None for tag in ("failure", "error")):
            count.failures.append(name)
        elif case.find("skipped") is not None:
            count.skipped += 1
        else:
            count.passed += 1
    if status not in (0, 1) or (status == 1 and not count.failures):  # 5: a group without tests
        count.failures.append(f"pytest ({group}): exit status {status}")
    return count


def run_pytest(build: Path, group: str, before: list[str], options: list[str]) -> Count:
    """One run of pytest."""
    print(f"\n== Python tests: {group}", flush=True)
    report = build / f"pytest-{group}.xml"
    report.unlink(missing_ok=True)
    command = [
        *before,
        sys.executable,
        "-m",
        "pytest",
        "-q",
        f"--junitxml={report}",
        *options,
    ]
    status = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, check=False).returncode
    sys.stdout.flush()
    return read_junit(report, group, status)


def run_python(build: Path) -> Count:
    """The groups of Python tests."""
    workers = str(min(os.cpu_count() or 1, 8))
    total = Count()
    for group, before, options in (
        ("free", [], ["-m", "not bus and not serial", "-n", workers]),
        ("serial", [], ["-m", "serial and not bus"]),
        (
            "bus",
            [str(ROOT / "tools/with-vcan"), "--own", "--name", f"test-{os.getpid()}"],
            ["-m", "bus"],
        ),
    ):
        total.add(run_pytest(build, group, before, options))
    return total


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--only", choices=("unit", "python"))
    options = parser.parse_args()
    build = options.build.resolve()
    build.mkdir(exist_ok=True)
    total = Count()
    if options.only != "python":
        print("== C tests (address and undefined-behaviour sanitizers)", flush=True)
        total.add(run_all_units(build))
    if options.only != "unit":
        total.add(run_python(build))
    print()
    for failure in total.failures:
        print(f"failed: {failure}")
    print(total, flush=True)
    return 0 if total.passed and not total.failures else 1


if __name__ == "__main__":
    sys.exit(main())
