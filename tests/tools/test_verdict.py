# SPDX-License-Identifier: MIT
"""The counter of tests: nothing that went wrong may look like a success. Run by pytest; writes to temporary folders."""

from __future__ import annotations

from pathlib import Path

import pytest

from testing.units import run_unit
from testing.verdict import Count, read_junit, read_unity

PASSING = "a.c:3:test_x:PASS\n\n-----------------------\n1 Tests 0 Failures 0 Ignored\nOK\n"


def test_a_passing_binary() -> None:
    count = read_unity("a", PASSING, 0)
    assert (count.passed, count.skipped, count.failures) == (1, 0, [])


def test_failed_and_ignored_tests() -> None:
    output = (
        "a.c:3:test_x:FAIL: Expected 1 Was 2\na.c:5:test_y:IGNORE: later\n"
        "2 Tests 1 Failures 1 Ignored\nFAIL\n"
    )
    count = read_unity("a", output, 1)
    assert (count.passed, count.skipped) == (0, 1)
    assert count.failures == ["a.c:3: test_x: Expected 1 Was 2"]


@pytest.mark.parametrize(
    ("output", "status"),
    [
        ("", 0),  # says nothing
        ("a.c:3:test_x:PASS\n", -11),  # crashes on the way
        (PASSING, 1),  # crashes, or leaks, after its tests
        ("0 Tests 0 Failures 0 Ignored\nOK\n", 0),  # tests nothing
    ],
)
def test_anything_else_is_one_failure(output: str, status: int) -> None:
    assert len(read_unity("a", output, status).failures) == 1


def test_a_binary_that_was_not_built(tmp_path: Path) -> None:
    assert len(run_unit(tmp_path / "none", tmp_path).failures) == 1


def test_a_report_of_pytest(tmp_path: Path) -> None:
    report = tmp_path / "r.xml"
    report.write_text(
        '<testsuites><testsuite><testcase classname="m" name="a"/>'
        '<testcase classname="m" name="b"><failure/></testcase>'
        '<testcase classname="m" name="c"><error/></testcase>'
        '<testcase classname="m" name="d"><skipped/></testcase></testsuite></testsuites>'
    )
    count = read_junit(report, "free", 1)
    assert (count.passed, count.skipped, count.failures) == (1, 1, ["m::b", "m::c"])


@pytest.mark.parametrize("status", [1, 2, 3, 4, 5, -9, 125])
def test_pytest_that_ended_badly_without_a_failure(tmp_path: Path, status: int) -> None:
    report = tmp_path / "r.xml"
    assert len(read_junit(report, "free", status).failures) == 1
    report.write_text("<testsuites><testsuite/></testsuites>")
    assert len(read_junit(report, "free", status).failures) == 1


def test_the_last_line() -> None:
    count = Count(passed=3, skipped=0, failures=["x"])
    assert str(count) == "3 passed, 1 failed"
    count.skipped = 2
    assert str(count) == "3 passed, 1 failed, 2 skipped"
