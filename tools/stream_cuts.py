#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Streamed jobs that are cut at random instants, and continued to their end.

    .venv/bin/python tools/stream_cuts.py [--seeds 1-100] [--kind kill ...] [--job five_axes ...] [--json FILE]

Run by `make cuts-stream` and by tests/system/test_stream_cuts.py. Starts machines and commands on local buses in
virtual time, receives all frames, and writes journals into a temporary folder; writes FILE.

Each seed draws a job, a controller memory and disturbances: the host killed, stopped, terminated, its cable pulled,
frames lost or doubled, the controller without power. After each of them `hodograph stream --continue` runs, which may
be disturbed too. At the end all setpoints together must lie on the path of the job, leave nothing of it out, and keep
all limits; outputs must be those of the job wherever the axes move (cut_oracle.py); the journal, the exit statuses and
the end of the job must be as documented. Prints a line for each seed and the counts for each kind; exit status 1 if a
seed failed.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np

from cut_oracle import (
    NEAR_UM,
    JobLine,
    away_um,
    changing,
    executed,
    final_outputs,
    line_of,
    outputs_trouble,
)
from hodograph.bus.address import BUS_VARIABLE, BusAddress
from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.setpoint_check import find_jumps, step_limits
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import (
    CONTROLLER,
    Process,
    controller_command,
    drive_command,
    find_program,
    virtual_clock,
)
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.objects import BOOT, MOVING, OFF
from hodograph.bus.sdo.stream_channel import ENDED, STOPPED, UNDERRUN, StreamStatus, stream_status
from hodograph.config import Machine, load_machine
from hodograph.errors import HodographError
from hodograph.faults.bench import INJECTOR
from hodograph.fixed_point import MM_PER_Q40, nearest_q40
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits
from hodograph.stream.journal import Entry, FileMark
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[1]
MACHINES = ROOT / "examples" / "machines"
OUTPUTS_MACHINE = MACHINES / "dispenser.toml"
TOOLPATHS = ROOT / "examples" / "toolpaths"
TOLERANCE_MM = 0.01
KINDS = (
    "kill", "suspend", "interrupt", "interrupt-twice", "terminate", "hang-up", "power",
    "cable", "answers-lost", "requests-lost", "doubled",
)  # fmt: skip
_SIGNALS = {
    "interrupt": (signal.SIGINT, 130),
    "interrupt-twice": (
        signal.SIGINT,
        130,
    ),  # or by the signal, which the end of Python does not catch
    "terminate": (signal.SIGTERM, 143),
    "hang-up": (signal.SIGHUP, 129),
}
_ENDED_BY_SIGNAL = (-signal.SIGKILL, -signal.SIGINT, -signal.SIGTERM, -signal.SIGHUP, 129, 130, 143)
_RULED = ("cable", "answers-lost", "requests-lost", "doubled")
"""Kinds that the injector makes by rules, from the start of the machine on."""
_RULED_TICKS = 14_000
"""Ticks in which rules act."""
_APART_TICKS = 3500
"""Between frames that are lost or doubled: so the one that is asked for again comes."""
_LIMIT_S = 200.0
_HANDLED_S = 0.1
"""Real time in which a process handles a signal."""
_CABLE_S = 25.0
"""After it the cable is in again."""
_ATTEMPTS = 14
_INPUT_STATUS, _BUS_STATUS, _REFUSED_STATUS = 2, 4, 5


# -- jobs -------------------------------------------------------------------------------------


def _stairs() -> str:
    corners = "\n".join(f"G1 X{4 - k % 2} Y{0.5 * k:g}" for k in range(1, 17))
    return f"F6000\nG61\nG1 X4\n{corners}\nG4 P0.2\nG1 X0 Y0 Z-2\nM2\n"


def _wave() -> str:
    lines = "\n".join(
        f"G1 X{0.25 * k:.4f} Y{3 * np.sin(0.12 * k):.4f} Z{np.cos(0.05 * k) - 1:.4f}"
        for k in range(1, 240)
    )
    return f"G64 P0.01\nF3000\n{lines}\nM2\n"


def _slow() -> str:
    return "F6000\nG1 X12\nG4 P0.2\nF300\nG1 Y9\nG4 P0.1\nF6000\nG1 X0 Y0 Z-3\nM2\n"


def _there_and_back() -> str:
    return "G64 P0.01\nF4000\nG1 X30 Y4\nG1 X0 Y8\nG1 X30 Y12 Z-1\nM0\nG1 X0 Y0 Z0\nM2\n"


def _pulses() -> str:
    """Two outputs and a value switch with nearly every move, at rest, and before and after dwells."""
    lines = []
    for k in range(1, 60):
        lines.append(f"M{62 + k % 2} P{k % 4 // 2}")
        if k % 3 == 0:
            lines.append(f"M67 E0 Q{k}")
        lines.append(f"G1 X{1.5 * k:.4f} Y{5 * np.sin(0.3 * k):.4f}")
        if k % 20 == 0:
            lines += ["M64 P1", "G4 P0.1", "M65 P1"]
    return "\n".join(["G64 P0.02", "F3000", *lines, "M68 E0 Q0", "G1 X0 Y0 Z-1", "M2", ""])


@dataclass(frozen=True)
class Job:
    """Files of a job, by name: text, or a path of an example.

    machine    its file among the examples
    outputs    whether the machine has the outputs of OUTPUTS_MACHINE
    slowness   factor of the period, where five axes would fill the bus
    least_us   least period, where three axes and the outputs would fill the bus at a lower one
    """

    name: str
    texts: tuple[str | Path, ...]
    machine: str = "mill"
    outputs: bool = False
    slowness: int = 1
    least_us: int = 1000

    def write(self, folder: Path) -> list[Path]:
        """The files, in this folder."""
        made = []
        for k, text in enumerate(self.texts):
            file = folder / f"{self.name}{k}.ngc"
            file.write_text(text.read_text() if isinstance(text, Path) else text)
            made.append(file)
        return made


JOBS = (
    Job("stairs", (_stairs(),)),
    Job("wave", (_wave(),)),
    Job("slow", (_slow(),)),
    Job("back", (_there_and_back(),)),
    Job("engraving", (TOOLPATHS / "engraving.ngc",)),
    Job("several", (_slow(), _there_and_back(), _stairs())),
    Job("five_axes", (TOOLPATHS / "five_axes.ngc",), machine="mill_five_axes", slowness=2),
    Job("dispensing", (TOOLPATHS / "dispensing.ngc",), outputs=True, least_us=2000),
    Job("pulses", (_pulses(),), outputs=True, least_us=2000),
)
_SHARES = (0.18, 0.17, 0.12, 0.1, 0.02, 0.09, 0.1, 0.08, 0.14)
"""Of the jobs among the seeds: long ones are rare."""
_INPUT_SHARE = 0.1
"""Of the jobs of one file that come from standard input."""


@cache
def job_line(job: Job, period_us: int) -> JobLine:
    """The job executed undisturbed."""
    with tempfile.TemporaryDirectory(prefix="hodograph-") as folder:
        machine = machine_at(job, period_us, Path(folder))
        limits = NativeLimits(**asdict(program_limits(machine)), chunk=1)
        files = JobFiles(tuple(job.write(Path(folder))), machine, TOLERANCE_MM, ReadOptions())
        with JobPlan(files, 16384, 1, Place(), stops=False) as plan:
            return line_of(plan.by_job(), limits, machine.path_counts)


def machine_at(job: Job, period_us: int, folder: Path) -> Machine:
    """The machine of a job at this period, in a file of its own."""
    text = (MACHINES / f"{job.machine}.toml").read_text()
    if job.outputs:
        given = OUTPUTS_MACHINE.read_text()
        text += "\n" + given[given.index("[outputs]") : given.index("[[axis]]")]
    text = text.replace('"../drives/', f'"{ROOT}/examples/drives/')
    text = re.sub(r"period_us = \d+", f"period_us = {period_us}", text)
    file = folder / f"{job.machine}{period_us}.toml"
    file.write_text(text)
    return load_machine(file)


# -- the machine and the host -----------------------------------------------------------------


class Rig:
    """Controller and drives on one bus, the host on another, the injector between them."""

    def __init__(
        self, hub: LocalHub, machine: Machine, clock: VirtualClock, rules: Path, ring_kib: int
    ) -> None:
        self.machine, self.clock = machine, clock
        self._controller = f"{find_program(CONTROLLER)} --ring {ring_kib}"
        self.bus, self.host_bus = hub.addresses
        self._injector = Process(
            "injector",
            [
                str(find_program(INJECTOR)),
                *("--bus", self.bus.channel, "--bus", self.host_bus.channel),
                *("--rules", str(rules), "--verbose"),
            ],
            clock,
        )
        self._drives = Process("drives", drive_command(machine, self.bus), clock)
        self.start_controller()

    def start_controller(self) -> None:
        """A controller after power-on."""
        command = controller_command(self.machine, self.bus, "real-time", self._controller)
        self.controller = Process(f"controller-{self.machine.node}", command, self.clock)

    def end(self) -> None:
        """Ends the processes."""
        for process in (self.controller, self._drives, self._injector):
            process.end()

    def status(self) -> tuple[int, StreamStatus, list[int]]:
        """State, job and targets of the controller; asked on its own bus, while no host runs."""
        machine = self.machine
        with connect(self.bus, machine.node, machine.bitrate) as controller:
            controller.require(10.0)
            return (
                controller.state(),
                stream_status(controller),
                controller.targets(machine.path_count),
            )


class Host:
    """One command on the bus of the host."""

    def __init__(
        self, clock: VirtualClock, bus: BusAddress, words: Sequence[str], read: Path | None = None
    ) -> None:
        self._clock = clock
        self._out = tempfile.TemporaryFile()  # noqa: SIM115  (lives as long as the child)
        self._input = (read or Path(os.devnull)).open("rb")

        def start(environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
            return subprocess.Popen(
                [sys.executable, "-m", "hodograph", *words],
                stdin=self._input,
                stdout=self._out,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment, BUS_VARIABLE: str(bus)},
            )

        self.child = clock.spawn("host", start)

    @property
    def printed(self) -> str:
        """All that it has printed."""
        self._out.seek(0)
        return self._out.read().decode(errors="replace")

    def is_running(self) -> bool:
        """Whether it still runs."""
        return self.child.poll() is None

    def run_for(self, seconds: float) -> bool:
        """Lets it run for this time. Returns whether it still runs."""
        end_s = self._clock.now_s() + seconds
        while self._clock.now_s() < end_s and self.is_running():
            self._clock.sleep(min(0.01, max(end_s - self._clock.now_s(), 1e-6)))
        return self.is_running()

    def wait(self) -> int:
        """Its exit status."""
        return self._clock.await_end("host", self.child, _LIMIT_S)

    def kill(self) -> None:
        """As a crash would."""
        self._clock.kill("host", self.child)

    def signal(self, number: int) -> None:
        """Sends a signal."""
        self._clock.signal("host", self.child, number)

    def signal_again(self, number: int) -> None:
        """Sends a signal that it may ignore."""
        self._clock.activate()
        self.child.send_signal(number)
        time.sleep(_HANDLED_S)

    def suspend(self, seconds: float) -> None:
        """As SIGSTOP and SIGCONT."""
        self._clock.suspend("host")
        self._clock.sleep(seconds)
        self._clock.resume("host")

    def close(self) -> None:
        """Ends it if it still runs."""
        if self.is_running():
            self.child.kill()
            self.child.wait()
        self._out.close()
        self._input.close()


# -- one case ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cut:
    """A disturbance: so long after the start of the command."""

    kind: str
    after_s: float
    length_s: float


@dataclass(frozen=True)
class Case:
    """What a seed draws."""

    seed: int
    job: Job
    period_us: int
    ring_kib: int
    cuts: tuple[Cut, ...]
    rules: str
    kinds: tuple[str, ...]
    waits_s: tuple[float, ...]
    """Pause before each --continue."""
    from_input: bool = False
    """The job comes from standard input, and cannot be continued."""


def draw(seed: int, kinds: Sequence[str] = KINDS, jobs: Sequence[Job] = JOBS) -> Case:
    """The case of a seed, with one of these jobs."""
    rng = np.random.default_rng(seed)
    shares = np.array([share for one, share in zip(JOBS, _SHARES, strict=True) if one in jobs])
    job = jobs[int(rng.choice(len(jobs), p=shares / shares.sum()))]
    wanted = [str(rng.choice(list(kinds))) for _ in range(int(rng.integers(1, 4)))]
    wanted = [kind for k, kind in enumerate(wanted) if kind not in _RULED or k == 0]
    rules = [line for kind in wanted if kind in _RULED for line in _rules(kind, rng)]
    cuts = tuple(
        Cut(
            kind,
            float(rng.uniform(0.05, 2.0) if rng.random() < 0.4 else rng.uniform(0.5, 9.0)),
            float(np.exp(rng.uniform(np.log(0.1), np.log(20.0)))),
        )
        for kind in wanted
        if kind not in _RULED
    )
    waits = tuple(float(one) for one in rng.choice([0.0, 0.05, 1.0, 8.0], _ATTEMPTS))
    return Case(
        seed,
        job,
        max(int(rng.choice([1000, 2000])) * job.slowness, job.least_us),
        int(rng.choice([12, 16, 24, 48])),
        cuts,
        "\n".join(rules) + "\n",
        tuple(wanted),
        waits,
        len(job.texts) == 1 and float(rng.random()) < _INPUT_SHARE,
    )


def _rules(kind: str, rng: np.random.Generator) -> Iterator[str]:
    if kind == "cable":
        at, length = int(rng.integers(0, _RULED_TICKS)), int(np.exp(rng.uniform(1.0, np.log(9000))))
        yield f"bus-off side=drives at={at} for={length}"
        return
    rule = "duplicate" if kind == "doubled" else "drop"
    ids = {"answers-lost": (0x581,), "requests-lost": (0x601,), "doubled": (0x581, 0x601)}[kind]
    ticks = rng.permutation(_RULED_TICKS // _APART_TICKS)[: int(rng.integers(1, 5))] * _APART_TICKS
    for at in sorted(ticks + rng.integers(0, _APART_TICKS // 2, len(ticks))):
        yield f"{rule} id=0x{rng.choice(ids):03X} at={at} for={_APART_TICKS // 2} count=1"


class _Failed(Exception):
    pass


@dataclass
class Found:
    """What one case found."""

    case: Case
    troubles: list[str] = field(default_factory=list)
    printed: list[str] = field(default_factory=list)
    statuses: list[int] = field(default_factory=list)
    away_um: float = 0.0
    left_out_um: float = 0.0


class Run:
    """A case on a machine of its own."""

    def __init__(self, case: Case, folder: Path) -> None:
        self.case, self.folder = case, folder
        self.machine = machine_at(case.job, case.period_us, folder)
        self.files = case.job.write(folder)
        self.journal = folder / "stream.json"
        self.found = Found(case)
        self.cuts = list(case.cuts)
        self.ended = True
        self.aside: list[tuple[int, int]] = []
        """Parts of the recording in which axes are moved beside the job."""

    def run(self) -> Found:
        """The whole case."""
        rules = self.folder / "rules"
        rules.write_text(self.case.rules)
        controller = f"{find_program(CONTROLLER)} --ring {self.case.ring_kib}"
        with ExitStack() as stack:
            stack.enter_context(patch.dict(os.environ, {"HODOGRAPH_CONTROLLER": controller}))
            hub = stack.enter_context(LocalHub(buses=2))
            clock = virtual_clock(hub.address)
            assert clock is not None
            stack.callback(_released, clock)
            self.clock = clock
            self.rig = Rig(hub, self.machine, clock, rules, self.case.ring_kib)
            stack.callback(self.rig.end)
            self.recorder = stack.enter_context(Recorder(hub.address))
            clock.sleep(0.3)
            self._stream()
            clock.sleep(0.3)
            self._judge(self.recorder.so_far())
        return self.found

    # the host, again and again

    def _stream(self) -> None:
        words: tuple[str, ...] = (
            *map(str, self.files), "--machine", str(self.machine.file), "--no-stops",
        )  # fmt: skip
        if self.case.from_input:
            self._stream_input()
            return
        for attempt in range(_ATTEMPTS):
            cut = self.cuts.pop(0) if self.cuts else None
            status = self._once(words, cut)
            if status == 0 or (status in _ENDED_BY_SIGNAL and self._is_done()):
                self._expect_end()
                return
            self._pause(attempt, status)
            if status == _REFUSED_STATUS:
                self._back_to_path()
            if self.journal.exists():
                words = ("--continue", "--no-stops")
        raise _Failed("the job does not come to its end")

    def _stream_input(self) -> None:
        """A job from standard input, which cannot be continued: it ends, or rests on its path."""
        words = ("-", "--machine", str(self.machine.file), "--no-stops")
        cut = self.cuts[0] if self.cuts else None
        if self._once(words, cut, self.files[0]) == 0:
            self._expect_end()
            return
        self.ended = False
        self.clock.sleep(_CABLE_S)
        if self._once(("--continue",), None, None, _INPUT_STATUS) != _INPUT_STATUS:
            self.found.troubles.append(f"--continue of standard input: {self.found.printed[-1]}")

    def _once(
        self, words: Sequence[str], cut: Cut | None, read: Path | None = None, status: int = 0
    ) -> int:
        words = ("stream", *words, "--journal", str(self.journal))
        host = Host(self.clock, self.rig.host_bus, words, read)
        try:
            expected: tuple[int, ...] = (status,)
            if cut is not None and host.run_for(cut.after_s):
                expected = self._act(host, cut)
            status = host.wait()
            self._note(f"{cut.kind if cut else 'undisturbed'}: status {status}", host.printed)
        except subprocess.TimeoutExpired:
            self._note("hangs", host.printed)
            raise _Failed(f"hodograph stream hangs: {host.printed}") from None
        finally:
            host.close()
        self.found.statuses.append(status)
        ruled = {4, 5, 6} if self.case.rules.strip() else set()
        if status not in {*expected, *ruled, _REFUSED_STATUS}:
            self.found.troubles.append(f"status {status}: {self.found.printed[-1]}")
        if status == 1 or "Traceback" in host_text(self.found.printed[-1]):
            self.found.troubles.append(f"internal error: {self.found.printed[-1]}")
        return status

    def _act(self, host: Host, cut: Cut) -> tuple[int, ...]:
        """Disturbs it; returns the expected statuses."""
        if cut.kind == "kill":
            host.kill()
            return (-signal.SIGKILL,)
        if cut.kind == "suspend":
            host.suspend(cut.length_s)
            return (0,)
        if cut.kind == "power":
            self.rig.controller.kill()
            self.rig.controller.end()
            self.clock.sleep(min(cut.length_s, 3.0))
            self.rig.start_controller()
            return (0, 4, 5, 6)  # 0: before the command has come to the bus
        number, status = _SIGNALS[cut.kind]
        host.signal(number)
        # By the signal itself: the end of Python catches none. 0: the job had ended, which its journal shows.
        statuses = (0, status, -number)
        if cut.kind == "interrupt-twice" and host.run_for(min(0.02 * cut.length_s, 0.3)):
            host.signal_again(number)
        return statuses

    def _note(self, head: str, printed: str) -> None:
        self.found.printed.append(f"{head}: {' | '.join(printed.strip().splitlines())}")

    def _pause(self, attempt: int, status: int) -> None:
        """Waits, and looks at the journal once the machine rests."""
        wait_s = self.case.waits_s[attempt]
        if status == _BUS_STATUS and "cable" in self.case.kinds:
            wait_s = _CABLE_S
        self.clock.sleep(wait_s)
        if wait_s < 1.0:
            return
        self.clock.sleep(8.0)
        with suppress(HodographError):
            self._check_journal(self.rig.status())

    def _check_journal(self, at: tuple[int, StreamStatus, list[int]]) -> None:
        state, status, _ = at
        if not self.journal.exists():
            return
        entry = entry_of(self.journal)
        if status.job != entry.job or status.state not in (UNDERRUN, STOPPED, ENDED):
            return
        arc_q40 = nearest_q40(status.arc_length_mm)
        if arc_q40 > entry.committed_q40 + (1 << 21):
            self.found.troubles.append(
                f"the journal has {entry.committed_q40 * MM_PER_Q40} mm sent, the axes are at {status.arc_length_mm}"
            )
        start_q40 = dict(entry.starts).get(entry.section, 0)
        if entry.arc_q40 + start_q40 > arc_q40 + (1 << 21):
            self.found.troubles.append("the journal is ahead of the axes")
        if state in MOVING and status.state != UNDERRUN:
            self.found.troubles.append(f"still moving: state {state}")

    def _back_to_path(self) -> None:
        """Does what a refusal says: reset, goto."""
        printed = self.found.printed[-1]
        way = re.search(r"hodograph (goto \S+ --to [-0-9.]+ [-0-9.]+(?: --z [-0-9.]+)?)", printed)
        if way is None:
            return
        begin = len(self.recorder.so_far())
        self._command("goto", *way[1].split()[1:])
        self.clock.sleep(0.2)
        self.aside.append((begin, len(self.recorder.so_far())))

    def _command(self, *words: str) -> None:
        host = Host(self.clock, self.rig.host_bus, words)
        try:
            status = host.wait()
            self._note(f"{words[0]}: status {status}", host.printed)
        finally:
            host.close()

    def _is_done(self) -> bool:
        return self.journal.exists() and entry_of(self.journal).done

    def _expect_end(self) -> None:
        if not self.case.from_input and not self._is_done():
            self.found.troubles.append("the job has ended, and the journal does not say so")
        state, _, targets = self.rig.status()
        end = job_line(self.case.job, self.case.period_us).points[-1]
        near = self.machine.start_tolerance_counts if "power" in self.case.kinds else 4
        if state not in (BOOT, OFF) and np.abs(end - targets).max() > near:  # restarted since
            self.found.troubles.append(f"ended at {targets}, not at {end.tolist()}")

    # the recording

    def _judge(self, frames: Frames) -> None:
        found, nodes = self.found, self.machine.nodes[: self.machine.path_count]
        if self.recorder.dropped:
            found.troubles.append(f"{self.recorder.dropped} frames are missing in the recording")
        keep = np.ones(len(frames), dtype=np.bool_)
        for begin, end in self.aside:
            keep[begin:end] = False
        own = frames[keep]
        points = changing(executed(own, nodes)[0])
        line = job_line(self.case.job, self.case.period_us)
        found.away_um = away_um(points, line.points, line.per_um)
        if self.ended:
            found.left_out_um = np.inf
            if len(points):
                found.left_out_um = away_um(line.points[::5], points, line.per_um)
        if "power" not in self.case.kinds and found.away_um > NEAR_UM:
            found.troubles.append(f"setpoints {found.away_um:.3f} um off the path")
        if found.left_out_um > NEAR_UM:
            found.troubles.append(f"{found.left_out_um:.3f} um of the path left out")
        if self.machine.outputs is not None:
            self._judge_outputs(own, line)
        jumps = find_jumps(frames, nodes, step_limits(self.machine))
        if jumps:
            found.troubles.append(f"{jumps[0]} ({len(jumps)} in all)")

    def _judge_outputs(self, frames: Frames, line: JobLine) -> None:
        trouble = outputs_trouble(frames, self.machine, line)
        last, wanted = final_outputs(frames, self.machine), tuple(line.outputs[-1].tolist())
        if trouble is None and self.ended and last != wanted:
            trouble = f"outputs {last} at the end, not {wanted}"
        if trouble is not None:
            self.found.troubles.append(trouble)


def host_text(line: str) -> str:
    """What the command printed, without the head."""
    return line.split(": ", 2)[-1]


def _released(clock: VirtualClock) -> None:
    with suppress(Exception):
        clock.release()


def entry_of(journal: Path) -> Entry:
    """The entry of a journal, also of one that is done."""
    found = json.loads(journal.read_text(encoding="utf-8"))
    found.pop("version")
    found["files"] = tuple(FileMark(**one) for one in found["files"])
    found["starts"] = tuple((int(number), int(start)) for number, start in found["starts"])
    return Entry(**found)


def run_case(case: Case) -> Found:
    """Runs a case; each trouble is in the result."""
    with tempfile.TemporaryDirectory(prefix="hodograph-cuts-") as folder:
        run = Run(case, Path(folder))
        try:
            return run.run()
        except _Failed as error:
            run.found.troubles.append(str(error))
        except Exception:
            run.found.troubles.append(traceback.format_exc())
        return run.found


# -- all cases --------------------------------------------------------------------------------


def _summary(found: Found) -> str:
    case = found.case
    cuts = ", ".join(f"{c.kind} {c.after_s:.3f} s {c.length_s:.2f} s" for c in case.cuts)
    return (
        f"{case.job.name}{' from -' if case.from_input else ''} {case.period_us} us {case.ring_kib} KiB "
        f"[{', '.join(case.kinds)}] ({cuts}) statuses {found.statuses}, off {found.away_um:.3f} um, "
        f"left out {found.left_out_um:.3f} um: {'FAILED' if found.troubles else 'ok'}"
    )


def _numbers(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main(arguments: list[str]) -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(prog="stream_cuts.py", description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=_numbers, default=_numbers("1-100"))
    parser.add_argument("--kind", choices=KINDS, nargs="+", default=list(KINDS))
    parser.add_argument("--job", choices=[job.name for job in JOBS], nargs="+")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args(arguments)
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell may start this with it ignored
    jobs = [job for job in JOBS if options.job is None or job.name in options.job]
    counts: Counter[str] = Counter()
    bad: Counter[str] = Counter()
    results = []
    with tempfile.TemporaryDirectory(prefix="hodograph-") as own:
        os.environ["XDG_STATE_HOME"] = os.environ["XDG_RUNTIME_DIR"] = own
        for seed in options.seeds:
            found = run_case(draw(seed, options.kind, jobs))
            case = found.case
            counts.update(set(case.kinds))
            bad.update(set(case.kinds) if found.troubles else ())
            print(f"{seed}: {_summary(found)}", flush=True)
            for trouble in found.troubles:
                print(f"    {trouble}", flush=True)
            if found.troubles or options.verbose:
                for line in found.printed:
                    print(f"    > {line}", flush=True)
            results.append(
                {
                    "seed": seed,
                    "kinds": case.kinds,
                    "troubles": found.troubles,
                    "printed": found.printed,
                }
            )
    for kind in KINDS:
        print(f"{kind}: {counts[kind]} seeds, {bad[kind]} failed")
    if options.json is not None:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 1 if sum(bad.values()) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
