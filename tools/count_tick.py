#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count_tick.py: instructions of the tick of one program on one emulated core, whole and in parts.

    .venv/bin/python tools/count_tick.py an386 float examples/alpha.toml
    .venv/bin/python tools/count_tick.py microbit fixed ladder --commands restless --worst 5
    .venv/bin/python tools/count_tick.py an386 float ladder --isr --functions  # the whole interrupt, by functions

Run by hand. Used by tools/count_til, for `show`. Starts the emulator, prints to stdout.

Needs `make counter`. The program is a path file, an image (.hdgp) or the name of one of the worst-case programs
(analysis/worst_case.py), which also has the commands: overrides, holds and resumes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis import counting, emulator, worst_case
from hodograph.pipeline import load_pipeline


def image_of(program: str) -> bytes:
    """The program's image, made if need be."""
    for row in worst_case.ADVERSARIES:
        if row.name == program:
            return worst_case.image(row)
    path = Path(program)
    return load_pipeline(path).image if path.suffix == ".toml" else path.read_bytes()


def show(names: Sequence[str], counts: counting.Counts, worst: int) -> None:
    whole = counts.sum(axis=1)
    print(f"{len(counts)} ticks   {'min':>24} {'median':>8} {'max':>8}")
    rows = [("whole", whole), *((p, counts[:, i]) for i, p in enumerate(names))]
    for name, column in sorted(rows, key=lambda row: -int(row[1].sum(dtype=np.int64))):
        if column.any():
            median = int(np.median(column))
            print(f"{name:28} {column.min():8} {median:8} {column.max():8}")
    for tick in np.argsort(whole)[::-1][:worst]:
        split = " ".join(f"{p} {n}" for p, n in zip(names, counts[tick], strict=True) if n)
        print(f"tick {tick}: {whole[tick]}: {split}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=emulator.TARGETS)
    parser.add_argument("kernel", choices=emulator.KERNELS)
    parser.add_argument("program", help="path file, image, or a name of analysis/worst_case.py")
    parser.add_argument("--commands", choices=worst_case.COMMANDS)
    parser.add_argument("--isr", action="store_true", help="the whole interrupt, not only motion")
    parser.add_argument("--functions", action="store_true", help="by functions, not by parts")
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--worst", type=int, default=3, help="show so many of the worst ticks")
    options = parser.parse_args()
    commands = worst_case.COMMANDS[options.commands]() if options.commands else []
    image, entry = ("isr", "isr") if options.isr else ("setpoints", "tick")
    target = emulator.TARGETS[options.target]
    counter = counting.Counter(options.build, target, image, entry, functions=options.functions)
    counts = counter.count(options.kernel, image_of(options.program), commands)
    show(counter.names, counts, options.worst)


if __name__ == "__main__":
    main()
