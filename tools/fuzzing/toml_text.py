# SPDX-License-Identifier: MIT
"""Mutates the values and keys of TOML documents, and writes the same document in many forms. Used by targets.py. No
I/O.
"""

from __future__ import annotations

import copy
import datetime
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, cast

Tree = dict[str, Any]
Place = tuple[Any, str | int]
"""A table or list, and a key or index in it."""

UNKNOWN = "zz_unknown"
_ORDERED = ("random", "vary")
"""Tables whose order counts, because random values are drawn for their names in this order."""
_NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 2, 3, 127, 128, 255, 2**31, 2**32, 2**63, 2**64, 10**400, -(2**31)),
    *(0.0, -0.0, 1e-300, 1e-12, 1e-6, 1e6, 1e12, 1e300, 0.1, 0.5, 1.5),
)
_TEXTS = (
    *("", " ", "x", "a" * 500, "é\u2028", "../..", "/dev/null", ".", "-", "{at}", "{at.real}"),
    *("{at[0]}", "{at!r}", "{at:>99}", "{", "{0}", "{}", "100", "nan", "true", "\0", "a\nb"),
)
_OTHER_TYPES: tuple[Any, ...] = (
    *(True, False, "text", [], [1], {}, {"x": 1}, [[]], [{}], 7, 1.5),
    *(datetime.date(2026, 1, 2), datetime.time(3, 4, 5), datetime.datetime(2026, 1, 2, 3, 4, 5)),
)


@dataclass
class Document:
    """A mutated document. `must_refuse`: why no reader may take it, or empty."""

    data: Tree
    must_refuse: str = ""


def places(data: Any) -> Iterator[Place]:
    """Every value of a document, at any depth."""
    keys: Sequence[Any] = ()
    if isinstance(data, dict):
        keys = list(data)
    elif isinstance(data, list):
        keys = range(len(data))
    for key in keys:
        yield data, key
        yield from places(data[key])


def mutate(data: Tree, words: Sequence[tuple[str, Any]], random: Random) -> Document:
    """One to three changes. `words`: keys with values that documents of this kind may have."""
    changed = copy.deepcopy(data)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        _change(changed, words, random)
    document = Document(changed)
    if random.random() < 0.15:
        _spoil(document, random)
    return document


def _change(data: Tree, words: Sequence[tuple[str, Any]], random: Random) -> None:
    found = list(places(data))
    if not found:
        return
    # Long lists, such as points, do not take all changes.
    plain = [place for place in found if not isinstance(place[0], list)]
    inside, key = random.choice(plain if plain and random.random() < 0.7 else found)
    kind = random.random()
    if kind < 0.55:
        inside[key] = _other(inside[key], random)
    elif kind < 0.65:
        inside[key] = copy.deepcopy(random.choice(_OTHER_TYPES))
    elif kind < 0.75:
        del inside[key]
    elif kind < 0.85 and isinstance(inside, list):
        again = copy.deepcopy(random.choice(inside))
        inside.insert(random.randrange(len(inside) + 1), again)
    elif kind < 0.9:
        _swap(found, random)
    else:
        table = random.choice([data, *(t[k] for t, k in found if isinstance(t[k], dict))])
        name, value = random.choice(words)
        table[name] = copy.deepcopy(value)


def _swap(found: Sequence[Place], random: Random) -> None:
    (one, a), (two, b) = random.choice(found), random.choice(found)
    if not isinstance(one[a], dict | list) and not isinstance(two[b], dict | list):
        one[a], two[b] = two[b], one[a]


def _other(value: Any, random: Random) -> Any:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return _other_number(value, random)
    if isinstance(value, str):
        return random.choice(_TEXTS)
    if isinstance(value, list) and value:
        return random.choice(([], value[:1], value[:-1], value[::-1], value + value[-1:], [value]))
    return copy.deepcopy(random.choice(_OTHER_TYPES))


def _other_number(value: float, random: Random) -> float:
    if random.random() < 0.5:
        return cast(float, random.choice(_NUMBERS))
    factor = random.choice((0.5, 2, 0.9, 1.1, 10, 0.1, -1, 1e3, 1e-3, 1 + 1e-9))
    if isinstance(value, int) and random.random() < 0.7:
        return round(value * factor) if abs(value) < 1e15 else value + 1
    return float(value) * factor if abs(value) < 1e300 else 1.0


def _spoil(document: Document, random: Random) -> None:
    """A change that each reader has to refuse: an unknown key, or a value that is no number in place of a number."""
    found = list(places(document.data))
    numbers = [
        (t, k)
        for t, k in found
        if isinstance(t, dict) and isinstance(t[k], int | float) and not isinstance(t[k], bool)
    ]
    if random.random() < 0.5 or not numbers:
        free = ("random",)  # names of its own choice
        tables = [t[k] for t, k in found if isinstance(t[k], dict) and k not in free]
        random.choice([document.data, *tables])[UNKNOWN] = 1
        document.must_refuse = "it has an unknown key"
    else:
        table, key = random.choice(numbers)
        table[key] = random.choice((math.nan, math.inf, -math.inf, "text", True, [], {}))
        document.must_refuse = f"{key} is {table[key]!r}"


# --- Spelling ---


def plain(data: Tree) -> str:
    """The document in the one canonical spelling."""
    return _Writer(None).document(data)


def spelled(data: Tree, random: Random) -> str:
    """The document in another order and another spelling."""
    return _Writer(random).document(data)


class _Writer:
    """Writes a document; without `random` canonically."""

    def __init__(self, random: Random | None) -> None:
        self._random = random

    def _chance(self, p: float) -> bool:
        return self._random is not None and self._random.random() < p

    def _order(self, data: Tree, name: str = "") -> list[tuple[str, Any]]:
        items = list(data.items())
        if self._random is not None and name not in _ORDERED:
            self._random.shuffle(items)
        return items

    def document(self, data: Tree) -> str:
        """The text."""
        lines = self._table(data, ())
        if self._chance(0.3):
            lines = [f"{line}{'  # a comment' if '=' in line else ''}" for line in lines]
        if self._chance(0.3):
            lines = [part for line in lines for part in (line, "")]
        return ("\r\n" if self._chance(0.3) else "\n").join(lines) + "\n"

    def _table(self, data: Tree, name: tuple[str, ...]) -> list[str]:
        values, tables = [], []
        for key, value in self._order(data, name[-1] if name else ""):
            is_tables = isinstance(value, list) and value and all(type(v) is dict for v in value)
            inline = 0.0 if key in _ORDERED or (name and name[-1] in _ORDERED) else 0.2
            if isinstance(value, dict) and not self._chance(inline):
                tables += [
                    f"[{self._name((*name, key))}]",
                    *self._table(value, (*name, key)),
                ]
            elif is_tables and not self._chance(0.2):
                for each in value:
                    tables += [
                        f"[[{self._name((*name, key))}]]",
                        *self._table(each, (*name, key)),
                    ]
            else:
                space = " " * (3 if self._chance(0.2) else 1)
                values.append(f"{self._key(key)}{space}={space}{self._value(value, key)}")
        return values + tables

    def _name(self, name: tuple[str, ...]) -> str:
        return (" . " if self._chance(0.2) else ".").join(map(self._key, name))

    def _key(self, key: str) -> str:
        is_bare = key.isascii() and key.replace("_", "a").replace("-", "a").isalnum()
        return key if is_bare and not self._chance(0.1) else self._text(key)

    def _value(self, value: Any, name: str = "") -> str:
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, int):
            return self._integer(value)
        if isinstance(value, float):
            return self._float(value)
        if isinstance(value, str):
            return self._text(value)
        if isinstance(value, list):
            end = "," if value and self._chance(0.3) else ""
            gap = "\n  " if self._chance(0.3) else " "
            return "[" + f",{gap}".join(map(self._value, value)) + end + "]"
        if isinstance(value, dict):
            items = self._order(value, name)
            pairs = (f"{self._key(k)} = {self._value(v, k)}" for k, v in items)
            return "{" + ", ".join(pairs) + "}"
        return str(value.isoformat())

    def _integer(self, value: int) -> str:
        if value >= 0 and self._chance(0.2):
            return f"0x{value:x}"
        return f"{value:_}" if self._chance(0.2) else str(value)

    def _float(self, value: float) -> str:
        if not math.isfinite(value):
            return repr(value)
        if self._chance(0.3):
            return f"{value:.17e}"  # 17 digits after the point: the same double
        text = repr(value)
        return text if any(mark in text for mark in ".e") else text + ".0"

    def _text(self, value: str) -> str:
        if self._chance(0.3) and value.isprintable() and "'" not in value:
            return f"'{value}'"
        escaped = (
            f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 or c in '\\"' else c for c in value
        )
        return '"' + "".join(escaped) + '"'
