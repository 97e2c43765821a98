# SPDX-License-Identifier: MIT
"""`hodograph stream` on a bus: to the end, stopped, killed and continued. Run by pytest; starts a controller, drives
and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, Bench, MakeBench
from commands import Command, run_command, running
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.controller import READY, RUNNING
from hodograph.bus.sdo.node import _Answers
from hodograph.bus.sdo.objects import STATE, STREAM
from hodograph.bus.sdo.stream_channel import ENDED, STOPPED, stream_status
from hodograph.cli.main import main
from hodograph.cli.monitor_command import machine_layout
from hodograph.config import load_machine
from hodograph.monitor.pump import Pump
from hodograph.monitor.source import open_source
from hodograph.stream import chunks

pytestmark = pytest.mark.long

MILL = EXAMPLES / "machines" / "mill.toml"
WAIT_S = 120.0
COUNTS_PER_MM = 1_000_000
COUNTS_PER_DEG = 100_000
JOB = "F6000\nG1 X12\nG4 P0.2\nF300\nG1 Y15\nG4 P0.1\nF6000\nG1 X0 Y0 Z-3\nM2\n"
"""Three sections: 12 mm along x, 15 mm along y at 5 mm/s, and back."""


@pytest.fixture
def bench(make_bench: MakeBench) -> Bench:
    return make_bench(file=MILL)


def _await(clock: VirtualClock, command: Command, reached: Callable[[], bool]) -> None:
    """Waits until it is so, while the command goes on."""
    end_s = clock.now_s() + WAIT_S
    while not reached():
        assert clock.now_s() < end_s
        assert command.child.poll() is None, command.err
        clock.sleep(0.02)


@pytest.fixture
def under_way(bench: Bench, clock: VirtualClock, tmp_path: Path) -> Iterator[Command]:
    """A job that is 4 mm along its second section."""
    file = tmp_path / "part.ngc"
    file.write_text(JOB)
    journal = ("--journal", str(tmp_path / "stream.json"))
    with running(
        clock, "stream", str(file), "--machine", str(MILL), *journal, name="stream"
    ) as command:
        _await(clock, command, lambda: bench.controller.targets(2)[1] >= 4 * COUNTS_PER_MM)
        yield command


def _continued(clock: VirtualClock, folder: Path) -> str:
    done = run_command(clock, "stream", "--continue", "--journal", str(folder / "stream.json"))
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_second_command_leaves_the_first_one_alone(
    bench: Bench, clock: VirtualClock, under_way: Command, tmp_path: Path
) -> None:
    """With the same journal, with one of its own, and with a job that the controller does not have."""
    part, kept, other = (
        str(tmp_path / "part.ngc"),
        tmp_path / "stream.json",
        tmp_path / "other.json",
    )
    machine = ("--machine", str(MILL))
    same = run_command(clock, "stream", part, *machine, "--journal", str(kept))
    again = run_command(clock, "stream", "--continue", "--journal", str(kept))
    for done in (same, again):
        assert done.returncode == 2
        assert "another hodograph stream writes this journal" in done.stderr
    entry = json.loads(kept.read_text()) | {"job0": 1}
    other.write_text(json.dumps(entry))
    own = run_command(clock, "stream", part, *machine, "--journal", str(tmp_path / "own.json"))
    lost = run_command(clock, "stream", "--continue", "--journal", str(other))
    for done in (own, lost):
        assert done.returncode == 5
        assert "is running: wait until the axes stand" in done.stderr
    assert bench.controller.state() == RUNNING
    assert under_way.wait(WAIT_S) == 0, under_way.err
    assert _at_the_end(bench)


def _at_the_end(bench: Bench) -> bool:
    at = bench.controller.targets(3)
    return at == [0, 0, -3 * COUNTS_PER_MM] and stream_status(bench.controller).state == ENDED


def test_a_job_comes_to_its_end(
    bench: Bench, clock: VirtualClock, under_way: Command, tmp_path: Path
) -> None:
    assert under_way.wait(WAIT_S) == 0, under_way.err
    assert _at_the_end(bench)
    again = run_command(clock, "stream", "--continue", "--journal", str(tmp_path / "stream.json"))
    assert again.returncode == 2
    assert "came to its end" in again.stderr


def test_a_killed_host_leaves_the_machine_on_its_path(
    bench: Bench, clock: VirtualClock, under_way: Command, tmp_path: Path
) -> None:
    under_way.kill()
    clock.sleep(8.0)
    x, y, z = bench.controller.targets(3)
    assert (x, z) == (12 * COUNTS_PER_MM, 0)
    assert 4 * COUNTS_PER_MM <= y <= 15 * COUNTS_PER_MM
    clock.sleep(0.5)
    assert bench.controller.targets(3) == [x, y, z]
    assert bench.controller.state() in (RUNNING, READY)
    _continued(clock, tmp_path)
    assert _at_the_end(bench)


@pytest.mark.parametrize(
    ("was", "now"), [("[0, 0, 0]", "[0, 1, 0]"), ("jerk_mm_s3 = 500000", "jerk_mm_s3 = 400000")]
)
def test_a_job_does_not_go_on_on_a_changed_machine(
    bench: Bench, clock: VirtualClock, tmp_path: Path, was: str, now: str
) -> None:
    """Its work offset or a limit is another one: the rest would be cut at another place, or on another curve."""
    machine, file = tmp_path / "mill.toml", tmp_path / "part.ngc"
    text = MILL.read_text().replace("../drives", str(EXAMPLES / "drives"))
    machine.write_text(text)
    file.write_text(JOB)
    with running(
        clock,
        *("stream", str(file), "--machine", str(machine)),
        *("--journal", str(tmp_path / "stream.json")),
        name="stream",
    ) as command:
        _await(clock, command, lambda: bench.controller.targets(2)[1] >= 4 * COUNTS_PER_MM)
        command.signal(signal.SIGINT)
        assert command.wait(WAIT_S) == 128 + signal.SIGINT
    rests = bench.controller.targets(3)
    machine.write_text(text.replace(was, now, 1))
    done = run_command(clock, "stream", "--continue", "--journal", str(tmp_path / "stream.json"))
    assert done.returncode == 2, (bench.controller.targets(3), done.stderr)
    assert (
        f"{machine}: its work offset, start, axes, limits or outputs have been changed"
        in done.stderr
    )
    assert bench.controller.targets(3) == rests
    machine.write_text(text)
    _continued(clock, tmp_path)
    assert _at_the_end(bench)


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_rests_on_the_path(
    bench: Bench, clock: VirtualClock, under_way: Command, tmp_path: Path, end: signal.Signals
) -> None:
    """Ctrl-C, a kill, and a terminal that is closed."""
    under_way.signal(end)
    assert under_way.wait(WAIT_S) == 128 + end
    x, y, z = bench.controller.targets(3)
    assert (x, z) == (12 * COUNTS_PER_MM, 0)
    assert 4 * COUNTS_PER_MM <= y < 15 * COUNTS_PER_MM
    assert bench.controller.state() == READY
    assert stream_status(bench.controller).state == STOPPED
    _continued(clock, tmp_path)
    assert _at_the_end(bench)


@pytest.mark.parametrize("again", [signal.SIGINT, signal.SIGTERM])
def test_an_impatient_operator(
    bench: Bench, clock: VirtualClock, under_way: Command, tmp_path: Path, again: signal.Signals
) -> None:
    """Ctrl-C, and more while the axes brake: they rest on the path all the same, and the job goes on from there."""
    under_way.signal(signal.SIGINT)
    for _ in range(4):
        under_way.child.send_signal(again)
        clock.sleep(0.02)
    assert under_way.wait(WAIT_S) == 128 + signal.SIGINT
    clock.sleep(2.0)
    x, y, z = bench.controller.targets(3)
    assert (x, z) == (12 * COUNTS_PER_MM, 0)
    assert 4 * COUNTS_PER_MM <= y < 15 * COUNTS_PER_MM
    assert stream_status(bench.controller).state == STOPPED
    _continued(clock, tmp_path)
    assert _at_the_end(bench)


def test_a_list_of_paths_goes_on_where_axes_turn_alone(
    make_bench: MakeBench, clock: VirtualClock, tmp_path: Path
) -> None:
    five = EXAMPLES / "machines" / "mill_five_axes.toml"
    bench = make_bench(file=five)
    journal = ("--journal", str(tmp_path / "stream.json"))
    with running(
        clock, "stream", str(EXAMPLES / "facets.toml"), *journal, name="stream"
    ) as command:
        _await(clock, command, lambda: bench.controller.targets(5)[4] >= 30 * COUNTS_PER_DEG)
        command.signal(signal.SIGINT)
        assert command.wait(WAIT_S) == 128 + signal.SIGINT
    *stands, _, c = bench.controller.targets(5)
    assert stands == [22 * COUNTS_PER_MM, 32 * COUNTS_PER_MM, 10 * COUNTS_PER_MM]
    assert 30 * COUNTS_PER_DEG <= c < 120 * COUNTS_PER_DEG
    _continued(clock, tmp_path)
    ends = [-20 * COUNTS_PER_MM, 30 * COUNTS_PER_MM, 2 * COUNTS_PER_MM]
    assert bench.controller.targets(5) == [*ends, 12 * COUNTS_PER_DEG, 120 * COUNTS_PER_DEG]


def test_the_page_has_the_contour_error_of_a_job(
    hub: LocalHub, clock: VirtualClock, tmp_path: Path
) -> None:
    """In each tick that moves, though the page gets the path only from the chunks on the bus."""
    machine, published = load_machine(MILL), list[dict[str, Any]]()
    file = tmp_path / "part.ngc"
    file.write_text("G64 P0.05\nF3000\nG1 X10\nG3 X20 Y10 Z-2 I0 J10\nG1 Y20\nG61\nG1 X15\nM2\n")
    pump = Pump(
        lambda: open_source(hub.address, machine.bitrate),
        machine_layout(machine),
        published.append,
    )
    pump.start()
    journal = ("--journal", str(tmp_path / "stream.json"))
    with running(
        clock, "stream", str(file), "--machine", str(MILL), *journal, name="stream"
    ) as command:
        assert command.wait(WAIT_S) == 0, command.err
    pump.close()
    rows = [message for message in published if message["type"] == "rows"]
    moving = [
        contour
        for row in rows
        for contour, feed in zip(row["contour"][1], row["feed"][0], strict=True)
        if feed is not None and feed > 1.0
    ]
    assert len(moving) > 50
    assert all(contour is not None and contour < 100.0 for contour in moving)
    assert max(moving) > 0.01


def test_a_long_job_goes_on_as_another_one_of_the_controller(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a rest after so much of it on; a controller takes no job of 4 km."""
    monkeypatch.setattr(chunks, "ENOUGH_Q40", 20 << 40)
    file = tmp_path / "part.ngc"
    file.write_text(JOB)
    journal = tmp_path / "stream.json"
    words = ("stream", str(file), "--machine", str(MILL), "--journal", str(journal))
    assert main(words) == 0
    assert _at_the_end(bench)
    kept = json.loads(journal.read_text())
    assert (kept["first"], kept["section"], kept["done"]) == (2, 2, True)
    assert stream_status(bench.controller).job == kept["job0"] + 2


@pytest.mark.parametrize("index", [STATE, STREAM])
def test_a_lost_answer_does_not_end_a_job(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, index: int
) -> None:
    """An answer to a read, lost while the axes move; no chunk is on its way."""
    file = tmp_path / "part.ngc"
    file.write_text(JOB)
    put, lost = _Answers.put, list[bytes]()

    def once(self: _Answers, answer: bytes) -> None:
        if answer[0] & 0xE0 == 0x40 and answer[1:3] == index.to_bytes(2, "little"):
            lost.append(answer)
            if len(lost) == 40:
                return
        put(self, answer)

    monkeypatch.setattr(_Answers, "put", once)
    journal = ("--journal", str(tmp_path / "stream.json"))
    assert main(["stream", str(file), "--machine", str(MILL), *journal]) == 0
    assert len(lost) > 40
    monkeypatch.undo()
    assert _at_the_end(bench)
