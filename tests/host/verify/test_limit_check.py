# SPDX-License-Identifier: MIT
"""The controller's proof of the axis limits (firmware/core/limit_check.h) against dense samples.

The truth beside it is `motion_at` of hodograph.verify at many instants: doubles, no bounds. HODOGRAPH_LIMIT_CASES
changes the number of mutated images; `make test-all` takes eight times as many. HODOGRAPH_LIMIT_SEED gives others. Run
by pytest; starts and writes nothing.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from programs import random_program

from hodograph.feed.override_levels import FACTOR_ONE_Q14, FULL, LEVEL_OVERRIDES, LEVELS
from hodograph.native.program import NativeFault, NativeLimits, NativeProgram
from hodograph.pipeline import load_pipeline
from hodograph.program import Program, encode
from hodograph.program.codes import ProgramError
from hodograph.verify.cells import cut
from hodograph.verify.curves import curve_of
from hodograph.verify.instants import motion_at
from marks import long

Real = NDArray[np.float64]

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
NAMES = ("alpha", "heart", "star", "alpha_optimal", "heart_optimal")
SEEDS = 12
MUTATED = int(os.environ.get("HODOGRAPH_LIMIT_CASES", "400"))
SEED = int(os.environ.get("HODOGRAPH_LIMIT_SEED", "2026"))
FIELDS = ("axis_velocity_um_s", "axis_acceleration_um_s2", "axis_jerk_mm_s3")
UNITS = np.array([[1e3], [1e3], [1.0]])
CODES = (ProgramError.AXIS_VELOCITY, ProgramError.AXIS_ACCELERATION, ProgramError.AXIS_JERK)
SAMPLES = 600


@dataclass(frozen=True, eq=False)
class Rates:
    """Bounds of the rate of program time in each piece, (M,), and of its derivatives up to it."""

    most: Real
    rate: Real
    second: Real


def levels_of(program: Program) -> Iterator[Rates]:
    pieces = program.pieces
    for level in range(LEVELS):
        most = np.full(len(pieces), (*LEVEL_OVERRIDES, 0.0)[level])
        yield Rates(
            pieces.override_factor if level == FULL else most,
            pieces.override_rate_per_s(level),
            pieces.override_second_per_s2(level),
        )


def plain(program: Program) -> Program:
    """With overrides of next to no room: what is judged is the motion at rate 1."""
    codes = np.ones_like(program.pieces.override_rate_codes)
    pieces = replace(
        program.pieces,
        override_factor_q14=np.full_like(program.pieces.override_factor_q14, FACTOR_ONE_Q14),
        override_rate_codes=codes,
        override_second_codes=codes,
    )
    return replace(program, pieces=pieces)


def peaks(program: Program, samples: int = SAMPLES) -> Real:
    """(3, 2): the greatest velocity, acceleration, jerk of x and y at any rate that the bounds allow."""
    cells = cut(program)
    ends = np.cumsum(program.pieces.duration_q32_s * 2.0**-32)
    cell = np.repeat(np.arange(len(cells)), samples)
    motion = motion_at(cells, cell, np.tile(np.linspace(0.0, 1.0, samples), len(cells)))
    middle = cells.start_s + 0.5 * cells.duration_s
    piece = np.clip(np.searchsorted(ends, middle), 0, ends.size - 1)[cell]
    out = np.zeros((3, 2))
    for rates in levels_of(program):
        f, r, s = rates.most[piece], rates.rate[piece], rates.second[piece]
        for axis in range(2):
            v, a, j = (
                np.abs(one[axis])
                for one in (motion.axis_velocity, motion.axis_acceleration, motion.axis_jerk)
            )
            own = (
                (f * v).max(),
                (f * f * a + r * v).max(),
                (f**3 * j + 3.0 * f * r * a + s * v).max(),
            )
            out[:, axis] = np.maximum(out[:, axis], own)
    return out


def check(
    program: Program, limits: Real, only: tuple[int, int] | None = None
) -> NativeFault | None:
    """The verdict with limits (3, 2), or with one of them alone."""
    values = np.clip(np.rint(limits * UNITS), 1, 2**32 - 1).astype(np.int64)
    if only is not None:
        kept = np.zeros_like(values)
        kept[only] = values[only]
        values = kept
    x_and_y = {name: (int(row[0]), int(row[1])) for name, row in zip(FIELDS, values, strict=True)}
    return NativeProgram(encode(program)).check(NativeLimits(**x_and_y))


@cache
def programs() -> tuple[Program, ...]:
    shipped = [load_pipeline(EXAMPLES / f"{name}.toml").program for name in NAMES]
    return (*shipped, *(random_program(seed) for seed in range(SEEDS)))


@pytest.mark.parametrize("number", range(len(NAMES) + SEEDS))
@pytest.mark.parametrize("at_rate_1", [True, False])
def test_half_a_percent_of_room_is_enough_and_a_hair_too_little_is_refused(
    number: int, at_rate_1: bool
) -> None:
    program = programs()[number]
    program = plain(program) if at_rate_1 else program
    found = peaks(program)
    assert check(program, 1.005 * found) is None
    for quantity in range(3):
        for axis in range(2):
            fault = check(program, found / 1.0002, (quantity, axis))
            assert fault is not None
            assert fault.code == CODES[quantity]


def test_limits_of_zero_are_none() -> None:
    assert NativeProgram(encode(programs()[0])).check(NativeLimits()) is None


def bumped(program: Program, rng: np.random.Generator) -> Program:
    """One piece goes another way between its ends: c tau^3 (end - tau)^3 leaves F, F' and F'' there as they are."""
    pieces = program.pieces
    k = int(rng.integers(len(pieces)))
    duration_s = float(pieces.duration_q32_s[k]) * 2.0**-32
    exponent = int(np.ceil(np.log2(duration_s)))
    end = duration_s * 2.0**-exponent
    distance = np.polynomial.polynomial.polyfromroots([0.0] * 3 + [end] * 3)
    size = 10.0 ** rng.uniform(-7.0, 0.0) * rng.choice([-1.0, 1.0]) / end**6
    c = pieces.c_q40.copy()
    c[k, :6] += np.rint(size * distance[1:] * 2.0**40).astype(np.int64)
    return replace(program, pieces=replace(pieces, c_q40=c))


def livelier(program: Program, rng: np.random.Generator) -> Program:
    """One piece allows more of the rate of program time than it should, in one of the levels."""
    pieces = program.pieces
    name = str(rng.choice(["override_factor_q14", "override_rate_codes", "override_second_codes"]))
    values = getattr(pieces, name).copy()
    k = int(rng.integers(len(pieces)))
    if name == "override_factor_q14":
        more = float(values[k]) * (1.0 + 10.0 ** rng.uniform(-3.0, 1.0))
        values[k] = int(min(more, 2.0 * FACTOR_ONE_Q14))
    else:
        level = int(rng.integers(LEVELS))
        values[k, level] = min(int(values[k, level]) + int(rng.integers(1, 80)), 255)
    return replace(program, pieces=replace(pieces, **{name: values}))


@pytest.mark.parametrize("count", [MUTATED, long(8 * MUTATED)])
def test_no_mutated_image_is_accepted_beyond_a_limit(count: int) -> None:
    """Limits of the program itself, half a percent above what it needs; then it is changed."""
    rng = np.random.default_rng(SEED)
    limits = [1.005 * peaks(program) for program in programs()]
    beyond = other = 0
    for case in range(count):
        which = case % len(limits)
        change = (bumped, livelier)[case // len(limits) % 2]
        program = change(programs()[which], rng)
        fault = check(program, limits[which])
        if fault is not None and fault.code not in CODES:
            other += 1  # another rule has refused it
            continue
        share = float((peaks(program, 60) / limits[which]).max())
        beyond += share > 1.01
        assert fault is not None or share <= 1.0, (case, share)
    assert beyond > count // 10
    assert other < count // 2


def test_rates_beyond_all_bounds_are_refused() -> None:
    program = programs()[0]
    limits = 1.005 * peaks(program)
    for name in ("override_rate_codes", "override_second_codes"):
        for level in range(LEVELS):
            codes = getattr(program.pieces, name).copy()
            codes[:, level] = 255
            pieces = replace(program.pieces, **{name: codes})
            fault = check(replace(program, pieces=pieces), limits)
            assert fault is not None
            assert fault.code in CODES


def with_a_step_of_curvature(program: Program, segment: int, share: float) -> Program:
    """The middle control point of w of one segment is moved so that its length stays.

    The directions at its ends stay, the curvatures do not. What comes after moves with its end.
    """
    w = 2.0**-44 * (program.a_q44[0, segment] + 1j * program.a_q44[1, segment])

    def length(middle: complex) -> float:
        return (
            float(
                (abs(w[0]) ** 2 + (w[0] * np.conj(middle)).real + (middle * np.conj(w[2])).real)
                + abs(w[2]) ** 2
                + (2.0 * abs(middle) ** 2 + (w[0] * np.conj(w[2])).real) / 3.0
            )
            / 5.0
        )

    aside = w[1] + 1j * share * w[1]
    low, high = 0.5, 1.5
    for _ in range(80):
        scale = 0.5 * (low + high)
        low, high = (scale, high) if length(scale * aside) < length(w[1]) else (low, scale)
    a = program.a_q44.copy()
    a[:, segment, 1] = [round(part * 2.0**44) for part in ((low * aside).real, (low * aside).imag)]
    moved = replace(program, a_q44=a)
    before, after = curve_of(program), curve_of(moved)

    def end(curve: object) -> complex:
        a0, a1, a2 = curve.w[segment]  # type: ignore[attr-defined]
        square = np.array([a0 * a0, 2 * a0 * a1, a1 * a1 + 2 * a0 * a2, 2 * a1 * a2, a2 * a2])
        return complex((square / np.arange(1.0, 6.0)).sum())

    gap = end(after) - end(before)
    point = program.point_q40.copy()
    point[0, segment + 1 :] += round(gap.real * 2.0**40)
    point[1, segment + 1 :] += round(gap.imag * 2.0**40)
    return replace(moved, point_q40=point)


def test_a_step_of_curvature_is_refused() -> None:
    """Every other limit has room: only the joint is at fault."""
    program = plain(programs()[0])
    limits = 3.0 * peaks(program)
    codes = set()
    for share in (1e-6, 1e-5, 1e-3, 1e-2):
        fault = check(with_a_step_of_curvature(program, 3, share), limits)
        codes.add((share, fault.code if fault else 0))
    assert codes == {
        (1e-6, 0),
        (1e-5, 0),
        (1e-3, ProgramError.AXIS_STEP),
        (1e-2, ProgramError.AXIS_STEP),
    }
