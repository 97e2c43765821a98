# SPDX-License-Identifier: MIT
"""Planted mistakes: each kind is found in a small source, at its line, and a known outcome is kept. Run by pytest;
starts the compiler, and writes to temporary folders.
"""

import subprocess
import sys
from pathlib import Path

import pytest

import mutants
from mutation import c_sites, python_sites
from mutation.areas import AREAS, Area
from mutation.native_module import NativeModule
from mutation.outcome import INVALID, KILLED, SAME, SURVIVED, Ledger, Outcome
from mutation.sites import Mutant

ROOT = Path(__file__).resolve().parents[2]
C_SOURCE = """\
/* a < b && 7 */
#define MOST 12
static const int table[2] = {
    3, 4,
};

int f(const int *a, int n)
{
    uint8_t data[8];
    assert(n > 3);
    if (n <= 5 && !a) {
        return -1;
    }
    *data = 2u;
    g(a[n],
      true);
    return n >> 1;
}
"""

PYTHON_SOURCE = '''\
"""Doc 1."""
import sys

LIMIT: float = 0.5


def f(a: int = 3, *, b: bool = True) -> int:
    """Doc 2 < 3."""
    if a is not None and -a < 4:
        raise ValueError("1 + 1")
    a += 1
    print(f"{a + 1}", zip([], [], strict=True))
    return a[1:] + "ü" * 2
'''


def lines(source: str, found: list[Mutant]) -> set[tuple[int, str, str]]:
    """(line, what was there, what is there) of each mistake."""
    return {(one.line, source[one.start : one.end], one.text) for one in found}


def test_mistakes_in_c() -> None:
    found = list(c_sites.find("x.c", C_SOURCE))
    assert lines(C_SOURCE, found) == {
        (11, "<=", "<"),
        (11, "<=", ">"),
        (11, "5", "6"),
        (11, "5", "4"),
        (11, "&&", "||"),
        (11, "!", ""),
        (12, "-", ""),
        (12, "1", "2"),
        (12, "1", "0"),
        (14, "*data = 2u;", ";"),
        (14, "2u", "3u"),
        (14, "2u", "1u"),
        (15, "g(a[n],\n      true);", ";\n"),
        (15, "n", "(n) + 1"),
        (16, "true", "false"),
        (17, ">>", "<<"),
        (17, "1", "2"),
        (17, "1", "0"),
    }


def test_mistakes_in_python() -> None:
    found = list(python_sites.find("x.py", PYTHON_SOURCE))
    assert lines(PYTHON_SOURCE, found) == {
        (4, "0.5", "0.625"),
        (7, "3", "4"),
        (7, "3", "2"),
        (7, "True", "False"),
        (9, "is not", "is"),
        (9, "and", "or"),
        (9, "-", ""),
        (9, "<", "<="),
        (9, "<", ">="),
        (9, "4", "5"),
        (9, "4", "3"),
        (10, 'raise ValueError("1 + 1")', "pass"),
        (11, "a += 1", "pass"),
        (11, "1", "2"),
        (11, "1", "0"),
        (12, 'print(f"{a + 1}", zip([], [], strict=True))', "pass"),
        (13, "1", "2"),
        (13, "1", "0"),
        (13, "+", "-"),
        (13, "2", "3"),
        (13, "2", "1"),
    }


@pytest.mark.parametrize(("find", "source"), [(c_sites.find, C_SOURCE)])
def test_later_lines_keep_their_numbers(find: object, source: str) -> None:
    assert callable(find)
    for one in find("x", source):
        assert one.applied(source).count("\n") == source.count("\n"), one


def test_every_python_mutant_compiles() -> None:
    for one in python_sites.find("x.py", PYTHON_SOURCE):
        compile(one.applied(PYTHON_SOURCE), "x.py", "exec")


def test_a_mutant_is_shown_as_a_short_diff() -> None:
    one = next(m for m in c_sites.find("x.c", C_SOURCE) if m.kind == "logic")
    assert one.shown(C_SOURCE).splitlines() == [
        "    - if (n <= 5 && !a) {",
        "    + if (n <= 5 || !a) {",
    ]


def test_a_sample_depends_on_the_seed_and_begins_with_different_lines(tmp_path: Path) -> None:
    (tmp_path / "x.c").write_text(C_SOURCE)
    area = Area("small", ("*.c",))
    one, again, other = (mutants.sampled(area, seed, tmp_path) for seed in (1, 1, 2))
    assert one == again
    assert one != other
    assert set(one) == set(other)
    places = {m.line for m in one}
    assert {m.line for m in one[: len(places)]} == places


def test_outcomes_are_known_until_the_source_changes(tmp_path: Path) -> None:
    one = next(iter(c_sites.find("x.c", C_SOURCE)))
    file = tmp_path / "mutation" / "small.jsonl"
    key = one.key(C_SOURCE)
    for result in (SURVIVED, KILLED):
        Ledger(file).add(Outcome(key, "x.c", one.line, one.kind, "", result, "test_x"))
    assert Ledger(file).known[key].result == KILLED
    assert one.key(C_SOURCE + "\n") not in Ledger(file).known


def test_every_area_has_sources_and_tests() -> None:
    assert len({area.name for area in AREAS}) == len(AREAS)
    for area in AREAS:
        assert area.files(mutants.ROOT), area.name
        for test in area.tests:
            assert (mutants.ROOT / test).exists(), test


def test_a_mistake_is_planted_in_the_native_module(tmp_path: Path) -> None:
    module = tmp_path / "tree/host_tools/hodograph/native/_native.abi3.so"
    module.parent.mkdir(parents=True)
    native = NativeModule(ROOT, ROOT / "build", tmp_path / "tree")
    native.work = tmp_path
    path = "sim/offline/stop_usage.c"
    source = (ROOT / path).read_text(encoding="utf-8")
    changed = source.replace("share < 0.0", "share >= 0.0")
    assert native.plant(path, changed) is None
    asked = "import cffi, sys; lib = cffi.FFI().dlopen(sys.argv[1])"
    subprocess.run([sys.executable, "-c", asked, str(module)], check=True)
    native.restore()
    sound = (ROOT / "host_tools/hodograph/native/_native.abi3.so").read_bytes()
    assert module.read_bytes() == sound
    assert native.plant(path, source.replace("/* SPDX", "/*  SPDX")) == SAME
    assert native.plant(path, changed + "}") == INVALID
    assert module.read_bytes() == sound
