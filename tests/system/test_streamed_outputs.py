# SPDX-License-Identifier: MIT
"""Outputs of a streamed job at the I/O module of a bus: those of the simulation, also when the job goes on. Run by
pytest; starts a controller, drives and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import asdict
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from bench import EXAMPLES, Bench, MakeBench
from commands import run_command, running
from hodograph.bus.capture.decode import SYNC_ID, decode_outputs
from hodograph.bus.capture.recordings import read_recording
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.stream_channel import close_stream
from hodograph.cli.main import main
from hodograph.config import Machine, load_machine
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits
from hodograph.native.stream import OfflineStream
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.toolpath.files import ReadOptions

MACHINE = EXAMPLES / "machines" / "dispenser.toml"
JOB = """F6000
M64 P0
G1 X10
M64 P1
G4 P0.05
M67 E0 Q20
G1 X20
M62 P2
G1 X30
M63 P0
M67 E0 Q40
G1 X45
M65 P1
M65 P2
M68 E0 Q0
M2
"""


def _wanted(file: Path, machine: Machine) -> list[tuple[int, int]]:
    """The outputs one after the other, as the controller's core has them: digital, the first analogue one."""
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    stream = OfflineStream("fixed", NativeLimits(**asdict(program_limits(machine)), chunk=1))
    with JobPlan(job, 16 * 1024, 1, Place()) as plan:
        for chunks in plan.by_job():
            for chunk in chunks:
                assert stream.give(chunk.encode()) is None
    values = stream.run_with_outputs(100_000)[1]
    return _changes(values)


def _changes(values: np.ndarray) -> list[tuple[int, int]]:
    pairs = zip(values["digital"].tolist(), values["analogue"][:, 0].tolist(), strict=True)
    return [one for one, _ in groupby(pairs)]


def test_a_job_switches_as_simulated(hub: LocalHub, tmp_path: Path) -> None:
    file, recording = tmp_path / "job.ngc", tmp_path / "job.log"
    file.write_text(JOB)
    machine = load_machine(MACHINE)
    own = ["--journal", str(tmp_path / "stream.json"), "--record", str(recording)]
    assert main(["stream", str(file), "--machine", str(MACHINE), *own]) == 0
    assert machine.outputs is not None
    frames = read_recording(recording)
    assert (frames["id"] == SYNC_ID).any()
    seen = _changes(decode_outputs(frames, machine.outputs))
    assert seen == [(0, 0), *_wanted(file, machine)]


SLOW = "F6000\nM64 P0\nM68 E0 Q20\nG1 X12\nM64 P1\nG4 P0.1\nF300\nG1 Y15\nG4 P0.1\nF6000\nG1 X0 Y0\nM2\n"
OUTPUTS = 0x2036


@pytest.mark.long
@pytest.mark.parametrize("loss", ["host", "power"])
def test_a_job_that_goes_on_switches_what_was_on(
    make_bench: MakeBench, clock: VirtualClock, tmp_path: Path, loss: str
) -> None:
    """Its outputs were switched in a section that is not sent again."""
    bench: Bench = make_bench(file=MACHINE)
    file = tmp_path / "part.ngc"
    file.write_text(SLOW)
    journal = ("--journal", str(tmp_path / "stream.json"))
    with running(
        clock, "stream", str(file), "--machine", str(MACHINE), *journal, name="stream"
    ) as command:
        while bench.controller.targets(2)[1] < 4_000_000:
            assert command.child.poll() is None, command.err
            clock.sleep(0.02)
        command.kill()
    assert bench.controller.read(OUTPUTS, 1) == 0b11
    if loss == "power":
        bench.controller.stop_and_wait()
        close_stream(bench.controller)
        assert bench.controller.read(OUTPUTS, 1) == 0
    clock.sleep(8.0)
    done = run_command(clock, "stream", "--continue", *journal)
    assert done.returncode == 0, done.stderr
    assert bench.controller.targets(2) == [0, 0]
    assert bench.controller.read(OUTPUTS, 1) == 0b11
    assert (
        bench.controller.read(OUTPUTS, 3) == 0
    )  # the channel of S: the end of the program switches it off
