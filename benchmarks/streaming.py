# SPDX-License-Identifier: MIT
"""Measures streaming: ratio of motion to planning time, time to the first chunk, memory by length of the job, and the
seconds of motion that a ring buffer of 48 KiB holds.

    python benchmarks/streaming.py [--json OUT] [--lines N…] [--fit-lines N…] [--files FILE…]

Run by `make bench`. The time to the first chunk is taken with a simulated machine on a local bus. Starts
processes; prints to stdout; writes OUT and temporary files.

Jobs are a zigzag of short lines over a wavy surface, as finishing passes are, at 50 mm/s on
examples/machines/mill.toml. Each is planned in a process of its own, by one thread; those of --fit-lines are only read
and fitted; FILEs are planned too. Other work on the computer affects wall time, and processor time less.
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
from contextlib import ExitStack, suppress
from math import inf, sin
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from _figures import figures_parser, write_figures

if TYPE_CHECKING:
    from hodograph.stream.plan import JobFiles

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "benchmarks/support"), str(ROOT / "host_tools")]
MILL = ROOT / "examples" / "machines" / "mill.toml"
LINES, FIT_LINES, RING_LINES = (300, 1200, 100_000), (2000, 20_000), 2500
_ROW_LINES, _STEP_MM, _PITCH_MM = 400, 0.25, 0.5
FOR_EVER_S, START_LINES = 1e6, 1200


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


def measure(
    lines: int, fit_only: bool, step_mm: float, given: Path | None = None
) -> dict[str, Any]:
    """Plans one job in this process, as `hodograph stream` does; each chunk is read as soon as it is planned. `given`:
    a file in place of the surface.
    """
    from hodograph.config import load_machine
    from hodograph.stream.chunks import CHUNK_BYTES
    from hodograph.stream.plan import JobFiles, JobPlan, Place
    from hodograph.toolpath.files import ReadOptions

    with tempfile.TemporaryDirectory() as folder:
        file = given or Path(folder) / "job.ngc"
        if given is None:
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
        "file": None if given is None else given.name,
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


def measure_start(lines: int) -> dict[str, Any]:
    """From the command to the start of the motion, on a machine that is there: processor time of the command with the
    start of Python, and bus time that passes meanwhile. Virtual time stands still while the command computes, and
    planning goes on beside what it waits for, so their sum is the most that it takes on a computer without other work.
    """
    from hodograph.bus.clock import VirtualClock
    from hodograph.bus.hub import LocalHub
    from hodograph.bus.processes import SimulatedMachine, virtual_clock
    from hodograph.bus.sdo.controller import OFF, Controller, connect
    from hodograph.cli.main import main as command
    from hodograph.config import load_machine

    machine, ended = load_machine(MILL), {}

    def start(controller: Controller, *_: object, **__: object) -> None:
        ended["processor_s"], ended["bus_s"] = time.process_time(), controller.clock.now_s()
        raise KeyboardInterrupt

    with tempfile.TemporaryDirectory() as folder, LocalHub() as hub, ExitStack() as stack:
        file = Path(folder) / "job.ngc"
        write_job(file, lines)
        imported_s = time.process_time()
        clock = virtual_clock(hub.address)
        assert isinstance(clock, VirtualClock)
        stack.callback(clock.release)
        stack.enter_context(SimulatedMachine(machine, hub.address, "fast"))
        with connect(hub.address, machine.node, machine.bitrate) as controller:
            controller.require(20.0)
            controller.wait_for((OFF,), 20.0)
        begun_s, begun_bus_s = time.process_time(), clock.now_s()
        words = ["stream", str(file), "--machine", str(MILL), "--bus", str(hub.address)]
        with patch.object(Controller, "start", start):
            command([*words, "--journal", str(Path(folder) / "stream.json"), "--quiet"])
    return {
        "lines": lines,
        "start_processor_s": imported_s + ended["processor_s"] - begun_s,
        "start_bus_s": ended["bus_s"] - begun_bus_s,
    }


def apart(lines: int, *words: str) -> dict[str, Any]:
    """The same in a process of its own, which keeps the bytecode of modules as an installed package does."""
    alone = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    alone["PYTHONPYCACHEPREFIX"] = str(ROOT / "build" / "pycache")
    alone.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, __file__, "--one", str(lines), *words]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=alone)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    """Print the table."""
    parser = figures_parser(__doc__)
    parser.add_argument("--lines", type=int, nargs="+", default=list(LINES))
    parser.add_argument("--fit-lines", type=int, nargs="*", default=list(FIT_LINES))
    parser.add_argument("--step", type=float, default=_STEP_MM, help="length of a line in mm")
    parser.add_argument(
        "--files", type=Path, nargs="*", default=[], help="toolpaths to plan as well"
    )
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--one-file", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--start", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--fit", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--no-ring", action="store_true", help="without the motion ahead in a ring")
    options = parser.parse_args()
    if options.one is not None and options.start:
        print(json.dumps(measure_start(options.one)))
        return
    if options.one is not None:
        print(json.dumps(measure(options.one, options.fit, options.step, options.one_file)))
        return
    step = ("--step", str(options.step))
    rows = [apart(lines, *step) for lines in options.lines]
    rows += [apart(lines, *step, "--fit") for lines in options.fit_lines]
    rows += [apart(0, "--one-file", str(file.resolve())) for file in options.files]
    apart(START_LINES, "--start")  # writes the bytecode of its modules
    begun = apart(START_LINES, "--start")
    print("| lines | processor s | first chunk s | motion s | times as fast | kB/s | memory MB |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        if row["fit_only"]:
            print(
                f"| {row['lines']}, fitted only | {row['processor_s']:.2f} | | | | | {row['memory_mb']:.0f} |"
            )
            continue
        print(
            f"| {row['file'] or row['lines']} | {row['processor_s']:.2f} | {row['first_chunk_processor_s']:.2f} "
            f"| {row['motion_s']:.2f} | {row['times_as_fast']:.2f} | {row['bytes_per_s'] / 1000:.1f} "
            f"| {row['memory_mb']:.0f} |"
        )
    print(
        f"start of the motion after the command, {START_LINES} lines: {begun['start_processor_s']:.2f} s of processor "
        f"time and {begun['start_bus_s']:.2f} s of bus time"
    )
    found = {"jobs": rows, "start": begun, "ring": {} if options.no_ring else ring_table()}
    write_figures(options.json, found)


def ring_table() -> dict[str, Any]:
    """Bytes of chunks by part, and motion ahead; prints them too."""
    from ring import BUS_BYTES_S, PARTS, RING, ahead, jobs, parts, worst_hold_s

    print(f"\n| job | chunks | {' | '.join(PARTS)} | ahead s: mean, least | at 17 kB/s | hold s |")
    print("|" + " --- |" * (len(PARTS) + 5))
    out: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        wave = Path(folder) / "wave.ngc"
        write_job(wave, RING_LINES)
        for job in jobs(wave):
            own = parts(job)
            rates = [ahead(job, RING, rate) for rate in (inf, BUS_BYTES_S)]
            hold_s = worst_hold_s(job)
            sizes = " | ".join(f"{own[part]:.0f}" for part in PARTS)
            pairs = " | ".join(f"{mean:.2f}, {least:.2f}" for mean, least in rates)
            print(f"| {job.name} | {len(job.chunks)} | {sizes} | {pairs} | {hold_s:.2f} |")
            (mean_s, least_s), (bus_mean_s, bus_least_s) = rates
            out[job.name] = {
                "bytes": own,
                "ahead_mean_s": mean_s,
                "ahead_least_s": least_s,
                "ahead_mean_on_bus_s": bus_mean_s,
                "ahead_least_on_bus_s": bus_least_s,
                "worst_hold_s": hold_s,
            }
    return out


if __name__ == "__main__":
    main()
