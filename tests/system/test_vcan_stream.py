# SPDX-License-Identifier: MIT
"""Real faults during `hodograph stream` on the CAN of the kernel: the host killed, the host stopped for a while, the
interface down. The machine rests on its path, and `--continue` finishes the job.

Times are real and at the fast pace, so nothing here is judged by them. Run by pytest on vcan0; starts a controller,
drives and `hodograph`, sets vcan0 down and up, and writes to temporary folders.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from other_node import latched

from bench import EXAMPLES, VCAN0, Bench, MakeBench, patient_machine
from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.processes import CONTROLLER, find_program
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.objects import MOVING
from hodograph.bus.sdo.stream_channel import ENDED, OPEN, stream_status
from hodograph.config import load_machine

pytestmark = pytest.mark.bus

MILL = EXAMPLES / "machines" / "mill.toml"
LIMIT_S = 240.0
"""Of real time: no test is judged by it, one that hangs ends by it."""
COUNTS_PER_MM = 1_000_000
CORNERS = ((0, 0, 0), (4, 0, 0), (4, 5, 0), (0, 0, -2))
"""Exact stops at each; the second side takes 1.7 s."""
PART = "F6000\nG61\nG1 X4\nG4 P0.1\nF180\nG1 Y5\nF6000\nG1 X0 Y0 Z-2\nM2\n"
LONG_PART = PART.replace("Y5", "Y90").replace("F180", "F360")
REFUSED = 5
STANDS_TICKS = 500


class Host:
    """`hodograph stream` as a process, and the machine that it moves."""

    def __init__(self, folder: Path, corners: tuple[tuple[float, ...], ...], text: str) -> None:
        self.file, self.journal = folder / "part.ngc", folder / "stream.json"
        self.file.write_text(text)
        self.machine = patient_machine(MILL, folder)
        self.corners = np.array(corners) * COUNTS_PER_MM

    @contextmanager
    def running(self, *words: str) -> Iterator[subprocess.Popen[str]]:
        """The job from its start, or what these words say; gone with the context."""
        child = self._start(*words)
        try:
            yield child
        finally:
            child.kill()
            child.communicate(timeout=LIMIT_S)

    def _start(self, *words: str) -> subprocess.Popen[str]:
        words = words or (str(self.file), "--machine", str(self.machine))
        command = [
            sys.executable,
            "-m",
            "hodograph",
            "stream",
            *words,
            "--journal",
            str(self.journal),
        ]
        return subprocess.Popen(
            [*command, "--bus", str(VCAN0)],
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def expect_on_path(self, frames: Frames, nodes: tuple[int, ...]) -> None:
        """All setpoints are on the lines between the corners, and no axis is faster than it may be."""
        machine = load_machine(MILL)
        points = np.stack([latched(frames, node) for node in nodes], axis=1).astype(float)
        off = np.full(len(points), np.inf)
        for a, b in zip(self.corners[:-1], self.corners[1:], strict=True):
            share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            off = np.minimum(off, np.linalg.norm(points - (a + share[:, None] * (b - a)), axis=1))
        assert off.max() <= 4.0  # nm
        for axis, one in enumerate(machine.axes[: len(nodes)]):
            speed = np.abs(np.diff(points[:, axis])).max()
            bend = np.abs(np.diff(points[:, axis], 2)).max()
            assert speed <= one.velocity_mm_s * 1000 + 2
            assert bend <= one.acceleration_mm_s2 + 4


def _until(happened: Callable[[], bool]) -> None:
    end_s = time.monotonic() + LIMIT_S
    while not happened():
        assert time.monotonic() < end_s, "it hangs"
        time.sleep(0.01)


def _await_y(bench: Bench, child: subprocess.Popen[str], mm: float) -> None:
    def there() -> bool:
        assert child.poll() is None, child.stderr and child.stderr.read()
        return bench.controller.targets(2)[1] > mm * COUNTS_PER_MM

    _until(there)


def _await_rest(bench: Bench) -> list[int]:
    """At the end of a tail, or of the job."""
    controller = bench.controller

    def rests() -> bool:
        moving = controller.state() in MOVING
        return not moving or stream_status(controller).state not in (OPEN, ENDED)

    _until(rests)
    at = controller.targets(3)
    first = controller.statistics()["syncs"]
    _until(lambda: controller.statistics()["syncs"] > first + 50)
    assert controller.targets(3) == at
    return at


def _stands(recorder: Recorder, nodes: tuple[int, ...]) -> bool:
    """For longer than a dwell. By the setpoints: the stopped host has the lock of the controller's SDO channel."""
    frames = recorder.so_far()
    return not any(np.diff(latched(frames, node)[-STANDS_TICKS:]).any() for node in nodes)


def _ended(child: subprocess.Popen[str], status: int = 0) -> str:
    _, err = child.communicate(timeout=LIMIT_S)
    assert child.returncode == status, err
    return err


def _killed_and_stopped(bench: Bench, host: Host, kill_mm: float, stop_mm: float) -> None:
    nodes = bench.machine.nodes[:3]
    with Recorder(VCAN0) as recorder:
        with host.running() as child:
            _await_y(bench, child, kill_mm)
            child.send_signal(signal.SIGKILL)
            child.communicate(timeout=LIMIT_S)
        assert _await_rest(bench) != host.corners[-1].tolist()
        with host.running("--continue") as child:
            _await_y(bench, child, stop_mm)
            child.send_signal(signal.SIGSTOP)
            _until(lambda: _stands(recorder, nodes))
            assert latched(recorder.so_far(), nodes[2])[-1] != host.corners[-1][2]  # still to come
            child.send_signal(signal.SIGCONT)
            _ended(child)
        frames = recorder.so_far()
        assert recorder.dropped == 0
    assert stream_status(bench.controller).state == ENDED
    assert bench.controller.targets(3) == host.corners[-1].tolist()
    host.expect_on_path(frames, nodes)


def test_a_host_that_is_killed_and_one_that_stops(
    make_bench: MakeBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ring of 12 KiB holds few of the sections: at any load most of them have not been sent when the host goes."""
    monkeypatch.setenv("HODOGRAPH_CONTROLLER", f"{find_program(CONTROLLER)} --ring 12")
    corners = [(0.0, 0.0, 0.0), *((4.0 - k % 2, 0.4 * k, 0.0) for k in range(28)), (0.0, 0.0, -2.0)]
    moves = "\n".join(f"G1 X{x:g} Y{y:g} Z{z:g}" for x, y, z in corners[1:])
    host = Host(tmp_path, tuple(corners), f"F6000\nG61\n{moves}\nM2\n")
    _killed_and_stopped(make_bench("fast", host.machine), host, 0.3, 2.5)


@pytest.mark.long
def test_the_same_of_a_longer_job(make_bench: MakeBench, tmp_path: Path) -> None:
    corners = ((0, 0, 0), (4, 0, 0), (4, 90, 0), (0, 0, -2))
    host = Host(tmp_path, corners, LONG_PART)
    _killed_and_stopped(make_bench("fast", host.machine), host, 20.0, 40.0)


@contextmanager
def _simulated(machine: Path) -> Iterator[subprocess.Popen[str]]:
    words = [sys.executable, "-m", "hodograph", "rig", str(machine), "--pace", "fast"]
    with subprocess.Popen([*words, "--bus", str(VCAN0)], stderr=subprocess.PIPE, text=True) as rig:
        assert rig.stderr is not None
        assert "are on " in rig.stderr.readline()
        try:
            yield rig
        finally:
            rig.send_signal(signal.SIGINT)
            rig.communicate(timeout=LIMIT_S)


def _link(state: str) -> None:
    subprocess.run(["ip", "link", "set", "vcan0", state], check=True)


@pytest.mark.long
@pytest.mark.skipif(os.geteuid() != 0, reason="only root may take the interface down")
def test_an_interface_that_goes_down_and_a_machine_that_has_lost_its_place(tmp_path: Path) -> None:
    """The processes of the machine end with it, and with them job and positions. The new machine stands at 0: the job
    is refused until the axes are back on the path, and goes on there.
    """
    host = Host(tmp_path, CORNERS, PART)
    with _simulated(host.machine) as rig, connect(VCAN0, 1, 1_000_000) as controller:
        controller.require(LIMIT_S)
        with host.running() as child:
            _until(lambda: child.poll() is not None or controller.targets(2)[1] > COUNTS_PER_MM)
            _link("down")
            try:
                assert "vcan0" in _ended(child, 4)
                rig.wait(LIMIT_S)
            finally:
                _link("up")
    with _simulated(host.machine):
        with host.running("--continue") as child:
            refused = _ended(child, REFUSED)
        way_back = re.search(r"hodograph (goto .*), then hodograph stream --continue", refused)
        assert way_back is not None, refused
        goto = [sys.executable, "-m", "hodograph", *way_back[1].split(), "--bus", str(VCAN0)]
        subprocess.run(goto, check=True, timeout=LIMIT_S)
        with Recorder(VCAN0) as recorder, connect(VCAN0, 1, 1_000_000) as controller:
            with host.running("--continue") as child:
                said = _ended(child)
            assert "no longer knows the job" in said
            assert controller.targets(3) == host.corners[-1].tolist()
            frames = recorder.so_far()
        host.expect_on_path(frames, load_machine(MILL).nodes[:3])
