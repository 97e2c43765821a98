#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""til.py [--target TARGET] FILE...: target in the loop. To be run under tools/with-vcan.

Runs paths on the bus twice, with hodograph-controller and with the controller on an emulated board, against the same
simulated drives; prints both, with the ticks per second of the board. Exit status 1 when a hash differs.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from emulate import TARGETS
from hodograph.bus.address import DEFAULT_BUS, parse_address
from hodograph.bus.run import BusRun, run_program, station
from hodograph.chain import Chain, load_chain
from hodograph.errors import HodographError

EMULATE = Path(__file__).resolve().parent / "emulate.py"


def _note(text: str) -> None:
    print(text, file=sys.stderr)


def run(chain: Chain, controller: str | None) -> BusRun:
    """One run at full pace; `controller` None: hodograph-controller."""
    address = parse_address(DEFAULT_BUS)
    with station(chain.machine, address, "fast", 15.0, _note, controller) as at:
        return run_program(at, chain.machine, chain.image, chain.machine.kernel)


def compare(file: Path, target: str) -> bool:
    """Whether both give the same bits."""
    chain = load_chain(file)
    runs = {"linux": run(chain, None), target: run(chain, f"{EMULATE} {target}")}
    found = set()
    for name, result in runs.items():
        motion = result.motion
        hashes = (motion.setpoints_sha256, motion.encoders_sha256)
        found.add(hashes)
        pace = motion.ticks / result.wall_s
        print(
            f"{file.stem:8} {name:6} {motion.ticks:6} ticks {pace:6.0f} ticks/s  "
            f"setpoints {hashes[0][:16]}  encoders {hashes[1][:16]}"
        )
    return len(found) == 1


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="til.py", description="Target in the loop.")
    parser.add_argument("--target", choices=TARGETS, default="an386")
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path)
    options = parser.parse_args(arguments)
    try:
        equal = [compare(file, options.target) for file in options.files]
    except HodographError as error:
        print(f"til.py: {error}", file=sys.stderr)
        return 1
    print("til: the same bits" if all(equal) else "til: DIFFERENT BITS")
    return 0 if all(equal) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
