# SPDX-License-Identifier: MIT
"""Shutdown of a moving machine at several instants of a time-optimal program: by one and by two signals, and by the
loss of its host.

The test reads the frames on the bus: the setpoints stop changing within the bound of the stop, or the drives get a
quick stop. A drive whose axis moves is never switched off. Run by pytest; starts a controller and drives on a local
bus.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import dataclass

import can
import numpy as np
import pytest
from canopen_bench import NOTHING
from numpy.typing import NDArray

from bench import EXAMPLES, Bench, MakeBench
from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.sdo.controller import FAULT_STATE
from hodograph.bus.sdo.objects import FAULT
from hodograph.cli.main import main
from hodograph.pipeline import load_pipeline
from hodograph.program import Program
from marks import every

HEART = str(EXAMPLES / "heart_optimal.toml")
PAPER_HEART = EXAMPLES / "machines" / "paper_heart.toml"
NODES = (2, 3)
ENABLE_VOLTAGE, QUICK_STOP = 0x0002, 0x0002
STATE_BITS, POWERED = 0x6F, (0x27, 0x07)
"""Of the statusword: Operation enabled, Quick stop active. A drive ends its quick stop by itself."""
STANDS_COUNTS = 2000
"""2 um: the axis may still settle by this much."""
LATE_US = 7000
"""One cycle of the main loop, and the ticks until its controlword is on the bus."""


@dataclass(frozen=True)
class AxisFrames:
    """The commands to one axis and the answers of its drive, in time order; times in us."""

    reported_us: NDArray[np.int64]
    word: NDArray[np.int64]
    target: NDArray[np.int64]
    answered_us: NDArray[np.int64]
    status: NDArray[np.int64]
    position: NDArray[np.int64]

    def would_coast_at(self, time_us: int) -> bool:
        """Whether the drive has power on at this instant, and its axis moves, or has just before."""
        before = int(np.searchsorted(self.answered_us, time_us)) - 1
        near = self.position[self.answered_us >= time_us - 20_000]
        powered = int(self.status[before]) & STATE_BITS in POWERED
        return powered and int(np.ptp(near)) > STANDS_COUNTS

    def first_us(self, value: int, after_us: int) -> int | None:
        """When this controlword was sent for the first time after an instant."""
        found = np.flatnonzero((self.word == value) & (self.reported_us >= after_us))
        return int(self.reported_us[found[0]]) if found.size else None

    def last_step_us(self, after_us: int) -> int:
        """When its target changed last while its controlword was that of operation."""
        follows = (self.word[1:] & 0x0F) == 0x0F
        steps = np.flatnonzero((np.diff(self.target) != 0) & follows)
        return max(int(self.reported_us[steps[-1] + 1]), after_us) if steps.size else after_us


def axis_frames(frames: Frames, node: int) -> AxisFrames:
    """The part of a recording that is about one axis."""

    def of(identifier: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        at = (frames["id"] == identifier + node) & (frames["length"] >= 6)
        data = np.ascontiguousarray(frames["data"][at])
        words = data[:, 0].astype(np.int64) | data[:, 1].astype(np.int64) << 8
        values = np.ascontiguousarray(data[:, 2:6]).view("<i4")[:, 0].astype(np.int64)
        return frames["time_us"][at].astype(np.int64), words, values

    reported_us, word, target = of(0x200)
    return AxisFrames(reported_us, word, target, *of(0x180))


def never_coasts(frames: Frames) -> None:
    """Asserts that no drive whose axis moves is commanded to take its power away."""
    for node in NODES:
        axis = axis_frames(frames, node)
        falls = np.flatnonzero(
            (axis.word[1:] & ENABLE_VOLTAGE == 0) & (axis.word[:-1] & ENABLE_VOLTAGE != 0)
        )
        for at in falls:
            time_us = int(axis.reported_us[at + 1])
            assert not axis.would_coast_at(time_us), f"node {node} is switched off while it moves"


@dataclass(frozen=True)
class Way:
    """A heart at its limits, under way; its recorder listens."""

    bench: Bench
    recorder: Recorder

    @property
    def clock(self) -> VirtualClock:
        assert isinstance(self.bench.clock, VirtualClock)
        return self.bench.clock

    def now_us(self) -> int:
        """In the time of recordings."""
        return self.clock.stamp_ns() // 1000

    def frames(self) -> Frames:
        """All so far."""
        return self.recorder.so_far()


@pytest.fixture
def way(make_bench: MakeBench) -> Iterator[Way]:
    bench = make_bench(file=PAPER_HEART)
    assert main(["goto", HEART]) == 0
    with Recorder(bench.bus) as recorder:
        assert main(["start"]) == 0
        yield Way(bench, recorder)


@pytest.fixture(scope="module")
def heart() -> Program:
    return load_pipeline(EXAMPLES / "heart_optimal.toml").program


def signalled(way: Way, end: signal.Signals, again_s: float | None = None) -> tuple[int, int]:
    """Sends a signal, and perhaps a second one so much later; the instant, and the controller's exit status."""
    _, controller = way.bench.rig.processes
    at_us = way.now_us()
    way.clock.signal(controller.name, controller.child, end)
    if again_s is not None:
        way.clock.sleep(again_s)
        way.clock.signal(controller.name, controller.child, end)
    status = way.clock.await_end(controller.name, controller.child, 15.0)
    way.clock.sleep(0.3)
    return at_us, status


def switched_off(frames: Frames, at_us: int) -> bool:
    """Whether both drives were commanded to switch off after an instant."""
    return all(axis_frames(frames, node).first_us(0, at_us) is not None for node in NODES)


INSTANTS_S = (0.0, 0.004, 0.03, 0.111, 0.25, 0.4, 0.585, 0.64, 0.8, 1.0, 1.2, 1.27)


@pytest.mark.parametrize("after_s", every(2, INSTANTS_S))
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_on_the_path_within_the_bound(
    way: Way, heart: Program, after_s: float, end: signal.Signals
) -> None:
    way.clock.sleep(after_s)
    at_us, status = signalled(way, end)
    frames = way.frames()
    assert status == 0
    never_coasts(frames)
    assert switched_off(frames, at_us)
    for node in NODES:
        axis = axis_frames(frames, node)
        assert axis.last_step_us(at_us) - at_us <= heart.stops.worst_us[0] + LATE_US
        assert axis.first_us(QUICK_STOP, at_us) is None


@pytest.mark.parametrize("after_s", every(3, INSTANTS_S[1:-1]))
@pytest.mark.parametrize("again_s", [0.0, 0.004, 0.02])
def test_a_second_signal_stops_quickly_at_once(way: Way, after_s: float, again_s: float) -> None:
    way.clock.sleep(after_s)
    at_us, status = signalled(way, signal.SIGTERM, again_s)
    frames = way.frames()
    assert status == 0
    never_coasts(frames)
    assert switched_off(frames, at_us)
    for node in NODES:
        reported_us = axis_frames(frames, node).first_us(QUICK_STOP, at_us)
        assert reported_us is not None
        assert reported_us - at_us <= again_s * 1e6 + LATE_US


@pytest.mark.parametrize("after_s", every(3, INSTANTS_S[1:-1]))
def test_a_closed_terminal_stops_on_the_path_also_if_it_signals_twice(
    way: Way, heart: Program, after_s: float
) -> None:
    """The shell and the kernel may each send SIGHUP."""
    way.clock.sleep(after_s)
    at_us, status = signalled(way, signal.SIGHUP, 0.004)
    frames = way.frames()
    assert status == 0
    assert switched_off(frames, at_us)
    for node in NODES:
        axis = axis_frames(frames, node)
        assert axis.last_step_us(at_us) - at_us <= heart.stops.worst_us[0] + LATE_US
        assert axis.first_us(QUICK_STOP, at_us) is None


HOST_NODE, BEAT_S, SILENT_MS = 127, 0.02, 100


@pytest.mark.parametrize("after_s", every(2, [0.02, 0.14, 0.3, 0.48, 0.7, 0.9, 1.1]))
def test_a_lost_host_stops_the_axes_on_the_path(
    make_bench: MakeBench, heart: Program, after_s: float
) -> None:
    """0x1016 names it, and it has spoken: its silence is a fault, in which every drive follows."""
    bench = make_bench(file=PAPER_HEART)
    assert main(["goto", HEART]) == 0
    bench.controller.write(0x1016, 1, HOST_NODE << 16 | SILENT_MS)
    host = LocalBus(bench.bus.channel, can_filters=NOTHING)
    beat = can.Message(arbitration_id=0x700 + HOST_NODE, data=[5], is_extended_id=False)
    with Recorder(bench.bus) as recorder:
        assert main(["start"]) == 0
        for _ in range(round(after_s / BEAT_S)):
            host.send(beat)
            bench.clock.sleep(BEAT_S)
        silent_us = bench.clock.stamp_ns() // 1000 - round(BEAT_S * 1e6)
        bench.clock.sleep(1.5)
        frames = recorder.so_far()
    host.shutdown()
    assert bench.controller.state() == FAULT_STATE
    assert [bench.controller.read(FAULT, sub) for sub in (1, 2)] == [0x8130, HOST_NODE]
    never_coasts(frames)
    assert switched_off(frames, silent_us)
    for node in NODES:
        axis = axis_frames(frames, node)
        reported_us = axis.last_step_us(silent_us) - silent_us - SILENT_MS * 1000
        assert reported_us <= heart.stops.worst_us[1] + 20_000 + LATE_US
        assert axis.first_us(QUICK_STOP, silent_us) is None
