# SPDX-License-Identifier: MIT
"""Programs in space on the bus: the controller leads all path axes, the others hold their position. Run by pytest;
starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench import EXAMPLES, Bench, MakeBench
from hodograph.bus import processes
from hodograph.bus.analysis import program_tick
from hodograph.bus.capture.decode import decode_ticks
from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.setpoint_check import find_jumps, step_limits
from hodograph.bus.goto import DETOUR_MM, LONGEST_DETOUR_MM, goto
from hodograph.bus.sdo.controller import (
    FAULT_STATE,
    HELD,
    OFF,
    READY,
    RUNNING,
    CommandRefusedError,
)
from hodograph.bus.sdo.objects import BOOT, FAULT, HOLD, PROGRAM, RESET, RESUME, STOP
from hodograph.bus.sdo.status import snapshot
from hodograph.cli.main import main
from hodograph.config import Machine
from hodograph.errors import RefusedError
from hodograph.feed import ControllerLimits
from hodograph.machine_limits import program_limits
from hodograph.native import Contour, NativeLimits, NativeProgram
from hodograph.native.program import counts_from_q40_mm
from hodograph.program import encode
from marks import long
from spatial_image import add_extra, chain, feed_along, image, wandering

MILL = EXAMPLES / "machines" / "mill.toml"
FIVE_AXES = EXAMPLES / "machines" / "mill_five_axes.toml"
CONTROLLER = ControllerLimits(200.0, 1000.0, 20000.0, 0.1)
FEED_MM_S, RAMP_S = 40.0, 0.3
ON_PATH_UM = 0.002
"""Rounding to counts of 1 nm, and the kernel's nanometre."""
WAIT_S = 60.0


def made_for(machine: Machine, extras: int = 0) -> bytes:
    """A curve that turns in all directions, from the origin, where simulated drives stand."""
    segments = chain(wandering(4, 12.0, bend=0.3), [0, 0, 0])
    for k in range(extras):
        add_extra(segments, 10.0 + 5 * k, 60.0, 0.0)
    feed = feed_along(segments, FEED_MM_S, RAMP_S, CONTROLLER, machine.period_us)
    whole = image(segments, feed)
    assert NativeProgram(whole).check(NativeLimits(**vars(program_limits(machine)))) is None
    return whole


def setpoints_of(whole: bytes, machine: Machine) -> NDArray[np.int32]:
    """The setpoints of the drives, by axis, each in its own counts."""
    program = NativeProgram(whole)
    points = program.points("fixed", program.tick_times_q42_s())["position_q40"]
    columns = [
        counts_from_q40_mm(points[:, i], axis.counts_per_unit)
        for i, axis in enumerate(machine.path_axes[: program.axis_count])
    ]
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Started:
    """A machine that runs a program."""

    bench: Bench
    recorder: Recorder
    whole: bytes

    def frames(self) -> Frames:
        """All that was on the bus since the start."""
        self.recorder.stop()
        return self.recorder.so_far()


def started(bench: Bench, whole: bytes) -> Started:
    bench.controller.upload(whole)
    bench.controller.enable()
    recorder = Recorder(bench.bus)
    bench.clock.sleep(0.02)
    bench.controller.start()
    return Started(bench, recorder, whole)


def on_path(frames: Frames, machine: Machine, whole: bytes) -> NDArray[np.int32]:
    """The targets of the recording, none of which jumps or is beside the curve."""
    program = NativeProgram(whole)
    expected = setpoints_of(whole, machine)
    assert find_jumps(frames, machine.nodes, step_limits(machine, expected)) == []
    targets = decode_ticks(frames, machine.nodes).targets
    points = program.points("double", program.tick_times_q42_s())
    contour = Contour(program)
    nodes = points["position_q40"][:, :3] * 2.0**-40
    for place in np.unique(targets[:, :3], axis=0)[::7] / machine.counts_per_mm:
        near = int(np.argmin(np.sum((nodes - place) ** 2, axis=1)))
        arc_mm = float(points["arc_length_q40_mm"][near]) * 2.0**-40
        assert contour.distance_mm(arc_mm, *place) * 1000 <= ON_PATH_UM
    return targets


def test_all_axes_follow_the_path(make_bench: MakeBench) -> None:
    bench = make_bench(file=MILL)
    whole = made_for(bench.machine)
    run = started(bench, whole)
    status = snapshot(bench.controller)
    bench.controller.wait_for((READY,), WAIT_S)
    bench.clock.sleep(0.3)
    frames = run.frames()
    expected = setpoints_of(whole, bench.machine)
    assert expected.shape[1] == 3
    assert np.ptp(expected, axis=0).min() > 1_000_000  # every axis moves
    targets = on_path(frames, bench.machine, whole)
    first = program_tick(targets, expected)
    assert first is not None
    reached = decode_ticks(frames, bench.machine.nodes).actual[first + 2 :][: len(expected)]
    arcs = NativeProgram(whole).points("fixed", NativeProgram(whole).tick_times_q42_s())
    errors_um = Contour(NativeProgram(whole)).errors_um(
        arcs["arc_length_q40_mm"], reached, bench.machine.counts_per_mm
    )
    assert errors_um.max() < 0.1
    assert bench.controller.read(PROGRAM, 24) == 3
    ends = [bench.controller.read(PROGRAM, sub) for sub in (12, 13, 25, 14, 15, 29, 26, 30)]
    assert ends == [*expected[0].tolist(), *expected[-1].tolist(), 0, 0]
    assert len(status.axes) == 3


@pytest.mark.parametrize("at_s", [0.05, 0.31, 0.9])
@pytest.mark.parametrize("command", [HOLD, STOP])
def test_hold_and_stop_end_on_the_path(make_bench: MakeBench, command: int, at_s: float) -> None:
    bench = make_bench(file=MILL)
    whole = made_for(bench.machine)
    run = started(bench, whole)
    bench.clock.sleep(at_s)
    assert bench.controller.state() == RUNNING
    bench.controller.command(command)
    bench.controller.wait_for((HELD if command == HOLD else READY,), WAIT_S)
    if command == HOLD:
        bench.clock.sleep(0.3)
        bench.controller.command(RESUME)
        bench.controller.wait_for((READY,), WAIT_S)
    targets = on_path(run.frames(), bench.machine, whole)
    end = setpoints_of(whole, bench.machine)[-1]
    assert np.array_equal(targets[-1], end) == (command == HOLD)


def test_run_gives_the_bits_of_simulate(
    make_bench: MakeBench, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """From the path file to the bus: goto in space, start, recording, analysis and report."""
    make_bench(file=MILL)
    text = (EXAMPLES / "helix.toml").read_text().replace("machines/", f"{MILL.parent}/")
    quick = 'profile = "minimax"\nnominal_mm_s = 60\nramp_time_s = 0.3'
    assert 'profile = "optimal"' in text
    text = text.replace('profile = "optimal"', quick)
    text, count = re.subn(r"\n    \[-20, 0, 5\],.*?\n\]", "\n]", text, flags=re.DOTALL)
    assert count == 1  # 135 degrees of the first turn
    text = re.sub(r"end_tangent = .*\n", "", text)
    path = tmp_path / "helix.toml"
    path.write_text(text)
    capsys.readouterr()
    words = [str(path), "--machine", str(MILL), "--json"]
    assert main(["run", *words, "--report", str(tmp_path / "report")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert main(["simulate", *words]) == 0
    expected = json.loads(capsys.readouterr().out)
    assert found["setpoints_sha256"] == expected["setpoints_sha256"]
    assert found["encoders_sha256"] == expected["encoders_sha256"]
    assert found["max_contour_error_um"] == expected["max_contour_error_um"]
    assert found["max_contour_error_um"] < 0.1
    assert (tmp_path / "report" / "helix_contour.png").is_file()
    assert main(["goto", str(MILL), "--to", "1", "2", "--z", "-3"]) == 0
    assert "at (1, 2, -3) mm" in capsys.readouterr().out


def test_five_axes_run_and_go_back_to_their_start(
    make_bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bits of simulate; then again: goto turns a and c back, though x, y, z are brought to the start as well."""
    bench = make_bench(file=FIVE_AXES)
    capsys.readouterr()
    words = [str(EXAMPLES / "five_axes.toml"), "--json"]
    assert main(["simulate", *words]) == 0
    expected = json.loads(capsys.readouterr().out)
    for _ in range(2):
        assert main(["run", *words]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["setpoints_sha256"] == expected["setpoints_sha256"]
        assert found["c_max_error_deg"] < 1e-3
    status = snapshot(bench.controller)
    assert status.axes[4].actual_mm == pytest.approx(360.0, abs=1e-3)


RULES = [
    "fault node=4 code=0x5400",
    "restart node=4",
    "stop node=4",
    "encoder-fault node=4",
    "encoder-jump node=4 counts=30000000",
    "limit-switch node=4 side=positive for=100000",
]


AT = (1, 2, 150, 700)
# `make test` has each fault at two instants, and each instant with three faults.
FAULTS = [
    (rule, at) if (i + k) % 2 == 0 else long(rule, at)
    for i, rule in enumerate(RULES)
    for k, at in enumerate(AT)
]


@pytest.mark.parametrize(("rule", "at"), FAULTS)
def test_the_third_drive_fails(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, rule: str, at: int
) -> None:
    """At any instant: no setpoint jumps or leaves the curve, the machine stands in fault, and a reset ends that."""
    file = tmp_path / "rules"
    file.write_text(f"{rule} at={at}\n")
    plain = processes.drive_command
    monkeypatch.setattr(
        processes, "drive_command", lambda *given: [*plain(*given), "--faults", str(file)]
    )
    bench = make_bench(file=MILL)
    whole = made_for(bench.machine)
    run = started(bench, whole)
    bench.controller.wait_for((FAULT_STATE, READY), WAIT_S)
    assert bench.controller.state() == FAULT_STATE
    assert bench.controller.read(FAULT, 2) == 4
    bench.clock.sleep(3.0)
    on_path_until_lost(run, bench.machine)
    bench.controller.command(RESET)
    bench.controller.wait_for((OFF, BOOT, FAULT_STATE), WAIT_S)


def on_path_until_lost(run: Started, machine: Machine) -> None:
    """No setpoint jumps; a drive that restarts follows its position again, so only the jumps are checked."""
    frames = run.frames()
    limits = step_limits(machine, setpoints_of(run.whole, machine))
    assert find_jumps(frames, machine.nodes, limits) == []


def test_axes_that_turn(make_bench: MakeBench) -> None:
    """Extra axes, each in its own counts, beside those that draw the path."""
    bench = make_bench(file=FIVE_AXES)
    whole = made_for(bench.machine, extras=2)
    run = started(bench, whole)
    bench.controller.wait_for((READY,), WAIT_S)
    bench.clock.sleep(0.3)
    targets = on_path(run.frames(), bench.machine, whole)
    expected = setpoints_of(whole, bench.machine)
    assert expected.shape[1] == 5
    assert program_tick(targets, expected) is not None
    status = snapshot(bench.controller)
    assert status.axes[4].actual_mm == pytest.approx(expected[-1, 4] / 100_000, abs=1e-4)


def test_goto_turns_axes_where_the_tool_stands(make_bench: MakeBench) -> None:
    """Without a way of x, y, z: a little way of x, and back."""
    bench = make_bench(file=FIVE_AXES)
    bench.controller.enable()
    counts = bench.machine.path_counts
    for a, c in ((-90.0, 720.0), (0.0, 0.0)):
        end = [0, 0, 0, round(a * counts[3]), round(c * counts[4])]
        way_mm = goto(bench.controller, bench.machine, end, unhomed=True)
        assert 2 * DETOUR_MM <= way_mm <= 2 * LONGEST_DETOUR_MM
        assert list(bench.controller.targets(5)) == end


def test_a_program_with_fewer_axes_leaves_the_others(make_bench: MakeBench) -> None:
    bench = make_bench(file=MILL)
    segments = chain(wandering(4, 12.0, bend=0.3), [0, 0, 0])
    whole = encode(feed_along(segments, FEED_MM_S, RAMP_S, CONTROLLER))
    run = started(bench, whole)
    bench.controller.wait_for((READY,), WAIT_S)
    bench.clock.sleep(0.3)
    targets = decode_ticks(run.frames(), bench.machine.nodes).targets
    assert program_tick(targets[:, :2], setpoints_of(whole, bench.machine)) is not None
    assert np.ptp(targets[:, 2]) == 0


def test_more_axes_than_configured_are_refused(make_bench: MakeBench) -> None:
    bench = make_bench(file=MILL)
    whole = made_for(bench.machine)
    bench.controller.upload(whole)
    two = replace(bench.machine, axes=bench.machine.axes[:2], path_count=2)
    bench.controller.configure(two, "fixed")
    bench.controller.wait_for((OFF,), WAIT_S)
    with pytest.raises(RefusedError, match="axis count"):
        bench.controller.upload(whole)
    bench.controller.enable()
    with pytest.raises(CommandRefusedError, match="more path axes than are configured"):
        bench.controller.start()
