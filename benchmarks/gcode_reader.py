# SPDX-License-Identifier: MIT
# bench: gcode
"""Reading G-code: lines per second of processor time, compared with a loop that only reads the lines.

    .venv/bin/python benchmarks/gcode_reader.py --json OUT

Run by `make bench`. Writes OUT, and the program as a temporary file.

The program has many G1 lines as CAM systems write them. `plain` uses the fast method for such lines, `general` does
not.
"""

from __future__ import annotations

import random
import resource
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from _figures import figures_parser, write_figures

from hodograph.toolpath.gcode import Options, read_gcode

LINES = 200_000
REPEATS = 3


def write_program(file: Path) -> None:
    """LINES lines, of which every other has G1, and every other Z."""
    numbers = random.Random(1)
    with file.open("w", encoding="utf-8") as out:
        out.write("G21 G90 G17\nG1 F600\n")
        for index in range(LINES):
            x, y, z = (numbers.uniform(-99.0, 99.0) for _ in range(3))
            out.write(f"G1 X{x:.4f} Y{y:.4f}\n" if index % 2 else f"X{x:.3f} Y{y:.3f} Z{z:.3f}\n")
        out.write("M2\n")


def user_s(action: Callable[[], None]) -> float:
    """Least processor time of some runs, in s."""
    times = []
    for _ in range(REPEATS):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        action()
        times.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
    return min(times)


def measure(file: Path) -> dict[str, Any]:
    """Times of reading the lines only, and of reading them as moves."""

    def only_lines() -> None:
        with file.open(encoding="utf-8") as lines:
            for _ in lines:
                pass

    def moves(options: Options) -> None:
        with file.open(encoding="utf-8") as lines:
            for _ in read_gcode(lines, file.name, options):
                pass

    lines_s = user_s(only_lines)
    plain_s = user_s(lambda: moves(Options()))
    general_s = user_s(lambda: moves(Options(fast_path=False)))
    return {
        "lines": LINES,
        "plain_lines_per_s": LINES / plain_s,
        "general_lines_per_s": LINES / general_s,
        "times_reading_only": plain_s / max(lines_s, 1e-6),
    }


def main() -> None:
    """Measure and write."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "flood.ngc")
        write_program(program)
        figures = measure(program)
    write_figures(out, figures)


if __name__ == "__main__":
    main()
