# SPDX-License-Identifier: MIT
"""Six axes whose plan uses velocity, acceleration and jerk of each in turn: on the bus, with commands at any instant,
every tick keeps the limits and the axes stay together. Run by pytest; starts a controller and drives on a local bus,
and writes to temporary folders.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bench import Bench, MakeBench
from hodograph.bus.capture.decode import decode_ticks
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.sdo.controller import HELD, READY, CommandRefusedError
from hodograph.bus.sdo.objects import HOLD, RESUME, STOP
from hodograph.bus.sdo.status import snapshot
from hodograph.native import NativeProgram
from hodograph.pipeline import Pipeline, load_pipeline
from marks import long
from six_axes import NAMES, Limits, six_axis_machine, six_axis_path

LIMITS: dict[str, Limits] = dict.fromkeys(("x", "y", "z"), (60.0, 600.0, 20000.0)) | {
    "a": (40.0, 400.0, 15000.0),
    "b": (60.0, 600.0, 20000.0),
    "c": (90.0, 900.0, 30000.0),
}
RESERVE = 0.2
COMMANDS = 25
STEPS = 400_000
"""Of the table of the path's points; 0.2 um each."""
ASIDE = np.array([2e-6] * 3 + [5e-5] * 3)
"""Counts of 1 nm and 1e-5 degrees, the kernel, and the chords of the table."""


@dataclass(frozen=True)
class Swings:
    """A path on which each axis swings in turn, while the others drift by up to `drift`; mm and degrees.

    most    way of each axis, long enough to reach its velocity
    shares  of this way, of each step
    """

    most: tuple[float, ...]
    shares: tuple[float, ...]
    drift: float


FORTH = Swings((17.0, 17.0, 17.0, 14.0, 20.0, 34.0), (0.5, 0.5), 0.5)
FORTH_AND_BACK = Swings((24.0, 24.0, 24.0, 20.0, 28.0, 48.0), (0.5, 0.5, -0.35), 1.0)


def points_of(swings: Swings) -> list[list[float]]:
    rng = random.Random(5)
    at, points = [0.0] * 6, [[0.0] * 6]
    for k, most in enumerate(swings.most):
        for share in swings.shares:
            at = [one + rng.uniform(-swings.drift, swings.drift) for one in at]
            at[k] += share * most
            if k >= 3:  # the tool moves on
                at[0] += 2.0
                at[1] += 1.5
            points.append([round(one, 4) for one in at])
    return points


@pytest.fixture
def pipeline(request: pytest.FixtureRequest, tmp_path: Path) -> Pipeline:
    """Of the swings that the parameter of a test gives."""
    machine = six_axis_machine(tmp_path, LIMITS, stop_time_ms=5000)
    path = six_axis_path(tmp_path, machine, points_of(request.param))
    return load_pipeline(path, allow_space=True)


@pytest.mark.parametrize("pipeline", [FORTH, long(FORTH_AND_BACK)], indirect=True)
def test_the_plan_uses_all_limits_of_all_axes(pipeline: Pipeline) -> None:
    setpoints = NativeProgram(pipeline.image).setpoints("fixed", pipeline.machine.path_counts)[1]
    used = shares(pipeline, setpoints)
    assert used.max() <= 1.0
    assert used[:, 0].min() > 0.99
    assert used[:, 1].min() > 0.95 * (1.0 - RESERVE)
    assert used[:, 2].min() > 0.8 * (1.0 - RESERVE)  # less the rounding of a third difference


def shares(pipeline: Pipeline, targets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Greatest share (6, 3) of each limit, as differences of counts show it; rounding is no part of it."""
    period_s = pipeline.machine.period_us * 1e-6
    out = np.zeros((6, 3))
    for axis, (name, counts) in enumerate(zip(NAMES, pipeline.machine.path_counts, strict=True)):
        for order, limit in enumerate(LIMITS[name], start=1):
            most = np.abs(np.diff(targets[:, axis].astype(np.float64), order)).max(initial=0.0)
            out[axis, order - 1] = (most - 2.0 ** (order - 1)) / (limit * period_s**order * counts)
    return out


@pytest.mark.parametrize(
    ("pipeline", "seed"),
    [(FORTH, 0), *(long(FORTH_AND_BACK, seed) for seed in range(6))],
    indirect=["pipeline"],
)
def test_commands_at_any_instant(make_bench: MakeBench, pipeline: Pipeline, seed: int) -> None:
    bench = make_bench(file=pipeline.machine.file)
    bench.controller.upload(pipeline.image)
    bench.controller.enable()
    recorder = Recorder(bench.bus)
    bench.clock.sleep(0.02)
    bench.controller.start()
    rng = random.Random(seed)
    for _ in range(COMMANDS):
        bench.clock.sleep(rng.choice([0.002, 0.01, 0.05, 0.1, 0.3, 0.6]))
        command_any(bench, rng)
    finish(bench)
    recorder.stop()
    targets = decode_ticks(recorder.so_far(), bench.machine.nodes).targets
    assert shares(pipeline, targets).max() <= 1.0
    places = np.unique(targets, axis=0)[::11] / np.array(bench.machine.path_counts)
    assert (aside(pipeline, places) <= ASIDE).all()
    assert places[0].tolist() == [0.0] * 6


def command_any(bench: Bench, rng: random.Random) -> None:
    """A command that the state allows; those that come too late for it are refused."""
    controller = bench.controller
    state = controller.state()
    if state == READY:
        go_on(bench)
        return
    kind = (
        "resume" if state == HELD else rng.choice(["override", "override", "hold", "stop", "both"])
    )
    try:
        if kind == "override":
            controller.override(rng.choice([0, 10, 50, 73, 100, 150, 200]))
        elif kind in ("hold", "both"):
            controller.command(HOLD)
        elif kind == "stop":
            controller.command(STOP)
        if kind in ("resume", "both"):
            controller.command(RESUME)
    except CommandRefusedError:
        assert kind != "override"


def go_on(bench: Bench) -> bool:
    """Starts where the axes stand; whether the path was left to go."""
    found = snapshot(bench.controller)
    at_mm, length_mm = found.motion.arc_length_mm, found.program.length_mm
    if at_mm >= length_mm - 1e-9:
        return False
    bench.controller.start(from_mm=at_mm)
    return True


def finish(bench: Bench) -> None:
    """To the end of the path, whatever was commanded before."""
    bench.controller.override(100)
    while True:
        if bench.controller.wait_for((READY, HELD), 60.0) == HELD:
            bench.controller.command(RESUME)
        elif not go_on(bench):
            return


def aside(pipeline: Pipeline, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Greatest distance (6,) of places from the path, of all axes at the point that is nearest in space."""
    curve = pipeline.curve
    table = np.asarray(curve.axes_point(np.linspace(0.0, curve.length_mm, STEPS)))
    worst = np.zeros(6)
    nearest = np.asarray(cKDTree(table[:, :3]).query(places[:, :3])[1])
    for place, near in zip(places, nearest, strict=True):
        first, second = table[max(near - 1, 0)], table[min(near + 1, STEPS - 1)]
        chord = second - first
        share = float(np.dot(place[:3] - first[:3], chord[:3]) / np.dot(chord[:3], chord[:3]))
        worst = np.maximum(worst, np.abs(first + share * chord - place))
    return worst
