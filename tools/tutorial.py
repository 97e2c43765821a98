# SPDX-License-Identifier: MIT
"""docs/start/tutorial.md as a notebook: its Python blocks, run one after the other in one namespace. Used by
tools/draw_figures. Executes the code of the page in this process.

A block of ```text right after a block of Python is what that prints. An image ../images/NAME.svg after it shows the
`figure` that it leaves.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "start" / "tutorial.md"
_BLOCK = re.compile(
    r"^```python\n(?P<code>.*?)^```\n(?:\n```text\n(?P<output>.*?)^```\n)?"
    r"(?:\n!\[[^\]]*\]\(\.\./images/(?P<image>[\w-]+)\.svg\)\n)?",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Cell:
    """A block of the page: its code, the line it begins in, what it should print, the name of its figure."""

    code: str
    line: int
    output: str
    image: str | None


@dataclass(frozen=True)
class Result:
    """A cell that has run: what it printed, and its figure."""

    cell: Cell
    output: str
    figure: Any


def cells(text: str) -> list[Cell]:
    """The cells of the page."""
    return [
        Cell(
            match["code"],
            text.count("\n", 0, match.start("code")) + 1,
            match["output"] or "",
            match["image"],
        )
        for match in _BLOCK.finditer(text)
    ]


def run(text: str) -> Iterator[Result]:
    """Runs the cells; an exception in one ends it."""
    namespace: dict[str, Any] = {"__name__": "tutorial"}
    for cell in cells(text):
        namespace.pop("figure", None)
        printed = io.StringIO()
        code = compile("\n" * (cell.line - 1) + cell.code, str(PAGE), "exec")
        with redirect_stdout(printed):
            exec(code, namespace)
        yield Result(cell, printed.getvalue(), namespace.get("figure"))
