# SPDX-License-Identifier: MIT
"""The setpoint step check: jumps are found, and motion within the limits is not reported as one. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hodograph.bus.capture.recorder import FRAME_DTYPE, Frames
from hodograph.bus.capture.setpoint_check import (
    StepLimits,
    find_jumps,
    find_rough_starts,
    require_no_jump,
    step_limits,
)
from hodograph.errors import RunError
from hodograph.native import NativeProgram
from hodograph.pipeline import load_pipeline
from marks import long

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
NODES = (2, 3)
LIMITS = StepLimits(speed=1000.0, acceleration=100.0)
ENABLED, SWITCHED_ON, OFF = 0x0F, 0x07, 0x06
OE, STANDBY = 0x1237, 0x1231


class Stream:
    """A recording in the making."""

    def __init__(self) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.syncs = 0

    def tick(self, *targets: float, control: int = ENABLED, status: int = OE) -> Stream:
        self.frames.append((0x80, bytes([self.syncs % 240 + 1])))
        self.syncs += 1
        for node, target in enumerate(targets, start=2):
            self.frames.append((0x180 + node, struct.pack("<Hi", status, 0)))
            self.frames.append((0x200 + node, struct.pack("<Hi", control, round(target))))
        return self

    def packed(self) -> Frames:
        array = np.zeros(len(self.frames), dtype=FRAME_DTYPE)
        for i, (identifier, data) in enumerate(self.frames):
            array[i]["id"], array[i]["length"] = identifier, len(data)
            array[i]["data"][: len(data)] = list(data)
        return array


def jumps(stream: Stream, limits: StepLimits = LIMITS, nodes: tuple[int, ...] = NODES) -> list[str]:
    return [f"{jump.rule}@{jump.sync}" for jump in find_jumps(stream.packed(), nodes, limits)]


def standing() -> Stream:
    return Stream().tick(0, 0).tick(0, 0)


def test_acceleration_within_the_limit() -> None:
    stream = standing()
    x = 0.0
    for k in range(1, 11):
        x += 100 * k
        stream.tick(x, 0)
    for _ in range(5):
        x += 1000
        stream.tick(x, 0)
    assert jumps(stream) == []


def test_a_step_from_rest_is_named_with_its_place() -> None:
    stream = standing().tick(0, 200).tick(0, 400)
    with pytest.raises(
        RunError, match=r"SYNC 2 of the recording, axis 1 and 2: acceleration 200\.0"
    ):
        require_no_jump(stream.packed(), NODES, LIMITS)


def test_too_fast_and_gone_back() -> None:
    stream = standing().tick(5000, 0).tick(0, 0)
    assert jumps(stream)[:2] == ["speed@2", "acceleration@2"]
    assert "speed@3" in jumps(stream)


def test_rounding_is_no_jump_but_more_is() -> None:
    limit = StepLimits(speed=1000.0, acceleration=0.0)
    assert jumps(standing().tick(4, 4), limit) == []
    assert jumps(standing().tick(5, 5), limit) == ["acceleration@2"]


def test_a_recording_that_begins_in_motion() -> None:
    stream = Stream()
    for k in range(5):
        stream.tick(900 * k, 0)
    assert jumps(stream) == []


def test_before_the_drive_follows_targets_are_free() -> None:
    stream = Stream().tick(0, 0, control=OFF, status=STANDBY)
    stream.tick(9000, 0, control=SWITCHED_ON, status=STANDBY)
    stream.tick(12000, 0, control=ENABLED, status=STANDBY)
    stream.tick(12000, 0)
    assert jumps(stream) == []


def test_a_step_as_soon_as_the_drive_follows() -> None:
    stream = Stream().tick(0, 0, control=ENABLED, status=STANDBY).tick(300, 0)
    assert jumps(stream) == ["acceleration@1"]


def test_a_start_away_from_where_the_drive_is() -> None:
    """The drives of these streams say that they are at 0."""

    def begun(x: int) -> Stream:
        stream = Stream().tick(x, 0, control=SWITCHED_ON, status=STANDBY)
        return stream.tick(x, 0, status=STANDBY).tick(x, 0).tick(x, 0)

    assert jumps(begun(5000)) == []  # which looks at steps only
    assert find_rough_starts(begun(100).packed(), NODES, 100) == []
    assert find_rough_starts(begun(-101).packed(), NODES, 100) == [
        "node 2 began to follow 101 counts from where it was"
    ]
    once = begun(101)  # the drive has reported its position once only
    del once.frames[6], once.frames[1]
    assert find_rough_starts(once.packed(), NODES, 100) == [
        "node 2 began to follow 101 counts from where it was"
    ]
    moving = Stream().tick(5000, 0).tick(5100, 0)  # begun before the recording: nobody knows
    assert find_rough_starts(moving.packed(), NODES, 100) == []
    assert find_rough_starts(np.zeros(0, dtype=FRAME_DTYPE), NODES, 100) == []


def test_homing_is_left_out_and_what_comes_after_is_not() -> None:
    stream = standing().tick(0, 0, control=0x1F).tick(40000, 0, control=0x1F).tick(50000, 0)
    stream.tick(50000, 0, control=SWITCHED_ON).tick(50000, 0)
    assert jumps(stream) == []
    assert jumps(stream.tick(60000, 0).tick(60000, 0))[0] == "speed@7"


def test_a_quick_stop_lets_go_of_the_targets() -> None:
    stream = standing().tick(0, 0, control=0x02).tick(70000, 0, control=0x02)
    assert jumps(stream) == []


def test_a_step_over_ticks_without_a_setpoint_is_one_step() -> None:
    """The drive stands at its target meanwhile, and makes the step in one period."""
    stream = standing().tick(100, 0).tick().tick(1300, 0)
    found = jumps(stream)
    assert "speed@4" in found
    assert all(jump.endswith(("@3", "@4")) for jump in found)


def braking_without(*lost: int, axes: tuple[int, ...] = (2, 3)) -> Stream:
    """From 1000 counts a period to rest at the limit; at these SYNCs the axes get no setpoint."""
    stream, x = Stream(), 0.0
    for k in range(20):
        x += min(1000.0, max(0.0, 100.0 * (15 - k)))
        stream.tick(x, x / 2)
        if k in lost:
            stream.frames = [
                frame
                for i, frame in enumerate(stream.frames)
                if i < len(stream.frames) - 4 or frame[0] not in [0x200 + axis for axis in axes]
            ]
    return stream


@pytest.mark.parametrize("lost", [(3,), (7,), (8, 9), (6, 8, 11)])
@pytest.mark.parametrize("axes", [(2, 3), (2,), (3,)])
def test_a_sync_without_setpoint_in_full_motion_is_a_jump(
    lost: tuple[int, ...], axes: tuple[int, ...]
) -> None:
    limits = StepLimits(1200.0, 120.0, normal=0.0)
    assert jumps(braking_without(*lost, axes=axes), limits)


def test_a_jump_after_a_sync_without_setpoint_is_found() -> None:
    stream = standing()
    for k in range(1, 6):
        stream.tick(50 * k, 0)
    stream.tick().tick(1500, 0).tick(1550, 0)
    assert "speed@8" in jumps(stream)


@pytest.mark.parametrize("lost", [{6}, {6, 7}, {4, 8}])
def test_a_step_is_not_spread_over_missing_syncs(lost: set[int]) -> None:
    """The drive acts on the last setpoint before each SYNC: it makes two steps or three in one period."""
    stream = Stream()
    for k in range(12):
        stream.tick(900 * k, 0)
    assert jumps(stream) == []
    counters = {number % 240 + 1 for number in lost}
    stream.frames = [
        frame for frame in stream.frames if frame[0] != 0x80 or frame[1][0] not in counters
    ]
    assert f"speed@{min(lost) - 1}" in jumps(stream)


@pytest.mark.parametrize("word", [0x1233, 0x0000, 0xFFFF])
def test_one_garbled_statusword_neither_hides_a_jump_nor_makes_one(word: int) -> None:
    def garbled(jump: int) -> Stream:
        stream = Stream()
        for k in range(8):
            x = 900 * k + (jump if k >= 5 else 0)
            stream.tick(x, 0, status=word if k == 5 else OE)
        return stream

    assert jumps(garbled(0)) == []
    assert jumps(garbled(300))[0] == "speed@5"


def test_two_setpoints_for_one_sync_are_two_steps() -> None:
    stream = standing().tick(0, 0)
    stream.frames.append((0x202, struct.pack("<Hi", ENABLED, 900)))
    stream.frames.append((0x202, struct.pack("<Hi", ENABLED, 0)))
    assert jumps(stream)[0] == "acceleration@2"


def test_a_sharp_turn_shows_where_the_program_is_known() -> None:
    stream = standing()
    x = 0.0
    for k in range(1, 11):
        x += 100 * k
        stream.tick(x, 0)
    stream.tick(x, 1000).tick(x, 2000)
    assert "turn@12" in jumps(stream, StepLimits(1000.0, 100.0, normal=200.0))


def test_a_jump_of_the_only_axis_that_still_follows() -> None:
    """The other drive is in fault: there is no path any more, yet no step beyond the limits either."""
    limits = StepLimits(1000.0, 100.0, normal=200.0)

    def one_left(*targets: int) -> Stream:
        stream = standing()
        for x in targets:
            stream.tick(x, 0)
            stream.frames[-2] = (0x183, struct.pack("<Hi", 0x1238, 0))
        return stream

    assert jumps(one_left(0, 100, 300, 500), limits) == []
    assert jumps(one_left(0, 600, 1200), limits) == ["turn@3"]


OF_AXES = StepLimits(math.inf, math.inf, axes=((1000.0, 200.0, 50.0), (500.0, 200.0, 50.0)))
UP = (50, 100, 150, 200, 200, 150, 100, 50, 0)
"""Second differences from rest to 1000 counts a period."""


def accelerated(axis: int, *second: int) -> Stream:
    """One axis by its second differences, from rest."""
    stream = standing()
    for place in np.cumsum(np.cumsum(second)):
        stream.tick(*(int(place) if k == axis else 0 for k in range(2)))
    return stream


def test_each_axis_by_its_own_limits() -> None:
    assert jumps(accelerated(0, *UP), OF_AXES) == []
    assert jumps(accelerated(0, *UP, *(-a for a in UP)), OF_AXES) == []
    assert jumps(accelerated(1, *UP), OF_AXES)[0] == "axis speed@6"
    # The limit, and 2, 4 or 8 counts of rounding
    assert jumps(accelerated(0, *UP, 2), OF_AXES) == []
    assert jumps(accelerated(0, *UP, 3), OF_AXES) == ["axis speed@11"]
    assert jumps(accelerated(0, 50, 100, 150, 200, 204), OF_AXES) == []
    assert jumps(accelerated(0, 50, 100, 150, 200, 205), OF_AXES) == ["axis acceleration@6"]
    assert jumps(accelerated(0, 58, 116), OF_AXES) == []
    assert jumps(accelerated(0, 58, 117), OF_AXES) == ["axis jerk@3"]
    assert jumps(accelerated(0, 0, 59), OF_AXES) == ["axis jerk@3"]


def test_the_axis_limits_without_a_setpoint_at_a_sync() -> None:
    """The drive stands at its target meanwhile: nothing is spread over both periods."""
    stream = accelerated(0, *UP)
    stream.tick().tick(5500 + 2000, 0).tick(5500 + 3000, 0)
    found = jumps(stream, OF_AXES)
    assert "axis speed@12" in found
    assert {"axis acceleration@11", "axis jerk@11"} <= set(found)


def test_a_recording_that_begins_in_motion_has_no_jerk_at_first() -> None:
    stream = Stream()
    for place in np.cumsum([0, 500, 700, 850, 950, 1000, 1000]):
        stream.tick(int(place), 0)
    assert jumps(stream, OF_AXES) == []


def test_third_axis_by_itself() -> None:
    stream = Stream().tick(0, 0, 7).tick(0, 0, 7).tick(0, 0, 7).tick(0, 0, 500)
    found = find_jumps(stream.packed(), (2, 3, 4), LIMITS)
    assert [(jump.sync, jump.axes) for jump in found] == [(3, (3,))]


def test_six_byte_and_eight_byte_setpoints_and_an_empty_recording() -> None:
    assert find_jumps(np.zeros(0, dtype=FRAME_DTYPE), NODES, LIMITS) == []
    stream = standing()
    for k in range(3):
        stream.frames.append((0x80, bytes([k + 3])))
        stream.frames.append((0x202, struct.pack("<Hih", ENABLED, 5000 * k, 77)))
    assert "speed@3" in jumps(stream)


def streamed(setpoints: NDArray[np.int32]) -> Stream:
    stream = Stream().tick(*map(int, setpoints[0])).tick(*map(int, setpoints[0]))
    for row in setpoints:
        stream.tick(*map(int, row))
    return stream


@pytest.mark.parametrize(
    "name", ["alpha", long("heart"), "star", "alpha_optimal", long("heart_optimal")]
)
def test_whole_programs_pass_and_each_jump_in_them_is_found(name: str) -> None:
    pipeline = load_pipeline(EXAMPLES / f"{name}.toml")
    machine = pipeline.machine
    _, setpoints = NativeProgram(pipeline.image).setpoints("fixed", machine.counts_per_mm)
    limits = step_limits(machine, setpoints)
    assert len(limits.axes) == len(machine.axes)
    assert find_jumps(streamed(setpoints).packed(), NODES, limits) == []
    least = math.ceil(2 * math.hypot(limits.acceleration, limits.normal)) + 20
    for at in range(50, len(setpoints) - 50, 97):
        moved = setpoints.copy()
        moved[at:, at % 2] += least
        assert find_jumps(streamed(moved).packed(), NODES, limits), f"at {at}"


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 1000), st.floats(20.0, 400.0), st.floats(0.0, 6.28))
def test_circles_at_any_speed_are_no_jump(steps: int, radius: float, phase: float) -> None:
    """A path that turns a lot within a tick: chords differ from arcs."""
    speed, place, stream = 0.0, 0.0, Stream()
    for k in range(120):
        speed = min(speed + 0.9 * 100, 200.0) if k < steps % 100 else max(speed - 90.0, 0.0)
        place += speed
        angle = phase + place / (10 * radius)
        stream.tick(10 * radius * math.cos(angle), 10 * radius * math.sin(angle))
    assert jumps(stream, StepLimits(200.0, 100.0)) == []


IN_SPACE = StepLimits(speed=200.0, acceleration=100.0, path=3)


def helix(radius: float, steps: int) -> Stream:
    """At 200 counts a tick, a third of it upwards; x and y alone change their speed by more than the limit."""
    stream, place, speed = Stream(), 0.0, 0.0
    for k in range(steps + 10):
        speed = min(speed + 90.0, 200.0) if k < steps else max(speed - 90.0, 0.0)
        place += speed
        angle = 0.94 * place / radius
        stream.tick(radius * math.cos(angle), 0.34 * place, radius * math.sin(angle))
    return stream


@pytest.mark.parametrize("radius", [150.0, 400.0, 5000.0])
def test_a_path_in_space_is_drawn_by_three_axes(radius: float) -> None:
    stream = helix(radius, 80)
    assert jumps(stream, IN_SPACE, (2, 3, 4)) == []
    if radius < 200:
        two = StepLimits(speed=200.0, acceleration=20.0, path=2)
        assert any(found.startswith("acceleration") for found in jumps(stream, two, (2, 3, 4)))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_jump_of_each_axis_in_space(axis: int) -> None:
    stream = Stream()
    for k in range(20):
        place = [100.0 * min(k, 1), 0.0, 50.0]
        place[axis] += 320.0 if k > 10 else 0.0
        stream.tick(*place)
    found = find_jumps(stream.packed(), (2, 3, 4), IN_SPACE)
    assert found[0].sync == 11
    assert "axis 1, 2 and 3: speed" in str(found[0])


def test_an_extra_axis_keeps_its_own_limits_only() -> None:
    """Its counts are not those of mm: speed along the path says nothing about it."""
    free = (math.inf, math.inf, math.inf)
    own = StepLimits(200.0, 100.0, axes=(free, free, free, (500.0, 500.0, math.inf)), path=4)
    stream = Stream()
    for k in range(10):
        stream.tick(0, 0, 0, 400 * k)
    nodes = (2, 3, 4, 5)
    assert jumps(stream, own, nodes) == []
    assert "axis speed@10" in jumps(stream.tick(0, 0, 0, 400 * 9 + 600), own, nodes)
    holds = StepLimits(200.0, 100.0, axes=(free,) * 4, path=3)
    assert "speed@1" in jumps(stream, holds, nodes)
