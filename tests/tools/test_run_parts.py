# SPDX-License-Identifier: MIT
"""tools/run_parts.py: a part that fails, or that prints no count of tests, adds a failure to the sum in the last line.
Run by pytest; starts processes.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from run_parts import Part, Result, judge, summary

ROOT = Path(__file__).resolve().parents[2]
STEP, TESTS = Part("a", "true", is_counted=False), Part("b", "true", is_counted=True)


@pytest.mark.parametrize(
    ("part", "status", "lines", "expected"),
    [
        (STEP, 0, ["9 passed, 4 failed\n"], (0, 0, 0)),
        (STEP, 2, [], (0, 1, 0)),
        (TESTS, 0, ["words\n", "7 passed, 0 failed\n"], (7, 0, 0)),
        (TESTS, 0, ["7 passed, 0 failed, 2 skipped\n"], (7, 0, 2)),
        (TESTS, 1, ["7 passed, 3 failed\n", "make: *** [test] Error 1\n"], (7, 3, 0)),
        (TESTS, 1, ["7 passed, 0 failed\n"], (7, 1, 0)),  # ended badly after its count
        (TESTS, 0, ["7 passed, 2 failed\n"], (7, 2, 0)),  # a failure, whatever its status says
        (TESTS, 0, [], (0, 1, 0)),
        (TESTS, 0, ["it said: 7 passed, 0 failed\n"], (0, 1, 0)),
        (TESTS, -9, ["1 passed, 0 failed\n", "2 passed, 0 failed\n"], (2, 1, 0)),  # the last counts
    ],
)
def test_a_part_is_judged(
    part: Part, status: int, lines: list[str], expected: tuple[int, int, int]
) -> None:
    result = judge(part, status, lines, 1.0)
    assert (result.passed, result.failed, result.skipped) == expected


def test_the_sum_is_the_last_line() -> None:
    parts = [
        Result("build", 61.0),
        Result("lint", 5.0, failed=1),
        Result("test", 4.0, 3, 1, 2, has_count=True),
    ]
    lines = summary(parts).splitlines()
    assert lines[-1] == "3 passed, 2 failed, 2 skipped"
    assert lines[-5:-1] == [
        "    1 min  1 s  build",
        "    0 min  5 s  lint     FAILED",
        "    0 min  4 s  test     3 passed, 1 failed, 2 skipped",
        "    1 min 10 s  all      3 passed, 2 failed, 2 skipped",
    ]


def run(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "tools/run_parts.py"), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_parts_after_a_failure_run_all_the_same() -> None:
    done = run("--step", "one", "echo to one; false", "--tests", "two", "echo 5 passed, 0 failed")
    assert done.returncode == 1
    assert "to one" in done.stdout
    assert done.stdout.splitlines()[-1] == "5 passed, 1 failed"


def test_all_is_well() -> None:
    done = run("--step", "one", "true", "--tests", "two", "echo 5 passed, 0 failed")
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "5 passed, 0 failed"


def test_no_parts_is_a_mistake() -> None:
    assert run().returncode == 2
