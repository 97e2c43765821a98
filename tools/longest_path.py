#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""longest_path.py: the longest path through the motion part of a tick, from the instructions of its image.

    .venv/bin/python tools/longest_path.py an386 float
    .venv/bin/python tools/longest_path.py --update     # the table of docs/wcet.md

Needs `make firmware`. Prints each function with all that it calls, in instructions; docs/wcet.md compares the sum with
what was counted. Exit status 1 when no bound can be shown.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from target import emulator
from target.image import Image
from target.longest import Bounds, Longest, LongestError

ROOT = Path(__file__).resolve().parents[1]
COUNTS = ROOT / "tests/data/counts.json"
DOCUMENT = ROOT / "docs/wcet.md"
_BEGIN, _END = "<!-- longest -->\n", "<!-- end longest -->\n"
ENTRY = "tick"  # of setpoints.elf: motion_step and the call of it


def motion_part(build: Path, target: str, kernel: str) -> Longest:
    """Ready to be asked for functions of setpoints.elf with this kernel."""
    others = [f"kernel_{k}_segment_at" for k in emulator.KERNELS if k != kernel]
    bounds = Bounds.read(ROOT / "firmware/targets/loops.toml", *others)
    return Longest(Image(build / "firmware" / target / "setpoints.elf"), bounds)


def table(build: Path) -> str:
    """The longest path of each kernel on each core beside the most that was counted."""
    counted = json.loads(COUNTS.read_text(encoding="utf-8"))["motion"]
    rows = [
        "| core, kernel | longest path | counted at most | ratio |",
        "| --- | --- | --- | --- |",
    ]
    for target in emulator.TARGETS.values():
        for kernel in target.kernels:
            path = motion_part(build, target.name, kernel).of(ENTRY)
            most = max(s["whole"][2] for s in counted[f"{target.name} {kernel}"].values())
            name = f"{target.core} ({target.name}) {kernel}"
            rows.append(f"| {name} | {path} | {most} | {path / most:.2f} |")
    return "".join(f"{row}\n" for row in rows)


def update(build: Path) -> None:
    """The table between its marks."""
    text = DOCUMENT.read_text(encoding="utf-8")
    before, rest = text.split(_BEGIN)
    DOCUMENT.write_text(before + _BEGIN + table(build) + _END + rest.split(_END)[1], "utf-8")


def show(longest: Longest) -> None:
    """Each function on the longest path, the dearest first."""
    longest.of(ENTRY)
    for function, count in sorted(longest.known.items(), key=lambda item: -item[1]):
        if count > 0:
            print(f"{function.name:28} {count:6}")


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", nargs="?", choices=emulator.TARGETS, default="an386")
    parser.add_argument("kernel", nargs="?", choices=emulator.KERNELS, default="float")
    parser.add_argument("--update", action="store_true", help="the table of docs/wcet.md")
    parser.add_argument("--build", type=Path, default=Path("build"))
    options = parser.parse_args()
    try:
        if options.update:
            update(options.build)
        else:
            show(motion_part(options.build, options.target, options.kernel))
    except LongestError as error:
        print(f"longest_path: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
