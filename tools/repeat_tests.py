#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""repeat_tests.py [--runs N] [--modes "idle busy one-core"] [--out DIR] [COMMAND...]: repeats `make test`.

Shows whether tests pass in each run, however busy the computer is. Run by `make test-repeat`. Starts and ends
processes; writes a log of each run to DIR. Default: 20 runs of `make test` in all modes, logs in build/repeat.

The runs take the modes in turn:

    idle      no other load
    busy      four processes that compute: `stress-ng --cpu 4` where it is installed, else of Python
    one-core  pinned to one core

After each run its line is printed: mode, time, count of the tests. The exit status is 0 only
when nothing has failed and all counts are the same; tests that failed are named. Ctrl-C ends what is running, and the
runs before it are judged.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from run_parts import Part, judge

ROOT = Path(__file__).resolve().parent.parent
MODES = ("idle", "busy", "one-core")
BUSY_PROCESSES = 4
"""Processes that keep the cores busy."""
_FAILED = "failed: "  # a line for each failed test (run_tests.py)
_PATIENCE_S = 30.0
"""Longest time until a process ends that was asked to."""


@dataclass(frozen=True)
class Run:
    """How one run ended."""

    number: int
    mode: str
    seconds: float
    count: str
    failures: tuple[str, ...]
    is_sound: bool

    @property
    def line(self) -> str:
        """One line of the table."""
        minutes, seconds = divmod(round(self.seconds), 60)
        return f"{self.number:4} {self.mode:9} {minutes:4}:{seconds:02}  {self.count}"


def repeated(command: Sequence[str], modes: Sequence[str], runs: int, out: Path) -> Iterator[Run]:
    """Runs the command so many times, in the modes in turn."""
    out.mkdir(parents=True, exist_ok=True)
    for number in range(1, runs + 1):
        mode = modes[(number - 1) % len(modes)]
        log = out / f"{number:02}-{mode}.log"
        began_s = time.monotonic()
        with _busy() if mode == "busy" else nullcontext():
            status = _run(command, log, one_core=mode == "one-core")
        yield _judged(number, mode, status, log, time.monotonic() - began_s)


def verdict(runs: Sequence[Run]) -> tuple[bool, str]:
    """Whether all runs said the same and nothing failed, and the line that says so."""
    counts = sorted({run.count for run in runs})
    is_same = len(counts) == 1 and all(run.is_sound for run in runs)
    said = "the same verdict" if len(counts) == 1 else f"{len(counts)} different verdicts"
    return is_same and bool(runs), f"{len(runs)} runs, {said}: {'; '.join(counts) or 'none'}"


def _judged(number: int, mode: str, status: int, log: Path, seconds: float) -> Run:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    result = judge(Part("test", "", is_counted=True), status, lines, seconds)
    failures = tuple(
        sorted(line.removeprefix(_FAILED) for line in lines if line.startswith(_FAILED))
    )
    return Run(number, mode, seconds, result.count, failures, result.failed == 0)


def _run(command: Sequence[str], log: Path, one_core: bool) -> int:
    """Exit status; the output goes to the log."""
    pinned = ["taskset", "-c", str(min(os.sched_getaffinity(0)))] if one_core else []
    with (
        log.open("wb") as out,
        subprocess.Popen(
            [*pinned, *command],
            cwd=ROOT,
            env=_plain(),
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            process_group=0,
        ) as process,
    ):
        try:
            return process.wait()
        except BaseException:
            _end(process)
            raise


def _plain() -> dict[str, str]:
    """The environment without the variables that `make` sets for its parts, since each run is a separate command."""
    return {name: text for name, text in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS")}


@contextmanager
def _busy() -> Iterator[None]:
    """Processes that compute."""
    if shutil.which("stress-ng"):
        commands = [["stress-ng", "--quiet", "--cpu", str(BUSY_PROCESSES)]]
    else:
        commands = [[sys.executable, "-c", "while True: pass"]] * BUSY_PROCESSES
    busy = [subprocess.Popen(command, process_group=0) for command in commands]
    try:
        yield
    finally:
        for process in busy:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """A process and all of its group."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_PATIENCE_S)
            return


def main(words: Sequence[str] | None = None) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--modes", default=" ".join(MODES), help="in turn, apart by spaces")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "repeat")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="default: make test")
    options = parser.parse_args(words)
    modes = options.modes.split()
    unknown = [mode for mode in modes if mode not in MODES]
    if unknown or not modes:
        parser.error(f"no mode {' '.join(unknown) or 'given'}; there are {', '.join(MODES)}")
    command = options.command or ["make", "--no-print-directory", "test"]
    print(f"{options.runs} runs; logs in {options.out}\n run mode       time  count", flush=True)
    done: list[Run] = []
    with suppress(KeyboardInterrupt):
        for run in repeated(command, modes, options.runs, options.out):
            done.append(run)
            print(
                "\n".join([run.line, *(f"     failed: {name}" for name in run.failures)]),
                flush=True,
            )
    is_same, text = verdict(done)
    print(text)
    return 0 if is_same and len(done) == options.runs else 1


if __name__ == "__main__":
    sys.exit(main())
