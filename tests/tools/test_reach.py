# SPDX-License-Identifier: MIT
"""Which test files a change reaches: in a small tree of its own, with all that a test can depend on. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from testing.cache import Stamps
from testing.reach import Imports, Reach, Recorded, within

FILES = {
    "pyproject.toml": "",
    "requirements.lock": "",
    "tests/conftest.py": "import support",
    "tests/support/support.py": "",
    "tests/host/test_one.py": "from pack.one import f\n",
    "tests/host/test_late.py": "def test_it():\n    from pack import late\n",
    "tests/host/test_any.py": "import pack.loader\n",
    "tests/host/beside.py": "",
    "tests/host/test_beside.py": "import beside\n",
    "tools/tool.py": "import pack.one",
    "tests/tools/test_tool.py": "import tool\n",
    "host_tools/pack/__init__.py": "",
    "host_tools/pack/__main__.py": "import pack.loader\n",
    "host_tools/pack/one.py": "from . import two\n",
    "host_tools/pack/two.py": "from ..pack.sub import three\n",
    "host_tools/pack/late.py": "",
    "host_tools/pack/alone.py": "",
    "host_tools/pack/sub/__init__.py": "",
    "host_tools/pack/sub/three.py": "import os",
    "host_tools/pack/loader/__init__.py": "from importlib import import_module\nimport_module(n)\n",
    "host_tools/pack/loader/any.py": "",
    "examples/data.toml": "a = 1",
    "firmware/core.c": "int a;",
    "build/bin/program": "1",
    "build/firmware/image.elf": "1",
}
ONE = "tests/host/test_one.py"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
        os.utime(tmp_path / name, (1, 1))
    return tmp_path


def reach(root: Path) -> Reach:
    return Reach(root, Stamps("python", base=root.parent / f"{root.name}-cache"))


def passed(*files: str, **more: object) -> Recorded:
    """A run in which one test of each file has passed."""
    recorded = Recorded(
        seconds={file: {f"{file}::test": 2.0} for file in files},
        cpu_s=dict.fromkeys(files, 1.0),
        groups={file: {"free": 1} for file in files},
    )
    for name, value in more.items():
        setattr(recorded, name, value)
    return recorded


def change(path: Path) -> None:
    path.write_text(path.read_text() + "\n")


def is_current(root: Path, file: str) -> bool | None:
    known = reach(root).known(file)
    return None if known is None else known.is_current


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        (ONE, {"__init__", "one", "two", "sub/__init__", "sub/three"}),
        ("tests/host/test_late.py", {"__init__", "late"}),
        ("tests/host/test_any.py", {"__init__", "loader/__init__", "loader/any"}),
        ("tests/tools/test_tool.py", {"__init__", "one", "two", "sub/__init__", "sub/three"}),
    ],
)
def test_imports_are_followed_to_the_end(root: Path, file: str, expected: set[str]) -> None:
    folder = root / "host_tools/pack"
    found = Imports(root).closure(root / file)
    assert {p.relative_to(folder) for p in found if p.is_relative_to(folder)} == {
        Path(f"{name}.py") for name in expected
    }


def test_what_is_not_known_is_not_current(root: Path) -> None:
    assert reach(root).known(ONE) is None


@pytest.mark.parametrize(
    ("changed", "reached"),
    [
        (ONE, True),
        ("host_tools/pack/one.py", True),
        ("host_tools/pack/sub/three.py", True),
        ("host_tools/pack/__init__.py", True),
        ("tests/conftest.py", True),
        ("tests/support/support.py", True),
        ("requirements.lock", True),
        ("pyproject.toml", True),
        ("host_tools/pack/alone.py", False),
        ("tests/host/test_late.py", False),
        ("examples/data.toml", False),
        ("firmware/core.c", False),
        ("build/bin/program", False),
    ],
)
def test_a_change_reaches_what_imports_it(root: Path, changed: str, reached: bool) -> None:
    reach(root).keep(passed(ONE), since_s=10.0)
    assert is_current(root, ONE) is True
    change(root / changed)
    assert is_current(root, ONE) is not reached
    known = reach(root).known(ONE)
    assert known is not None
    assert known.is_edited == (changed == ONE)


def test_a_module_beside_the_test(root: Path) -> None:
    reach(root).keep(passed("tests/host/test_beside.py"), since_s=10.0)
    change(root / "tests/host/beside.py")
    assert is_current(root, "tests/host/test_beside.py") is False


def test_a_file_that_was_read(root: Path) -> None:
    reach(root).keep(passed(ONE, reads={ONE: {"examples/data.toml"}}), since_s=10.0)
    change(root / "examples/data.toml")
    assert is_current(root, ONE) is False


def test_a_folder_that_was_listed(root: Path) -> None:
    reach(root).keep(passed(ONE, reads={ONE: {"examples"}}), since_s=10.0)
    change(root / "examples/data.toml")
    assert is_current(root, ONE) is True
    (root / "examples/new.toml").write_text("")
    assert is_current(root, ONE) is False


def test_what_a_module_reads_once_in_a_process_reaches_all_that_import_it(root: Path) -> None:
    late = "tests/host/test_late.py"
    reads = {"host_tools/pack/two.py": {"examples/data.toml"}}
    reach(root).keep(passed(ONE, late, module_reads=reads), since_s=10.0)
    change(root / "examples/data.toml")
    assert is_current(root, ONE) is False
    assert is_current(root, late) is True


@pytest.mark.parametrize(
    "changed", ["host_tools/pack/alone.py", "tools/tool.py", "firmware/core.c", "build/bin/program"]
)
def test_a_process_can_be_made_of_anything(root: Path, changed: str) -> None:
    reach(root).keep(passed(ONE, processes={ONE}), since_s=10.0)
    known = reach(root).known(ONE)
    assert known is not None
    assert known.is_current
    assert known.starts_processes
    change(root / changed)
    assert is_current(root, ONE) is False


def test_an_image_is_made_of_the_firmware_though_it_was_not_built_again(root: Path) -> None:
    reach(root).keep(passed(ONE, reads={ONE: {"build/firmware/image.elf"}}), since_s=10.0)
    known = reach(root).known(ONE)
    assert known is not None
    assert known.needs_images
    change(root / "firmware/core.c")
    assert is_current(root, ONE) is False


@pytest.mark.parametrize(
    "recorded",
    [
        passed(ONE, failed={ONE}),
        passed(ONE, groups={ONE: {"free": 2}}),  # one of two never ended
        passed(ONE, groups={ONE: {"free": 1, "bus": 1}}),
    ],
    ids=["failed", "not ended", "a group that did not run"],
)
def test_no_trace_without_success(root: Path, recorded: Recorded) -> None:
    reach(root).keep(recorded, since_s=10.0)
    assert reach(root).known(ONE) is None


@pytest.mark.parametrize("edited", ["host_tools/pack/two.py", "tests/conftest.py"])
def test_no_trace_of_what_was_edited_during_the_run(root: Path, edited: str) -> None:
    os.utime(root / edited, (20, 20))
    reach(root).keep(passed(ONE), since_s=10.0)
    assert reach(root).known(ONE) is None


def test_a_state_that_passed_earlier_is_known_again(root: Path) -> None:
    file = root / "host_tools/pack/one.py"
    before = file.read_text()
    reach(root).keep(passed(ONE), since_s=10.0)
    change(file)
    os.utime(file, (1, 1))
    reach(root).keep(passed(ONE), since_s=10.0)
    assert is_current(root, ONE) is True
    file.write_text(before)
    assert is_current(root, ONE) is True
    file.write_text(before + "# a third")
    assert is_current(root, ONE) is False


def test_the_time_expected_does_not_depend_on_load_but_where_processes_are_waited_for(
    root: Path,
) -> None:
    for processes, expected_s in ((set(), 1.0), ({ONE}, 2.0)):
        reach(root).keep(passed(ONE, processes=processes), since_s=10.0)
        known = reach(root).known(ONE)
        assert known is not None
        assert known.seconds == expected_s


def test_a_budget_is_kept_and_filled(root: Path) -> None:
    seconds = {"a": 5.0, "b": 20.0, "c": 4.0, "d": 2.0}
    assert within(seconds, ["a", "b", "c", "d"], 10.0) == ["a", "c"]
    assert within(seconds, ["d", "c", "b", "a"], 10.0) == ["d", "c"]
    assert within(seconds, ["b"], 10.0) == []
