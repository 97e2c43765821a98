# SPDX-License-Identifier: MIT
"""Programs of three axes: exact joints, images there and back, and the same verdict of both checks. Run by pytest;
starts and writes nothing.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hodograph.errors import InputError, PlanError
from hodograph.feed import AxisLimits, ControllerLimits, FeedRequest, Limits
from hodograph.feed.optimal import plan_optimal
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.program import (
    Program,
    ProgramLimits,
    ProgramOptions,
    compile_path,
    decode,
    encode,
    inspect_dict,
    inspect_text,
)
from hodograph.program.check import check_image
from hodograph.program.codes import ProgramError
from hodograph.program.exact import ExactProgram
from hodograph.program.geometry import quantise, segment_arcs
from hodograph.program.wide import product
from hodograph.spline.spatial import spatial_through_points
from spatial_curve import walk

MM = 1 << 40
FIELDS = (1000, 500_000, 5_000_000, 200_000, (-200 * MM,) * 3, (200 * MM,) * 3, 2000)
LIMITS = ProgramLimits(*FIELDS, axis_count=3)
NATIVE = NativeLimits(*FIELDS, axis_count=3)
SPACE = Limits(
    axis=AxisLimits((200.0,) * 3, (2000.0,) * 3, (50000.0,) * 3),
    names=("x", "y", "z"),
    reserve=0.2,
)


@cache
def compiled(seed: int) -> Program:
    curve = walk(seed)
    plan = plan_optimal(
        curve, FeedRequest("optimal"), SPACE, ControllerLimits(400.0, 4000.0, 150000.0)
    )
    options = ProgramOptions("walk", (10.0, -20.0, 30.0), LIMITS)
    return compile_path(curve, plan, options).program


def verdicts(program: Program) -> tuple[tuple[int, int], tuple[int, int]]:
    image = encode(program)
    own, native = check_image(image, LIMITS), NativeProgram(image).check(NATIVE)
    return (
        (int(own.code), own.index) if own else (0, 0),
        (native.code, native.index) if native else (0, 0),
    )


def test_sums_of_products_are_exact() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.integers(-(2**50), 2**50, (2, 500, 3))
    weights = np.array([[6, 3, 1], [3, 4, 3], [1, 3, 6]])
    found = product(a, b, weights)
    big = [[int(v) for v in row] for row in a], [[int(v) for v in row] for row in b]
    wanted = [
        sum(int(weights[j, k]) * x[j] * y[k] for j in range(3) for k in range(3))
        for x, y in zip(*big, strict=True)
    ]
    assert found.exact().tolist() == wanted
    assert found.sums().exact().tolist() == [sum(wanted[:n]) for n in range(501)]
    assert (found - found.doubled()).exact().tolist() == [-one for one in wanted]


@pytest.mark.parametrize("seed", range(2))
def test_joints_meet_far_within_the_tolerance(seed: int) -> None:
    program = compiled(seed)
    assert np.abs(program.a_q44).max() < 8 << 44
    *distances, along = (distance.exact() for distance in segment_arcs(program.a_q44))
    joints = np.append(program.start_q40, program.length_q40)
    columns = [
        (one, distance, 17) for one, distance in zip(program.point_q40, distances, strict=True)
    ]
    for start, distance, allowed in [*columns, (joints, along, 1)]:
        gaps = [
            int(start[i]) * (15 << 48) + distance[i] - int(start[i + 1]) * (15 << 48)
            for i in range(start.size - 1)
        ]
        assert max(map(abs, gaps)) <= allowed * (15 << 48)


def test_program_is_the_path_in_50_digits() -> None:
    program, curve = compiled(0), walk(0)
    exact = ExactProgram(program)
    for share in (0.0, 0.3, 0.71, 1.0):
        point = exact.at(round(share * program.duration_q32_s))
        s = min(float(point.arc_length_mm), curve.length_mm)
        ideal = curve.point(s) + np.array([10.0, -20.0, 30.0])
        assert [float(mm) for mm in point.point_mm] == pytest.approx(ideal, abs=2e-9)


def test_image_there_and_back() -> None:
    program = compiled(0)
    image = encode(program)
    assert int.from_bytes(image[6:8], "little") == 136
    assert len(image) == 136 + 104 * program.segment_count + 104 * program.piece_count
    again = decode(image)
    assert encode(again) == image
    assert again.axis_count == 3
    assert np.array_equal(again.a_q44, program.a_q44)
    assert again.offset_q40 == (10 * MM, -20 * MM, 30 * MM)
    found, text = inspect_dict(again), inspect_text(again, full=True)
    assert found["end_mm"] == pytest.approx(walk(0).nodal_points[-1] + (10.0, -20.0, 30.0))
    assert "z mm" in text


def test_extra_axes_there_and_back() -> None:
    program = compiled(0)
    rng = np.random.default_rng(5)
    extra = rng.integers(-(2**46), 2**46, (2, program.segment_count, 5))
    starts = rng.integers(-(2**50), 2**50, (2, program.segment_count))
    five = replace(
        program,
        point_q40=np.concatenate((program.point_q40, starts)),
        extra_q40=extra,
        offset_q40=(*program.offset_q40, 7, -8),
    )
    image = encode(five)
    assert len(image) == len(encode(program)) + 16 + 76 * program.segment_count
    again = decode(image)
    assert encode(again) == image
    assert np.array_equal(again.extra_q40, extra)
    assert np.array_equal(again.point_q40, five.point_q40)


@pytest.mark.parametrize("seed", range(2))
def test_both_checks_accept(seed: int) -> None:
    assert verdicts(compiled(seed)) == ((0, 0), (0, 0))


def moved(field: str, place: tuple[int, ...], by: int) -> Program:
    program = compiled(0)
    values = getattr(program, field).copy()
    values[place] += by
    return replace(program, **{field: values})


@pytest.mark.parametrize(
    ("program", "code"),
    [
        (lambda: moved("point_q40", (2, 1), 1 << 8), ProgramError.JOIN_POINT),
        (lambda: moved("point_q40", (0, 1), -(1 << 8)), ProgramError.JOIN_POINT),
        (lambda: moved("point_q40", (2, 0), 4096 << 40), ProgramError.POINT_RANGE),
        (lambda: moved("start_q40", (1,), 1 << 8), ProgramError.JOIN_ARC),
        (lambda: moved("point_q40", (2, slice(None)), 190 << 40), ProgramError.TRAVEL),
        (
            lambda: replace(compiled(0), length_q40=compiled(0).length_q40 + (1 << 10)),
            ProgramError.SEGMENT_END,
        ),
        (lambda: replace(compiled(0), closed=True), ProgramError.NOT_CLOSED),
        (lambda: moved("a_q44", (slice(None), 0, 0), 1 << 45), None),
        (lambda: moved("a_q44", (1, 1, 1), 1 << 30), None),
        (lambda: moved("a_q44", (2, 1, 2), 1 << 26), None),
    ],
)
def test_both_checks_refuse_the_same(program, code) -> None:
    own, native = verdicts(program())
    assert own == native
    assert own[0] != 0
    if code is not None:
        assert own[0] == code


@pytest.mark.parametrize(
    ("first_axis", "served", "code"),
    [(3, 0, 0), (0, 3, 0), (4, 0, ProgramError.AXES), (3, 3, ProgramError.AXES)],
)
def test_a_first_axis_is_for_a_machine_that_has_it_and_looks_at_it(
    first_axis: int, served: int, code: int
) -> None:
    image = encode(replace(compiled(0), first_axis=first_axis))
    assert decode(image).first_axis == NativeProgram(image).first_axis == first_axis
    fault = check_image(image, replace(LIMITS, axis_count=served))
    native = NativeProgram(image).check(replace(NATIVE, axis_count=served))
    assert [0 if one is None else one.code for one in (fault, native)] == [code, code]


def test_axes_have_to_be_those_of_the_machine() -> None:
    image = encode(compiled(0))
    planar = replace(LIMITS, axis_count=2)
    fault = check_image(image, planar)
    assert fault is not None
    assert fault.code == ProgramError.AXES
    native = NativeProgram(image).check(replace(NATIVE, axis_count=2))
    assert native is not None
    assert native.code == ProgramError.AXES
    for axes in (0, 1, 7):
        patched = image[:30] + axes.to_bytes(2, "little") + image[32:]
        with pytest.raises(InputError, match="axis count"):
            decode(patched)


def test_wide_segments_are_split() -> None:
    """A half circle of one segment would need a component of 8 or more."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4)[:-1]
    ring = spatial_through_points(
        np.stack((9.0 * np.cos(angle), 9.0 * np.sin(angle), 0.2 * angle), axis=-1), False
    ).spline
    geometry = quantise(ring)
    assert np.abs(geometry.a_q44).max() < 8 << 44


def test_travel_names_the_axis() -> None:
    curve = walk(0)
    plan = plan_optimal(curve, FeedRequest("optimal"), SPACE)
    narrow = replace(LIMITS, min_q40_mm=(-200 * MM, -200 * MM, 0), max_q40_mm=(200 * MM,) * 3)
    with pytest.raises(PlanError, match=r"leaves the travel.* z .* mm \(travel 0 … 200\)"):
        compile_path(curve, plan, ProgramOptions(offset_mm=(0.0, 0.0, -90.0), limits=narrow))
