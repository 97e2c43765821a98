# SPDX-License-Identifier: MIT
"""`make compare`: the same toolpaths planned by Hodograph and by its peers, side by side in one run.

    compare.py [--json OUT] [--figure OUT] [--only NAME ...] [--klipper CLONE --klipper-python PYTHON]

Run by `make compare`. Starts processes; writes both files OUT, and temporary files.

Each motion is sampled at 1 kHz. Printed of each: cycle time, greatest distance from the programmed path (both ways),
greatest velocity, acceleration and jerk of an axis, ticks beyond the limits of the axes, processor time (of LinuxCNC,
which plans while it moves, there is none) and peak memory of the planning process. docs/validation/compare.md says how
each peer is set up.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hodograph.toolpath.fit.reference import ReferenceBuilder
from hodograph.toolpath.gcode import read_gcode
from hodograph.toolpath.moves import ORIGIN, ArcMove, SplineMove, StraightMove

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from _figures import figures_parser, write_figures

from peers import klipper, linuxcnc, picture, ruckig_stops, toppra_spline
from peers.motion import AxisLimits, Motion, deviation_um
from peers.plan_alone import SLOWEST_S, plan_alone
from peers.process_cost import Cost, run_measured
from peers.toolpaths import WORDS, Toolpath, toolpaths

Real = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
MACHINE = ROOT / "examples" / "machines" / "mill.toml"
LIMITS = AxisLimits(200.0, 2000.0, 50_000.0)
FEEDS_MM_MIN = (6000.0, 12_000.0)
TOLERANCE_MM = 0.01
_SAG_MM = 1e-5


@dataclass(frozen=True)
class Row:
    """The measured figures of one motion."""

    toolpath: str
    feed_mm_min: float
    peer: str
    cycle_s: float
    deviation_um: float
    velocity_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    ticks_beyond_acceleration: int
    ticks_beyond_jerk: int
    processor_s: float | None
    memory_mib: float


Outcome = tuple[Motion, Cost]
Runner = Callable[[Toolpath, Path], Outcome]


def main() -> int:
    """Exit status."""
    parser = figures_parser(__doc__)
    parser.add_argument("--figure", type=Path, help="a corner of the zigzag, drawn as SVG")
    parser.add_argument("--only", nargs="+", choices=WORDS, metavar="NAME", help=", ".join(WORDS))
    parser.add_argument(
        "--klipper", type=Path, metavar="CLONE", help="folder of a clone of Klipper"
    )
    parser.add_argument("--klipper-python", type=Path, default=Path(sys.executable))
    options = parser.parse_args()
    try:
        with _optional_klipper(options) as peer:
            motions: dict[str, Motion] = {}
            rows = _printed(options.only, peer, motions)
    except klipper.NoKlipperError as error:
        print(f"compare.py: {error}", file=sys.stderr)
        return 1
    write_figures(options.json, [vars(row) for row in rows])
    if options.figure is not None and motions:
        picture.draw(motions, TOLERANCE_MM, LIMITS.jerk_mm_s3 or np.inf, options.figure)
    return 0


def _optional_klipper(
    options: argparse.Namespace,
) -> AbstractContextManager[klipper.Klipper | None]:
    if options.klipper is None:
        print(
            "Klipper: left out, as no registry has it: give the folder of a clone, make compare KLIPPER=~/klipper"
        )
        return nullcontext()
    return klipper.copied(options.klipper.expanduser(), options.klipper_python.absolute())


def _printed(
    only: list[str] | None, peer: klipper.Klipper | None, motions: dict[str, Motion]
) -> list[Row]:
    """Measures and prints row by row; keeps the motions that the figure shows."""
    klipper_part = "" if peer is None else f", Klipper {peer.version}"
    print(
        f"axes: {LIMITS.velocity_mm_s:g} mm/s, {LIMITS.acceleration_mm_s2:g} mm/s^2, {LIMITS.jerk_mm_s3:g} mm/s^3 "
        f"(those that limit it); tolerance {1000 * TOLERANCE_MM:g} um; LinuxCNC {linuxcnc.version()}, TOPP-RA "
        f"{toppra_spline.version()}, Ruckig {ruckig_stops.version()}{klipper_part}"
    )
    print(_HEAD)
    rows = []
    for row in _rows(only, peer, motions):
        rows.append(row)
        print(_line(row), flush=True)
    return rows


def _rows(
    only: list[str] | None, peer: klipper.Klipper | None, motions: dict[str, Motion]
) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        for feed in FEEDS_MM_MIN:
            for toolpath in toolpaths(feed):
                if only and toolpath.word not in only:
                    continue
                file = Path(folder, f"{toolpath.name.replace(' ', '_')}_{feed:g}.ngc")
                file.write_text(toolpath.text, encoding="utf-8")
                path_mm = programmed_path(file)
                for name, run in _peers(toolpath, peer):
                    outcome = run(toolpath, file)
                    if (toolpath.name, feed) == ("zigzag", FEEDS_MM_MIN[0]):
                        motions[name] = outcome[0]
                    yield _measured(toolpath, name, outcome, path_mm)


def _peers(toolpath: Toolpath, peer: klipper.Klipper | None) -> Iterator[tuple[str, Runner]]:
    yield "Hodograph", _hodograph
    yield "LinuxCNC", _linuxcnc
    if peer is not None and toolpath.plain:
        yield "Klipper", lambda _, file: _klipper(peer, file)
    if toolpath.smooth:
        yield "TOPP-RA", _toppra
    if toolpath.name == "zigzag":
        yield "Ruckig", _ruckig


def _measured(toolpath: Toolpath, peer: str, outcome: Outcome, path_mm: Real) -> Row:
    motion, cost = outcome
    return Row(
        toolpath.name,
        toolpath.feed_mm_min,
        peer,
        motion.duration_s,
        deviation_um(motion, path_mm),
        motion.peak(1),
        motion.peak(2),
        motion.peak(3),
        motion.ticks_beyond(2, LIMITS.acceleration_mm_s2),
        motion.ticks_beyond(3, LIMITS.jerk_mm_s3 or np.inf),
        cost.processor_s,
        cost.memory_mib,
    )


def programmed_path(file: Path) -> Real:
    """The programmed path as chords (n, 3) that are off by at most 10 nm."""
    builder = ReferenceBuilder(ORIGIN, _SAG_MM)
    with file.open(encoding="utf-8", errors="replace") as source:
        for command in read_gcode(source, file.name):
            if isinstance(command, StraightMove | ArcMove | SplineMove):
                builder.add(command)
    return np.asarray(builder.reference().point)


def _hodograph(_: Toolpath, file: Path) -> Outcome:
    trace = file.with_suffix(".csv")
    command = [
        *(sys.executable, "-m", "hodograph", "simulate", str(file), "--machine", str(MACHINE)),
        *("--tolerance", f"{TOLERANCE_MM:g}", "--trace", str(trace)),
    ]
    done, cost = run_measured(command, SLOWEST_S)
    if done.returncode != 0:
        raise RuntimeError(f"hodograph simulate failed:\n{done.stderr}")
    with trace.open(newline="") as rows:
        found = [[float(row[f"{axis}_cmd_mm"]) for axis in "xyz"] for row in csv.DictReader(rows)]
    return Motion.trimmed(np.array(found)), cost


def _linuxcnc(_: Toolpath, file: Path) -> Outcome:
    motion, memory_mib = linuxcnc.run(file, LIMITS, f"G64 P{TOLERANCE_MM:g}")
    return motion, Cost(None, memory_mib)


def _klipper(peer: klipper.Klipper, file: Path) -> Outcome:
    return peer.run(file, LIMITS)


def _toppra(toolpath: Toolpath, file: Path) -> Outcome:
    return plan_alone("TOPP-RA", programmed_path(file), toolpath.feed_mm_s, LIMITS)


def _ruckig(toolpath: Toolpath, file: Path) -> Outcome:
    return plan_alone("Ruckig", programmed_path(file), toolpath.feed_mm_s, LIMITS)


_HEAD = (
    f"{'toolpath':<18}{'F':>6} {'planner':<10}{'cycle s':>9}{'off um':>8}{'mm/s':>8}{'mm/s^2':>8}{'mm/s^3':>9}"
    f"{'ticks beyond':>14}{'CPU s':>8}{'MiB':>6}"
)


def _line(row: Row) -> str:
    processor = "-" if row.processor_s is None else f"{row.processor_s:.2f}"
    beyond = f"{row.ticks_beyond_acceleration}, {row.ticks_beyond_jerk}"
    return (
        f"{row.toolpath:<18}{row.feed_mm_min:>6g} {row.peer:<10}{row.cycle_s:>9.3f}{row.deviation_um:>8.2f}"
        f"{row.velocity_mm_s:>8.1f}{row.acceleration_mm_s2:>8.0f}{row.jerk_mm_s3:>9.0f}{beyond:>14}{processor:>8}"
        f"{row.memory_mib:>6.0f}"
    )


if __name__ == "__main__":
    sys.exit(main())
