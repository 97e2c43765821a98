# SPDX-License-Identifier: MIT
"""Figures of campaign.py as text: tables for docs/counts.md and the console, JSON of one line for each row."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from target.campaign import FLOOR, GOALS, OVERRIDE_GOAL, SCENARIOS, SPREAD_GOAL
from target.emulator import TARGETS
from target.parts import PARTS

Figures = dict[str, Any]


def stored(figures: Figures) -> str:
    """JSON in which a changed count changes one line."""

    def lines(value: Any, depth: int, deep: int) -> str:
        if not isinstance(value, dict) or depth == deep:
            return json.dumps(value)
        indent = " " * (depth + 1)
        rows = [f"{indent}{json.dumps(k)}: {lines(v, depth + 1, deep)}" for k, v in value.items()]
        return "{\n" + ",\n".join(rows) + "\n" + " " * depth + "}"

    return lines(figures, 0, 4) + "\n"


def _table(head: list[str], rows: Iterator[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _pairs(figures: Figures) -> Iterator[tuple[str, str, str, Figures]]:
    for pair, scenarios in figures["motion"].items():
        target, kernel = pair.split()
        yield target, kernel, f"{TARGETS[target].core} ({target}) {kernel}", scenarios


def motion_table(figures: Figures) -> str:
    """Whole motion part: one row for each pair and scenario."""
    head = ["core, kernel", "scenario", "ticks", "min", "median", "max", "max / median", "goal"]

    def rows() -> Iterator[list[str]]:
        for target, kernel, title, scenarios in _pairs(figures):
            for name, row in scenarios.items():
                least, median, most = row["motion"]
                ratio = f"{most / max(median, 1):.2f}"
                goal = goal_text(target, kernel, name, most)
                cells = [title, name, *map(str, (row["ticks"], least, median, most)), ratio, goal]
                yield cells
                title = ""

    return _table(head, rows())


def goal_of(target: str, kernel: str, scenario: str) -> int | None:
    """Most instructions wanted, None where there is no goal."""
    goal = GOALS.get((target, kernel))
    if goal is None:
        return None
    return round(goal * OVERRIDE_GOAL) if scenario.startswith("override") else goal


def goal_text(target: str, kernel: str, scenario: str, most: int) -> str:
    goal = goal_of(target, kernel, scenario)
    if goal is None:
        return ""
    return f"{goal}: kept" if most <= goal else f"{goal}: {most / goal:.2f} times as many"


def parts_table(figures: Figures) -> str:
    """Most (and median) instructions of the parts, each by itself, over all scenarios of one kind."""
    names = [p for p in PARTS if any(p in r for *_, s in _pairs(figures) for r in s.values())]
    head = ["core, kernel", "scenario", *names]

    def rows() -> Iterator[list[str]]:
        for _target, _kernel, title, scenarios in _pairs(figures):
            for name, row in scenarios.items():
                cells = [row.get(part, [0, 0, 0]) for part in names]
                yield [title, name, *(f"{c[1]} … {c[2]}" for c in cells)]
                title = ""

    return _table(head, rows())


def worst(scenarios: Figures, kind: str) -> tuple[int, int]:
    """(median, most) over the scenarios of a kind: `plain` or `override`; the median is that of the examples."""
    rows = {name: row for name, row in scenarios.items() if name.startswith(kind)}
    return rows[kind]["motion"][1], max(row["motion"][2] for row in rows.values())


def goal_lines(figures: Figures) -> str:
    """The goals with what was counted."""
    head = ["core, kernel", "", "most", "goal", "worst / median", f"goal {SPREAD_GOAL}", "floor"]

    def rows() -> Iterator[list[str]]:
        for target, kernel, title, scenarios in _pairs(figures):
            for kind in ("plain", "override"):
                median, most = worst(scenarios, kind)
                spread = most / median
                yield [
                    title,
                    kind,
                    str(most),
                    goal_text(target, kernel, kind, most),
                    f"{spread:.2f}",
                    "kept" if spread <= SPREAD_GOAL else "missed",
                    f"{most / FLOOR:.0f} times",
                ]
                title = ""

    return _table(head, rows())


def histogram(figures: Figures, pair: str, bin_width: int) -> str:
    """Bars of text for the scenarios of one pair."""
    lines = []
    for scenario in SCENARIOS:
        bins = figures["motion"][pair][scenario.name]["histogram"]
        total = sum(bins.values())
        lines.append(f"{scenario.name} ({total} ticks)")
        for low, ticks in bins.items():
            bar = "#" * max(1, round(50 * ticks / total))
            lines.append(f"  {int(low):6} … {int(low) + bin_width - 1:6} {ticks:6} {bar}")
    return "\n".join(lines) + "\n"


def taylor_table(figures: Figures) -> str:
    """The usual NURBS interpolator beside ours."""
    head = ["core", "interpolator", "min", "median", "max", "max / median", "feed ripple"]

    def rows() -> Iterator[list[str]]:
        for target, both in figures["taylor"].items():
            for name, row in both.items():
                least, median, most = row["motion"]
                title = f"{TARGETS[target].core} ({target})"
                ratio = f"{most / median:.2f}"
                cells = [*map(str, (least, median, most)), ratio, f"{row['ripple']:.1e}"]
                yield [title, name, *cells]

    return _table(head, rows())
