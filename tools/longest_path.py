#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""longest_path.py: the longest path through the motion part of a tick, from the instructions of its image.

    .venv/bin/python tools/longest_path.py an386 float

Needs `make firmware`. Prints each function with all that it calls, in instructions; docs/wcet.md compares the sum with
what was counted. Exit status 1 when no bound can be shown.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from target import emulator
from target.image import Image
from target.longest import Bounds, Longest, LongestError

ROOT = Path(__file__).resolve().parents[1]
ENTRY = "tick"  # of setpoints.elf: motion_step and the call of it


def motion_part(build: Path, target: str, kernel: str) -> Longest:
    """Ready to be asked for functions of setpoints.elf with this kernel."""
    others = [f"kernel_{k}_segment_at" for k in emulator.KERNELS if k != kernel]
    bounds = Bounds.read(ROOT / "firmware/targets/loops.toml", *others)
    return Longest(Image(build / "firmware" / target / "setpoints.elf"), bounds)


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=emulator.TARGETS)
    parser.add_argument("kernel", choices=emulator.KERNELS)
    parser.add_argument("--build", type=Path, default=Path("build"))
    options = parser.parse_args()
    longest = motion_part(options.build, options.target, options.kernel)
    try:
        longest.of(ENTRY)
    except LongestError as error:
        print(f"longest_path: {error}", file=sys.stderr)
        return 1
    for function, count in sorted(longest.known.items(), key=lambda item: -item[1]):
        if count > 0:
            print(f"{function.name:28} {count:6}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
