# SPDX-License-Identifier: MIT
"""`hodograph stream` killed repeatedly at random instants: the machine comes to rest on its path, and the job
continues. Run by pytest; starts a controller, drives and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from itertools import chain
from math import inf
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from other_node import latched

from bench import EXAMPLES, MakeBench
from commands import Command, running
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.processes import CONTROLLER, find_program
from hodograph.bus.sdo.controller import Controller
from hodograph.bus.sdo.objects import MOVING
from hodograph.bus.sdo.stream_channel import ENDED, OPEN, stream_status
from hodograph.config import Machine, load_machine
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.program import encode
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.simulation import concatenated, from_rest_to_rest
from hodograph.toolpath.files import ReadOptions

pytestmark = pytest.mark.long

RING_KIB = 16
"""A ring that holds little, so that most instants are near a takeover."""
LIMIT_S = 120.0
"""Longest wait for the end of a command, and for the end of a motion."""
TRANSFER_S = 6.0
"""Time after which the controller aborts an interrupted SDO transfer and accepts another."""
NEAR_UM = 1.0
"""Greatest accepted distance of a target from the path, which is taken as straight lines between setpoints 1 ms apart.
"""
LOOK_TICKS = 400
"""Setpoints of the path among which the place of a target is searched."""


def _path_counts(file: Path, machine: Machine) -> NDArray[np.float64]:
    """The setpoints (n, A) of the job, in counts."""
    limits = NativeLimits(**asdict(program_limits(machine)) | {"stop_time_ms": 0})
    setpoints = []
    with JobPlan(JobFiles((file,), machine, 0.01, ReadOptions()), 16384, 1, Place()) as plan:
        for chunks in plan.by_job():
            for part in from_rest_to_rest(chunks):
                program = NativeProgram(encode(concatenated(part)))
                assert program.check(limits) is None
                setpoints.append(program.setpoints("fixed", _counts_per_unit(machine))[1])
    return np.concatenate(setpoints).astype(np.float64)


def _counts_per_unit(machine: Machine) -> tuple[int, ...]:
    return tuple(axis.counts_per_unit for axis in machine.path_axes)


def _off_um(
    points: NDArray[np.float64], path: NDArray[np.float64], per_um: NDArray[np.float64]
) -> float:
    """How far points (n, A) are from a path (m, A) at most, whose places they come to in order."""
    own, line, at, off = points / per_um, path / per_um, 0, 0.0
    for point in own:
        ahead = line[at : at + LOOK_TICKS]
        begin, step = ahead[:-1], np.diff(ahead, axis=0)
        length = np.maximum((step * step).sum(axis=1), 1e-12)
        share = np.clip(((point - begin) * step).sum(axis=1) / length, 0.0, 1.0)
        apart = np.linalg.norm(begin + share[:, None] * step - point, axis=1)
        nearest = int(np.argmin(apart))
        off = max(off, float(apart[nearest]))
        at = max(at, min(at + nearest, len(line) - 2))
    return off


def _await_rest(controller: Controller, clock: VirtualClock) -> None:
    clock.sleep(TRANSFER_S)
    end_s = clock.now_s() + LIMIT_S
    while controller.state() in MOVING and stream_status(controller).state in (OPEN, ENDED):
        assert clock.now_s() < end_s, "it does not come to rest"
        clock.sleep(0.02)
    clock.sleep(0.2)


def _kills(clock: VirtualClock, seed: int) -> Iterator[float]:
    """Virtual time from the start of each command to its death, s; the last one lives."""
    draw = np.random.default_rng(seed)
    yield from chain(draw.uniform(0.5, 4.0, 6), (inf,))


def _ended(command: Command, clock: VirtualClock, after_s: float) -> bool:
    """Kills it after this time, if it is still there."""
    if after_s == inf:
        assert command.wait(LIMIT_S) == 0, command.err
        return True
    end_s = clock.now_s() + after_s
    while clock.now_s() < end_s and command.child.poll() is None:
        clock.sleep(0.01)
    if command.child.poll() is None:
        command.kill()
        return False
    assert command.child.returncode == 0, command.err
    return True


@pytest.mark.parametrize("seed", [1, 2])
def test_hosts_killed_at_any_instant(
    make_bench: MakeBench,
    clock: VirtualClock,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
) -> None:
    monkeypatch.setenv("HODOGRAPH_CONTROLLER", f"{find_program(CONTROLLER)} --ring {RING_KIB}")
    file = EXAMPLES / "toolpaths" / "engraving.ngc"
    machine_file = EXAMPLES / "machines" / "mill.toml"
    machine, bench = load_machine(machine_file), make_bench(file=machine_file)
    journal = ("--journal", str(tmp_path / "stream.json"))
    words: tuple[str, ...] = (str(file), "--machine", str(machine_file))
    with Recorder(bench.bus) as recorder:
        for after_s in _kills(clock, seed):
            with running(clock, "stream", *words, *journal, "--no-stops", name="stream") as command:
                if _ended(command, clock, after_s):
                    break
            _await_rest(bench.controller, clock)
            if (tmp_path / "stream.json").exists():
                words = ("--continue",)
        frames = recorder.so_far()
    points = np.stack([latched(frames, axis.node) for axis in machine.path_axes], axis=1)
    assert stream_status(bench.controller).state == ENDED
    per_um = np.array(_counts_per_unit(machine), dtype=np.float64) * 1e-3
    assert _off_um(points.astype(np.float64), _path_counts(file, machine), per_um) < NEAR_UM
