# SPDX-License-Identifier: MIT
"""A feed piece that runs back below the feed that counts as rounding, and returns faster than the pieces beside it
allow: both checks refuse it. Run by pytest; starts and writes nothing.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.feed.pieces import FeedPieces, derivative_extremes
from hodograph.native.program import NativeProgram
from hodograph.program import decode, encode
from hodograph.program.check import check_image
from hodograph.program.codes import ProgramError
from hodograph.program.image import Program
from hodograph.program.stop_planning import with_bounds
from hodograph.program.stops import no_stops

GOLDEN = Path(__file__).parents[2] / "data" / "programs" / "alpha_minimax.hdgp"
FIRST_MM = 2.0**-6
"""Way of the first piece: from rest to rest, more slowly than 2^-10 mm/s."""
DURATION_S = 64
SHORT_MM = 1.0e-6
"""Two of them are a little longer than the distance of 2 ms at 2^-10 mm/s."""


def creeping_piece(back: float) -> list[float]:
    """Coefficients c1 … c7 in mm: feed A tau^2 (1 - tau)^2 (tau - back) / 64 s."""
    strength = 0.4 / back**3 if back else 0.2
    square = np.polynomial.polynomial.polymul([0, 0, 1, -2, 1], [-back, 1])
    feed = strength * np.append(square, [0.0] * (7 - len(square)))
    return [float(f) / k for k, f in enumerate(feed, start=1)]


def creeping_program(back: float) -> Program:
    """A line with many short segments just before the second piece begins, which creeps back over them."""
    first = [0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]
    c_mm = np.array([np.array(first) * FIRST_MM, creeping_piece(back)])
    c_q40 = np.round(np.ldexp(c_mm, 40)).astype(np.int64)
    distances_q40 = c_q40.sum(axis=1)
    length = int(distances_q40.sum())
    short = 2500
    lengths = [FIRST_MM - short * SHORT_MM, *[SHORT_MM] * short, length * 2.0**-40 - FIRST_MM]
    w_q44 = np.round(np.ldexp(np.sqrt(np.array(lengths)), 44)).astype(np.int64)
    ends = np.cumsum([int(w) * int(w) for w in w_q44], dtype=object)
    start = np.array([0, *(int(end) >> 48 for end in ends[:-1])], dtype=np.int64)
    length_by_segments = int(ends[-1]) >> 48
    c_q40[1, 6] += length_by_segments - length
    zeros = np.zeros_like(start)
    golden = decode(GOLDEN.read_bytes())
    pieces = FeedPieces(
        np.full(2, DURATION_S << 32, dtype=np.int64),
        np.array([0, distances_q40[0]], dtype=np.int64),
        c_q40,
        np.full(2, 1 << 14, dtype=np.uint32),
        np.full((2, 7), 128, dtype=np.uint8),
        np.full((2, 7), 64, dtype=np.uint8),
    )
    u = np.repeat(w_q44[:, None], 3, axis=1)
    return replace(
        golden,
        period_us=1000,
        closed=False,
        duration_q32_s=2 * DURATION_S << 32,
        length_q40=length_by_segments,
        start_q40=start,
        point_q40=np.stack((start, zeros)),
        a_q44=np.stack((u, np.zeros_like(u))),
        pieces=pieces,
        stops=no_stops(2),
    )


def most_ends_crossed(program: Program) -> int:
    """Segment ends between two ticks of the second piece, at most; in floats."""
    tau = np.arange(0, DURATION_S, program.period_us * 1e-6) / DURATION_S
    c_mm = np.ldexp(program.pieces.c_q40[1].astype(np.float64), -40)
    place_mm = FIRST_MM + np.polynomial.polynomial.polyval(tau, [0.0, *c_mm])
    starts_mm = np.ldexp(program.start_q40.astype(np.float64), -40)
    segment = np.searchsorted(starts_mm, place_mm, side="right")
    return int(np.abs(np.diff(segment)).max())


@pytest.mark.parametrize("back", [0.06, 0.1, 0.2])
def test_a_piece_that_creeps_back_is_refused_by_both(back: float) -> None:
    program = creeping_program(back)
    lows, _ = derivative_extremes(program.pieces.duration_q32_s, program.pieces.c_q40, 9)
    assert lows[0].min() > -(2.0**-10), "slow enough to pass for rounding"
    assert most_ends_crossed(program) > 2, "it would be a jump at run time"
    image = encode(program)
    own, native = check_image(image, None), NativeProgram(image).check()
    assert own is not None
    assert native is not None
    assert (own.code, own.index) == (ProgramError.BACKWARDS, 1)
    assert (native.code, native.index) == (own.code, 1)


def test_the_same_without_the_way_back_is_accepted() -> None:
    program = with_bounds(creeping_program(0.0))
    assert most_ends_crossed(program) <= 2
    image = encode(program)
    assert check_image(image, None) is None
    assert NativeProgram(image).check() is None
