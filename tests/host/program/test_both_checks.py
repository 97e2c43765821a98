# SPDX-License-Identifier: MIT
"""The Python check and the controller's own (through cffi) give the same verdict on the same bytes.

Fixed examples: at the very edge of a tolerance the two may round differently (seen in 1 of 5000 images with numbers
moved by powers of two), which must not make a test fail now and then. Run by pytest; starts and writes nothing.
"""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hodograph.errors import PlanError
from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.program import ProgramLimits, compile_path, decode, encode
from hodograph.program.check import check_image
from hodograph.program.codes import ProgramError
from hodograph.program.image import FLAG_COMPACT, with_crc
from hodograph.spline import from_control_polygon, line

PROGRAMS = Path(__file__).parents[2] / "data" / "programs"
FIELDS = (
    1000,
    500_000,
    5_000_000,
    200_000,
    (-200 << 40, -200 << 40),
    (200 << 40, 200 << 40),
    250,
)
LIMITS = ProgramLimits(*FIELDS)
NATIVE = NativeLimits(*FIELDS)
BASE = (PROGRAMS / "alpha_minimax.hdgp").read_bytes()


def verdicts(image: bytes) -> tuple[tuple[int, int], tuple[int, int]]:
    """(code, index) by Python and by C of an image that opens; (0, 0): accepted."""
    own = check_image(image, LIMITS)
    native = NativeProgram(image).check(NATIVE)
    return (
        (int(own.code), own.index) if own else (0, 0),
        (native.code, native.index) if native else (0, 0),
    )


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    st.integers(28, len(BASE) - 1).filter(
        lambda place: place not in (30, 31, *range(76, 80))
    ),  # axes and the count of events: other sizes
    st.integers(0, 255),
)
def test_one_byte_changed(place: int, value: int) -> None:
    if place == 28:
        value &= ~FLAG_COMPACT  # other sizes too
    image = with_crc(BASE[:place] + bytes([value]) + BASE[place + 1 :])
    python, native = verdicts(image)
    assert python == native


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.integers(0, 7),
    st.integers(0, 8),
    st.integers(-12, 50).map(lambda e: 1 << max(e, 0)),
    st.sampled_from((-1, 1)),
)
def test_one_number_of_a_segment_moved(segment: int, column: int, by: int, sign: int) -> None:
    place = 128 + 72 * segment + 8 * column
    number = np.frombuffer(BASE, "<i8", 1, place)[0] + sign * by
    image = with_crc(BASE[:place] + np.array([number], "<i8").tobytes() + BASE[place + 8 :])
    python, native = verdicts(image)
    assert python == native


SEGMENT, FIRST_SEGMENT, FIRST_PIECE, PIECE = 72, 128, 128 + 72 * decode(BASE).segment_count, 88
START, X, Y, U0, V2 = 0, 8, 16, 24, 64
"""Offsets within a segment: docs/reference/protocol.md 1.2."""


def with_number(place: int, number: int) -> bytes:
    """The program with another 64-bit number at an offset."""
    return with_crc(BASE[:place] + number.to_bytes(8, "little", signed=True) + BASE[place + 8 :])


@pytest.mark.parametrize("segment", [0, 2])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("offset", "limit", "code"),
    [
        (X, 4096 << 40, ProgramError.POINT_RANGE),
        (Y, 4096 << 40, ProgramError.POINT_RANGE),
        (U0, 64 << 44, ProgramError.W_RANGE),
        (V2, 64 << 44, ProgramError.W_RANGE),
    ],
)
def test_ranges_of_a_segment_end_where_the_format_says(
    segment: int, sign: int, offset: int, limit: int, code: ProgramError
) -> None:
    place = FIRST_SEGMENT + SEGMENT * segment + offset
    python, native = verdicts(with_number(place, sign * limit))
    assert python == native == (code, segment)
    python, native = verdicts(with_number(place, sign * (limit - 1)))
    assert python == native
    assert python[0] not in (0, code)


def test_arc_lengths_are_from_0_to_2_to_the_62() -> None:
    place = FIRST_SEGMENT + SEGMENT * 2 + START
    for number, code in ((-1, -22), (1 << 62, -22), (0, -28), ((1 << 62) - 1, -28)):
        python, native = verdicts(with_number(place, number))
        assert python == native
        assert python[0] == code, number


@pytest.mark.parametrize("piece", [2, 5])
def test_a_piece_that_starts_before_its_predecessor_is_named(piece: int) -> None:
    start = decode(BASE).pieces[piece - 1].start_q40
    place = FIRST_PIECE + PIECE * piece + 8
    python, native = verdicts(with_number(place, start - 1))
    assert python == native == (ProgramError.BACKWARDS, piece)
    python, native = verdicts(with_number(place, start))
    assert python == native
    assert python[0] == ProgramError.JOIN_LENGTH


@example("exponential", 19.0, 1.0, 5, 1000, 0)
@pytest.mark.long_examples(200)
@settings(max_examples=12, deadline=None)
@given(
    st.sampled_from(("quintic", "exponential", "minimax")),
    st.floats(0.05, 450.0),
    st.floats(0.003, 2.0),
    st.integers(3, 12),
    st.sampled_from((1000, 2000, 4000, 8000)),
    st.integers(0, 10**6),
)
def test_whatever_is_compiled_is_accepted(profile, feed, ramp, degree, period_us, seed) -> None:
    rng = np.random.default_rng(seed)
    if seed % 3:
        turn = np.cumsum(rng.uniform(-0.4, 0.4, 8))
        spline = from_control_polygon(
            np.cumsum(rng.uniform(1, 15) * np.exp(1j * turn)), False
        ).spline
    else:
        spline = line(0, rng.uniform(0.01, 90.0) * np.exp(1j * rng.uniform(0, 6)))
    controller = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)
    request = FeedRequest(profile, feed, ramp, degree=degree)
    plan = plan_feed(
        spline.length_mm, request, Limits(None, 2000.0, 50000.0), controller, period_us=period_us
    )
    program = compile_path(spline, plan).program
    limits = NativeLimits(period_us, *FIELDS[1:-1])
    assert NativeProgram(encode(program)).check(limits) is None
    assert np.array_equal(
        NativeProgram(encode(program)).tick_times_q42_s(), program.tick_times_q42_s()
    )


@pytest.mark.parametrize("period_us", [1000, 8000])
@pytest.mark.parametrize("spacing_mm", [0.002, 0.0007, 0.00037])
def test_feeds_lowered_for_the_shortest_segments_are_accepted(spacing_mm, period_us) -> None:
    """Where the controller's resolution of 2^-24 mm and mm/s is a visible part of distance and feed."""
    turn = 0.3 * np.sin(np.arange(24) / 3.0)
    spline = from_control_polygon(np.cumsum(spacing_mm * np.exp(1j * turn)), False).spline
    plan = plan_feed(spline.length_mm, FeedRequest("quintic", 100.0, 0.002), period_us=period_us)
    result = compile_path(spline, plan)
    assert any("two neighbouring segments" in note for note in result.notes)
    limits = NativeLimits(period_us=period_us)
    assert NativeProgram(encode(result.program)).check(limits) is None


def test_segments_too_short_for_any_feed_are_refused_by_both() -> None:
    turn = 0.3 * np.sin(np.arange(200) / 3.0)
    spline = from_control_polygon(np.cumsum(6e-6 * np.exp(1j * turn)), False).spline
    plan = plan_feed(spline.length_mm, FeedRequest("quintic", 1e-3, 0.1), period_us=8000)
    with pytest.raises(PlanError, match="at any feed: take points that lie further apart"):
        compile_path(spline, plan)
    short = (PROGRAMS / "broken_segment_short.hdgp").read_bytes()
    python, native = verdicts(short)
    assert python == native == (-32, 15)


@pytest.mark.parametrize("name", sorted(p.name for p in PROGRAMS.glob("broken_*.hdgp")))
def test_golden(name: str) -> None:
    image = (PROGRAMS / name).read_bytes()
    fault = check_image(image, LIMITS)
    assert fault is not None
    if fault.code < -5 and fault.code != ProgramError.AXES:  # found when it is opened
        python, native = verdicts(image)
        assert python == native
        assert decode(image).segment_count >= 1
