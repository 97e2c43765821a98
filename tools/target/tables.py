# SPDX-License-Identifier: MIT
"""Figures of campaign.py as text: tables for docs/counts.md and the console, JSON of one line for each row."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from target.campaign import FLOOR, GOALS, INTERRUPT_GOAL, OVERRIDE_GOAL, SCENARIOS, SPREAD_GOAL
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


def _pairs(figures: Figures, section: str) -> Iterator[tuple[str, str, str, Figures]]:
    for pair, scenarios in figures[section].items():
        target, kernel = pair.split()
        yield target, kernel, f"{TARGETS[target].core} ({target}) {kernel}", scenarios


def whole_table(figures: Figures, section: str) -> str:
    """The whole of a section: one row for each pair and scenario."""
    head = ["core, kernel", "scenario", "ticks", "min", "median", "max", "max / median", "goal"]

    def rows() -> Iterator[list[str]]:
        for target, kernel, title, scenarios in _pairs(figures, section):
            for name, row in scenarios.items():
                least, median, most = row["whole"]
                ratio = f"{most / max(median, 1):.2f}"
                goal = goal_text(section, target, kernel, name, most)
                cells = [title, name, *map(str, (row["ticks"], least, median, most)), ratio, goal]
                yield cells
                title = ""

    return _table(head, rows())


def goal_of(section: str, target: str, kernel: str, scenario: str) -> int | None:
    """Most instructions wanted, None where there is no goal."""
    goal = GOALS.get((target, kernel))
    if goal is None or section == "receive" or scenario == "settling":
        return None
    times = OVERRIDE_GOAL if scenario.startswith("override") else 1.0
    return round(goal * times * (INTERRUPT_GOAL if section == "isr" else 1))


def goal_text(section: str, target: str, kernel: str, scenario: str, most: int) -> str:
    goal = goal_of(section, target, kernel, scenario)
    if goal is None:
        return ""
    return f"{goal}: kept" if most <= goal else f"{goal}: missed by {most / goal - 1:.0%}"


def parts_table(figures: Figures, section: str) -> str:
    """Most (and median) instructions of the parts, each by itself."""
    rows_of = [row for *_, s in _pairs(figures, section) for row in s.values()]
    names = [p for p in PARTS if any(p in row for row in rows_of)]
    head = ["core, kernel", "scenario", *names]

    def rows() -> Iterator[list[str]]:
        for _target, _kernel, title, scenarios in _pairs(figures, section):
            for name, row in scenarios.items():
                cells = [row.get(part, [0, 0, 0]) for part in names]
                yield [title, name, *(f"{c[1]} … {c[2]}" for c in cells)]
                title = ""

    return _table(head, rows())


def worst(scenarios: Figures, kind: str) -> tuple[int, int]:
    """(median, most) over the scenarios of a kind, `plain` or `override`; the median is that of the examples."""
    most = max(row["whole"][2] for name, row in scenarios.items() if name.startswith(kind))
    return scenarios[kind]["whole"][1], most


def _spread(most: int, median: int) -> str:
    spread = most / median
    return f"{spread:.2f}" + ("" if spread <= SPREAD_GOAL else " (missed)")


def goal_lines(figures: Figures) -> str:
    """The goals with what was counted."""
    head = [
        "core, kernel",
        "",
        "most",
        "goal",
        "worst / median",
        "most / floor",
        "interrupt",
        "goal",
        "worst / median",
    ]

    def rows() -> Iterator[list[str]]:
        for target, kernel, title, scenarios in _pairs(figures, "motion"):
            interrupts = figures["isr"][f"{target} {kernel}"]
            for kind in ("plain", "override"):
                median, most = worst(scenarios, kind)
                usual, interrupt = worst(interrupts, kind)
                yield [
                    title,
                    kind,
                    str(most),
                    goal_text("motion", target, kernel, kind, most),
                    _spread(most, median),
                    f"{most / FLOOR:.0f}",
                    str(interrupt),
                    goal_text("isr", target, kernel, kind, interrupt),
                    _spread(interrupt, usual),
                ]
                title = ""

    return _table(head, rows())


def histogram(figures: Figures, pair: str) -> str:
    """Bars of text for the scenarios of one pair; a bin is named by its least count."""
    lines = []
    for scenario in SCENARIOS:
        bins = figures["motion"][pair][scenario.name]["histogram"]
        total = sum(bins.values())
        lines.append(f"{scenario.name} ({total} ticks)")
        for low, ticks in bins.items():
            bar = "#" * max(1, round(50 * ticks / total))
            lines.append(f"  {int(low):6} {ticks:6} {bar}")
    return "\n".join(lines) + "\n"


def taylor_table(figures: Figures) -> str:
    """The usual NURBS interpolator beside ours."""
    head = ["core", "interpolator", "min", "median", "max", "max / median", "feed ripple"]

    def rows() -> Iterator[list[str]]:
        for target, both in figures["taylor"].items():
            for name, row in both.items():
                least, median, most = row["whole"]
                title = f"{TARGETS[target].core} ({target})"
                ratio = f"{most / median:.2f}"
                cells = [*map(str, (least, median, most)), ratio, f"{row['ripple']:.1e}"]
                yield [title, name, *cells]

    return _table(head, rows())
