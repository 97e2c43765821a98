#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count_tick.py: instructions of the tick of one program on one emulated core, whole and in parts.

    .venv/bin/python tools/count_tick.py an386 float examples/alpha.toml
    .venv/bin/python tools/count_tick.py microbit fixed ladder --commands restless --worst 5

Needs `make counter`. The program is a path file, an image (.hdgp) or the name of one of the programs made to be dear
(target/adversary.py), which also has the commands: overrides, holds and resumes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from hodograph.chain import load_chain
from target import adversary, counting, emulator
from target.parts import PARTS


def image_of(program: str) -> bytes:
    """The program's image, made if need be."""
    for row in adversary.ADVERSARIES:
        if row.name == program:
            return adversary.image(row)
    path = Path(program)
    return load_chain(path).image if path.suffix == ".toml" else path.read_bytes()


def show(counts: counting.Counts, worst: int) -> None:
    whole = counts.sum(axis=1)
    print(f"{len(counts)} ticks   {'min':>8} {'median':>8} {'max':>8}")
    rows = [("motion", whole), *((p, counts[:, i]) for i, p in enumerate(PARTS))]
    for name, column in rows:
        if column.any():
            median = int(np.median(column))
            print(f"{name:12} {column.min():8} {median:8} {column.max():8}")
    for tick in np.argsort(whole)[::-1][:worst]:
        split = " ".join(f"{p} {n}" for p, n in zip(PARTS, counts[tick], strict=True) if n)
        print(f"tick {tick}: {whole[tick]}: {split}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=emulator.TARGETS)
    parser.add_argument("kernel", choices=emulator.KERNELS)
    parser.add_argument("program", help="path file, image, or a name of target/adversary.py")
    parser.add_argument("--commands", choices=adversary.COMMANDS)
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--worst", type=int, default=3, help="show so many of the worst ticks")
    options = parser.parse_args()
    commands = adversary.COMMANDS[options.commands]() if options.commands else []
    counter = counting.Counter(options.build, emulator.TARGETS[options.target])
    show(counter.count(options.kernel, image_of(options.program), commands), options.worst)


if __name__ == "__main__":
    main()
