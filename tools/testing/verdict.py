# SPDX-License-Identifier: MIT
"""Counts tests from the output of test programs. Output that is not understood counts as a failure. Used by
tools/run_tests, testing/groups and testing/units. Reads the reports of pytest; prints skipped tests to stdout.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

_RESULT = re.compile(
    r"^(?P<where>[^:\n]+:\d+):(?P<name>\w+):(?P<result>PASS|FAIL|IGNORE)(?P<why>.*)$"
)
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
    """The counts in a Unity binary's output and exit status."""
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


def read_junit(path: Path, group: str, status: int) -> Count:
    """The counts in pytest's XML report and exit status."""
    try:
        cases = list(ElementTree.parse(path).iter("testcase"))
    except (OSError, ElementTree.ParseError):
        return Count(failures=[f"pytest ({group}): no report, exit status {status}"])
    count = Count()
    for case in cases:
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
