# SPDX-License-Identifier: MIT
"""Groups of Python tests, run in a small tree of their own: marks, records, hanging tests, and what check chooses. Run
by pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from testing.cache import Stamps
from testing.choice import Choice, choose
from testing.groups import Groups
from testing.reach import Reach
from testing.units import Units

TOOLS = Path(__file__).resolve().parents[2] / "tools"
SETTINGS = """
[tool.pytest.ini_options]
addopts = "--strict-markers"
markers = ["bus", "serial", "long"]
"""
TEST = """
import pytest, subprocess, sys, time
from pathlib import Path
ROOT = Path(__file__).resolve().parents[1]
"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A tree with a copy of the tools: a recorder watches the tree that it lies in."""
    (tmp_path / "tests").mkdir()
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools/testing").mkdir()
    for file in (TOOLS / "testing").glob("*.py"):
        (tmp_path / "tools/testing" / file.name).write_bytes(file.read_bytes())
    (tmp_path / "pyproject.toml").write_text(SETTINGS)
    (tmp_path / "requirements.lock").write_text("")
    (tmp_path / "data").write_text("a")
    for path in tmp_path.rglob("*"):
        os.utime(path, (1, 1))
    return tmp_path


def write(root: Path, name: str, text: str) -> str:
    path = root / "tests" / f"test_{name}.py"
    path.write_text(TEST + text)
    os.utime(path, (1, 1))
    return f"tests/test_{name}.py"


def groups(root: Path, **more: object) -> Groups:
    return Groups(root, root / "build/tests", **more)  # type: ignore[arg-type]


def choice(root: Path, budget_s: float = 100.0) -> Choice:
    base = root.parent / f"{root.name}-cache"
    units = Units(root, root / "build", Stamps("units", base=base))
    return choose(root, units, Reach(root, Stamps("python", base=base)), budget_s)


def keep(root: Path, ran: Groups) -> None:
    base = root.parent / f"{root.name}-cache"
    Reach(root, Stamps("python", base=base)).keep(ran.recorded(), since_s=10.0)


def test_marks_divide_the_tests(root: Path) -> None:
    write(
        root,
        "marks",
        "def test_free(): pass\n"
        "@pytest.mark.serial\ndef test_alone(): pass\n"
        "@pytest.mark.serial\n@pytest.mark.bus\ndef test_on_a_bus(): pass\n"
        "@pytest.mark.long\ndef test_long(): pass\n"
        "@pytest.mark.long\n@pytest.mark.serial\ndef test_long_alone(): pass\n",
    )
    assert groups(root).run("serial").passed == 1
    assert groups(root, is_long=True).run("serial").passed == 2


def test_reads_and_processes_are_recorded(root: Path) -> None:
    reader = write(root, "reads", "def test(): assert (ROOT / 'data').read_text()\n")
    at_import = write(root, "import", "TEXT = (ROOT / 'data').open().read()\ndef test(): pass\n")
    writer = write(root, "writes", "def test(): (ROOT / 'out').write_text('')\n")
    starts = "def test(): subprocess.run(['true', 5000 * '\\n', b'\\xff', ROOT], check=True)\n"
    starter = write(root, "starts", starts)
    write(root, "odd", "def test():\n    with pytest.raises(Exception): subprocess.run([])\n")
    lister = write(root, "lists", "def test(): assert list((ROOT / 'tests').iterdir())\n")
    ran = groups(root)
    assert str(ran.run("serial", [])) == "0 passed, 1 failed"  # none of these: pytest says so
    odd = "tests/test_odd.py"
    for file in (reader, at_import, writer, starter, lister, odd):
        (root / file).write_text((root / file).read_text() + "pytestmark = pytest.mark.serial\n")
    ran = groups(root)
    assert str(ran.run("serial")) == "6 passed, 0 failed"
    recorded = ran.recorded()
    assert "data" in recorded.reads[reader]
    assert "data" in recorded.reads[at_import]
    assert "out" not in recorded.reads.get(writer, set())
    assert "tests" in recorded.reads[lister]
    assert "data" not in recorded.reads.get(starter, set())
    assert recorded.processes - {odd} == {starter}
    assert recorded.passed() == {reader, at_import, writer, starter, lister, odd}
    busy = write(
        root,
        "busy",
        "pytestmark = pytest.mark.serial\ndef test():\n    began = time.process_time()\n"
        "    while time.process_time() - began < 0.3: pass\n    time.sleep(0.3)\n",
    )
    ran = groups(root)
    ran.run("serial", [busy])
    (seconds,) = ran.recorded().seconds[busy].values()
    tick_s = 0.01  # what a kernel counts processor time of children in, at each end
    assert 0.3 - 2 * tick_s <= ran.recorded().cpu_s[busy] <= seconds - 0.2


def test_a_failure_in_any_phase_is_recorded(root: Path) -> None:
    text = "pytestmark = pytest.mark.serial\n@pytest.fixture\ndef thing():\n    {}\n"
    text += "def test(thing): {}\n"
    good = write(root, "good", text.format("yield", "pass"))
    write(root, "before", text.format("assert False", "pass"))
    write(root, "within", text.format("yield", "assert False"))
    write(root, "after", text.format("yield; assert False", "pass"))
    ran = groups(root)
    assert len(ran.run("serial").failures) == 3
    assert ran.recorded().passed() == {good}


@pytest.mark.parametrize("group", ["serial", "free"])
def test_a_test_that_hangs_fails_by_its_name(root: Path, group: str) -> None:
    """By pytest-timeout: the tests after it run all the same."""
    mark = "" if group == "free" else "pytestmark = pytest.mark.serial\n"
    write(
        root,
        "hangs",
        mark + "@pytest.mark.timeout(1)\ndef test_hangs(): time.sleep(1000)\ndef test_b(): pass\n",
    )
    count = groups(root).run(group)
    assert count.passed == 1
    assert len(count.failures) == 1
    assert count.failures[0].endswith("::test_hangs")


def test_a_test_that_cannot_be_interrupted_ends_its_group(root: Path) -> None:
    """The last resort: a test that no signal gets to."""
    write(
        root,
        "stuck",
        "import signal\npytestmark = pytest.mark.serial\n"
        "def test_stuck():\n"
        "    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM, signal.SIGTERM])\n"
        "    time.sleep(1000)\n",
    )
    count = groups(root, last_limit_s=1.0).run("serial")
    assert count.passed == 0
    assert "tests/test_stuck.py::test_stuck: hung" in count.failures


def test_a_test_that_takes_pytest_down_is_named(root: Path) -> None:
    write(root, "dies", "import os\ndef test_dies(): os._exit(3)\ndef test_b(): pass\n")
    count = groups(root).run("free")
    assert [failure.rpartition("::")[2] for failure in count.failures] == ["test_dies"]


def test_a_mark_that_its_file_does_not_name_is_a_failure(root: Path) -> None:
    (root / "tests/alone.py").write_text("import pytest\nalone = pytest.mark.serial\n")
    named = write(root, "named", "@pytest.mark.serial\ndef test(): pass\ndef test_free(): pass\n")
    hidden = write(root, "hidden", "from alone import alone\n@alone\ndef test(): pass\n")
    ran = groups(root)
    assert (ran.run("free").passed, ran.run("serial").passed) == (1, 1)
    assert ran.marked("serial") == [named]
    (failure,) = ran.unnamed()
    assert failure.startswith(f"{hidden}: its tests marked serial do not run")


def test_a_group_in_the_background_ends_on_request(root: Path) -> None:
    write(root, "waits", "pytestmark = pytest.mark.serial\ndef test(): time.sleep(600)\n")
    ran, log = groups(root), root / "log"
    with ThreadPoolExecutor(1) as pool:
        count = pool.submit(ran.run, "serial", (), log)
        while not any(list(ran.out.glob("record-serial/*.jsonl"))):
            time.sleep(0.05)
        ran.end()
        assert count.result().passed == 0
    assert log.exists()


def test_the_first_check_runs_what_needs_no_bus(root: Path) -> None:
    free = write(root, "free", "def test(): pass\n")
    write(root, "bus", "@pytest.mark.bus\ndef test(): pass\n")
    assert choice(root).files == {"free": [free], "serial": [], "bus": []}
    assert choice(root).left == ["tests/test_bus.py"]


def test_check_chooses_what_a_change_reaches(root: Path) -> None:
    mark = "pytestmark = pytest.mark.serial\n"
    reader = write(root, "reads", mark + "def test(): assert (ROOT / 'data').read_text()\n")
    starter = write(root, "starts", mark + "def test(): subprocess.run(['true'], check=True)\n")
    write(root, "plain", mark + "def test(): pass\n")
    ran = groups(root)
    ran.run("serial")
    keep(root, ran)
    assert choice(root).files == {"free": [], "serial": [], "bus": []}
    assert choice(root).current == 3
    (root / "data").write_text("b")
    assert choice(root).files["serial"] == [reader]
    (root / "tools/new.py").write_text("")  # any process may be made of it
    assert choice(root).files["serial"] == [reader, starter]
    assert choice(root).current == 1
    small = choice(root, budget_s=0.0)
    assert small.files["serial"] == []
    assert small.left == [reader, starter]
    assert all(file in small.text() for file in (reader, starter))
    new = write(root, "new", "def test(): pass\n")
    (root / reader).write_text((root / reader).read_text() + "\n")
    edited = choice(root, budget_s=0.0)
    assert edited.files == {"free": [new], "serial": [reader], "bus": []}
