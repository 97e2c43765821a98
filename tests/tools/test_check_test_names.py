# SPDX-License-Identifier: MIT
"""The check of names in tests: each kind of breach is found in a small tree, and none in this one. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from check_test_names import breaches

ROOT = Path(__file__).resolve().parents[2]
GOOD = (
    "tests/conftest.py",
    "tests/host/conftest.py",
    "tests/host/feed/test_plan.py",
    "tests/support/commands.py",
    "tools/vcan/agent.py",
    "tools/unity.lock",
    "tools/count.py",
)


def found(root: Path, *more: str) -> list[str]:
    for name in (*GOOD, *more):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).touch()
    return [line.partition(":")[0] for line in breaches(root)]


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ((), []),
        (("tests/host/job/test_plan.py",), ["tests/host/job/test_plan.py"]),
        (("tests/host/job/__init__.py", "tests/host/job/test_plan.py"), []),
        (("tests/host/feed/commands.py",), ["tests/support/commands.py"]),
        (("tests/support/vcan.py",), ["tests/support/vcan.py"]),
        (("tests/support/unity.py",), []),
        (("tests/system/count.py",), ["tests/system/count.py"]),
        (("tests/support/selectors.py",), ["tests/support/selectors.py"]),
    ],
)
def test_names_that_are_taken(more: tuple[str, ...], named: list[str], tmp_path: Path) -> None:
    assert found(tmp_path, *more) == named
