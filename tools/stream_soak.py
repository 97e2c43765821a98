#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A streamed job of hours on an emulated board: setpoints and memory.

    .venv/bin/python tools/stream_soak.py [--seconds 3600] [--chord MM] [--period 1000] [--target an386] [--json FILE]

Run by `make soak-stream`. Starts the machine, sends to its controller and receives all frames of its bus; writes FILE.

Streams one job of about `--seconds` of motion on a local bus in virtual time to the controller on an emulated board.
The setpoints on the bus must have the hash that the same chunks have in the offline simulation, without the standstill
before and after. Virtual time stands still while the host plans, so no load on this computer makes a chunk late. Prints
a summary; exit status 1 if hashes differ or an underrun occurred, 4 if the machine failed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import queue
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from math import ceil, cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from emulate import TARGETS
from hodograph.bus.capture.decode import RPDO1
from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.hub import LocalHub
from hodograph.bus.run import RunSession, bring_up, run_session
from hodograph.bus.sdo.objects import STREAM
from hodograph.bus.sdo.stream_channel import close_stream
from hodograph.config import Machine, load_machine
from hodograph.errors import HodographError
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits
from hodograph.stream.chunk import Chunk
from hodograph.stream.plan import JobFiles, JobPlan, Place, PlannedSection
from hodograph.stream.sender import Sender, StreamedJob, StreamProgress
from hodograph.stream.simulation import simulate_chunks
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[1]
MILL = ROOT / "examples" / "machines" / "mill.toml"
EMULATE = ROOT / "tools" / "emulate.py"
FEED_MM_S, LEAST_MM, MOST_MM, GROWTH_MM = 50.0, 20.0, 60.0, 0.5
ICOUNT = 3
"""The board makes 125 million instructions a second: about 2 million for the check of each KiB of a chunk."""
MARK_TICKS = 60_000
"""Ticks between two hashes of the setpoints."""
PATIENCE_S = 1e6
"""Longest wait for a chunk: practically without limit."""
_REPORT_S, _TAKE_S = 60.0, 2.0
_PAGE_MB = 4096 / 2**20
"""Size of a page of memory."""


def write_job(file: Path, seconds: float, chord_mm: float = 0.0) -> int:
    """Writes half circles of changing radius with about this much motion; returns the number of lines.

    Each half circle is one line (G3), or G1 chords of at most `chord_mm` if that is not 0.
    """
    x_mm, radius_mm, growth_mm, side, length_mm, lines = 0.0, LEAST_MM, GROWTH_MM, 1, 0.0, 0
    with file.open("w", encoding="ascii") as out:
        out.write(f"G21 G90 G64 P0.02\nF{60.0 * FEED_MM_S:g}\n")
        while length_mm < seconds * FEED_MM_S or not lines:
            arc = _half_circle(x_mm, side * radius_mm, chord_mm)
            out.write("".join(arc))
            x_mm += 2.0 * side * radius_mm
            length_mm, lines, side = length_mm + pi * radius_mm, lines + len(arc), -side
            radius_mm += growth_mm
            if not LEAST_MM <= radius_mm <= MOST_MM:
                growth_mm = -growth_mm
                radius_mm += 2.0 * growth_mm
        out.write("M2\n")
    return lines


def _half_circle(x_mm: float, to_centre_mm: float, chord_mm: float) -> list[str]:
    """Lines from (x_mm, 0), counter-clockwise about (x_mm + to_centre_mm, 0)."""
    if not chord_mm:
        return [f"G3 X{x_mm + 2.0 * to_centre_mm:.4f} Y0 I{to_centre_mm:.4f} J0\n"]
    chords = ceil(pi * abs(to_centre_mm) / chord_mm)
    angles = [pi * (index + 1) / chords for index in range(chords)]
    return [
        f"G1 X{x_mm + to_centre_mm * (1.0 - cos(angle)):.4f} Y{-to_centre_mm * sin(angle):.4f}\n"
        for angle in angles
    ]


def plane_machine(period_us: int) -> Machine:
    """The axes x and y of the mill."""
    mill = load_machine(MILL)
    return replace(
        mill, period_us=period_us, axes=mill.axes[:2], path_count=2, offset_mm=(0.0, 0.0)
    )


class MovingHash:
    """SHA-256 of setpoints without the standstill before and after them, and their number.

    marks  the hash at each MARK_TICKS of them
    """

    def __init__(self) -> None:
        self.marks: list[str] = []
        self._digest = hashlib.sha256()
        self._last: NDArray[np.int32] | None = None
        self._standing = 0
        self.ticks = 0

    def feed(self, counts: NDArray[np.integer[Any]]) -> None:
        """Setpoints (n, A) that follow those before."""
        if not len(counts):
            return
        self._feed(counts.astype(np.int32))

    def _feed(self, counts: NDArray[np.int32]) -> None:
        last = counts[:1] if self._last is None else self._last
        moves = (np.diff(np.concatenate((last, counts)), axis=0) != 0).any(axis=1)
        self._last = counts[-1:]
        at = np.flatnonzero(moves)
        if not at.size:
            self._standing += len(counts)
            return
        before = np.repeat(last, self._standing, axis=0) if self.ticks else last[:0]
        first = 0 if self.ticks else int(at[0])
        self._put(before)
        self._put(counts[first : at[-1] + 1])
        self._standing = len(counts) - 1 - int(at[-1])

    def _put(self, counts: NDArray[np.int32]) -> None:
        while len(counts):
            part = counts[: MARK_TICKS - self.ticks % MARK_TICKS]
            self._digest.update(part.tobytes())
            self.ticks += len(part)
            if self.ticks % MARK_TICKS == 0:
                self.marks.append(self.sha256)
            counts = counts[len(part) :]

    @property
    def sha256(self) -> str:
        """The hash so far."""
        return self._digest.hexdigest()


@dataclass
class BusSetpoints:
    """The setpoints of drives, from frames as they come."""

    nodes: tuple[int, ...]
    moving: MovingHash = field(default_factory=MovingHash)
    _kept: list[NDArray[np.int32]] = field(default_factory=list)

    def feed(self, frames: Frames) -> None:
        """The frames that follow those before."""
        fresh = [self._of(frames, node) for node in self.nodes]
        kept = self._kept or [one[:0] for one in fresh]
        fresh = [np.concatenate(pair) for pair in zip(kept, fresh, strict=True)]
        count = min(map(len, fresh))
        self._kept = [one[count:] for one in fresh]
        self.moving.feed(np.stack([one[:count] for one in fresh], axis=1))

    @staticmethod
    def _of(frames: Frames, node: int) -> NDArray[np.int32]:
        own = frames["data"][frames["id"] == RPDO1 + node]
        return np.ascontiguousarray(own[:, 2:6]).view("<i4")[:, 0]


class PatientPlan(JobPlan):
    """A plan whose readers wait for it in real time, while virtual time stands still; `copy` gets each chunk once."""

    def __init__(self, *words: Any, **named: Any) -> None:
        super().__init__(*words, **named)
        self.copy: queue.SimpleQueue[Chunk | None] = queue.SimpleQueue()
        self._copied = 0

    def item(self, index: int, wait_s: float) -> tuple[PlannedSection, Chunk, float] | None:
        """See JobPlan."""
        found = super().item(index, PATIENCE_S)
        if found is not None and index == self._copied:
            self._copied += 1
            self.copy.put(found[1])
        return found

    def copies(self) -> Iterator[Chunk]:
        """Copies of the chunks."""
        last = False
        while not last:
            chunk = self.copy.get()
            if chunk is None:
                raise HodographError("the job was not sent to its end")
            yield chunk
            last = chunk.header.last


class Memory:
    """Resident memory of processes, MB, as it was sampled."""

    def __init__(self, processes: dict[str, int]) -> None:
        self._processes = processes
        self.samples: dict[str, list[float]] = {name: [] for name in processes}

    def look(self) -> None:
        """Takes a sample of each."""
        for name, process in self._processes.items():
            pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
            self.samples[name].append(pages * _PAGE_MB)

    def summary(self) -> dict[str, dict[str, float]]:
        """Memory of each process: after a quarter of the samples, at the end, and the most."""
        return {
            name: {"quarter": found[len(found) // 4], "end": found[-1], "most": max(found)}
            for name, found in self.samples.items()
            if found
        }


def child_named(parent: int, name: str) -> int | None:
    """A child of a process by the name of its program."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent_of = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            program = (folder / "cmdline").read_bytes().split(b"\0")[0].decode()
        except (OSError, ValueError):
            continue
        if parent_of == parent and Path(program).name == name:
            return int(folder.name)
    return None


class Soak:
    """One job: streamed, its setpoints hashed on the bus and offline."""

    def __init__(self, machine: Machine, file: Path) -> None:
        self.machine = machine
        self.job = JobFiles((file,), machine, 0.01, ReadOptions())
        self.offline = MovingHash()
        self.failure: HodographError | None = None
        self.bus = BusSetpoints(machine.nodes[: machine.path_count])
        self.memory = Memory({})

    def run(self, target: str) -> StreamedJob:
        """Raises HodographError: the machine or the simulation failed."""
        with (
            LocalHub() as hub,
            Recorder(hub.address) as recorder,
            run_session(
                self.machine,
                hub.address,
                "fast",
                15.0,
                _note,
                f"{EMULATE} {target} --icount {ICOUNT}",
            ) as at,
        ):
            bring_up(at, self.machine, self.machine.kernel)
            close_stream(at.controller)
            most = at.controller.read(STREAM, 7) // 3
            with PatientPlan(self.job, most, 1, Place()) as plan:
                beside = threading.Thread(target=self._simulate, args=(plan,))
                beside.start()
                try:
                    done = self._send(at, plan, recorder)
                finally:
                    plan.copy.put(None)
                    beside.join()
            if self.failure is not None:
                raise self.failure
        return done

    def _send(self, at: RunSession, plan: JobPlan, recorder: Recorder) -> StreamedJob:
        self.memory = Memory(self._processes(at))
        begun_s = reported_s = taken_s = time.monotonic()

        def look(now: StreamProgress) -> None:
            nonlocal reported_s, taken_s
            if time.monotonic() - taken_s >= _TAKE_S:
                taken_s = time.monotonic()
                self.bus.feed(recorder.take())
                self.memory.look()
            if time.monotonic() - reported_s >= _REPORT_S:
                reported_s = time.monotonic()
                motion_s = 1e-6 * self.machine.period_us * self.bus.moving.ticks
                memory = {name: round(found[-1], 1) for name, found in self.memory.samples.items()}
                _note(
                    f"{motion_s:.0f} s of motion in {time.monotonic() - begun_s:.0f} s, line {now.line}, "
                    f"{plan.planned_s:.0f} s planned, {self.equal_marks()} hashes equal, MB {memory}, "
                    f"{now.underruns} underruns"
                )

        done = Sender(at, self.machine, plan, _no_operator, progress=look).run()
        self.bus.feed(recorder.take())
        if recorder.dropped:
            raise HodographError(f"{recorder.dropped} frames are missing in the recording")
        return done

    def equal_marks(self) -> str:
        """Number of equal intermediate hashes, of those that both sides have."""
        pairs = list(zip(self.bus.moving.marks, self.offline.marks, strict=False))
        return f"{sum(one == other for one, other in pairs)} of {len(pairs)}"

    def _processes(self, at: RunSession) -> dict[str, int]:
        assert at.rig is not None
        board = at.rig.processes[1].child.pid
        emulator = child_named(board, "qemu-system-arm")
        return {"host": _own()} | ({} if emulator is None else {"emulator": emulator})

    def _simulate(self, plan: PatientPlan) -> None:
        limits = NativeLimits(**asdict(program_limits(self.machine)), chunk=1)
        kernel, scale = self.machine.kernel, self.machine.counts_per_mm
        try:
            simulate_chunks(plan.copies(), limits, kernel, scale, self.offline.feed)
        except HodographError as error:
            self.failure = error


def _own() -> int:
    return int(Path("/proc/self").resolve().name)


def _note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _no_operator(text: str, look: object) -> None:
    del look
    raise HodographError(f"{text}: the job of this test has no program stops")


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="stream_soak.py", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3600.0, help="of motion (default 3600)")
    parser.add_argument(
        "--chord", type=float, default=0.0, metavar="MM", help="of G1 (default: arcs)"
    )
    parser.add_argument("--period", type=int, default=1000, help="us (default 1000)")
    parser.add_argument("--target", choices=TARGETS, default="an386")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    machine = plane_machine(options.period)
    with tempfile.TemporaryDirectory(prefix="hodograph-") as folder:
        file = Path(folder) / "job.ngc"
        lines = write_job(file, options.seconds, options.chord)
        soak = Soak(machine, file)
        begun_s, used_s = time.monotonic(), time.process_time()
        try:
            done = soak.run(options.target)
        except HodographError as error:
            print(f"stream_soak.py: {error}", file=sys.stderr)
            return 4
    found = {
        "target": options.target,
        "period_us": machine.period_us,
        "lines": lines,
        **asdict(done),
        "wall_s": time.monotonic() - begun_s,
        "host_processor_s": time.process_time() - used_s,
        "ticks": (soak.bus.moving.ticks, soak.offline.ticks),
        "sha256": (soak.bus.moving.sha256, soak.offline.sha256),
        "memory_mb": soak.memory.summary(),
    }
    print(json.dumps(found, indent=1))
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    equal = found["ticks"][0] == found["ticks"][1] and found["sha256"][0] == found["sha256"][1]
    print("stream_soak: the same bits" if equal else "stream_soak: DIFFERENT BITS")
    return 0 if equal and not done.underruns else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
