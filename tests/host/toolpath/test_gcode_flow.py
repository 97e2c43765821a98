# SPDX-License-Identifier: MIT
"""O-words: subroutines, conditions and loops. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcode import commands_of, error_of, place_of, xyz_of
from hodograph.toolpath.gcode.flow import MOST_LEVELS
from hodograph.toolpath.moves import Message


def xs_of(text: str, **options: int) -> list[float]:
    return [end[0] for end in xyz_of("G0\n" + text, **options)]


@pytest.mark.parametrize(
    ("text", "xs"),
    [
        ("o1 sub\nX1\no1 endsub\nX2", [2]),
        ("o1 sub\nX1\no1 endsub\no1 call\nX2", [1, 2]),
        ("o1 call\nX2\nM2\no1 sub\nX1\no1 endsub", [1, 2]),
        ("o<A b> sub\nX#1 Y#2\no<ab> endsub\no<AB> call [1+2] (c) [4]", [3]),
        ("#1=7\no1 sub\n#1=[#1+1]\nX#1\no1 endsub\no1 call [1]\nX#1", [2, 7]),
        ("#<a>=7\no1 sub\n#<a>=1\nX#<a>\no1 endsub\no1 call\nX#<a>", [1, 7]),
        ("o1 sub\no1 return [#1*2]\nX9\no1 endsub\no1 call [4]\nX#<_value>", [8]),
        ("o1 sub\no1 endsub [3]\no1 call\nX[#<_value> + #<_value_returned>]", [4]),
        ("o1 sub\no1 endsub\no1 call\nX[#<_value_returned>+5]", [5]),
        ("#5=1\no[#5+1] call\no2 sub\nX2\no2 endsub", [2]),
        ("#5=2\no#5 call\no2 sub\nX2\no2 endsub", [2]),
        ("o1 if [1]\nX1\no1 elseif [1]\nX2\no1 else\nX3\no1 endif\nX4", [1, 4]),
        ("o1 if [0]\nX1\no1 elseif [1]\nX2\no1 else\nX3\no1 endif\nX4", [2, 4]),
        ("o1 if [0]\nX1\no1 elseif [0]\nX2\no1 else\nX3\no1 endif\nX4", [3, 4]),
        ("o1 if [0]\nX1\no1 endif\nX4", [4]),
        ("o1 if [1]\no2 if [0]\nX1\no2 endif\nX2\no1 else\nX3\no1 endif", [2]),
        ("o1 while [#1 LT 3]\n#1=[#1+1]\nX#1\no1 endwhile", [1, 2, 3]),
        ("o1 while [0]\nX1\no1 endwhile\nX2", [2]),
        ("o1 do\n#1=[#1+1]\nX#1\no1 while [#1 LT 3]", [1, 2, 3]),
        ("o1 do\nX1\no1 while [0]\nX2", [1, 2]),
        ("o1 repeat [3]\n#1=[#1+1]\nX#1\no1 endrepeat", [1, 2, 3]),
        ("o1 repeat [0]\nX1\no1 endrepeat\nX2", [2]),
        ("o1 repeat [2]\no2 repeat [2]\n#1=[#1+1]\nX#1\no2 endrepeat\no1 endrepeat", [1, 2, 3, 4]),
        ("o1 while [1]\n#1=[#1+1]\no2 if [#1 EQ 3]\no1 break\no2 endif\nX#1\no1 endwhile", [1, 2]),
        (
            "o1 while [#1 LT 3]\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 continue\no2 endif\nX#1\no1 endwhile",
            [1, 3],
        ),
        (
            "o1 do\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 continue\no2 endif\nX#1\no1 while [#1 LT 3]",
            [1, 3],
        ),
        ("o1 do\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 break\no2 endif\nX#1\no1 while [1]\nX9", [1, 9]),
        (
            "o1 repeat [4]\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 continue\no2 endif\nX#1\no1 endrepeat",
            [1, 3, 4],
        ),
        (
            "o1 repeat [4]\n#1=[#1+1]\no2 if [#1 EQ 3]\no1 break\no2 endif\nX#1\no1 endrepeat\nX9",
            [1, 2, 9],
        ),
        ("o1 while [1]\nX1\nM2\no1 endwhile", [1]),
        (
            "o1 sub\no2 repeat [3]\nX1\no1 return\no2 endrepeat\no1 endsub\no1 call\no1 call\nX2",
            [1, 1, 2],
        ),
        ("o1 if [1]\nX1\no1 endif\no1 if [1]\nX2\no1 endif", [1, 2]),  # a label may come again
        ("o1 if [0]\nnonsense here\no1 endif\nX2", [2]),  # what is not executed is not read
        ("N10 O1 IF [1] (why)\nN20 X1\n  N30 o1 EndIf ; end\nX2", [1, 2]),
        ("O1234\nX1", [1]),
        ("o1 sub\nO7\nX1\no1 endsub\no1 call", [1]),
    ],
)
def test_flow(text: str, xs: list[float]) -> None:
    assert xs_of(text) == xs


def test_nothing_is_read_after_the_closing_percent() -> None:
    text = "%\no1 call\no1 sub\nG0 X1\no1 endsub\n%\no1 endsub"
    assert [end[0] for end in xyz_of(text)] == [1]


def test_recursion() -> None:
    text = """
o<f> sub
  o1 if [#1 LE 1]
    o<f> return [1]
  o1 endif
  #<mine> = #1
  o<f> call [#1 - 1]
  o<f> return [#<mine> * #<_value>]
o<f> endsub
o<f> call [6]
X#<_value>
"""
    assert xs_of(text) == [720]


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("o1 if [1]", 1, 1),
        ("o1 endif", 1, 1),
        ("o1 else", 1, 1),
        ("o1 if [1]\no1 else\no1 else\no1 endif", 3, 1),
        ("o1 if [1]\no2 endif", 2, 1),
        ("o1 if [1]\no1 endwhile", 2, 1),
        ("o1 if [1]\no2 while [0]\no1 endif\no2 endwhile", 3, 1),
        ("o1 sub\no2 sub\no2 endsub\no1 endsub", 2, 1),
        ("o1 sub\no1 endsub\no1 sub\no1 endsub", 3, 1),
        ("o1 break", 1, 1),
        ("o1 while [1]\no2 break\no1 endwhile", 2, 1),
        ("o1 return", 1, 1),
        ("o1 call\n", 1, 1),
        ("o<nothing> call", 1, 1),
        ("o1 if 1\no1 endif", 1, 7),
        ("o1 if [1] X1\no1 endif", 1, 11),
        ("o1 if [1]\no1 endif X1", 2, 10),
        ("o1 sub\no1 endsub\no1 call 5", 3, 9),
        ("o1 sub\no1 endsub\no1 call [#<no>]", 3, 10),
        ("o1 nothing", 1, 4),
        ("o", 1, 2),
        ("o<a if [1]", 1, 2),
        ("o[1] if [1]", 1, 1),
        ("o1 sub\no1 endsub\nG0 X1 o1 call", 3, 7),
        ("o1 sub\no1 endsub\no1 call" + "[1]" * 31, 3, 98),
        ("%\no1 sub\no1 endsub", 4, 1),
    ],
)
def test_refused_flow(text: str, line: int, column: int) -> None:
    assert place_of(text) == (line, column)


def test_endless_loops_are_refused() -> None:
    text = "o1 while [1]\n#1=[#1+1]\no1 endwhile"
    error = error_of(text, most_jumps=1000)
    assert (error.line, error.column) == (3, 1)
    assert "1000 jumps" in str(error)
    assert xs_of("o1 repeat [500]\n#1=[#1+1]\no1 endrepeat\nX#1", most_jumps=500) == [500]


def test_levels_are_bounded() -> None:
    text = "o1 sub\no1 call [#1+1]\no1 endsub\no1 call"
    assert f"{MOST_LEVELS} subroutines" in str(error_of(text))


def test_messages_beside_o_words() -> None:
    assert commands_of("o1 if [1] (msg, yes)\no1 endif") == [Message(1, "yes")]


def test_block_delete_takes_o_words_away() -> None:
    text = "/o1 repeat [3]\nX1\n/o1 endrepeat\n"
    assert xs_of(text) == [1, 1, 1]
    assert xs_of(text, block_delete=True) == [1]


_Tree = list[object]
_LEAVES = st.just("step")
_TREES = st.recursive(
    st.lists(_LEAVES, max_size=3),
    lambda inner: st.lists(
        st.one_of(
            _LEAVES,
            st.tuples(
                st.sampled_from(["repeat", "while", "do", "if", "else"]), st.integers(0, 3), inner
            ),
        ),
        max_size=3,
    ),
    max_leaves=8,
)


class _Model:
    """Writes a tree as G-code, and runs it in Python: two ways to the same sequence of steps."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.xs: list[float] = []
        self._labels = 0
        self._step = 0

    def write(self, tree: _Tree) -> None:
        for node in tree:
            if node == "step":
                self.lines += ["#1=[#1+1]", "X#1"]
            elif isinstance(node, tuple):
                self._labels += 1
                self._write_node(f"o{self._labels}", *node)

    def _write_node(self, label: str, kind: str, count: int, inner: _Tree) -> None:
        counter = f"#<c{label}>"
        begin = {
            "repeat": [f"{label} repeat [{count}]"],
            "while": [
                f"{counter}=0",
                f"{label} while [{counter} LT {count}]",
                f"{counter}=[{counter}+1]",
            ],
            "do": [f"{counter}=0", f"{label} do", f"{counter}=[{counter}+1]"],
            "if": [f"{label} if [{count} GT 1]"],
            "else": [f"{label} if [{count} GT 1]", "#1=[#1+100]", f"{label} else"],
        }
        end = {
            "repeat": "endrepeat",
            "while": "endwhile",
            "do": f"while [{counter} LT {count}]",
            "if": "endif",
            "else": "endif",
        }
        self.lines += begin[kind]
        self.write(inner)
        self.lines.append(f"{label} {end[kind]}")

    def run(self, tree: _Tree) -> None:
        for node in tree:
            if node == "step":
                self._step += 1
                self.xs.append(self._step)
            elif isinstance(node, tuple):
                kind, count, inner = node
                if kind == "else" and count > 1:
                    self._step += 100
                times = {"if": int(count > 1), "else": int(count <= 1), "do": max(count, 1)}
                for _ in range(times.get(kind, count)):
                    self.run(inner)


@given(_TREES)
def test_structures_run_as_in_python(tree: _Tree) -> None:
    model = _Model()
    model.write(tree)
    model.run(tree)
    assert xs_of("\n".join(model.lines)) == model.xs
