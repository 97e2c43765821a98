#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count_til.py [--target TARGET] FILE: instructions of the tick's interrupt in a run on a bus of its own.

The whole controller on an emulated board, with simulated drives, uploads and runs a path at full pace; every tick while
setpoints come from the program is counted, as tests/target/isr.c is without a bus.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import til
from count_tick import show
from emulate import TARGETS
from hodograph.chain import load_chain
from target import emulator
from target.counting import Counter, read
from target.parts import PARTS

ROOT = Path(__file__).resolve().parent.parent
_FEED = PARTS.index("feed")


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="count_til.py", description=__doc__.splitlines()[0])
    parser.add_argument("--target", choices=TARGETS, default="an386")
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    parser.add_argument("--worst", type=int, default=3, help="show so many of the worst ticks")
    parser.add_argument("file", metavar="FILE", type=Path)
    options = parser.parse_args(arguments)
    counter = Counter(options.build, emulator.TARGETS[options.target], "controller", "run_tick")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "map").write_text(counter.map.text)
        out = folder / "out"
        plugin = counter.plugin_words(folder / "map", out)
        board = f"{til.EMULATE} {options.target} --plugin {plugin}"
        with til.local_bus() as bus:
            til.run(load_chain(options.file), bus, "fast", board)
        counts = read(out, len(counter.names))
    show(counter.names, counts[counts[:, _FEED] > 0], options.worst)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
