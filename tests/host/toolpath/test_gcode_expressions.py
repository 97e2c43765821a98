# SPDX-License-Identifier: MIT
"""Numbers, parameters and expressions of G-code. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcode import error_of, last, place_of
from hodograph.toolpath.gcode.expression import MAX_NESTING, Scanner
from hodograph.toolpath.gcode.parameters import Parameters
from hodograph.toolpath.gcode.source import SourceLine


def value_of(text: str) -> float:
    scanner = Scanner(SourceLine("x", 1, text), Parameters())
    value = scanner.value()
    assert scanner.at == len(scanner.text)
    return value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5.0),
        ("+5.", 5.0),
        ("-.5", -0.5),
        ("- 1 2 . 5", -12.5),
        ("--3", 3.0),
        ("-[2]", -2.0),
        ("[1+2*3]", 7.0),
        ("[9+8*7/6+5-4*3**2+1]", 9 + 8 * 7 / 6 + 5 - 4 * 3**2 + 1),
        ("[2**3**2]", 64.0),  # from left to right
        ("[-2**2]", 4.0),  # the sign belongs to the number
        ("[2 ** -1]", 0.5),
        ("[-5 MOD 3]", 1.0),
        ("[7 mod -3]", 1.0),
        ("[1 LT 2 AND 0 OR 1]", 1.0),
        ("[1 OR 1 AND 0]", 0.0),  # one row of the table, from left to right
        ("[1 + 1 EQ 2]", 1.0),
        ("[1 EQ 1.00009]", 1.0),
        ("[1 NE 1.00011]", 1.0),
        ("[2 GE 2]", 1.0),
        ("[2 LE 1]", 0.0),
        ("[2 GT 1 XOR 1]", 0.0),
        ("abs[-3]", 3.0),
        ("acos[0]", 90.0),
        ("asin[-1]", -90.0),
        ("atan[1]/[-1]", 135.0),
        ("atan[-1]/[-1]", -135.0),
        ("cos[60]", 0.5),
        ("exp[0]", 1.0),
        ("fix[-1.5]", -2.0),
        ("fup[-1.5]", -1.0),
        ("ln[1]", 0.0),
        ("round[2.5]", 3.0),
        ("round[-2.5]", -3.0),
        ("SIN[30]", 0.5),
        ("sqrt[16]", 4.0),
        ("tan[45]", 1.0),
        ("#7", 0.0),
        ("exists[#<none>]", 0.0),
        ("##3", None),
    ],
)
def test_values(text: str, value: float | None) -> None:
    if value is None:
        assert error_of(f"G0 X{text}").column == 5  # parameter 0 does not exist
    else:
        assert value_of(text) == pytest.approx(value, abs=1e-12)


def test_parameters_are_set_after_all_values_of_the_block() -> None:
    text = "#1=2 #<a>=3\nG0 X#1 Y#<A> #1=5 #2=[#1+1]\nX#1 Y#2 Z##3\n"
    assert last("#3=1\n" + text)[:3] == (5.0, 3.0, 5.0)


def test_names_forget_case_and_blanks_and_globals_are_everywhere() -> None:
    text = "#<My Name>=1 #<_all>=2\no1 sub\nG0 X[exists[#<myname>]] Y#<_ALL>\no1 endsub\no1 call\n"
    assert last(text)[:2] == (0.0, 2.0)


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("G0 X[1+]", 8),
        ("G0 X[1 2", 9),
        ("G0 X[1+2", 9),
        ("G0 X[1/0]", 7),
        ("G0 X[1 MOD 0]", 8),
        ("G0 X [-1 ** 0.5]", 10),
        ("G0 X[10 ** 400]", 9),
        ("G0 Xsqrt[-1]", 5),
        ("G0 Xln[0]", 5),
        ("G0 Xacos[2]", 5),
        ("G0 Xatan[1]", 12),
        ("G0 Xexists[5]", 12),
        ("G0 X#<nothing>", 5),
        ("G0 X#0", 5),
        ("G0 X#6000", 5),
        ("G0 X#1.5", 6),
        ("G0 X#<open", 6),
        ("#5=", 4),
        ("#5 1", 5),
        ("#5420=1", 1),
        ("#<_x> = 1", 1),
        ("G0 X1e5", 6),
        ("G0 X1.2.3", 8),
        ("G0 X", 5),
        ("G0 X+", 6),
        ("G0 X2000000000", 4),
        ("G0 X" + "9" * 400, 5),
    ],
)
def test_refused_values_name_the_column(text: str, column: int) -> None:
    assert place_of(text) == (1, column)


def test_nesting_is_bounded() -> None:
    deepest = "[" * MAX_NESTING + "1" + "]" * MAX_NESTING
    assert value_of(deepest) == 1.0
    assert "levels" in str(error_of(f"G0 X[{deepest}]"))
    assert "levels" in str(error_of("G0 X" + "-" * 3000 + "1"))
    assert "levels" in str(error_of("G0 X" + "#" * 3000 + "1"))


_OPERATORS = {
    "+": 3,
    "-": 3,
    "*": 4,
    "/": 4,
    "EQ": 2,
    "LT": 2,
    "GE": 2,
    "AND": 1,
    "OR": 1,
    "XOR": 1,
}


def _plainly(numbers: list[float], operators: list[str]) -> float | None:
    """The value, by doing the strongest operators first, over and over; None for a division by 0."""
    numbers, operators = list(numbers), list(operators)
    for strength in (4, 3, 2, 1):
        at = 0
        while at < len(operators):
            if _OPERATORS[operators[at]] != strength:
                at += 1
                continue
            a, b = numbers[at], numbers.pop(at + 1)
            if operators[at] == "/" and b == 0.0:
                return None
            results = {
                "+": a + b,
                "-": a - b,
                "*": a * b,
                "/": a / b if b else 0.0,
                "EQ": float(abs(a - b) < 1e-4),
                "LT": float(a < b),
                "GE": float(a >= b),
                "AND": float(bool(a) and bool(b)),
                "OR": float(bool(a) or bool(b)),
                "XOR": float(bool(a) != bool(b)),
            }
            numbers[at] = results[operators.pop(at)]
    return numbers[0]


@given(st.data())
def test_operators_bind_as_in_the_table(data: st.DataObject) -> None:
    numbers = data.draw(st.lists(st.integers(-9, 9).map(float), min_size=1, max_size=8))
    count = len(numbers) - 1
    operators = data.draw(
        st.lists(st.sampled_from(sorted(_OPERATORS)), min_size=count, max_size=count)
    )
    text = f"[{numbers[0]:g}" + "".join(
        f" {operator} {number:g}" for operator, number in zip(operators, numbers[1:], strict=True)
    )
    expected = _plainly(numbers, operators)
    if expected is not None:
        assert value_of(text + "]") == pytest.approx(expected, rel=1e-12)
    else:
        assert "not defined" in str(error_of(f"G0 X{text}]"))
