# SPDX-License-Identifier: MIT
"""Figures of campaign.py as text: tables for docs/validation/counts.md and the console, JSON of one line for each row.
Used by tools/count, tools/longest_path and benchmarks/counts. No I/O.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from analysis.campaign import FLOOR, GOALS, INTERRUPT_GOAL, OVERRIDE_GOAL, SCENARIOS, SPREAD_GOAL
from analysis.emulator import TARGETS
from analysis.parts import PARTS

Figures = dict[str, Any]

_BARS = "▁▂▃▄▅▆▇█"


def stored(figures: Figures) -> str:
    """JSON in which a changed count changes one line."""

    def lines(value: Any, depth: int, deep: int) -> str:
        if not isinstance(value, dict) or depth == deep:
            return json.dumps(value)
        indent = " " * (depth + 1)
        rows = [f"{indent}{json.dumps(k)}: {lines(v, depth + 1, deep)}" for k, v in value.items()]
        return "{\n" + ",\n".join(rows) + "\n" + " " * depth + "}"

    return lines(figures, 0, 5) + "\n"


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
    """The goal: most instructions allowed; None: there is no goal."""
    goal = GOALS.get((target, kernel))
    if goal is None or section == "receive" or scenario in ("settling", "drive lost"):
        return None
    times = 1.0 if scenario.startswith("plain") else OVERRIDE_GOAL
    return round(goal * times * (INTERRUPT_GOAL if section == "isr" else 1))


def goal_text(section: str, target: str, kernel: str, scenario: str, most: int) -> str:
    goal = goal_of(section, target, kernel, scenario)
    if goal is None:
        return ""
    return f"{goal}: kept" if most <= goal else f"{goal}: missed by {most / goal - 1:.0%}"


def parts_table(figures: Figures, section: str) -> str:
    """Least, median and most instructions of the parts, each by itself."""
    rows_of = [row for *_, s in _pairs(figures, section) for row in s.values()]
    names = [p for p in PARTS if any(p in row for row in rows_of)]
    head = ["core, kernel", "scenario", *names]

    def rows() -> Iterator[list[str]]:
        for _target, _kernel, title, scenarios in _pairs(figures, section):
            for name, row in scenarios.items():
                cells = [row.get(part, [0, 0, 0]) for part in names]
                yield [title, name, *(" ".join(map(str, c)) for c in cells)]
                title = ""

    return _table(head, rows())


def worst(scenarios: Figures, kind: str) -> tuple[int, int]:
    """(median, most) over the scenarios of a kind, `plain` or `override`; the median is that of the examples."""
    most = max(row["whole"][2] for name, row in scenarios.items() if name.startswith(kind))
    return scenarios[kind]["whole"][1], most


# Scenarios of the interrupt alone, and the kind whose median they are compared with.
_FAULTS = {"fault": "plain", "fault, override": "override"}


def _spread(most: int, median: int) -> str:
    spread = most / median
    return f"{spread:.2f}" + ("" if spread <= SPREAD_GOAL else " (missed)")


def goal_lines(figures: Figures) -> str:
    """The goals with the counts."""
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
            for name, kind in _FAULTS.items():
                usual, most = interrupts[kind]["whole"][1], interrupts[name]["whole"][2]
                goal = goal_text("isr", target, kernel, name, most)
                yield ["", name, "", "", "", "", str(most), goal, _spread(most, usual)]

    return _table(head, rows())


def spread_text(figures: Figures) -> str:
    """The greatest ratios of worst and median in words, each with where it is."""
    found: dict[str, list[tuple[float, str]]] = {
        "motion": [],
        "isr": [],
        "fault": [],
        "settling": [],
    }
    for section in ("motion", "isr"):
        for *_, title, scenarios in _pairs(figures, section):
            for kind in ("plain", "override"):
                median, most = worst(scenarios, kind)
                found[section].append((most / median, f"{title}, {kind}"))
    for *_, title, scenarios in _pairs(figures, "isr"):
        for name, kind in _FAULTS.items():
            ratio = scenarios[name]["whole"][2] / scenarios[kind]["whole"][1]
            found["fault"].append((ratio, f"{title}, {name}"))
        _, median, most = scenarios["settling"]["whole"]
        found["settling"].append((most / median, title))
    motion, running, fault, settling = (f"{r:.2f} ({w})" for r, w in map(max, found.values()))
    return (
        f"Greatest ratios of a count to the median of the examples: {motion} for a motion part;\n"
        f"{running} for an interrupt while a program runs, with and without unanswered SYNCs;\n"
        f"{fault} for one that finds a fault. The greatest ratio to the median of scenario *settling*,\n"
        f"which is a tick without motion, is {settling} in that scenario.\n"
    )


def port_table(figures: Figures, port: int, wait: int) -> str:
    """The worst interrupts of the M4F with what a port adds, `wait` of it to wait for simulated drives."""
    target, kernel = "an386", "float"
    scenarios = figures["isr"][f"{target} {kernel}"]
    most = {name: row["whole"][2] for name, row in scenarios.items()}
    most["plain"] = max(most["plain"], most["plain, adversary"])

    def rows() -> Iterator[list[str]]:
        for name in ("plain", "plain, silent", "override, silent", *_FAULTS):
            sums = (most[name] + port, most[name] + port - wait)
            goals = [goal_text("isr", target, kernel, name, count) for count in sums]
            yield [name, str(most[name]), str(sums[0]), goals[0], str(sums[1]), goals[1]]

    head = ["M4F, float kernel", "isr.elf", "with the port", "goal", "without the wait", "goal"]
    return _table(head, rows())


def short_table(figures: Figures, pair: str, port: int) -> str:
    """The most expensive ticks of a core and kernel: motion part, whole interrupt, and interrupt with a port."""
    motion, isr = figures["motion"][pair], figures["isr"][pair]

    def row(text: str, motion_most: int | None, isr_most: int) -> list[str]:
        return [
            text,
            "" if motion_most is None else str(motion_most),
            str(isr_most),
            str(isr_most + port),
        ]

    rows = [
        row(
            "constant override, drives answer",
            worst(motion, "plain")[1],
            max(isr[name]["whole"][2] for name in ("plain", "plain, adversary")),
        ),
        row(
            "any sequence of override commands and holds, drives answer or not",
            worst(motion, "override")[1],
            worst(isr, "override")[1],
        ),
        row("the tick that finds a fault", None, max(isr[name]["whole"][2] for name in _FAULTS)),
    ]
    return _table(["tick", "motion part", "whole interrupt", "with a port"], iter(rows))


def fault_text(figures: Figures, pair: str) -> str:
    """What finding a fault adds to supervision."""
    scenarios = figures["isr"][pair]
    usual = scenarios["plain"]["supervision"][1]
    most = max(scenarios[name]["supervision"][2] for name in _FAULTS)
    more = f"{most - usual} more in supervision ({most}, usually {usual})"
    return f"The tick that finds both drives in a fault takes {more}.\n"


def histogram(figures: Figures, pair: str) -> str:
    """Bars of text for the scenarios of one pair; a bin is named by its least count."""
    lines = []
    for scenario in SCENARIOS:
        bins = figures["motion"][pair][scenario.name]["histogram"]["whole"]
        total = sum(bins.values())
        lines.append(f"{scenario.name} ({total} ticks)")
        for low, ticks in bins.items():
            bar = "#" * max(1, round(50 * ticks / total))
            lines.append(f"  {int(low):6} {ticks:6} {bar}")
    return "\n".join(lines) + "\n"


def _together(rows: Iterable[Figures], part: str) -> dict[int, int]:
    """Bins of a part over several scenarios."""
    bins: Counter[int] = Counter()
    for row in rows:
        found = row["histogram"].get(part, {"0": row["ticks"]})
        bins.update({int(low): ticks for low, ticks in found.items()})
    return dict(bins)


def strip(bins: dict[int, int], columns: int = 12) -> str:
    """Least and greatest bin, and between them a bar for each of `columns` stretches, as high as the logarithm of its
    ticks; `·` where there are none."""
    low, high = min(bins), max(bins)
    if low == high:
        return str(low)
    ticks = [0] * columns
    for at, count in bins.items():
        ticks[min((at - low) * columns // (high - low), columns - 1)] += count
    most = math.log(1 + max(ticks))
    bars = (_BARS[math.ceil(len(_BARS) * math.log(1 + n) / most) - 1] if n else "·" for n in ticks)
    return f"{low} {''.join(bars)} {high}"


def strips_table(figures: Figures, section: str) -> str:
    """Histograms of the whole and of the parts on each core: all scenarios without override together, all with it."""
    pairs = list(_pairs(figures, section))
    names = [p for p in PARTS if p != "rest" and any(p in row for row in pairs[0][3].values())]
    head = ["core, kernel", "", "whole", *names]

    def rows() -> Iterator[list[str]]:
        for _target, _kernel, title, scenarios in pairs:
            for kind in ("plain", "override"):
                chosen = [row for name, row in scenarios.items() if name.startswith(kind)]
                yield [title, kind, *(strip(_together(chosen, part)) for part in ("whole", *names))]
                title = ""

    return _table(head, rows())


_ABOVE = {
    "position": "position: three polynomials of degree 5 to 2^-40 mm, tangent, counts",
    "feed": "arc length: a polynomial of degree 7, 64 x 32 bits, and its slope",
    "rate": "program time, in integers without drift, rounded, and two ends of pieces",
    "newton": "Newton",
    "search": "finding the segment, two ends",
    "rest": "calls",
}


def floor_table(figures: Figures, pair: str) -> str:
    """The parts of a plain tick, each at its most."""
    chosen = [row for name, row in figures["motion"][pair].items() if name.startswith("plain")]
    most = {part: max(row[part][2] for row in chosen) for part in _ABOVE}
    rows = [[_ABOVE[part], str(count)] for part, count in most.items()]
    rows += [["sum", str(sum(most.values()))], ["a whole tick, at most", str(worst_of(chosen))]]
    return _table(["", "instructions"], iter(rows))


def worst_of(rows: Iterable[Figures]) -> int:
    """Most of the whole over some scenarios."""
    return int(max(row["whole"][2] for row in rows))


_KINDS = {
    "steady": "*steady*",
    "moves": "*ramp*",
    "chooses": "*decides*",
    "looks": "*searches*",
    "begins": "*begins*",
}


def kinds_table(figures: Figures) -> str:
    """Instructions of the feed override by what a tick does with it, on the cores that have goals."""
    chosen = [f"{target} {kernel}" for target, kernel in GOALS]
    cores = [TARGETS[target].core for target, _ in GOALS]
    head = [
        "tick",
        *(cell for core in cores for cell in (f"{core}: ticks", "min", "median", "max")),
    ]

    def rows() -> Iterator[list[str]]:
        for kind, title in _KINDS.items():
            found = [figures["kinds"][pair][kind] for pair in chosen]
            yield [title, *(str(n) for f in found for n in (f["ticks"], *f["whole"]))]

    return _table(head, rows())


def taylor_table(figures: Figures) -> str:
    """Comparison with the usual NURBS interpolator."""
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
