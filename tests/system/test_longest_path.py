# SPDX-License-Identifier: MIT
"""No tick that was ever counted is longer than the longest path through the instructions of its image. Run by pytest;
reads the images of `make firmware`, and runs one on an emulated board.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from analysis.campaign import EXAMPLES  # noqa: E402
from analysis.counting import Counter  # noqa: E402
from analysis.emulator import TARGETS  # noqa: E402
from analysis.image import Function, Image, Instruction  # noqa: E402
from analysis.longest import Bounds, Longest, LongestError  # noqa: E402
from longest_path import (  # noqa: E402
    DOCUMENT,
    ENTRY,
    NOT_PLAIN,
    SPATIAL_GOALS,
    counted_at_most,
    document,
    motion_part,
)

PAIRS = [(t.name, k) for t in TARGETS.values() for k in t.kernels]
COUNTS = json.loads((ROOT / "tests/data/counts.json").read_text(encoding="utf-8"))["motion"]


@pytest.mark.parametrize(("kind", "ratio"), [("plain", 1.3), ("stop", 1.65)])
@pytest.mark.parametrize(("target", "kernel"), PAIRS)
def test_nothing_counted_is_longer(target: str, kernel: str, kind: str, ratio: float) -> None:
    longest = motion_part(ROOT / "build", target, kernel, kind).of(ENTRY)
    most = counted_at_most(COUNTS[f"{target} {kernel}"], kind)
    assert most <= longest <= ratio * most


@pytest.mark.parametrize(
    ("target", "kernel", "kind", "goal"),
    [
        ("an386", "float", "plain", 600),
        ("an386", "float", "override", 900),
        ("an385", "fixed", "plain", 1500),
        ("an385", "fixed", "override", 2250),
        ("microbit", "fixed", "override", 6000),
    ],
)
def test_goals_are_kept_by_construction(target: str, kernel: str, kind: str, goal: int) -> None:
    assert motion_part(ROOT / "build", target, kernel, kind).of(ENTRY) <= goal


MISSED = {("microbit", "fixed", "3"): 1.13, ("microbit", "fixed", "6"): 1.08}
"""Goals that are missed, and at most by which factor."""


@pytest.mark.parametrize(("target", "kernel", "axes"), SPATIAL_GOALS)
def test_goals_of_spatial_ticks_are_kept_by_construction(
    target: str, kernel: str, axes: str
) -> None:
    longest = motion_part(ROOT / "build", target, kernel, "plain", axes).of(ENTRY)
    assert longest <= SPATIAL_GOALS[target, kernel, axes] * MISSED.get((target, kernel, axes), 1.0)


@pytest.mark.parametrize("name", ["alpha", "heart_optimal"])
def test_plain_ticks_call_nothing_that_plain_excludes(name: str) -> None:
    """At 100 % and without commands, after the first tick; and what is never called in a tick is called in none."""
    counter = Counter(ROOT / "build", TARGETS["an386"], functions=True)
    counts = counter.count("float", EXAMPLES[name].read_bytes())
    never = Bounds.read(ROOT / "firmware/targets/loops.toml", *NOT_PLAIN["plain"]).never
    called = {n for n, column in zip(counter.names, counts.T, strict=True) if column[1:].any()}
    assert "motion_step" in called
    assert "override_plan_change" in counter.names
    assert not called & never


def test_the_document_has_them() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    assert document(ROOT / "build", text) == text


class Written(Image):
    """An image of functions that a test has written."""

    def __init__(self, *functions: Function) -> None:
        self.is_riscv = False
        self.__dict__["functions"] = list(functions)


def function(name: str, address: int, *lines: str) -> Function:
    words = [line.partition(" ") for line in lines]
    code = [Instruction(address + 2 * i, w[0], w[2], "") for i, w in enumerate(words)]
    return Function(name, address, code)


def longest(*functions: Function, **bounds: object) -> int:
    given = {"rounds": {}, "order": {}, "never": frozenset()} | bounds
    return Longest(Written(*functions), Bounds(**given)).of("a")  # type: ignore[arg-type]


def test_the_longer_branch_counts() -> None:
    a = function("a", 0, "cmp r0, #0", "beq.n 8 <a+0x8>", "movs r0, #1", "movs r0, #2", "bx lr")
    assert longest(a) == 5


def test_a_loop_counts_as_often_as_it_may_go_round() -> None:
    a = function("a", 0, "movs r0, #3", "subs r0, #1", "bne.n 2 <a+0x2>", "bx lr")
    assert longest(a, rounds={"a": 3}) == 8
    with pytest.raises(LongestError, match="a: 0x2: a loop without a bound"):
        longest(a)


def test_calls_count_and_what_is_never_called_does_not() -> None:
    a = function("a", 0, "beq.n 6 <a+0x6>", "bl 10 <b>", "bx lr", "bl 20 <c>", "bx lr")
    b = function("b", 16, "movs r0, #1", "bx lr")
    c = function("c", 32, *["movs r0, #1"] * 20, "bx lr")
    assert longest(a, b, c) == 1 + 1 + 21 + 1
    assert longest(a, b, c, never=frozenset({"c"})) == 1 + 1 + 2 + 1


def test_a_jump_into_another_function_is_the_end_of_a_way() -> None:
    a = function("a", 0, "beq.n 10 <b>", "movs r0, #1", "b.n 20 <c>")
    b = function("b", 16, *["movs r0, #1"] * 5, "bx lr")
    c = function("c", 32, *["movs r0, #1"] * 3, "bx lr")
    assert longest(a, b, c) == 1 + 6
    assert longest(a, b, c, never=frozenset({"b"})) == 3 + 4
    assert longest(a, b, c, never=frozenset({"c"})) == 1 + 6


def test_a_call_through_a_pointer_needs_its_row() -> None:
    a = function("a", 0, "blx r3", "bx lr")
    b = function("b", 16, "movs r0, #1", "bx lr")
    assert longest(a, b, order={"a": ["b"]}) == 4
    with pytest.raises(LongestError, match="a: 1 calls through pointers"):
        longest(a, b)


def test_recursion_has_no_bound() -> None:
    with pytest.raises(LongestError, match="recursion"):
        longest(function("a", 0, "bl 0 <a>", "bx lr"))
