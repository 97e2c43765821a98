# SPDX-License-Identifier: MIT
"""Streaming: how much faster than it runs a job is planned, how soon its first part is there, and memory by length.

    python benchmarks/streaming.py [--json OUT] [--lines N…] [--fit-lines N…]

Jobs are a zigzag of short lines over a wavy surface, as finishing passes are, at 50 mm/s on
examples/machines/mill.toml. Each is planned in a process of its own, by one thread; those of --fit-lines are only read
and fitted. Wall time has other work on the computer in it; processor time has less of that.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from math import sin
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hodograph.stream.plan import JobFiles

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "host_tools")]
MILL = ROOT / "examples" / "machines" / "mill.toml"
LINES, FIT_LINES = (300, 1200, 100_000), (2000, 20_000)
_ROW_LINES, _STEP_MM, _PITCH_MM = 400, 0.25, 0.5
FOR_EVER_S = 1e6


def write_job(file: Path, lines: int, step_mm: float = _STEP_MM) -> None:
    """The G-code of a job."""
    with file.open("w", encoding="ascii") as out:
        out.write("G21 G90 G64 P0.01\nF3000\n")
        for k in range(lines):
            row, at = divmod(k, _ROW_LINES)
            x = step_mm * (at if row % 2 == 0 else _ROW_LINES - 1 - at)
            y = _PITCH_MM * row
            out.write(f"G1 X{x:.4f} Y{y:.4f} Z{2.0 * sin(0.11 * x) * sin(0.07 * y + 0.5):.4f}\n")
        out.write("M2\n")


def measure(lines: int, fit_only: bool, step_mm: float) -> dict[str, Any]:
    """Plans one job in this process, as `hodograph stream` does; each chunk is read as soon as it is planned."""
    from hodograph.config import load_machine
    from hodograph.stream.chunks import CHUNK_BYTES
    from hodograph.stream.plan import JobFiles, JobPlan, Place
    from hodograph.toolpath.files import ReadOptions

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "job.ngc"
        write_job(file, lines, step_mm)
        begun, used = time.perf_counter(), time.process_time()
        job = JobFiles((file,), load_machine(MILL), 0.01, ReadOptions())
        first_s, motion_s, chunks, size, samples = None, 0.0, 0, 0, [0.0]
        if fit_only:
            _fit(job)
        else:
            with JobPlan(job, CHUNK_BYTES, 1, Place()) as plan, suppress(IndexError):
                while (item := plan.item(chunks, FOR_EVER_S)) is not None:
                    first_s = first_s or time.process_time() - used
                    motion_s, chunks = motion_s + item[2], chunks + 1
                    size += item[1].size
                    samples.append(_resident_mb())
        processor_s = time.process_time() - used
    return {
        "lines": lines,
        "fit_only": fit_only,
        "processor_s": processor_s,
        "wall_s": time.perf_counter() - begun,
        "first_chunk_processor_s": first_s,
        "motion_s": motion_s,
        "times_as_fast": motion_s / processor_s,
        "chunks": chunks,
        "bytes_per_s": size / motion_s if motion_s else None,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "memory_after_a_tenth_mb": samples[len(samples) // 10],
    }


def _fit(job: JobFiles) -> None:
    from hodograph.stream.reading import StreamReader

    for section in StreamReader(
        job.files[0], job.machine, job.tolerance_mm, job.reading
    ).sections():
        for _ in section.blocks:
            pass


def _resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def apart(lines: int, fit_only: bool, step_mm: float) -> dict[str, Any]:
    """The same in a process of its own."""
    alone = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [
        sys.executable,
        __file__,
        "--one",
        str(lines),
        "--step",
        str(step_mm),
        *(["--fit"] if fit_only else []),
    ]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=alone)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    parser.add_argument("--lines", type=int, nargs="+", default=list(LINES))
    parser.add_argument("--fit-lines", type=int, nargs="*", default=list(FIT_LINES))
    parser.add_argument("--step", type=float, default=_STEP_MM, help="length of a line in mm")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--fit", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(measure(options.one, options.fit, options.step)))
        return
    rows = [apart(lines, False, options.step) for lines in options.lines]
    rows += [apart(lines, True, options.step) for lines in options.fit_lines]
    print("| lines | processor s | first chunk s | motion s | times as fast | kB/s | memory MB |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        if row["fit_only"]:
            print(
                f"| {row['lines']}, fitted only | {row['processor_s']:.2f} | | | | | {row['memory_mb']:.0f} |"
            )
            continue
        print(
            f"| {row['lines']} | {row['processor_s']:.2f} | {row['first_chunk_processor_s']:.2f} "
            f"| {row['motion_s']:.2f} | {row['times_as_fast']:.2f} | {row['bytes_per_s'] / 1000:.1f} "
            f"| {row['memory_mb']:.0f} |"
        )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
