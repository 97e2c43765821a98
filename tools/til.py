#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""til.py [--target TARGET] [--link slcan] [--local] FILE...: target in the loop.

Runs paths on the bus twice, with hodograph-controller and with the controller on an emulated board, against the same
simulated drives; prints both, with the ticks per second of the board. Exit status 1 when a hash differs. On vcan0 it
is to be run under tools/with-vcan; --local makes a bus of its own (hodograph-hub).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

from emulate import TARGETS
from hodograph.bus.address import DEFAULT_BUS, parse_address
from hodograph.bus.processes import find_program
from hodograph.bus.run import BusRun, run_program, station
from hodograph.chain import Chain, load_chain
from hodograph.errors import HodographError

EMULATE = Path(__file__).resolve().parent / "emulate.py"


def _note(text: str) -> None:
    print(text, file=sys.stderr)


@contextmanager
def local_bus() -> Iterator[str]:
    """A bus of our own, as an address."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="hodograph-"))
        path = Path(folder) / "bus"
        hub = subprocess.Popen([str(find_program("hodograph-hub")), str(path)])
        stack.callback(hub.wait)
        stack.callback(hub.terminate)
        while not path.exists() and hub.poll() is None:
            time.sleep(0.01)
        yield f"local:{path}"


def run(chain: Chain, bus: str, pace: str, controller: str | None) -> BusRun:
    """One run; `controller` None: hodograph-controller."""
    with station(chain.machine, parse_address(bus), pace, 15.0, _note, controller) as at:
        return run_program(at, chain.machine, chain.image, chain.machine.kernel)


def compare(file: Path, options: argparse.Namespace, bus: str) -> bool:
    """Whether both give the same bits."""
    chain = load_chain(file)
    target, link = options.target, options.link
    board = f"{EMULATE} {target} --link {link}"
    board += f" --image {options.image}" if options.image else ""
    runs = {
        "linux": run(chain, bus, "fast", None),
        target: run(chain, bus, "fast" if link == "fifo" else "real-time", board),
    }
    found = set()
    for name, result in runs.items():
        motion = result.motion
        hashes = (motion.setpoints_sha256, motion.encoders_sha256)
        found.add(hashes)
        pace = motion.ticks / result.wall_s
        print(
            f"{file.stem:8} {name:6} {motion.ticks:6} ticks {pace:6.0f} ticks/s  "
            f"{result.deadline_misses} misses  setpoints {hashes[0][:16]}  encoders {hashes[1][:16]}"
        )
    return len(found) == 1


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="til.py", description="Target in the loop.")
    parser.add_argument("--target", choices=TARGETS, default="an386")
    parser.add_argument(
        "--link", choices=("fifo", "slcan"), default="fifo", help="slcan: real time, on its UART"
    )
    parser.add_argument("--image", type=Path, help="another image than that of make firmware")
    parser.add_argument("--local", action="store_true", help="a bus of its own, not vcan0")
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path)
    options = parser.parse_args(arguments)
    try:
        with local_bus() if options.local else nullcontext(DEFAULT_BUS) as bus:
            equal = [compare(file, options, bus) for file in options.files]
    except HodographError as error:
        print(f"til.py: {error}", file=sys.stderr)
        return 1
    print("til: the same bits" if all(equal) else "til: DIFFERENT BITS")
    return 0 if all(equal) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
