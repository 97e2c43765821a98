#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count_tick.py: instructions of the tick of one program on one emulated core, whole and in parts.

    .venv/bin/python tools/count_tick.py an386 float PROGRAM [--worst N]

Needs `make build firmware counter`. PROGRAM is a path file (examples/alpha.toml) or an image (.hdgp).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from hodograph.cli.main import main as hodograph
from target import counting, emulator
from target.parts import PARTS


def image_of(program: Path, folder: Path) -> Path:
    """The program's image, compiled if it is a path file."""
    if program.suffix != ".toml":
        return program
    image = folder / f"{program.stem}.hdgp"
    hodograph(["compile", str(program), "-o", str(image)])
    return image


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
    parser.add_argument("program", type=Path)
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--worst", type=int, default=3, help="show so many of the worst ticks")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        image = image_of(options.program, Path(name))
        target = emulator.TARGETS[options.target]
        show(counting.count(options.build, target, options.kernel, image), options.worst)


if __name__ == "__main__":
    main()
