# SPDX-License-Identifier: MIT
"""A job that is read by another process: the same chunks and errors, and no process is left. Run by pytest; starts
processes, and writes to temporary folders.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.util
import os
import signal
import subprocess
import sys
from math import sin
from pathlib import Path

import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import HodographError, InputError
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.reading import StreamReader
from hodograph.stream.reading_process import ParallelReader
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[3]
MILL = ROOT / "examples" / "machines" / "mill.toml"
MOST = 16 * 1024
"""Greatest size of a chunk, in bytes."""
PART = """G64 P0.01
F6000
M8
G1 X12
G1 X20 Y3
G4 P0.2
G1 Y15
G1 X0 Y0 Z-3
G4 P1
M2
"""
LATE_ERROR = PART.replace("G4 P1\n", "G1 X1\nG1 X[1/0]\n")
KILLED = """
import sys
from pathlib import Path
from hodograph.config import load_machine
from hodograph.stream.reading import StreamReader
from hodograph.stream.reading_process import ParallelReader
from hodograph.toolpath.files import ReadOptions

reader = StreamReader(Path(sys.argv[2]), load_machine(Path(sys.argv[1])), 0.01, ReadOptions())
sections = ParallelReader(reader).sections()
section = next(sections)
next(section.blocks)
print("reads", flush=True)
sys.stdin.read()
"""


@pytest.fixture(scope="module")
def machine() -> Machine:
    """The mill of the examples."""
    return load_machine(MILL)


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    """A job of several parts."""
    file = tmp_path / "wave.ngc"
    lines = (f"G1 X{0.04 * k:.2f} Y{2.0 * sin(0.02 * k):.4f}" for k in range(1, 4000))
    file.write_text("G64 P0.01\nF3000\n" + "\n".join(lines) + "\nM2\n")
    return file


def _plan(file: Path, machine: Machine, processes: int) -> tuple[list[bytes], list[str], object]:
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    with JobPlan(job, MOST, 7, Place(), processes=processes) as plan:
        chunks = [chunk.encode() for chunks in plan.by_job() for chunk in chunks]
        return chunks, plan.notes, plan.after


def test_chunks_are_the_same_by_one_process_and_by_two(tmp_path: Path, machine: Machine) -> None:
    """Bytes, notes and what happens at the end."""
    file = tmp_path / "part.ngc"
    file.write_text(PART)
    alone, together = (_plan(file, machine, count) for count in (1, 2))
    assert together == alone
    assert len(alone[0]) > 1
    assert alone[1], "M8 without outputs has a note"
    assert alone[2], "the last dwell is after the last section"
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("processes", [1, 2])
def test_room_of_the_controller_may_be_known_late(
    tmp_path: Path, machine: Machine, processes: int
) -> None:
    """The chunks are the same; nothing is planned before."""
    file = tmp_path / "part.ngc"
    file.write_text(PART)
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    with JobPlan(job, None, 7, Place(), processes=processes) as plan:
        assert plan.item(0, 0.2) is None
        plan.allow(MOST)
        chunks = [chunk.encode() for chunks in plan.by_job() for chunk in chunks]
    assert chunks == _plan(file, machine, processes)[0]


def test_plan_may_end_before_the_room_is_known(wave: Path, machine: Machine) -> None:
    """As when the controller does not answer."""
    job = JobFiles((wave,), machine, 0.01, ReadOptions())
    with JobPlan(job, None, 7, Place(), processes=2) as plan:
        assert plan.chunks == 0
    assert not plan._thread.is_alive()
    assert not multiprocessing.active_children()


def test_error_of_a_late_line_is_that_of_one_process(tmp_path: Path, machine: Machine) -> None:
    """Class, message and place."""
    file = tmp_path / "wrong.ngc"
    file.write_text(LATE_ERROR)
    found = []
    for processes in (1, 2):
        with pytest.raises(InputError) as caught:
            _plan(file, machine, processes)
        found.append((type(caught.value), str(caught.value), vars(caught.value)))
    assert found[0] == found[1]
    assert ":10:" in found[0][1]


def test_plan_that_ends_early_leaves_no_process(wave: Path, machine: Machine) -> None:
    """After the first chunk of many."""
    job = JobFiles((wave,), machine, 0.01, ReadOptions())
    with JobPlan(job, MOST, 7, Place(), processes=2) as plan:
        assert plan.item(0, 1e6) is not None
    assert not multiprocessing.active_children()


def test_process_that_is_killed_is_an_error(wave: Path, machine: Machine) -> None:
    """Not an end of the job."""
    reader = ParallelReader(StreamReader(wave, machine, 0.01, ReadOptions()))
    sections = reader.sections()
    section = next(sections)
    next(section.blocks)
    (process,) = multiprocessing.active_children()
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    with pytest.raises(HodographError, match="the process that reads it has ended"):
        list(section.blocks)


def test_process_ends_with_a_host_that_is_killed(wave: Path) -> None:
    """The end of its standard output, which both have, is the end of both."""
    command = [sys.executable, "-c", KILLED, str(MILL), str(wave)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as host:
        assert host.stdout is not None
        assert host.stdout.readline() == "reads\n"
        host.kill()
        assert host.stdout.read() == ""


def test_interrupt_is_not_for_the_process_that_reads(wave: Path, machine: Machine) -> None:
    """Ctrl-C goes to all processes of a terminal: it goes on to read what is wanted."""
    reader = ParallelReader(StreamReader(wave, machine, 0.01, ReadOptions()))
    sections = reader.sections()
    section = next(sections)
    (process,) = multiprocessing.active_children()
    assert process.pid is not None
    os.kill(process.pid, signal.SIGINT)
    first, second = next(section.blocks), next(section.blocks)
    assert first.line[0] < first.line[-1] <= second.line[0]


def test_process_that_is_ended_while_it_starts_says_nothing(
    wave: Path,
    machine: Machine,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The handlers of the command would raise their exception in it, as a traceback on the terminal."""

    def terminate(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    def early() -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    before = signal.signal(signal.SIGTERM, terminate)
    monkeypatch.setattr(multiprocessing.util, "_close_stdin", early)
    try:
        reader = StreamReader(wave, machine, 0.01, ReadOptions())
        with pytest.raises(HodographError, match="the process that reads it has ended"):
            next(ParallelReader(reader).sections())
    finally:
        signal.signal(signal.SIGTERM, before)
    assert capfd.readouterr().err == ""
