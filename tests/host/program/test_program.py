# SPDX-License-Identifier: MIT
"""Compiling: exact chaining, drift, limits, and what is refused. Run by pytest; starts and writes nothing."""

import time

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.errors import InputError, PlanError
from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.program import (
    Program,
    ProgramLimits,
    ProgramOptions,
    check,
    compile_path,
    compile_program,
    decode,
    encode,
)
from hodograph.program.check import check_image
from hodograph.program.exact import ExactProgram
from hodograph.program.geometry import segment_arcs
from hodograph.program.image import with_crc
from hodograph.program.inspection import inspect_dict
from hodograph.spline import PHSpline, from_control_polygon, line

CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)
REQUEST = FeedRequest("minimax", 100.0, 0.1)
MM = 1 << 40
LIMITS = ProgramLimits(1000, 500_000, 5_000_000, 200_000, (-4000 * MM,) * 2, (4000 * MM,) * 2)


def wavy(count: int, seed: int = 0, closed: bool = False) -> PHSpline:
    """A smooth random path of `count` control points."""
    rng = np.random.default_rng(seed)
    if closed:
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        return from_control_polygon(
            (60.0 + rng.uniform(-5, 5, count)) * np.exp(1j * angle), True
        ).spline
    turn = np.cumsum(rng.uniform(-0.5, 0.5, count))
    return from_control_polygon(
        np.cumsum(rng.uniform(8, 20, count) * np.exp(1j * turn)), False
    ).spline


def compiled(
    spline: PHSpline, request: FeedRequest = REQUEST, offset_mm: tuple[float, ...] = ()
) -> Program:
    plan = plan_feed(spline.length_mm, request, None, CONTROLLER)
    return compile_program(
        spline, plan, ProgramOptions(offset_mm=offset_mm, limits=LIMITS, name="test")
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(4, 40), st.integers(0, 10**6), st.booleans())
def test_joints_meet_far_within_the_tolerance(count, seed, closed) -> None:
    program = compiled(wavy(count, seed, closed and count > 5))
    dx, dy, ds = (distance.exact() for distance in segment_arcs(program.a_q44))
    unit = 15 << 48
    for start, distance, allowed in (
        (program.point_q40[0], dx, 17),
        (program.point_q40[1], dy, 17),
        (np.append(program.start_q40, program.length_q40), ds, 1),
    ):
        n = start.size - 1
        gaps = [int(start[i]) * unit + distance[i] - int(start[i + 1]) * unit for i in range(n)]
        assert max(map(abs, gaps), default=0) <= allowed * unit


@settings(max_examples=15, deadline=None)
@given(st.integers(4, 12), st.integers(0, 10**6), st.complex_numbers(max_magnitude=2000.0))
def test_program_is_the_path_in_50_digits(count, seed, offset) -> None:
    spline = wavy(count, seed)
    plan = plan_feed(spline.length_mm, REQUEST, None, CONTROLLER)
    program = compile_program(
        spline, plan, ProgramOptions(offset_mm=(offset.real, offset.imag), limits=LIMITS)
    )
    exact = ExactProgram(program)
    for share in (0.0, 0.03, 0.3, 0.71, 0.999, 1.0):
        time_q32 = round(share * program.duration_q32_s)
        point = exact.at(time_q32)
        s = float(point.arc_length_mm)
        assert s == pytest.approx(float(plan.arc_length(time_q32 * 2.0**-32)), abs=1e-9)
        ideal = complex(spline.point(min(s, spline.length_mm))) + offset
        assert abs(complex(*point.point_mm) - ideal) < 2e-9
    end = exact.at(program.duration_q32_s)
    with mpmath.workdps(50):
        assert abs(end.arc_length_mm - mpmath.ldexp(program.length_q40, -40)) < 2.0**-34


@pytest.mark.parametrize("closed", [False, True])
def test_drift_from_the_ideal_curve_is_nil(closed: bool) -> None:
    spline = wavy(60, 3, closed)
    plan = plan_feed(spline.length_mm, REQUEST, None, CONTROLLER)
    assert compile_path(spline, plan).drift_mm <= 2.0**-40


def test_ticks_and_their_times_are_exact() -> None:
    program = compiled(line(0, 50))
    times = program.tick_times_q42_s()
    assert times.size == program.ticks == -(-program.duration_q32_s * 1000 // 2**32) + 1
    assert times[-1] == program.duration_q32_s << 10
    for k in (0, 1, 2, 333, program.ticks - 2):
        assert times[k] == (k * 1000 * 2**42 * 2 + 10**6) // (2 * 10**6)


def test_work_offset_moves_everything_and_travel_is_kept() -> None:
    program = compiled(line(0, 50), offset_mm=(100.0, 20.0))
    assert program.point_q40[0, 0] == 100 * MM
    assert program.offset_q40[1] == 20 * MM
    plan = plan_feed(50.0, REQUEST, None, CONTROLLER)
    narrow = ProgramLimits(1000, 500_000, 5_000_000, 200_000, (0, 0), (120 * MM, 120 * MM))
    with pytest.raises(PlanError, match=r"travel.* span 1 .* x 1.* mm \(travel 0 … 120\)"):
        compile_program(line(0, 50), plan, ProgramOptions(offset_mm=(100.0, 20.0), limits=narrow))
    compile_program(line(0, 50), plan, ProgramOptions(offset_mm=(10.0, 20.0), limits=narrow))


@pytest.mark.parametrize("closed", [False, True])
def test_inspection_tells_where_a_program_begins_and_ends(closed: bool) -> None:
    spline = wavy(9, 2, closed)
    found = inspect_dict(compiled(spline, offset_mm=(100.0, -20.0)))
    for key, s in (("start_mm", 0.0), ("end_mm", 0.0 if closed else spline.length_mm)):
        assert complex(*found[key]) == pytest.approx(complex(spline.point(s)) + 100 - 20j, abs=1e-9)
    assert found["offset_mm"] == [100.0, -20.0]
    assert found["length_mm"] == pytest.approx(spline.length_mm, abs=1e-9)
    assert found["peak_feed_mm_s"] == pytest.approx(100.0, rel=1e-6)


def test_short_segments_lower_the_feed_under_respect_only() -> None:
    points = np.cumsum(0.08 * np.exp(0.05j * np.sin(np.arange(600) / 40.0)))
    spline = from_control_polygon(points, False).spline
    plan = plan_feed(spline.length_mm, FeedRequest("quintic", 200.0, 0.02), None, None)
    result = compile_path(spline, plan)
    assert result.plan.feed_mm_s < 85.0
    assert any("two neighbouring segments" in note for note in result.notes)
    assert check(result.program) is None
    report = plan_feed(
        spline.length_mm, FeedRequest("quintic", 200.0, 0.02), Limits(policy="report"), None
    )
    with pytest.raises(PlanError, match=r"span \d+.* would do"):
        compile_path(spline, report)


def test_limits_asked_for_are_in_the_header() -> None:
    plan = plan_feed(50.0, REQUEST, Limits(1.1, 1500.0, 45000.5), CONTROLLER)
    program = compile_program(line(0, 50), plan)
    assert program.feed_limit_um_s == 1_100
    assert program.acceleration_limit_um_s2 == 1_500_000
    assert program.jerk_limit_mm_s3 == 45_001


def test_plan_and_path_must_belong_together() -> None:
    plan = plan_feed(50.0, REQUEST, None, CONTROLLER)
    with pytest.raises(InputError, match="the plan is for"):
        compile_program(line(0, 51), plan)
    with pytest.raises(InputError, match="period"):
        compile_program(line(0, 50), plan, ProgramOptions(period_us=2000))


def test_controller_refuses_what_was_planned_for_another() -> None:
    plan = plan_feed(50.0, REQUEST, None, CONTROLLER)
    weak = ProgramLimits(1000, 50_000, 5_000_000, 200_000, (-(2**50),) * 2, (2**50,) * 2)
    with pytest.raises(PlanError, match="FEED"):
        compile_program(line(0, 50), plan, ProgramOptions(limits=weak))


def test_long_names_are_cut_at_whole_characters() -> None:
    plan = plan_feed(50.0, REQUEST, None, CONTROLLER)
    program = compile_program(line(0, 50), plan, ProgramOptions(name="ü" * 40))
    assert program.name == "ü" * 16
    assert decode(encode(program)).name == program.name
    assert check_image(encode(program)) is None


SMALL = encode(compiled(wavy(6)))


@settings(max_examples=300, deadline=None)
@given(st.integers(16, len(SMALL) - 1), st.integers(1, 255))
def test_any_changed_byte_breaks_the_crc(place, change) -> None:
    broken = SMALL[:place] + bytes([SMALL[place] ^ change]) + SMALL[place + 1 :]
    fault = check_image(broken)
    assert fault is not None
    # Counts, the flag of compact records (byte 28) and axes are checked before the sum.
    counts = (*range(20, 29), *range(76, 80))
    early = {"SIZE": counts, "AXES": range(30, 32), "VERSION": range(30, 32)}
    assert fault.code.name == "CRC" or place in early[fault.code.name]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(st.integers(16, len(SMALL) - 1), st.integers(0, 255)), max_size=6))
def test_no_content_makes_the_check_fall_over(changes) -> None:
    image = bytearray(SMALL)
    for place, value in changes:
        image[place] = value
    fault = check_image(with_crc(bytes(image)))
    if fault is not None:
        assert fault.code.text
        assert fault.place


@settings(max_examples=100, deadline=None)
@given(st.integers(0, len(SMALL) - 1))
def test_truncated_images_are_refused(size) -> None:
    fault = check_image(SMALL[:size])
    assert fault is not None
    assert fault.code.name == "SIZE"


@pytest.mark.serial
def test_compile_and_check_take_linear_time() -> None:
    """A segment costs as much of 20 000 as of 2000, within the noise of a busy machine. Processor time only, and no
    limit in seconds: a slow computer has the same verdict.
    """

    def seconds(count: int) -> float:
        # Slow circles that stay within the 4096 mm of the format.
        turn = np.exp(1j * np.arange(2 * count + 1) * np.pi / 500)
        w = 2.0 * np.stack((turn[:-1:2], turn[1::2], turn[2::2]), axis=1)
        distances = (
            3 * w[:, 0] ** 2
            + 3 * w[:, 0] * w[:, 1]
            + 2 * w[:, 1] ** 2
            + w[:, 0] * w[:, 2]
            + 3 * w[:, 1] * w[:, 2]
            + 3 * w[:, 2] ** 2
        ) / 15
        origin = np.concatenate(([0.0], np.cumsum(distances)[:-1]))
        spline = PHSpline(origin, w, False)
        plan = plan_feed(spline.length_mm, REQUEST, None, CONTROLLER)
        begin = time.process_time()
        image = encode(compile_program(spline, plan, ProgramOptions(limits=LIMITS)))
        assert decode(image).segment_count >= count
        return time.process_time() - begin

    small = min(seconds(2_000) for _ in range(2))
    large = seconds(20_000)
    assert large / small < 25.0
