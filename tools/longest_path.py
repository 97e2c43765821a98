#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""longest_path.py: the longest path through the motion part of a tick, from the instructions of its image.

    .venv/bin/python tools/longest_path.py an386 float
    .venv/bin/python tools/longest_path.py --update     # the tables of docs/validation/wcet.md

Run by tests/system/test_longest_path.py and by hand. Reads images by the binary utilities. --update writes
docs/validation/wcet.md.

Needs `make firmware`. Prints each function with all that it calls, in instructions; docs/validation/wcet.md compares
the sum with what was counted. Exit status 1 when no bound can be shown.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from analysis import emulator, tables
from analysis.image import Image
from analysis.longest import Bounds, Longest, LongestError

ROOT = Path(__file__).resolve().parents[1]
COUNTS = ROOT / "tests/data/counts.json"
DOCUMENT = ROOT / "docs/validation/wcet.md"
ENTRY = "tick"  # of setpoints.elf: motion_step and the call of it
# What a tick does not call while nothing changes the override; its first one is not plain.
NOT_PLAIN = {
    "plain": (
        "override_plan_change",
        "feed_override_stop_tick",
        "path_brake_step",
        "interpolator_at_arc_length",
    ),
    "override": ("feed_override_stop_tick", "path_brake_step", "interpolator_at_arc_length"),
}
# Any tick, also of a stop.
STOP: tuple[str, ...] = ()


# What a tick does not call, by what is said of the program's path axes.
PATHS: dict[str, tuple[str, ...]] = {
    "2": ("interpolator_point_copy_others", "path_counts_others"),
    "3": ("extras_at",),
    "6": (),
}


# Loops over axes, and the axes that come before them.
OVER_AXES = {"interpolator_point_copy_others": 2, "path_counts_others": 3}

SPATIAL = ("3", "6")
SPATIAL_GOALS = {
    ("an386", "float", "3"): 720,
    ("an386", "float", "6"): 950,
    # As the goals of the plane, in proportion: times 720/600 and 950/600.
    ("an385", "fixed", "3"): 1800,
    ("an385", "fixed", "6"): 2375,
    ("microbit", "fixed", "3"): 4800,
    ("microbit", "fixed", "6"): 6333,
}


def motion_part(
    build: Path, target: str, kernel: str, kind: str = "override", axes: str = "2"
) -> Longest:
    """The longest paths in setpoints.elf with this kernel; `kind` is of NOT_PLAIN, `axes` of PATHS."""
    own = f"kernel_{kernel}_{'segment' if axes == '2' else 'space'}_at"
    paths = (f"kernel_{k}_{p}_at" for k in emulator.KERNELS for p in ("segment", "space"))
    others = [*(path for path in paths if path != own), *PATHS[axes]]
    rules = ROOT / "firmware/targets/loops.toml"
    bounds = Bounds.read(rules, *others, *NOT_PLAIN.get(kind, STOP))
    bounds.rounds.update({name: max(int(axes) - own, 0) for name, own in OVER_AXES.items()})
    return Longest(Image(build / "firmware" / target / "setpoints.elf"), bounds)


def counted_at_most(counts: dict[str, Any], kind: str) -> int:
    """The most counted instructions of the scenarios without override, or of all, which have stops; 0: ticks with
    override alone are not counted.
    """
    if kind == "override":
        return 0
    rows = (row for name, row in counts.items() if kind == "stop" or name.startswith(kind))
    return int(max(row["whole"][2] for row in rows))


def table(build: Path) -> str:
    """The longest path of each kernel on each core beside the most that was counted, and the goal."""
    counted = json.loads(COUNTS.read_text(encoding="utf-8"))["motion"]
    rows = [
        "| core, kernel |  | longest path | counted at most | ratio | goal |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for target in emulator.TARGETS.values():
        for kernel in target.kernels:
            name = f"{target.core} ({target.name}) {kernel}"
            own = counted[f"{target.name} {kernel}"]
            for kind in (*NOT_PLAIN, "stop"):
                path = motion_part(build, target.name, kernel, kind).of(ENTRY)
                most = counted_at_most(own, kind)
                seen = f"{most} | {path / most:.2f}" if most else " | "
                goal = (
                    ""
                    if kind == "stop"
                    else tables.goal_text("motion", target.name, kernel, kind, path)
                )
                rows.append(f"| {name} | {kind} | {path} | {seen} | {goal} |")
                name = ""
            for axes in SPATIAL:
                path = motion_part(build, target.name, kernel, "plain", axes).of(ENTRY)
                rows.append(
                    f"|  | plain, {axes} axes | {path} |  |  | {_goal(target.name, kernel, axes, path)} |"
                )
    return "".join(f"{row}\n" for row in rows)


def _goal(target: str, kernel: str, axes: str, path: int) -> str:
    """The goal of a spatial tick."""
    goal = SPATIAL_GOALS.get((target, kernel, axes))
    if goal is None:
        return ""
    return f"{goal}: kept" if path <= goal else f"{goal}: missed by {path / goal - 1:.0%}"


def document(build: Path, text: str) -> str:
    """docs/validation/wcet.md with what is generated between its marks."""
    figures = json.loads(COUNTS.read_text(encoding="utf-8"))
    blocks = {
        "longest": table(build),
        "kinds": tables.kinds_table(figures),
        "floor": tables.floor_table(figures, "an386 float"),
        "fault": tables.fault_text(figures, "an386 float"),
    }
    for name, block in blocks.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->\n"
        before, rest = text.split(begin)
        text = before + begin + block + end + rest.split(end)[1]
    return text


def update(build: Path) -> None:
    """Writes the document anew."""
    DOCUMENT.write_text(document(build, DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")


def show(longest: Longest) -> None:
    """Each function on the longest path, the most expensive first."""
    longest.of(ENTRY)
    for function, count in sorted(longest.known.items(), key=lambda item: -item[1]):
        if count > 0:
            print(f"{function.name:28} {count:6}")


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", nargs="?", choices=emulator.TARGETS, default="an386")
    parser.add_argument("kernel", nargs="?", choices=emulator.KERNELS, default="float")
    parser.add_argument(
        "--plain", action="store_true", help="of a tick in which the override does not change"
    )
    parser.add_argument(
        "--stop", action="store_true", help="of any tick, also one that plans a brake"
    )
    parser.add_argument(
        "--update", action="store_true", help="the tables of docs/validation/wcet.md"
    )
    parser.add_argument("--axes", choices=PATHS, default="2", help="path axes of the program")
    parser.add_argument("--build", type=Path, default=Path("build"))
    options = parser.parse_args()
    try:
        if options.update:
            update(options.build)
        else:
            kind = "stop" if options.stop else "plain" if options.plain else "override"
            show(motion_part(options.build, options.target, options.kernel, kind, options.axes))
    except LongestError as error:
        print(f"longest_path: {error}", file=sys.stderr)
        return 1
    except FileNotFoundError as error:
        print(f"longest_path: {error.filename} is missing: run `make firmware`", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
