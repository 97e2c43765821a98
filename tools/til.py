#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""til.py [--target TARGET ...] [--link slcan] [--local] FILE...: target in the loop.

Run by `make til`. Used by tools/count_til. Starts processes, sends to the controllers, receives the frames of the bus.

Compares the setpoints of emulated boards with those of hodograph-controller. Runs each path with hodograph-controller
and with each board, against the same simulated drives, and prints the hash of the setpoints and the ticks per second of
each run. Exit status 1 if the hash of a board differs. On vcan0 run it under tools/with-vcan. --local makes a bus of
its own (hodograph-hub), in virtual time, or in real time with --link slcan.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from emulate import TARGETS
from hodograph.bus.address import DEFAULT_BUS, parse_address
from hodograph.bus.hub import LocalHub
from hodograph.bus.run import BusRun, run_program, run_session
from hodograph.errors import HodographError
from hodograph.pipeline import Pipeline, load_pipeline, start_counts

EMULATE = Path(__file__).resolve().parent / "emulate.py"


def _note(text: str) -> None:
    print(text, file=sys.stderr)


@contextmanager
def local_bus(*, virtual: bool = True) -> Iterator[str]:
    """A local bus, as an address; in virtual time results do not depend on the clock of this computer."""
    with LocalHub(virtual=virtual) as hub:
        yield str(hub.address)


def run(pipeline: Pipeline, bus: str, pace: str, controller: str | None) -> BusRun:
    """One run; `controller` None: hodograph-controller."""
    machine, whole = pipeline.machine, pipeline.whole_machine
    start = start_counts(pipeline, machine.kernel)
    with run_session(whole, parse_address(bus), pace, 15.0, _note, controller) as at:
        return run_program(at, machine, pipeline.image, machine.kernel, on=whole, start=start)


def compare(file: Path, options: argparse.Namespace, bus: str) -> bool:
    """Whether both give the same bits."""
    pipeline = load_pipeline(file, allow_space=True)
    pace = "fast" if options.link == "fifo" else "real-time"
    image = f" --image {options.image}" if options.image else ""
    boards = {name: f"{EMULATE} {name} --link {options.link}{image}" for name in options.target}
    found = set()
    for name, controller in {"linux": None, **boards}.items():
        result = run(pipeline, bus, pace if controller else "fast", controller)
        motion = result.motion
        hashes = (motion.setpoints_sha256, motion.encoders_sha256)
        found.add(hashes)
        print(
            f"{file.stem:8} {name:8} {motion.ticks:6} ticks {motion.ticks / result.wall_s:6.0f} ticks/s  "
            f"{result.deadline_misses} misses  setpoints {hashes[0][:16]}  encoders {hashes[1][:16]}"
        )
    return len(found) == 1


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="til.py", description="Target in the loop.")
    parser.add_argument(
        "--target", choices=TARGETS, action="append", help="may be given again (default an386)"
    )
    parser.add_argument(
        "--link", choices=("fifo", "slcan"), default="fifo", help="slcan: real time, on its UART"
    )
    parser.add_argument("--image", type=Path, help="another image than that of make firmware")
    parser.add_argument("--local", action="store_true", help="a bus of its own, not vcan0")
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path)
    options = parser.parse_args(arguments)
    options.target = options.target or ["an386"]
    try:
        own = local_bus(virtual=options.link == "fifo")
        with own if options.local else nullcontext(DEFAULT_BUS) as bus:
            equal = [compare(file, options, bus) for file in options.files]
    except HodographError as error:
        print(f"til.py: {error}", file=sys.stderr)
        return 1
    print("til: the same bits" if all(equal) else "til: DIFFERENT BITS")
    return 0 if all(equal) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
