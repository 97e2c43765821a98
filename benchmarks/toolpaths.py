# SPDX-License-Identifier: MIT
"""Cycle times of toolpaths compared with those measured with LinuxCNC, and the certified deviation.

    python benchmarks/toolpaths.py [--json OUT] [--only NAME…] [--folder DIR…] [--lines N]

Run by `make bench`. Prints to stdout; writes OUT and temporary files.

The machine is examples/machines/mill.toml, the tolerance 10 um. Times are those of the programs, including the time
that plans lose so that stops may begin soon enough. LinuxCNC 2.9 (G64 P0.01) has no jerk limit. 2.10 was measured with
its S-curve planner and 50000 mm/s^3. Zigzag and rectangle are written here; spiral and 3D_Chips come with LinuxCNC
(tools/fetch_linuxcnc.sh). The file of heart05 is not published. For a file that is in none of the folders a
line is printed instead. At the end the processor time for generated programs of N lines is measured.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "host_tools")]

from peers.toolpaths import rectangle, zigzag  # noqa: E402

from hodograph.config import load_machine  # noqa: E402
from hodograph.job import load_job  # noqa: E402
from hodograph.toolpath.files import ReadOptions  # noqa: E402

MILL = ROOT / "examples" / "machines" / "mill.toml"
FOLDERS = (ROOT / "build/linuxcnc/root/usr/share/linuxcnc/ncfiles",)
WRITTEN = {"zigzag": zigzag, "rrect": rectangle}
"""Toolpaths that are written here, by the first word of their names."""


@dataclass(frozen=True)
class Row:
    """A file at a feed, and its cycle times in s by LinuxCNC with and without a jerk limit. `goal`: greatest ratio to
    the time with one.
    """

    file: str
    feed_mm_s: float
    scurve_s: float | None
    without_jerk_s: float
    goal: float
    lines: int | None = None


ROWS = (
    Row("zigzag_f6000.ngc", 100.0, 3.832, 3.182, 0.98),
    Row("zigzag_f12000.ngc", 200.0, 3.769, 3.012, 0.98),
    Row("rrect_f6000.ngc", 100.0, 5.155, 3.217, 0.75),
    Row("rrect_f12000.ngc", 200.0, 4.016, 2.019, 0.75),
    Row("heart05_f6000.ngc", 100.0, 8.707, 3.057, 0.6),
    Row("heart05_f12000.ngc", 200.0, 8.617, 1.933, 0.6),
    Row("spiral.ngc", 100.0, 62.97, 17.35, 0.6),
    Row("spiral.ngc", 200.0, None, 11.91, 0.6),
    Row("3D_Chips.ngc", 100.0, 88.13, 32.13, 0.6, lines=2000),
    Row("3D_Chips.ngc", 200.0, None, 26.53, 0.6, lines=2000),
)


def found(row: Row, folders: list[Path], scratch: Path) -> Path | None:
    """The file of a row: written to `scratch`, or in the first folder that has it."""
    write = WRITTEN.get(row.file.partition("_")[0])
    if write is None:
        return next((at / row.file for at in folders if (at / row.file).is_file()), None)
    file = scratch / row.file
    file.write_text(write(60.0 * row.feed_mm_s) + "M2\n", encoding="ascii")
    return file


def first_lines(file: Path, lines: int | None, folder: Path) -> Path:
    """The file, or a copy of its first lines."""
    if lines is None:
        return file
    text = file.read_text(encoding="utf-8", errors="surrogateescape").splitlines(keepends=True)
    copy = folder / file.name
    copy.write_text("".join([*text[:lines], "M2\n"]), encoding="utf-8", errors="surrogateescape")
    return copy


def smooth(lines: int) -> Iterator[str]:
    """A wavy spiral in chords of 0.2 mm."""
    for k in range(lines):
        t = 0.02 * k
        r = 100.0 + 20.0 * math.sin(0.155 * t) + 3.0 * math.sin(0.9 * t)
        yield f"G1 X{r * math.cos(0.1 * t):.4f} Y{r * math.sin(0.1 * t):.4f}"


def feeds(lines: int) -> Iterator[str]:
    """The wavy spiral with another feed in each line, from 50 to 100 mm/s."""
    for k, line in enumerate(smooth(lines)):
        yield f"{line} F{3000 + 7919 * k % 3001}"


def raster(lines: int) -> Iterator[str]:
    """Rows of 60 mm over a surface, a point each 0.3 mm."""
    for k in range(lines):
        row, column = divmod(k, 200)
        x, y = 0.3 * (column if row % 2 == 0 else 199 - column), 0.5 * row
        z = 3.0 * math.sin(0.2 * x) * math.cos(0.15 * y) + 0.8 * math.sin(0.7 * x + 0.3 * y)
        yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}"


def stairs(lines: int) -> Iterator[str]:
    """Right angles, legs of 0.5 mm."""
    for k in range(1, lines + 1):
        yield f"G1 X{0.5 * ((k + 1) // 2):g} Y{0.5 * (k // 2):g}"


GENERATED = {"smooth": smooth, "feeds": feeds, "raster": raster, "stairs": stairs}


def seconds_by_stage(kind: str, lines: int, folder: Path) -> dict[str, object]:
    """Processor time of each stage for a generated program, s, and the cycle time that comes out."""
    file = folder / f"{kind}.ngc"
    file.write_text(
        "\n".join(["G21 G90 F6000", *GENERATED[kind](lines), "M2"]) + "\n", encoding="utf-8"
    )
    begin = time.process_time()
    job = load_job(file, load_machine(MILL))
    fitted = time.process_time()
    planned_s = sum(section.pipeline.plan.duration_s for section in job.sections)
    planned = time.process_time()
    duration_s = sum(section.pipeline.compilation.plan.duration_s for section in job.sections)
    return {
        "kind": kind,
        "lines": lines,
        "fit_s": fitted - begin,
        "plan_s": planned - fitted,
        "compile_s": time.process_time() - planned,
        "planned_duration_s": planned_s,
        "duration_s": duration_s,
    }


def print_stages(lines: int) -> list[dict[str, object]]:
    """The table of generated programs; its rows."""
    print("\n| program, lines | fit, feed, program: s for 1000 lines | cycle: plan, program, s |")
    print("| --- | --- | --- |")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for kind in GENERATED:
            # Stairs take a hundred times as long to pass as to write.
            one = seconds_by_stage(kind, lines if kind != "stairs" else lines // 10, Path(folder))
            rows.append(one)
            each = 1e-3 * float(str(one["lines"]))
            stages = ", ".join(
                f"{float(str(one[key])) / each:.2f}" for key in ("fit_s", "plan_s", "compile_s")
            )
            cycle = f"{one['planned_duration_s']:.3f}, {one['duration_s']:.3f}"
            print(f"| {kind}, {one['lines']} | {stages} | {cycle} |", flush=True)
    return rows


def measured(row: Row, file: Path) -> dict[str, object]:
    """The figures of one row."""
    begin = time.process_time()
    job = load_job(file, load_machine(MILL), reading=ReadOptions(feed_mm_s=row.feed_mm_s))
    fit_s = time.process_time() - begin
    begin = time.process_time()
    planned_s = sum(section.pipeline.plan.duration_s for section in job.sections)
    plan_s = time.process_time() - begin
    duration_s = sum(section.pipeline.compilation.plan.duration_s for section in job.sections)
    return {
        "file": row.file,
        "feed_mm_s": row.feed_mm_s,
        "duration_s": duration_s,
        "ratio": None if row.scurve_s is None else duration_s / row.scurve_s,
        "goal": row.goal,
        "ratio_without_jerk": duration_s / row.without_jerk_s,
        "fit_s": fit_s,
        "plan_s": plan_s,
        "compile_s": time.process_time() - begin - plan_s,
        "planned_duration_s": planned_s,
    } | job.summary()


def results(names: list[str] | None, folders: list[Path]) -> Iterator[dict[str, object]]:
    """All rows whose files are there."""
    with tempfile.TemporaryDirectory() as folder:
        for row in ROWS:
            if names and not any(name in row.file for name in names):
                continue
            file = found(row, folders, Path(folder))
            if file is None:
                print(f"{row.file}: in none of the folders, left out", file=sys.stderr)
                continue
            yield measured(row, first_lines(file, row.lines, Path(folder)))


def main() -> None:
    """Print the table."""
    parser = figures_parser(__doc__)
    parser.add_argument("--only", nargs="+")
    parser.add_argument("--folder", type=Path, nargs="+", default=list(FOLDERS))
    parser.add_argument("--lines", type=int, default=5000, help="of generated programs; 0: none")
    options = parser.parse_args()
    print(
        "| file, mm/s | time, s | S-curve planner | goal | no jerk limit | bound, um | segments "
        "| fit, feed, program: s |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for one in results(options.only, options.folder):
        rows.append(one)
        ratio = "–" if one["ratio"] is None else f"{one['ratio']:.3f}"
        print(
            f"| {one['file']} {one['feed_mm_s']:.0f} | {one['duration_s']:.3f} | {ratio} | {one['goal']:g} "
            f"| {one['ratio_without_jerk']:.3f} | {one['deviation_bound_um']:.3f} | {one['segments']} "
            f"| {one['fit_s']:.2f}, {one['plan_s']:.2f}, {one['compile_s']:.2f} |",
            flush=True,
        )
    ratios = [float(str(one["ratio"])) for one in rows if one["ratio"] is not None]
    if ratios:
        mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
        print(f"\nGeometric mean of the ratios to the S-curve planner: {mean:.3f} (goal 0.40)")
    if options.lines:
        rows += print_stages(options.lines)
    write_figures(options.json, rows)


if __name__ == "__main__":
    main()
