# SPDX-License-Identifier: MIT
"""The proof that path stops keep the limits of the axes (firmware/core/brake_check.h) compared with random stops.

The truth beside it are setpoints of the controller's own stops (sim/offline/stop_trial), at random instants, overrides
and sequences of commands. HODOGRAPH_BRAKE_CASES changes the number of mutated images. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
import pytest
from programs import random_program
from test_limit_check import EXAMPLES, peaks

from hodograph.native.brake_check import BrakeCheck
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.native.stop_search import StopLimits
from hodograph.native.stop_trial import run_trials
from hodograph.pipeline import load_pipeline
from hodograph.program import Program, encode
from hodograph.program.stop_planning import with_bounds
from hodograph.program.stops import DECELERATION, FAULT, HOLD, no_stops
from marks import long

NAMES = ("alpha", "heart", "star", "alpha_optimal", "heart_optimal")
SEEDS = 6
MUTATED = int(os.environ.get("HODOGRAPH_BRAKE_CASES", "60"))
CODES = (144, 146, 144)
"""65 000 mm/s^3, 1220 mm/s^2: of the random programs, which have no stops of their own."""
FIELDS = ("axis_velocity_um_s", "axis_acceleration_um_s2", "axis_jerk_mm_s3")
UNITS = (1e3, 1e3, 1.0)


@cache
def programs() -> tuple[Program, ...]:
    shipped = [load_pipeline(EXAMPLES / f"{name}.toml").program for name in NAMES]
    made = [random_program(seed) for seed in range(SEEDS)]
    for k, program in enumerate(made):
        codes = np.full((program.piece_count, 2, 3), CODES, dtype=np.uint8)
        made[k] = replace(program, stops=replace(no_stops(program.piece_count), codes=codes))
    return (*shipped, *made)


@cache
def needed(which: int) -> tuple[tuple[float, float], ...]:
    """Greatest velocity, acceleration, jerk of x and y that the program makes itself, at any override."""
    return tuple((float(x), float(y)) for x, y in peaks(programs()[which]))


def mutated(which: int, kind: int, rng: np.random.Generator) -> Program:
    """Stops of one kind alone, with other parameters than the program was given."""
    program = programs()[which]
    codes = program.stops.codes.copy().astype(np.int64)
    codes[:, 1 - kind] = 0
    some = codes[:, kind, DECELERATION] != 0
    codes[some, kind] += rng.integers(-4, 13, size=3) * rng.integers(0, 2, size=3)
    stops = replace(program.stops, codes=np.clip(codes, 0, 255).astype(np.uint8))
    return with_bounds(replace(program, stops=stops))


def proved(program: Program, kind: int, limits: list[tuple[float, float]]) -> bool:
    values = [
        tuple(round(one * unit) for one in row) for row, unit in zip(limits, UNITS, strict=True)
    ]
    native = NativeLimits(**dict(zip(FIELDS, values, strict=True)))
    check = BrakeCheck(NativeProgram(encode(program)), native)
    return all(
        check.proves(i, kind, codes)
        for i, codes in enumerate(program.stops.codes[:, kind].tolist())
    )


def use(program: Program, limits: list[tuple[float, float]], seed: int) -> float:
    """The greatest share of a limit of the axes in random motions with stops."""
    velocity, acceleration, jerk = limits
    own = StopLimits(
        axis_velocity=velocity,
        axis_acceleration=acceleration,
        axis_jerk=jerk,
        acceleration=inf,
        jerk=inf,
    )
    found = run_trials(NativeProgram(encode(program)), own, own, 200, seed=seed)
    return max(
        share
        for uses in (found.of_hold, found.of_fault)
        for name, share in uses.items()
        if not name.startswith("path_")
    )


@pytest.mark.parametrize("count", [MUTATED, long(40 * MUTATED)])
def test_no_mutated_image_is_proved_beyond_a_limit(count: int) -> None:
    rng = np.random.default_rng(1104)
    beyond = accepted = 0
    for case in range(count):
        which, kind = case % len(programs()), int(rng.integers(2))
        program = mutated(which, kind, rng)
        room = rng.uniform(1.005, 1.6, size=3)
        limits = [(x * r, y * r) for (x, y), r in zip(needed(which), room, strict=True)]
        is_proved = proved(program, kind, limits)
        share = use(program, limits, case)
        accepted += is_proved
        beyond += share > 1.01
        assert not is_proved or share <= 1.002, (case, share)
    assert beyond > count // 10
    assert accepted > count // 20


@pytest.mark.parametrize("name", NAMES)
def test_what_is_proved_of_the_examples(name: str) -> None:
    """Holds, which keep the path file's lower limits, nearly all; fault stops, which use the machine's, most."""
    program = programs()[NAMES.index(name)]
    machine = load_pipeline(EXAMPLES / f"{name}.toml").machine
    axes = machine.path_axes
    limits = [
        tuple(axis.velocity_mm_s for axis in axes),
        tuple(axis.acceleration_mm_s2 for axis in axes),
        tuple(axis.jerk_mm_s3 for axis in axes),
    ]
    values = [
        tuple(round(one * unit) for one in row) for row, unit in zip(limits, UNITS, strict=True)
    ]
    check = BrakeCheck(
        NativeProgram(encode(program)), NativeLimits(**dict(zip(FIELDS, values, strict=True)))
    )
    for kind, least in ((HOLD, 0.9), (FAULT, 0.6)):
        codes = [one for one in enumerate(program.stops.codes[:, kind].tolist()) if one[1][1]]
        share = sum(check.proves(i, kind, own) for i, own in codes) / len(codes)
        assert share >= least, (kind, share)


def test_without_limits_of_axes_there_is_nothing_to_prove() -> None:
    program = programs()[0]
    check = BrakeCheck(NativeProgram(encode(program)), NativeLimits())
    assert check.proves(0, FAULT, (255, 255, 255))
    assert check.evaluations == 0
