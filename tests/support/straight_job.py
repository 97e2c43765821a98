# SPDX-License-Identifier: MIT
"""Chunks of a job that needs no planner.

The path is straight along x from the origin, to 16 mm/s in 0.5 s (4 mm), then pieces of 1/32 s (0.5 mm) at 16 mm/s;
each chunk ends in 0.5 s (4 mm). Segments of 4 mm. Every number is exact. Used by tests of streaming and of the live
page; no I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hodograph.feed.pieces import FeedPieces
from hodograph.program.image import Program, encode
from hodograph.program.stop_planning import with_bounds
from hodograph.program.stops import Stops
from hodograph.stream.chunk import Chunk, ChunkHeader

Q32, Q40, Q44 = 1 << 32, 1 << 40, 1 << 44
RAMP_S, EVEN_S, RAMP_MM, SEGMENT_MM = 0.5, 1 / 32, 4, 4
UP, EVEN, DOWN = (0, 0, 0, 20, -24, 8, 0), (0.5, 0, 0, 0, 0, 0, 0), (8, 0, 0, -20, 24, -8, 0)
"""Coefficients of arc length in the time of a piece, mm."""
STOP_CODES = ((118, 124, 118), (134, 132, 134))
LEVELS = 7  # of the override bounds


@dataclass(frozen=True)
class Part:
    """Pieces `begin` … `end` - 1 of the job, then a tail. Piece 0 is the one from rest; `end` is 1 more than a multiple
    of 8. The pieces before `joint` are the predecessor's, which begins with piece `previous`.
    """

    begin: int
    end: int
    previous: int = 0
    joint: int = 0
    last: bool = False


def arc_mm(piece: int) -> float:
    """Where a piece begins."""
    return 0.0 if piece == 0 else RAMP_MM + 0.5 * (piece - 1)


def time_s(piece: int) -> float:
    """When it begins."""
    return 0.0 if piece == 0 else RAMP_S + EVEN_S * (piece - 1)


def segment_of(piece: int) -> int:
    """The segment that it begins in."""
    return int(arc_mm(piece) // SEGMENT_MM)


def program(part: Part) -> Program:
    """The program of a chunk."""
    numbers = range(part.begin, part.end)
    zero_mm = segment_of(part.begin) * SEGMENT_MM
    starts = np.array([arc_mm(i) - zero_mm for i in (*numbers, part.end)])
    lasting = [RAMP_S if i == 0 else EVEN_S for i in numbers] + [RAMP_S]
    forms = [UP if i == 0 else EVEN for i in numbers] + [DOWN]
    count = len(forms)
    pieces = FeedPieces(
        (np.array(lasting) * Q32).astype(np.int64),
        (starts * Q40).astype(np.int64),
        (np.array(forms) * Q40).astype(np.int64),
        np.full(count, 3 << 13, dtype=np.uint16),
        np.full((count, LEVELS), 152, dtype=np.uint8),
        np.full((count, LEVELS), 125, dtype=np.uint8),
    )
    segments = segment_of(part.end) + 1 - segment_of(part.begin)
    along = np.arange(segments, dtype=np.int64) * SEGMENT_MM * Q40
    points = np.stack([along + int(zero_mm) * Q40, np.zeros(segments, dtype=np.int64)])
    preimage = np.zeros((2, segments, 3), dtype=np.int64)
    preimage[0] = 2 * Q44
    codes = np.tile(np.array(STOP_CODES, dtype=np.uint8), (count, 1, 1))
    stops = Stops(codes, np.zeros((count, 2), dtype=np.uint32), (0, 0), (0, 0))
    return with_bounds(
        Program(
            name="straight",
            period_us=1000,
            closed=False,
            duration_q32_s=int(pieces.duration_q32_s.sum()),
            length_q40=segments * SEGMENT_MM * Q40,
            offset_q40=(0, 0),
            feed_limit_um_s=0,
            acceleration_limit_um_s2=0,
            jerk_limit_mm_s3=0,
            start_q40=along,
            point_q40=points,
            a_q44=preimage,
            pieces=pieces,
            stops=stops,
            moving=part.begin > 0,
        )
    )


def chunk(part: Part, sequence: int, job: int) -> bytes:
    """The bytes of a chunk."""
    shift = segment_of(part.begin) - segment_of(part.previous)
    follows = part.begin > 0
    lag_s = time_s(part.begin) - time_s(part.previous)
    header = ChunkHeader(
        first=not follows,
        last=part.last,
        job=job,
        sequence=sequence,
        piece_shift=part.begin - part.previous if follows else 0,
        segment_shift=shift,
        shared_pieces=part.joint - part.begin if follows else 0,
        shared_segments=segment_of(part.joint) + 1 - segment_of(part.begin) if follows else 0,
        arc_shift_q40=shift * SEGMENT_MM * Q40,
        time_shift_q32_s=round(lag_s * Q32) if follows else 0,
        job_start_q40=segment_of(part.begin) * SEGMENT_MM * Q40,
        line=100 + sequence,
    )
    return Chunk(header, encode(program(part))).encode()


def chunks(count: int, job: int) -> list[bytes]:
    """A job of so many chunks, each 1 s further than the one before; half a second before each joint is shared."""
    made = []
    begin = previous = joint = 0
    for sequence in range(count):
        end = 33 + 32 * sequence
        part = Part(begin, end, previous, joint, last=sequence == count - 1)
        made.append(chunk(part, sequence, job))
        previous, joint, begin = begin, end, end - 24
    return made


def whole(count: int, job: int) -> bytes:
    """The same job as one chunk."""
    return chunk(Part(0, 33 + 32 * (count - 1), last=True), 0, job)
