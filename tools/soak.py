#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs programs over and over on a virtual bus and checks every frame.

    .venv/bin/python tools/soak.py [--seconds 3600] [--periods 1000,2000] [--json FILE] [--bus vcan0]

Run by `make soak`. Starts the simulated machine, sends to its controller and receives all frames of its bus; writes
FILE.

Without --bus it has local buses of its own, in virtual time. `--seconds` is bus time: SYNCs times period. It is shared
equally by the periods. Setpoints and encoders of each repetition must have the hashes that `hodograph simulate` gives
for the program. Prints a summary; exit status 1 if the bus had unexpected frames, 4 if the machine failed.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from bus_checker import BusChecker
from hodograph.bus.address import BusAddress
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.hub import LocalHub
from hodograph.bus.run import run_program, run_session
from hodograph.errors import HodographError
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import simulate

ROOT = Path(__file__).resolve().parents[1]
MACHINE = ROOT / "examples" / "machines" / "paper_alpha.toml"
PERIODS_US = (1000, 2000, 4000, 8000)
PROGRAMS = tuple(ROOT / "examples" / name for name in ("alpha.toml", "heart.toml", "star.toml"))
KERNEL = "fixed"
_REPORT_S = 60.0


class Soak:
    """One soak: its programs, their hashes, and its findings."""

    def __init__(self, address: BusAddress, machine: Path, note: Callable[[str], None]) -> None:
        """Plans and simulates the programs. Raises HodographError."""
        self.address = address
        self.note = note
        self.pipelines = [load_pipeline(file, machine) for file in PROGRAMS]
        self.machine = self.pipelines[0].machine
        self.expected = [self._simulated(pipeline) for pipeline in self.pipelines]
        self.checker = BusChecker(self.machine)
        self.repetitions = 0
        self.program_ticks = 0
        self.deadline_misses = 0
        self.wall_s = 0.0
        self.dropped = 0

    def _simulated(self, pipeline: Pipeline) -> tuple[str, str]:
        drives = [axis.drive for axis in self.machine.path_axes if axis.drive is not None]
        counts = self.machine.counts_per_mm
        motion = simulate(pipeline.image, drives, kernel=KERNEL, counts_per_mm=counts)
        return motion.setpoints_sha256, motion.encoders_sha256

    @property
    def bus_s(self) -> float:
        """Bus time so far."""
        return self.checker.syncs * self.machine.period_us / 1e6

    def run(self, seconds: float) -> None:
        """Runs until so much bus time has passed and the last program has ended. Raises HodographError."""
        begun = reported = time.monotonic()
        with (
            Recorder(self.address) as recorder,
            run_session(self.machine, self.address, "fast", 10.0, self.note) as at,
        ):
            while self.bus_s < seconds:
                which = self.repetitions % len(self.pipelines)
                run = run_program(at, self.machine, self.pipelines[which].image, KERNEL)
                found = (run.motion.setpoints_sha256, run.motion.encoders_sha256)
                if found != self.expected[which]:
                    self.checker.found(f"{PROGRAMS[which].name}: hashes {found}")
                self.repetitions += 1
                self.program_ticks += run.motion.ticks
                self.deadline_misses += run.deadline_misses or 0
                known = len(self.checker.findings)
                self.checker.take(recorder.take())
                for finding in self.checker.findings[known:]:
                    self.note(finding)
                self.wall_s = time.monotonic() - begun
                if time.monotonic() - reported > _REPORT_S:
                    reported = time.monotonic()
                    self.note(self.line())
            self.dropped = recorder.dropped
        if self.dropped:
            self.checker.found(f"{self.dropped} frames dropped by the kernel: not all were checked")

    def line(self) -> str:
        """The progress in a line."""
        return (
            f"{self.machine.period_us} us: {self.bus_s:.0f} s of bus time in {self.wall_s:.0f} s, "
            f"{self.checker.frames} frames, {self.repetitions} programs, {self.checker.finding_count} unexpected"
        )

    def summary(self) -> dict[str, object]:
        """Figures for --json."""
        return {
            "period_us": self.machine.period_us,
            "bus_s": self.bus_s,
            "wall_s": self.wall_s,
            "frames": self.checker.frames,
            "syncs": self.checker.syncs,
            "programs": self.repetitions,
            "program_ticks": self.program_ticks,
            "deadline_misses": self.deadline_misses,
            "late_frames": self.checker.late,
            "worst_heartbeat_ms": round(self.checker.worst_heartbeat_s * 1000, 1),
            "kinds": dict(sorted(self.checker.kinds.items())),
            "unexpected": self.checker.finding_count,
            "findings": self.checker.findings,
        }


@contextmanager
def _machine_with(period_us: int) -> Iterator[Path]:
    """The machine's file with another period, beside copies of its drives."""
    with tempfile.TemporaryDirectory() as folder:
        examples = Path(folder) / "examples"
        shutil.copytree(ROOT / "examples", examples)
        file = examples / MACHINE.relative_to(ROOT / "examples")
        text = file.read_text(encoding="utf-8")
        file.write_text(
            re.sub(r"^period_us = .*$", f"period_us = {period_us}", text, count=1, flags=re.M),
            encoding="utf-8",
        )
        yield file


@contextmanager
def _bus(interface: str | None) -> Iterator[BusAddress]:
    if interface is not None:
        yield BusAddress("socketcan", interface)
    else:
        with LocalHub() as hub:
            yield hub.address


def _note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _periods(text: str) -> list[int]:
    periods = [int(word) for word in text.split(",")]
    if not periods or any(period not in PERIODS_US for period in periods):
        raise ValueError
    return periods


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="programs over and over, every frame checked")
    parser.add_argument("--seconds", type=float, default=3600.0, help="bus time (%(default)g)")
    parser.add_argument(
        "--periods", type=_periods, default=list(PERIODS_US), help="in us, some of %(default)s"
    )
    parser.add_argument("--bus", help="a CAN interface (default: local buses of its own)")
    parser.add_argument("--json", type=Path, help="write the figures there")
    return parser


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    options = _parser().parse_args(arguments)
    soaks = []
    try:
        for period_us in options.periods:
            with _machine_with(period_us) as machine, _bus(options.bus) as address:
                soak = Soak(address, machine, _note)
                soak.run(options.seconds / len(options.periods))
            soaks.append(soak)
            print(soak.line(), flush=True)
    except HodographError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 4
    if options.json is not None:
        figures = [soak.summary() for soak in soaks]
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    unexpected = sum(soak.checker.finding_count for soak in soaks)
    bus_s = sum(soak.bus_s for soak in soaks)
    print(f"{bus_s:.0f} s of bus time, {unexpected} unexpected")
    return 1 if unexpected else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
