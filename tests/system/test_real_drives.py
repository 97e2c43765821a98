# SPDX-License-Identifier: MIT
"""Drives with a vendor in 0x1018: checks that simulated drives do not need. Run by pytest; starts a controller and
drives on a local bus.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from other_node import flood, latched, other_node, real_drives, runs_again, settled

from bench import PAPER_ALPHA, Bench, MakeAlpha, MakeBench
from boards import EMULATE
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.setpoint_check import find_jumps, step_limits
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.controller import FAULT_STATE, READY, RUNNING
from hodograph.bus.sdo.objects import FAULT, TIMING
from hodograph.cli.main import main
from hodograph.config import load_machine

SYNC_GAP = 0xFF09


@pytest.fixture
def real(hub: LocalHub, clock: VirtualClock) -> Iterator[Bench]:
    with real_drives(hub, load_machine(PAPER_ALPHA)) as bench:
        yield bench


def begin(path: str, bench: Bench, seconds: float) -> None:
    """Half a program, seen from its start."""
    assert main(["goto", path]) == 0
    assert main(["start"]) == 0
    bench.clock.sleep(seconds)
    assert bench.controller.state() == RUNNING


@pytest.mark.parametrize("gap_s", [0.003, 0.010, 0.150])
def test_a_gap_of_syncs_is_a_fault(
    real: Bench, clock: VirtualClock, alpha_at: MakeAlpha, gap_s: float
) -> None:
    path = str(alpha_at(20))
    begin(path, real, 2.0)
    clock.suspend("controller-1")
    clock.sleep(gap_s)
    clock.resume("controller-1")
    assert settled(real) == (FAULT_STATE, SYNC_GAP, 0)
    assert real.controller.read(FAULT, 3) == pytest.approx(gap_s * 1e6, abs=1500)
    runs_again(path)


def test_a_late_sync_is_none(real: Bench, clock: VirtualClock, alpha_at: MakeAlpha) -> None:
    begin(str(alpha_at(20)), real, 2.0)
    for _ in range(5):
        clock.suspend("controller-1")
        clock.sleep(0.001)
        clock.resume("controller-1")
        clock.sleep(0.1)
    assert settled(real) == (READY, 0, 0)


def test_simulated_drives_bear_it(
    make_bench: MakeBench, clock: VirtualClock, alpha_at: MakeAlpha
) -> None:
    bench = make_bench()
    begin(str(alpha_at(20)), bench, 2.0)
    clock.suspend("controller-1")
    clock.sleep(0.150)
    clock.resume("controller-1")
    assert settled(bench) == (READY, 0, 0)


FEED_COUNTS = 40_000
"""Distance of 1 ms at 40 mm/s: the largest step of a setpoint from one SYNC to the next."""


def full_bus(bench: Bench, hub: LocalHub, path: str, seconds: float) -> tuple[int, int]:
    """A bus that is full of higher priority in the middle of a program, and what comes of it; no drive may make the way
    of two periods at any SYNC.
    """
    recorder = Recorder(bench.bus)
    begin(path, bench, 1.0)
    with other_node(hub) as other:
        flood(other, 0x001, seconds)
        bench.clock.sleep(seconds)
    outcome = settled(bench)[:2]
    frames = recorder.so_far()
    recorder.stop()
    assert find_jumps(frames, bench.machine.nodes, step_limits(bench.machine)) == []
    ways = [np.abs(np.diff(latched(frames, node))).max() for node in bench.machine.nodes]
    assert FEED_COUNTS / 2 < max(ways) <= FEED_COUNTS + 2
    return outcome


@pytest.mark.parametrize(
    ("seconds", "outcome"),
    [
        (0.0005, (READY, 0)),
        (0.0015, (READY, 0)),
        (0.003, (FAULT_STATE, SYNC_GAP)),
        (0.006, (FAULT_STATE, SYNC_GAP)),
        (0.15, (FAULT_STATE, SYNC_GAP)),
    ],
)
def test_a_bus_full_of_frames_of_higher_priority(
    real: Bench, hub: LocalHub, alpha_at: MakeAlpha, seconds: float, outcome: tuple[int, int]
) -> None:
    """SYNC waits for the setpoints that wait with it, and program time for both, as far as a gap of SYNC may last."""
    path = str(alpha_at(40))
    assert full_bus(real, hub, path, seconds) == outcome
    runs_again(path)


@pytest.mark.parametrize("phase_us", range(0, 1000, 125))
def test_a_bus_that_is_full_from_any_instant_on(
    real: Bench, hub: LocalHub, clock: VirtualClock, alpha_at: MakeAlpha, phase_us: int
) -> None:
    """For one and a half periods: it begins before SYNC, between SYNC and setpoints, between these, and after them."""
    clock.sleep(phase_us * 1e-6)
    state, _ = full_bus(real, hub, str(alpha_at(40)), 0.0015)
    assert state in (READY, FAULT_STATE)


@pytest.mark.parametrize(("seconds", "state"), [(0.0015, READY), (0.006, FAULT_STATE)])
def test_a_board_waits_too(
    hub: LocalHub,
    monkeypatch: pytest.MonkeyPatch,
    alpha_at: MakeAlpha,
    seconds: float,
    state: int,
) -> None:
    monkeypatch.setenv("HODOGRAPH_CONTROLLER", f"{EMULATE} an386")
    with real_drives(hub, load_machine(PAPER_ALPHA)) as bench:
        assert full_bus(bench, hub, str(alpha_at(40)), seconds)[0] == state


def test_virtual_time_keeps_ticks(real: Bench) -> None:
    assert real.controller.read(TIMING) == 0
