# SPDX-License-Identifier: MIT
"""Mistakes that can be planted in a C source, found in its text. Used by tools/mutants. No I/O.

The text must be in the format of `make format`: binary operators stand between spaces, and a statement
begins its line. Not touched: comments, strings, the preprocessor, assertions, and initialisers of
file scope tables (`static const`), whose numbers other tests check.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from mutation.sites import Mutant, line_of

_HIDDEN = re.compile(
    r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'"
    r"|^[ \t]*#(?:[^\n\\]|\\.|\\\n)*|\b(?:static_)?assert\([^;]*;",
    re.DOTALL | re.MULTILINE,
)
_TABLE = re.compile(
    r"^(?:static )?(?:const )?[\w ]+\b\w+\[[^\n]*\] = \{.*?^\};", re.DOTALL | re.MULTILINE
)

_OPERATORS: dict[str, dict[str, tuple[str, ...]]] = {
    "compare": {
        "<": ("<=", ">="),
        "<=": ("<", ">"),
        ">": (">=", "<="),
        ">=": (">", "<"),
        "==": ("!=",),
        "!=": ("==",),
    },
    "logic": {"&&": ("||",), "||": ("&&",)},
    "arithmetic": {
        "+": ("-",),
        "-": ("+",),
        "*": ("+",),
        "/": ("*",),
        "%": ("*",),
        "<<": (">>",),
        ">>": ("<<",),
        "&": ("|",),
        "|": ("&",),
        "+=": ("-=",),
        "-=": ("+=",),
        "|=": ("&=",),
        "&=": ("|=",),
    },
}
_BETWEEN = re.compile(r"(?<= )(<<|>>|<=|>=|==|!=|&&|\|\||\+=|-=|\|=|&=|[-+*/%<>&|])(?= )")
_NUMBER = re.compile(r"(?<![\w.])(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)(?![\w.])")
_FLOAT = re.compile(r"(?<![\w.])(\d+\.\d*)(f?)(?![\w.])")
_NOT = re.compile(r"!(?=[\w(])")
_MINUS = re.compile(r"(?<=[(=,] )-(?=\w)|(?<=\()-(?=\w)|(?<=return )-(?=\w)")
_BOOLEAN = re.compile(r"\b(true|false)\b")
_INDEX = re.compile(r"(?<=\w)\[([^\[\]]*[a-z][^\[\]]*)\]")
_STATEMENT = re.compile(r"(?<=[{};:]\n)[ \t]+(?=[\w*(])([^;{}]*;)", re.MULTILINE)
_DECLARATION = re.compile(
    r"(?:const|static|struct|enum|union|unsigned|void|typedef|return|break|continue|goto|case|default|"
    r"if|for|while|switch|do|else)\b|[A-Za-z_]\w*\s+\*?[A-Za-z_]\w*\s*(?:[=;,\[]|$)"
)


def masked(source: str) -> str:
    """The source with everything that is not to be touched as blanks; offsets stay."""

    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", found[0])

    return _TABLE.sub(blank, _HIDDEN.sub(blank, source))


def find(path: str, source: str) -> Iterator[Mutant]:
    """Every mistake that can be planted in the source."""
    text = masked(source)
    for kind, start, end, new in _changes(text):
        yield Mutant(path, line_of(source, start), kind, start, end, new)


def _changes(text: str) -> Iterator[tuple[str, int, int, str]]:
    yield from _operators(text)
    yield from _constants(text)
    for found in _NOT.finditer(text):
        yield "negation", found.start(), found.end(), ""
    for found in _MINUS.finditer(text):
        yield "negation", found.start(), found.end(), ""
    for found in _BOOLEAN.finditer(text):
        yield "boolean", found.start(), found.end(), "false" if found[1] == "true" else "true"
    yield from _indices(text)
    yield from _statements(text)


def _operators(text: str) -> Iterator[tuple[str, int, int, str]]:
    for found in _BETWEEN.finditer(text):
        for kind, table in _OPERATORS.items():
            for new in table.get(found[1], ()):
                yield kind, found.start(1), found.end(1), new


def _constants(text: str) -> Iterator[tuple[str, int, int, str]]:
    for found in _NUMBER.finditer(text):
        if text[: found.start()].endswith("default: ") or _declares_array(text, found):
            continue
        value = int(found[1], 0)
        for other in (value + 1, value - 1):
            if other >= 0:
                yield "constant", found.start(), found.end(), f"{other}{found[2]}"
    for found in _FLOAT.finditer(text):
        yield "constant", found.start(1), found.end(1), str(float(found[1]) * 1.25 or 1.0)


def _declares_array(text: str, number: re.Match[str]) -> bool:
    """`uint8_t data[8];`: a greater array changes nothing, and a lesser one is a compiler's business."""
    line = text[text.rfind("\n", 0, number.start()) + 1 : number.start()].strip()
    return line.endswith("[") and _DECLARATION.match(line.split("[")[0] + "[") is not None


def _indices(text: str) -> Iterator[tuple[str, int, int, str]]:
    for found in _INDEX.finditer(text):
        line = text[text.rfind("\n", 0, found.start()) + 1 : found.start() + 1].strip()
        if _DECLARATION.match(line) and not line.startswith(
            ("return", "if", "for", "while", "case")
        ):
            continue
        yield "index", found.start(1), found.end(1), f"({found[1]}) + 1"


def _statements(text: str) -> Iterator[tuple[str, int, int, str]]:
    """Assignments, and calls without use of their value, left out; the lines stay, so later ones keep their numbers."""
    for found in _STATEMENT.finditer(text):
        if _DECLARATION.match(found[1]) is None:
            lines = found[1].count("\n")
            yield "statement", found.start(1), found.end(1), ";" + "\n" * lines
