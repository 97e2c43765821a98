# SPDX-License-Identifier: MIT
"""Toolpaths on a local bus in virtual time: sections one after the other, what happens between them, and how a job ends
before its end. Run by pytest; starts a controller, drives and `hodograph` on a local bus, and writes to temporary
folders.
"""

from __future__ import annotations

import itertools
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench import EXAMPLES, Bench, MakeBench
from commands import Command, result, running
from hodograph.bus import processes
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.controller import FAULT_STATE, HELD, READY, RUNNING
from hodograph.bus.sdo.objects import DISABLE, HOLD, RESUME, STOP
from hodograph.cli import run_command
from hodograph.cli.bus_session import await_enter
from hodograph.cli.main import main
from hodograph.job_run import BusCheck

MILL = EXAMPLES / "machines" / "mill.toml"
WAIT_S = 60.0
COUNTS_PER_MM = 1_000_000
OF_MOTION = (
    *("first_line", "last_line", "ticks", "setpoints_sha256", "encoders_sha256"),
    "max_contour_error_um",
)

THREE = "F6000\nG1 X12\nG4 P0.2\nF600\nG1 Y15\n(MSG, third)\nG4 P0.1\nF6000\nG1 X0 Y0 Z-3\nM2\n"
"""Three sections: 12 mm along x, 15 mm along y at 10 mm/s, and back."""
SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">'
    '<circle cx="5" cy="25" r="3"/></svg>'
)


def job_file(folder: Path, text: str, name: str = "part.ngc") -> str:
    file = folder / name
    file.write_text(text)
    return str(file)


def words(file: str, *more: str) -> tuple[str, ...]:
    return (file, "--machine", str(MILL), *more)


def same_sections(recorded: dict[str, Any], simulated: dict[str, Any]) -> bool:
    """Whether both made the same motion, section by section, bit for bit."""
    assert len(recorded["section"]) == recorded["sections"] == simulated["sections"]
    pairs = zip(recorded["section"], simulated["section"], strict=True)
    return all(one[key] == other[key] for one, other in pairs for key in OF_MOTION)


@pytest.mark.usefixtures("hub")
@pytest.mark.parametrize("kernel", ["fixed", "double"])
def test_run_gives_the_bits_of_simulate(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, kernel: str
) -> None:
    file = job_file(tmp_path, THREE)
    traces = [tmp_path / "simulated.csv", tmp_path / "recorded.csv"]
    common = words(file, "--json", "--kernel", kernel, "--trace")
    simulated = result(capsys, "simulate", *common, str(traces[0]))
    recording = str(tmp_path / "run.log")
    recorded = result(capsys, "run", *common, str(traces[1]), "--record", recording)
    assert recorded["sections"] == 3
    assert same_sections(recorded, simulated)
    for key in ("ticks", "duration_s", "deviation_bound_um", "lines", "segments", "dwell_s"):
        assert recorded[key] == simulated[key]
    assert recorded["deadline_misses"] == 0
    assert recorded["frames"] == sum(one["frames"] for one in recorded["section"])
    assert traces[0].read_text() == traces[1].read_text()
    assert sorted(p.name for p in tmp_path.glob("*.log")) == [f"run.{k}.log" for k in (1, 2, 3)]


@pytest.mark.usefixtures("hub")
@pytest.mark.parametrize(
    ("name", "text", "more"),
    [
        ("one.ngc", "F3000\nG2 X8 Y0 I4\nM2\n", ()),
        ("part.svg", SVG, ("--feed", "50")),
        ("part.csv", "x,y,feed\n3,0,3000\n9,4,3000\n", ("--closed",)),
        ("exact.ngc", "G61\nF3000\nG1 X3\nG1 Y2\nG1 X1 Z1\nG1 X0\nM2\n", ()),
    ],
)
def test_every_kind_and_any_number_of_sections(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    name: str,
    text: str,
    more: tuple[str, ...],
) -> None:
    common = words(job_file(tmp_path, text, name), "--json", *more)
    simulated = result(capsys, "simulate", *common)
    assert same_sections(result(capsys, "run", *common), simulated)


@pytest.mark.usefixtures("hub")
def test_axes_turn_alone_while_the_others_hold_their_counts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """From rest to rest between moves on a path; the first section turns before anything else moves."""
    text = "G1 A20 F3600\nX3 Y1 F1200\nC90 A0 F7200\nX0 A10 F1200\nM2\n"
    file, machine = job_file(tmp_path, text), str(EXAMPLES / "machines" / "mill_five_axes.toml")
    traces = [tmp_path / "simulated.csv", tmp_path / "recorded.csv"]
    common = (file, "--machine", machine, "--json", "--trace")
    simulated = result(capsys, "simulate", *common, str(traces[0]))
    recorded = result(capsys, "run", *common, str(traces[1]))
    assert recorded["sections"] == 4
    assert same_sections(recorded, simulated)
    assert traces[0].read_text() == traces[1].read_text()
    assert [round(one.get("turned_deg", 0.0), 3) for one in recorded["section"]] == [
        *(20.0, 0.0, 92.195, 0.0)
    ]


@pytest.fixture
def bench(make_bench: MakeBench) -> Bench:
    return make_bench(file=MILL)


@pytest.fixture
def under_way(bench: Bench, clock: VirtualClock, tmp_path: Path) -> Iterator[Command]:
    """A job that is 4 mm along its second section."""
    with running(clock, "run", *words(job_file(tmp_path, THREE), "--json")) as command:
        _await_y(bench, clock, 4.0)
        assert bench.controller.state() == RUNNING
        yield command


def _await_y(bench: Bench, clock: VirtualClock, y_mm: float) -> None:
    end_s = clock.now_s() + WAIT_S
    while bench.controller.targets(2)[1] < y_mm * COUNTS_PER_MM:
        assert clock.now_s() < end_s
        clock.sleep(0.02)


def test_a_stop_ends_the_job(bench: Bench, clock: VirtualClock, under_way: Command) -> None:
    bench.controller.command(STOP)
    assert under_way.wait() == 6
    assert "part.ngc:5: section 2 of 3: stopped before its end" in under_way.err
    x, y, z = bench.controller.targets(3)
    clock.sleep(0.5)
    assert bench.controller.targets(3) == [x, y, z]
    assert (x, z) == (12 * COUNTS_PER_MM, 0)
    assert 4.0 < y / COUNTS_PER_MM < 6.0


def test_after_a_hold_the_job_goes_to_its_end(
    bench: Bench, clock: VirtualClock, under_way: Command
) -> None:
    bench.controller.command(HOLD)
    bench.controller.wait_for((HELD,), WAIT_S)
    clock.sleep(1.0)
    under_way.await_text("held: hodograph resume goes on")
    bench.controller.command(RESUME)
    assert under_way.wait() == 6
    assert "part.ngc:5: section 2 of 3: recording" in under_way.err
    assert "part.ngc:6: third" in under_way.err
    assert bench.controller.targets(3) == [0, 0, -3 * COUNTS_PER_MM]


def test_ctrl_c_stops_the_axes(bench: Bench, clock: VirtualClock, under_way: Command) -> None:
    under_way.signal(signal.SIGINT)
    assert under_way.wait() == 130
    assert bench.controller.state() == READY
    place = bench.controller.targets(3)
    clock.sleep(0.5)
    assert bench.controller.targets(3) == place
    assert place[1] < 6 * COUNTS_PER_MM


def test_drives_that_are_switched_off_in_a_dwell_end_the_job(
    bench: Bench, clock: VirtualClock, tmp_path: Path
) -> None:
    file = job_file(tmp_path, "F6000\nG1 X2\nG4 P20\nG1 Y15\nM2\n")
    with running(clock, "run", *words(file)) as command:
        clock.sleep(0.1)
        while bench.controller.targets(1)[0] != 2 * COUNTS_PER_MM:
            clock.sleep(0.1)
        clock.sleep(2.0)
        begun_s = clock.now_s()
        bench.controller.command(DISABLE)
        assert command.wait() == 6
        assert clock.now_s() - begun_s < 10.0
        assert "at a rest of the job: another command has moved the axes or switched" in command.err
    assert bench.controller.targets(2)[1] == 0


@pytest.mark.parametrize("at", [300, 2000, 2900])
def test_a_fault_ends_the_job(
    make_bench: MakeBench,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    at: int,
) -> None:
    """At any instant of it, in motion and in the dwells."""
    rules = tmp_path / "rules"
    rules.write_text(f"fault node=4 code=0x5400 at={at}\n")
    plain = processes.drive_command
    monkeypatch.setattr(
        processes, "drive_command", lambda *given: [*plain(*given), "--faults", str(rules)]
    )
    bench = make_bench(file=MILL)
    assert main(["run", *words(job_file(tmp_path, THREE))]) == 6
    assert "0x5400" in capsys.readouterr().err
    assert bench.controller.state() == FAULT_STATE


DWELLS = "F6000\nG1 X2\nG4 P20\nG1 X4\nM2\n"


@pytest.fixture
def resting(bench: Bench, clock: VirtualClock, tmp_path: Path) -> Iterator[Command]:
    """A job in the dwell between its sections."""
    with running(clock, "run", *words(job_file(tmp_path, DWELLS)), name="first") as command:
        while bench.controller.targets(1)[0] != 2 * COUNTS_PER_MM:
            assert command.child.poll() is None, command.err
            clock.sleep(0.1)
        clock.sleep(2.0)
        yield command


def test_a_job_that_rests_is_not_disturbed(
    bench: Bench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    resting: Command,
) -> None:
    """By commands that would move axes or switch drives off; it comes to its end."""
    monkeypatch.chdir(tmp_path)
    other = words(job_file(tmp_path, THREE, "other.ngc"))
    text = f"another hodograph command runs a job (process {resting.child.pid})"
    commands: tuple[tuple[str, ...], ...] = (
        ("run", *other),
        ("stream", *other, "--journal", "stream.json"),
        ("goto", str(MILL), "--to", "1", "1"),
        ("start",),
        ("home",),
        ("reset",),
        ("configure", str(EXAMPLES / "machines" / "paper_alpha.toml")),
    )
    for command in commands:
        assert main(command) == 5, command
        assert text in capsys.readouterr().err.splitlines()[-1]
    assert bench.controller.state() == READY
    assert bench.controller.targets(2) == [2 * COUNTS_PER_MM, 0]
    assert resting.wait() == 0, resting.err
    assert bench.controller.targets(2) == [4 * COUNTS_PER_MM, 0]


def test_a_job_at_a_program_stop_is_not_disturbed(
    bench: Bench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Not either by a command of the same process."""
    other = words(job_file(tmp_path, THREE, "other.ngc"))
    found: list[int] = []

    def operator(text: str, check: BusCheck) -> None:
        assert text.endswith("part.ngc:3: M0")
        found.append(main(["run", *other]))
        check()

    monkeypatch.setattr(run_command, "await_enter", operator)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    assert main(["run", *words(job_file(tmp_path, "F6000\nG1 X2\nM0\nG1 X4\nM2\n"))]) == 0
    assert found == [5]
    assert "another hodograph command runs a job" in capsys.readouterr().err
    assert bench.controller.targets(2) == [4 * COUNTS_PER_MM, 0]


def test_a_job_whose_host_was_killed_is_over(
    bench: Bench, tmp_path: Path, resting: Command
) -> None:
    resting.kill()
    assert main(["run", *words(job_file(tmp_path, "F6000\nG1 X3\nM2\n"))]) == 0
    assert bench.controller.targets(2) == [3 * COUNTS_PER_MM, 0]


STOPS = "F6000\nG1 X2\nM0\nG1 X4\nM6 T2\nG1 X6\nM1\nM2\n"


def test_stops_need_a_terminal(
    bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = job_file(tmp_path, STOPS)
    assert main(["run", *words(file)]) == 2
    assert "part.ngc:3: M0 waits for the operator" in capsys.readouterr().err
    assert bench.controller.state() != READY  # nothing was switched on
    assert main(["run", *words(file, "--no-stops")]) == 0
    err = capsys.readouterr().err
    for place in ("3: M0", "5: M6 T2", "7: M1"):
        assert f"part.ngc:{place}: passed" in err
    assert bench.controller.targets(1) == [6 * COUNTS_PER_MM]


class _Terminal:
    """Standard input, of which a test holds the keyboard."""

    def __init__(self) -> None:
        read, self.keyboard = os.pipe()
        self._lines = os.fdopen(read)

    def isatty(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._lines.fileno()

    def readline(self) -> str:
        return self._lines.readline()

    def close(self) -> None:
        self._lines.close()
        os.close(self.keyboard)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[_Terminal]:
    made = _Terminal()
    monkeypatch.setattr("sys.stdin", made)
    yield made
    made.close()


def test_enter_is_waited_for(terminal: _Terminal) -> None:
    looks = []

    def look() -> None:
        looks.append(0)
        if len(looks) == 5:
            os.write(terminal.keyboard, b"\n")

    await_enter("M0", look)
    assert len(looks) == 5


def test_a_program_stop_goes_on_at_enter(
    hub: LocalHub, terminal: _Terminal, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    del hub
    os.write(terminal.keyboard, b"\n")
    file = job_file(tmp_path, "F6000\nG1 X2\nM0\nG1 X4\nM2\n")
    assert main(["run", *words(file)]) == 0
    assert "part.ngc:3: M0: waits for Enter" in capsys.readouterr().err


@pytest.mark.usefixtures("hub")
@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--report", "r"), "--report takes path files only"),
        (("--layer", "a"), "--layer is for"),
        (("--trace", "t.csv", "part.ngc"), "--trace: takes one FILE"),
    ],
)
def test_what_a_toolpath_cannot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], message: str
) -> None:
    assert main(["run", *more, *words(job_file(tmp_path, THREE))]) == 2
    assert message in capsys.readouterr().err


def test_a_section_begins_where_the_one_before_ended(tmp_path: Path) -> None:
    """Within the rounding that a start is allowed: no move between, however many sections there are."""
    from hodograph.config import load_machine
    from hodograph.job import load_job

    rounds = "".join(f"G1 X{0.1 * k:.3f} Y{k % 3 / 7:.6f} Z{k % 5 / 3:.6f}\n" for k in range(1, 60))
    job = load_job(Path(job_file(tmp_path, f"G61.1\nF3000\n{rounds}M2\n")), load_machine(MILL))
    assert len(job.sections) == 59
    programs = [section.pipeline.accepted for section in job.sections]
    for before, after in itertools.pairwise(programs):
        end = before.setpoints("fixed", COUNTS_PER_MM, before.ticks, 1)[1][0]
        start = after.setpoints("fixed", COUNTS_PER_MM, 0, 1)[1][0]
        assert np.abs(end - start).max() <= 2
