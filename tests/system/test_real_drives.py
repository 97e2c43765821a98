# SPDX-License-Identifier: MIT
"""Drives that name a vendor in 0x1018: what simulated ones are spared."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from neighbour import flood, neighbour, real_drives, runs_again, settled

from bench import PAPER_ALPHA, Bench, MakeAlpha, MakeBench
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.listening.recorder import Recorder
from hodograph.bus.listening.setpoint_check import find_jumps, step_limits
from hodograph.bus.sdo.controller import FAULT_STATE, READY, RUNNING
from hodograph.bus.sdo.objects import FAULT, TIMING
from hodograph.cli.main import main
from hodograph.config import load_machine

SYNC_GAP = 0xFF09
LOST = 0x8250


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


@pytest.mark.parametrize(
    ("seconds", "outcome", "late"),
    [
        (0.0005, (READY, 0), False),
        (0.0015, (READY, 0), True),
        (0.003, (READY, 0), True),
        (0.006, (FAULT_STATE, LOST), True),
        (0.15, (FAULT_STATE, LOST), False),
    ],
)
def test_a_bus_full_of_frames_of_higher_priority(
    real: Bench,
    hub: LocalHub,
    alpha_at: MakeAlpha,
    seconds: float,
    outcome: tuple[int, int],
    late: bool,
) -> None:
    """Up to 5 ms without an answer are borne. The SYNCs of that time go before the setpoints that wait with them:
    `late` says that a step is made of two, which the check of a recording finds. docs/reference/bus-time.md.
    """
    path = str(alpha_at(10))
    recorder = Recorder(real.bus)
    begin(path, real, 1.0)
    with neighbour(hub) as other:
        flood(other, 0x001, seconds)
        real.clock.sleep(seconds)
    assert settled(real)[:2] == outcome
    found = find_jumps(recorder.so_far(), real.machine.nodes, step_limits(real.machine))
    recorder.stop()
    assert bool(found) == late
    assert all(jump.sync - found[0].sync <= 10 for jump in found)
    runs_again(path)


def test_virtual_time_keeps_ticks(real: Bench) -> None:
    assert real.controller.read(TIMING) == 0
