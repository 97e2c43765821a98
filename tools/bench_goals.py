# SPDX-License-Identifier: MIT
"""Compares measured figures with goals: benchmarks/goals.toml and the figures of all benchmarks, by script. Used by
tools/run_benchmarks. Reads the file of goals.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Judged:
    """A goal and its measured figure; `kept` None: not measured."""

    text: str
    wanted: str
    found: str
    kept: bool | None
    load: bool

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if self.kept is None:
            return "not measured"
        if self.kept:
            return "kept"
        return "missed (a time: look at the load)" if self.load else "MISSED"


def judged(file: Path, figures: dict[str, Any]) -> list[Judged]:
    """Every goal of the file."""
    goals = tomllib.loads(file.read_text(encoding="utf-8"))["goal"]
    return [_judge(goal, list(_at(figures, goal["figure"]))) for goal in goals]


def _judge(goal: dict[str, Any], values: list[Any]) -> Judged:
    kind = next(k for k in ("at_most", "at_least", "is") if k in goal)
    limit = goal[kind]
    known = [value for value in values if value is not None]
    wanted = _shown(limit) if kind == "is" else f"{kind.replace('_', ' ')} {_shown(limit)}"
    if not known:
        return Judged(goal["text"], wanted, "-", None, goal.get("load", False))
    worst = max(known) if kind == "at_most" else min(known)
    kept = worst <= limit if kind == "at_most" else worst >= limit
    return Judged(goal["text"], wanted, _shown(worst), kept, goal.get("load", False))


def _at(figures: Any, way: Sequence[str]) -> Iterator[Any]:
    """The figures at a path of keys; "*" is any key."""
    if not way:
        yield figures
        return
    if not isinstance(figures, dict):
        return
    for key in figures if way[0] == "*" else (way[0],):
        if key in figures:
            yield from _at(figures[key], way[1:])


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}"


def goal_lines(found: Sequence[Judged]) -> list[str]:
    """As a table."""
    rows = [
        ("goal", "required", "measured", ""),
        *((j.text, j.wanted, j.found, j.verdict) for j in found),
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    return [
        "  ".join(
            cell.rjust(width) if i == 2 else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
