# SPDX-License-Identifier: MIT
"""rust_literal: reads constants of Rust source text into Python values. Used by tools/register_facts. No I/O.

Enough of the syntax for tables of data: structs become dicts (their type is dropped), arrays lists, Some(x) x and
None None; `a..=b` a range; a path such as `Clock::Mux` becomes its last word, `Mux(x)` the pair ("Mux", x).
"""

from __future__ import annotations

import re
from typing import Any

_TOKEN = re.compile(
    r'\s*(?://[^\n]*\n\s*)*(?P<text>"(?:[^"\\]|\\.)*")|\s*(?P<number>-?(?:0x[\da-fA-F_]+|\d[\d_]*))|\s*(?P<word>[A-Za-z_]\w*)'
    r"|\s*(?P<mark>::|.)",
    re.DOTALL,
)


class _Reader:
    def __init__(self, source: str, start: int) -> None:
        self._matches = _TOKEN.finditer(source, start)
        self._step()

    def _step(self) -> None:
        match = next(self._matches, None)
        self.kind = match.lastgroup or "" if match else ""
        self.token = match[self.kind] if match and self.kind else ""

    def _take(self) -> str:
        token = self.token
        self._step()
        return token

    def value(self) -> Any:
        while self.token == "&":
            self._step()
        if self.kind == "text":
            return self._take()[1:-1]
        if self.kind == "number":
            return self._number()
        if self.token == "[":
            return self._items("]", self.value)
        return self._named()

    def _number(self) -> int | range:
        first = int(self._take().replace("_", ""), 0)
        if self.token != ".":
            return first
        while self.token in {".", "="}:
            self._step()
        return range(first, int(self._take(), 0) + 1)

    def _named(self) -> Any:
        word = self._take()
        while self.token == "::":
            self._step()
            word = self._take()
        if self.token == "{":
            return dict(self._items("}", self._field))
        if self.token == "(":
            (inside,) = self._items(")", self.value)
            return inside if word == "Some" else (word, inside)
        return {"None": None, "true": True, "false": False}.get(word, word)

    def _field(self) -> tuple[str, Any]:
        name = self._take()
        self._step()  # the colon
        return name, self.value()

    def _items(self, end: str, item: Any) -> list[Any]:
        self._step()
        items = []
        while self.token != end:
            items.append(item())
            if self.token == ",":
                self._step()
        self._step()
        return items


def read_static(source: str, name: str) -> Any:
    """The value of `static NAME: TYPE = VALUE;`. Raises ValueError when there is none."""
    found = re.search(rf"static {name}: [^=]+=", source)
    if found is None:
        raise ValueError(f"no static {name}")
    return _Reader(source, found.end()).value()
