# SPDX-License-Identifier: MIT
"""The Python half of `make fuzz`: documents are written as they are meant, and a planted mistake is found. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from fuzzing import harnesses
from fuzzing.child import run_case
from fuzzing.targets import TARGETS, Finding, Outcome, Toml, is_rounding, loaded
from fuzzing.toml_text import UNKNOWN, mutate, places, plain, spelled
from hodograph.config.table import Table, read_toml
from hodograph.errors import InputError
from hodograph.native.program import NativeProgram
from hodograph.program import Program, decode, encode
from hodograph.program.stops import FAULT, HOLD

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples/machines/real_drives.toml"


def test_a_spelling_says_what_was_meant() -> None:
    data = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    words = [(str(k), t[k]) for t, k in places(data) if isinstance(t, dict)]
    texts = set()
    for number in range(300):
        random = Random(number)
        document = mutate(data, words, random)
        text = spelled(document.data, random)
        # repr: NaN is not equal to itself, and 1 is not to be 1.0
        assert _ordered(tomllib.loads(text)) == _ordered(document.data)
        assert _ordered(tomllib.loads(plain(document.data))) == _ordered(document.data)
        texts.add(text)
    assert len(texts) == 300


def _ordered(data: object) -> str:
    if isinstance(data, dict):
        return "{" + ", ".join(f"{k!r}: {_ordered(data[k])}" for k in sorted(data)) + "}"
    return "[" + ", ".join(map(_ordered, data)) + "]" if isinstance(data, list) else repr(data)


def test_a_case_is_a_function_of_its_number() -> None:
    data = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    words = [("node", 1)]
    for number in range(20):
        once, again = (mutate(data, words, Random(number)) for _ in range(2))
        assert repr(once) == repr(again)


def _least_us(program: Program, piece: int, kind: int) -> int:
    """The least bound of a stop that the controller accepts for a piece."""
    low, high = 0, int(program.stops.bound_us[piece, kind])
    while low < high:
        middle = (low + high) // 2
        fault = NativeProgram(encode(_with_bound(program, piece, kind, middle))).check()
        low, high = (low, middle) if fault is None else (middle + 1, high)
    return low


def _with_bound(program: Program, piece: int, kind: int, value_us: int) -> Program:
    bound_us = program.stops.bound_us.copy()
    bound_us[piece, kind] = value_us
    hold_us, fault_us = bound_us.max(axis=0).tolist()
    stops = replace(program.stops, bound_us=bound_us, worst_us=(hold_us, fault_us))
    return replace(program, stops=stops)


@pytest.mark.parametrize("kind", [HOLD, FAULT])
def test_only_the_bound_that_is_refused_excuses_a_difference(kind: int) -> None:
    """That of the other kind has as little room as rounding leaves."""
    program = decode((ROOT / "tests/data/programs/alpha_minimax.hdgp").read_bytes())
    piece, other = 3, HOLD + FAULT - kind
    tight = _with_bound(program, piece, other, _least_us(program, piece, other))
    least_us = _least_us(tight, piece, kind)
    for value_us, excused in ((least_us - 1, True), (least_us - 200, False)):
        image = encode(_with_bound(tight, piece, kind, value_us))
        fault = NativeProgram(image).check()
        assert fault is not None
        assert is_rounding(image, fault.code, fault.index) == excused


def _careful(file: Path) -> object:
    root = Table(file, "", read_toml(file), ("a", "b"))
    return root.number("a"), root.number("b")


def _internal(file: Path) -> object:
    return read_toml(file)["a"] + 1


def _by_order(file: Path) -> object:
    return list(read_toml(file))


def _takes_all(file: Path) -> object:
    return "fine"


def _wrong(read: Callable[[Path], object], folder: Path, cases: int = 60) -> set[str]:
    source = folder / "example.toml"
    source.write_text("a = 1\nb = 2.5\n")

    def use(file: Path) -> list[Outcome]:
        return [loaded(read, file)]

    target = Toml((source,), use, "fuzz.toml")
    found = set()
    for number in range(cases):
        try:
            target.run(Random(number), folder / "case")
        except Finding as finding:
            found.add(str(finding).partition(":")[0])
    return found


def test_a_careful_reader_passes(tmp_path: Path) -> None:
    assert _wrong(_careful, tmp_path) == set()


@pytest.mark.parametrize(
    ("read", "words"),
    [
        (_internal, {"KeyError", "TypeError"}),
        (_by_order, {"another spelling gives another result"}),
        (_takes_all, {"accepted, though it has an unknown key"}),
    ],
)
def test_a_planted_mistake_is_found(
    tmp_path: Path, read: Callable[[Path], object], words: set[str]
) -> None:
    assert words <= _wrong(read, tmp_path)


def test_refusals_of_unknown_keys_are_seen(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text(f"{UNKNOWN} = 1\n")
    assert loaded(_careful, file).status == InputError.exit_status


@pytest.mark.parametrize("target", ["scenario", "campaign", "image", "eds"])
def test_some_cases(tmp_path: Path, target: str) -> None:
    """Those that take no time; `make fuzz` runs all."""
    found = [run_case(target, 3, case, tmp_path / target) for case in range(10)]
    assert found == [None] * 10


@pytest.mark.parametrize("case", [572, 1223])
def test_a_bound_that_only_rounding_makes_too_short_is_no_finding(
    tmp_path: Path, case: int
) -> None:
    """The controller's bounds of stops are rounded up, by 3 and 2 us in these images."""
    assert run_case("image", 1124, case, tmp_path) is None


def test_each_harness_has_a_corpus() -> None:
    corpora = sorted(folder.name for folder in (ROOT / "tests/data/fuzz").iterdir())
    assert harnesses.names(ROOT) == corpora
    assert set(TARGETS) == {
        *("path", "machine", "drive", "scenario", "campaign", "recording", "image", "eds")
    }
