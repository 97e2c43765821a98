# SPDX-License-Identifier: MIT
"""Long programs of G-code: the short path for plain lines, memory, and input that is broken in any way. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gcode import FILE, commands_of
from hodograph.errors import ToolpathError
from hodograph.toolpath.gcode import Options, read_gcode
from hodograph.toolpath.gcode.reader import _PLAIN
from hodograph.toolpath.moves import Command, StraightMove

PROGRAM = """%
O1000 (part)
N10 G21 G90 G17 G94 G64 P0.01
N20 T1 M6 (msg, tool 1)
N30 S12000 M3 M8
N40 G54 G43 H1 G0 X0 Y0 Z5
N50 G1 Z-1 F300
X10.5 Y-3.25
G2 X20.5 I5
G3 X22 Y-5 R6
#<depth> = [1.5 * 2]
o100 sub
  G1 Z-#1 F[100 + #2]
  G5.1 X30 Y5 I2 J3
o100 endsub
o101 repeat [2]
  o100 call [#<depth>] [5]
o101 endrepeat
G5.2 P1 L3
X31 Y6 P1
X33 Y5 P2
G5.3
G81 X1 Y1 Z-2 R2 F100
G80 M62 P1
G92 X0
G93 G1 X1 F2
G94 G28 Z0
M5 M9
M30
%
"""
"""Something of everything."""


def outcome(lines: Iterable[str], **options: Any) -> tuple[list[Command], str]:
    """The commands up to the end or the refusal, and the refusal, which names a place."""
    found: list[Command] = []
    refusal = ""
    try:
        found.extend(read_gcode(lines, FILE, Options(**options)))
    except ToolpathError as error:
        refusal = str(error)
    if refusal:
        place = re.match(rf"{FILE}:([0-9]+):([0-9]+): .", refusal)
        assert place is not None
        assert min(int(place[1]), int(place[2])) >= 1
    return found, refusal


def test_the_program_of_everything_is_read() -> None:
    found, error = outcome(PROGRAM.splitlines())
    assert error == ""
    assert len({type(command) for command in found}) >= 11


_NUMBER = st.one_of(
    st.integers(-999, 999).map(str),
    st.floats(-1e4, 1e4).map(lambda value: f"{value:.4f}"),
    st.sampled_from(
        [
            "+1",
            ".5",
            "-.25",
            "3.",
            "1..2",
            "1e3",
            "#1",
            "[2*3]",
            "",
            "999999999",
            "9999999999",
            "- 4",
        ]
    ),
)
_PLAIN_WORD = st.tuples(st.sampled_from("XYZFxyzf"), _NUMBER).map("".join)
_RARE_WORD = st.sampled_from(
    [
        "G0",
        "G1",
        "G01",
        "g00",
        "G2",
        "G53",
        "G90",
        "G91",
        "G20",
        "G21",
        "G93",
        "G94",
        "G95",
        "G28",
        "G4P1",
        "N12",
        "A5",
        "R1",
        "I2",
        "M3",
        "S9",
        "T1",
        "(c)",
        ";",
        "/",
        "%",
        "#1=4",
        "G92",
        "G10L2P1X3R5",
        "G10L2P1R0",
        "G54",
        "G55",
        "G43.1Z2",
        "G49",
        "G81Z-1R2",
        "G80",
        "G18",
        "@3",
        "G64P1",
    ]
)
_BLANKS = st.sampled_from(["", " ", "\t", "   ", " " * 30])
_LINE = st.tuples(
    st.sampled_from(["", "", "G1", "G0 ", "N5 G01 ", " "]),
    st.lists(_PLAIN_WORD, max_size=3),
    st.one_of(st.just([]), st.just([]), st.lists(_RARE_WORD, max_size=2)),
    _BLANKS,
    st.sampled_from(["\n", "\r\n", ""]),
).map(lambda parts: parts[0] + parts[3].join(parts[1] + parts[2]) + parts[4])


@settings(max_examples=400)
@given(st.lists(_LINE, min_size=1, max_size=12))
def test_plain_lines_mean_the_same_without_the_short_path(lines: list[str]) -> None:
    text = ["G1 F100 X0\n", *lines]
    assert outcome(text) == outcome(text, fast_path=False)


def test_the_short_path_reads_what_cam_systems_write() -> None:
    for line in ("G1 X1.5 Y-2.25\n", "X1Y2Z3\r\n", "N100 G01 X1. Y.5 Z-3 F1200\n", "g0x1\n", "Z5"):
        assert _PLAIN.fullmatch(line)
    for line in ("G2 X1 I1", "X[1]", "X1 ; c", "Y1 X1", "G10 X1", "G1.5X1", "X1e3", "X" + "1" * 10):
        assert not _PLAIN.fullmatch(line)


def flood(count: int) -> Iterator[str]:
    yield "G21 G90 G1 F100\n"
    for index in range(count):
        yield f"X{index % 100}.125 Y{index % 77}.5\n"


def test_memory_does_not_grow_with_the_program() -> None:
    peaks = []
    for count in (2_000, 40_000):
        tracemalloc.start()
        for _ in read_gcode(flood(count), FILE):
            pass
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 20_000


def test_lines_are_consumed_as_commands_are_taken() -> None:
    taken = 0

    def lines() -> Iterator[str]:
        nonlocal taken
        for line in flood(1_000):
            taken += 1
            yield line

    moves = list(islice(read_gcode(lines(), FILE), 10))
    assert all(isinstance(move, StraightMove) for move in moves)
    assert taken == 11


def test_an_o_word_at_the_end_does_not_change_the_lines_before_it() -> None:
    lines = [*flood(50), "o1 sub\n", "o1 endsub\n"]
    assert list(read_gcode(lines, FILE))[:-1] == list(read_gcode(flood(50), FILE))[:-1]


def test_plain_lines_inside_loops_take_the_short_path_too() -> None:
    text = "G1 F10\no1 repeat [3]\nX1\nX2 Y3\nG91\nX1\nG90\no1 endrepeat\nX9"
    assert commands_of(text) == commands_of(text, fast_path=False)


_TOKENS = sorted({word for line in PROGRAM.splitlines() for word in line.split()})


@settings(max_examples=400)
@given(st.data())
def test_a_broken_program_gives_moves_or_one_error(data: st.DataObject) -> None:
    lines = PROGRAM.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["cut", "swap", "token", "character", "number", "drop"]))
        line = lines[at]
        place = data.draw(st.integers(0, len(line)))
        if kind == "cut":
            lines[at] = line[:place]
        elif kind == "swap":
            other = data.draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        elif kind == "token":
            lines[at] = line[:place] + data.draw(st.sampled_from(_TOKENS)) + line[place:]
        elif kind == "character":
            lines[at] = line[:place] + data.draw(st.characters(codec="utf-8")) + line[place + 1 :]
        elif kind == "number":
            digits = data.draw(st.sampled_from(["0", "-1", "1e9", "99999999999", ".", "1" * 500]))
            lines[at] = line[:place] + digits + line[place:]
        else:
            lines[at] = ""
    found, error = outcome(lines, most_jumps=1000)
    assert found or error
    assert outcome(lines, most_jumps=1000, fast_path=False) == (found, error)


@settings(max_examples=300)
@given(st.text(alphabet="gxyzfmo#[]<>=+-*/.0123456789 \n%;()nabsqrtif", max_size=60))
def test_any_text_gives_moves_or_one_error(text: str) -> None:
    found, error = outcome(text.splitlines(), most_jumps=100)
    assert found or error


@pytest.mark.parametrize(
    "text",
    [
        "G1 X" + "[" * 4000,
        "(" * 4000,
        "o" * 4000,
        "#" * 4000,
        "G0 X" + "sin[" * 900,
        "o1 sub\n" * 3000,
        "G0 X#<" + "a" * 4000,
        "G0 X1" + "." * 4000,
    ],
)
def test_long_nonsense_is_refused(text: str) -> None:
    assert outcome(text.splitlines())[1]
