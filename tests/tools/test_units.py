# SPDX-License-Identifier: MIT
"""C tests run again when their binary or their data has changed, and not else. Run by pytest; starts scripts, and
writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from testing.cache import Stamps
from testing.units import Units

SAYS = "#!/bin/sh\necho '{}'\n"
GOOD = "1 Tests 0 Failures 0 Ignored"
BAD = "a.c:1:test_a:FAIL: x\n1 Tests 1 Failures 0 Ignored"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for folder in ("tests/unit", "tests/data", "build/asan/tests", "build/host/tests"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "tests/unit/test_a.c").write_text("")
    (tmp_path / "tests/data/program").write_text("1")
    for name in ("host/tests/test_override", "host/tests/test_stm32g4_flash", "asan/tests/test_a"):
        write(tmp_path, name, GOOD)
    return tmp_path


def write(root: Path, name: str, says: str) -> None:
    path = root / "build" / name
    path.write_text(SAYS.format(says))
    path.chmod(0o755)


def units(root: Path, *, used: bool = True) -> Units:
    return Units(root, root / "build", Stamps("units", used=used, base=root / "cache"))


def changed(root: Path) -> set[str]:
    return {str(path.relative_to(root / "build")) for path in units(root).changed()}


IN_FULL = {"host/tests/test_override", "host/tests/test_stm32g4_flash"}
ALL = {"asan/tests/test_a"}


def test_what_has_passed_does_not_run_again(root: Path) -> None:
    assert changed(root) == ALL
    write(root, "asan/tests/test_a", "a.c:1:test_a:PASS\n" + GOOD)
    them = units(root)
    count = them.run(them.binaries(), 2)
    assert (count.passed, count.failures) == (1, [])
    assert set(them.seconds) == ALL | IN_FULL
    assert changed(root) == set()
    write(root, "asan/tests/test_a", GOOD)
    assert changed(root) == {"asan/tests/test_a"}
    write(root, "asan/tests/test_a", "a.c:1:test_a:PASS\n" + GOOD)  # linked as it was
    assert changed(root) == set()
    (root / "tests/data/program").write_text("2")
    assert changed(root) == ALL


def test_what_has_failed_runs_again(root: Path) -> None:
    write(root, "asan/tests/test_a", BAD)
    them = units(root)
    assert len(them.run(them.binaries(), 1).failures) == 1
    assert changed(root) == {"asan/tests/test_a"}


def test_two_binaries_of_one_content_are_two(root: Path) -> None:
    them = units(root)
    them.run([root / "build/asan/tests/test_a"], 1)
    assert "asan/tests/test_a" not in changed(root)
    (root / "tests/unit/test_b.c").write_text("")
    write(root, "asan/tests/test_b", GOOD)
    assert "asan/tests/test_b" in changed(root)


def test_a_binary_that_is_not_there_has_changed_and_fails(root: Path) -> None:
    them = units(root)
    them.run(them.binaries(), 1)
    (root / "build/asan/tests/test_a").unlink()
    assert changed(root) == {"asan/tests/test_a"}
    assert len(them.run(them.changed(), 1).failures) == 1
    assert changed(root) == {"asan/tests/test_a"}


def test_all_run_where_stamps_are_off(root: Path) -> None:
    them = units(root)
    them.run(them.binaries(), 1)
    assert len(units(root, used=False).changed()) == len(ALL)
