#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count_til.py [--target TARGET] [--kernel KERNEL] FILE: counts the instructions of the tick interrupt of a whole
controller on an emulated board, with simulated drives on a local bus.

Run by hand. Starts a local bus, the simulated drives and the emulator; uses a temporary folder; prints to stdout.

The path of FILE is uploaded to the controller and runs as fast as the emulator can. Each tick that takes setpoints from
the program is counted, from the first to the last instruction of the interrupt handler. Unlike tests/target/isr.c this
includes the handler and the clock of the port. Left out is the exchange of frames with the gateway, which replaces a
bus: the board's clock stands still meanwhile.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import til
from analysis import emulator
from analysis.counting import Counter, read
from analysis.parts import PARTS
from count_tick import show
from emulate import TARGETS
from hodograph.pipeline import load_pipeline

ROOT = Path(__file__).resolve().parent.parent
_FEED = PARTS.index("feed")
_EXCHANGE = "after_tick"  # firmware/port/mps2/link_fifo.c


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="count_til.py", description=__doc__.splitlines()[0])
    parser.add_argument("--target", choices=TARGETS, default="an386")
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    parser.add_argument(
        "--kernel", choices=emulator.KERNELS, help="in place of the kernel of the path's machine"
    )
    parser.add_argument("--worst", type=int, default=3, help="show so many of the worst ticks")
    parser.add_argument("file", metavar="FILE", type=Path)
    options = parser.parse_args(arguments)
    pipeline = load_pipeline(options.file)
    if options.kernel:
        pipeline = replace(pipeline, given_machine=replace(pipeline.machine, kernel=options.kernel))
    target = emulator.TARGETS[options.target]
    counter = Counter(options.build, target, "controller", "startup_systick", (_EXCHANGE,))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "map").write_text(counter.map.text)
        out = folder / "out"
        plugin = counter.plugin_words(folder / "map", out)
        board = f"{til.EMULATE} {options.target} --plugin {plugin}"
        with til.local_bus() as bus:
            til.run(pipeline, bus, "fast", board)
        counts = read(out, len(counter.names))
    show(counter.names, counts[counts[:, _FEED] > 0], options.worst)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
