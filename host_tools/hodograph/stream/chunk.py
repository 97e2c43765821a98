# SPDX-License-Identifier: MIT
"""A chunk (a part of a job): a header and a whole program image, to and from bytes; docs/reference/protocol.md 1.7.
Used by stream/, monitor/ and cli/stream_command. No I/O.

Every chunk ends at rest. Where the path continues in motion, the last pieces of a chunk are a tail that brakes along
the path; the next chunk repeats the pieces before the tail with the same numbers and goes on from their end, the joint.
A chunk that begins at rest repeats nothing.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..program.image import Program, decode, encode

MAGIC = b"HDGC"
VERSION = 2
_READABLE = (1, VERSION)
"""Older recordings have chunks of version 1, with the same fields; a controller refuses those."""
HEADER_SIZE = 80
FLAG_FIRST, FLAG_LAST, FLAG_REST, FLAG_JOINED = 1, 2, 4, 8
_FLAGS = FLAG_FIRST | FLAG_LAST | FLAG_REST | FLAG_JOINED
REST_STOP, REST_OPTIONAL = 1, 2
REST_TICKS = 8
"""The shortest rest before a chunk that begins at rest."""
TIME_UNKNOWN = 0xFFFFFFFF
LEAST_SHARED_PIECES = 16
"""The largest look-ahead window of the controller: this number of pieces before a joint is in both chunks."""

BLOCK_HEAD = 384
"""Most bytes of the ring that the controller uses for each chunk in addition to the chunk's own."""

FARTHEST_Q40 = 1 << 62
"""No chunk of a controller's job begins at this arc length or beyond."""
ENOUGH_Q40 = 1 << 61
"""A controller's job that is as long as this ends at the next rest, and another one continues from there."""

_HEADER = struct.Struct("<4sHH I I I I I I I I q Q q I I II".replace(" ", ""))
_CRC_FROM = 16


def largest_chunk(free_bytes: int) -> int:
    """The largest chunk that always fits as soon as its predecessor is the active one: a third of the ring, heads
    included; docs/reference/protocol.md 3.7.

    free_bytes  free bytes of the ring without a job (object 0x2060 sub 7)
    """
    return max((free_bytes - 2 * BLOCK_HEAD) // 3 - 8, 0)


@dataclass(frozen=True)
class Rest:
    """What happens at rest before a chunk that begins where its predecessor ends.

    dwell_ms       standstill
    stop           the controller waits for resume
    optional_stop  the same, only while the switch for optional stops is on
    """

    dwell_ms: int = 0
    stop: bool = False
    optional_stop: bool = False

    def ticks(self, period_us: int) -> int:
        """Number of setpoints that repeat the end of the predecessor."""
        return max(-(-self.dwell_ms * 1000 // period_us), REST_TICKS)


@dataclass(frozen=True)
class ChunkHeader:
    """The header of a chunk.

    first, last       the job begins with it, at rest; the job ends with it
    job               number of the job, not 0
    sequence          0, 1, 2, …
    piece_shift       index of this chunk's piece 0 in the predecessor; `segment_shift`: the same of segment 0
    shared_pieces     number of pieces, from the first, that are those of the predecessor; the joint is the end of the
                      last
    shared_segments   the same of segments
    arc_shift_q40     arc length in the predecessor of arc length 0 here
    time_shift_q32_s  program time in the predecessor of time 0 here
    job_start_q40     arc length of the job at arc length 0 here
    line              source line at its start; 0: none
    remaining_ms      time from the joint to the end of the job; None: not known yet
    rest              what happens at rest before it; None: it begins in motion, or is the first
    joined            it ends without a tail: the next chunk begins at its end, at rest
    """

    first: bool
    last: bool
    job: int
    sequence: int
    piece_shift: int = 0
    segment_shift: int = 0
    shared_pieces: int = 0
    shared_segments: int = 0
    arc_shift_q40: int = 0
    time_shift_q32_s: int = 0
    job_start_q40: int = 0
    line: int = 0
    remaining_ms: int | None = None
    rest: Rest | None = None
    joined: bool = False

    @property
    def flags(self) -> int:
        """The flags as bits."""
        return (
            FLAG_FIRST * self.first
            | FLAG_LAST * self.last
            | FLAG_REST * (self.rest is not None)
            | FLAG_JOINED * self.joined
        )


@dataclass(frozen=True, eq=False)
class Chunk:
    """A header and the image of its program."""

    header: ChunkHeader
    image: bytes

    @property
    def size(self) -> int:
        """Bytes."""
        return HEADER_SIZE + len(self.image)

    @property
    def program(self) -> Program:
        """The program. Raises InputError: the image cannot be read."""
        return decode(self.image)

    def with_remaining(self, remaining_s: float | None) -> Chunk:
        """The chunk with this time from its joint to the end of the job."""
        ms = None if remaining_s is None else min(round(1000.0 * remaining_s), TIME_UNKNOWN - 1)
        return replace(self, header=replace(self.header, remaining_ms=ms))

    def encode(self) -> bytes:
        """The bytes. Raises InputError for values that the fields cannot hold."""
        one, rest = self.header, self.header.rest or Rest()
        try:
            body = _HEADER.pack(
                MAGIC,
                VERSION,
                one.flags,
                self.size,
                0,
                one.job,
                one.sequence,
                one.piece_shift,
                one.segment_shift,
                one.shared_pieces,
                one.shared_segments,
                one.arc_shift_q40,
                one.time_shift_q32_s,
                one.job_start_q40,
                one.line,
                TIME_UNKNOWN if one.remaining_ms is None else one.remaining_ms,
                rest.dwell_ms,
                REST_STOP * rest.stop | REST_OPTIONAL * rest.optional_stop,
            )
        except struct.error as error:
            raise InputError(f"chunk: a header field does not fit the format: {error}") from None
        whole = body + self.image
        crc = _crc_of(whole)
        return whole[: _CRC_FROM - 4] + struct.pack("<I", crc) + whole[_CRC_FROM:]


def _crc_of(whole: bytes) -> int:
    """CRC-32 of all bytes except the magic and the CRC."""
    return zlib.crc32(whole[_CRC_FROM:], zlib.crc32(whole[4 : _CRC_FROM - 4]))


def parse(data: bytes) -> Chunk:
    """The chunk in these bytes. Raises InputError: magic, version, size, flags, CRC or a reserved field is wrong."""
    if len(data) < HEADER_SIZE:
        raise InputError(f"chunk: {len(data)} bytes are less than a header")
    (magic, version, flags, size, crc, *rest) = _HEADER.unpack_from(data)
    if magic != MAGIC or version not in _READABLE or not _flags_fit(flags, rest[-2], rest[-1]):
        raise InputError("chunk: wrong magic, version or flag, or a reserved field is not 0")
    if not HEADER_SIZE <= size <= len(data):
        raise InputError(f"chunk: says {size} bytes, and there are {len(data)}")
    if _crc_of(data[:size]) != crc:
        raise InputError("chunk: CRC-32 is wrong")
    job, sequence, *shared, arc, time, start, line, remaining, dwell_ms, stops = rest
    header = ChunkHeader(
        bool(flags & FLAG_FIRST),
        bool(flags & FLAG_LAST),
        job,
        sequence,
        shared[0],
        shared[1],
        shared[2],
        shared[3],
        arc,
        time,
        start,
        line,
        None if remaining == TIME_UNKNOWN else remaining,
        Rest(dwell_ms, bool(stops & REST_STOP), bool(stops & REST_OPTIONAL))
        if flags & FLAG_REST
        else None,
        bool(flags & FLAG_JOINED),
    )
    return Chunk(header, bytes(data[HEADER_SIZE:size]))


def _flags_fit(flags: int, dwell_ms: int, stops: int) -> bool:
    """Whether flags and rest go together, by the rules of the controller."""
    if flags & ~_FLAGS or stops & ~(REST_STOP | REST_OPTIONAL):
        return False
    return bool(flags & FLAG_REST or not (dwell_ms or stops)) and not (
        flags & FLAG_JOINED and flags & FLAG_LAST
    )


def make(header: ChunkHeader, program: Program) -> Chunk:
    """A chunk of a program."""
    return Chunk(header, encode(program))


def shared_fault(chunk: Chunk, before: Chunk | None) -> str | None:
    """Why a chunk may not follow its predecessor (None: it is the first); None: it may. `program.check` checks the
    program itself.
    """
    one = chunk.header
    if before is None:
        alone = one.first and one.sequence == 0 and not (one.shared_pieces or one.shared_segments)
        return None if alone else "it is no first chunk"
    if one.rest is not None:
        return _rest_fault(one, before)
    if before.header.joined:
        return "its predecessor is followed by a rest"
    if one.first or one.job != before.header.job or one.sequence != before.header.sequence + 1:
        return "it is not the next chunk of the job"
    if one.job_start_q40 != before.header.job_start_q40 + one.arc_shift_q40:
        return "the arc length of the job does not go on"
    return _shared_fault(one, chunk.program, before.program)


def _rest_fault(one: ChunkHeader, before: Chunk) -> str | None:
    """The fault of a chunk that begins at rest."""
    if one.first or one.job != before.header.job or one.sequence != before.header.sequence + 1:
        return "it is not the next chunk of the job"
    shared = (one.piece_shift, one.segment_shift, one.shared_pieces, one.shared_segments)
    if any(shared) or one.arc_shift_q40 or one.time_shift_q32_s:
        return "it begins at rest and shares something"
    end_q40 = before.header.job_start_q40 + before.program.length_q40
    return None if one.job_start_q40 == end_q40 else "the arc length of the job does not go on"


def _shared_fault(one: ChunkHeader, own: Program, old: Program) -> str | None:
    """The fault of the shared part in the programs of both."""
    if one.piece_shift + one.shared_pieces >= old.piece_count + 1 or not one.shared_pieces:
        return "the shared pieces are not in the predecessor"
    if own.first_axis != old.first_axis or own.axis_count != old.axis_count:
        return "it moves other axes than its predecessor"
    if one.segment_shift + one.shared_segments != old.segment_count:
        return "the shared segments are not all that the predecessor has"
    if one.shared_segments > own.segment_count or one.shared_pieces > own.piece_count:
        return "it is shorter than its shared part"
    mine, theirs = slice(0, one.shared_segments), slice(one.segment_shift, None)
    moved = own.start_q40[mine] + one.arc_shift_q40
    same = (
        np.array_equal(moved, old.start_q40[theirs])
        and np.array_equal(own.point_q40[:, mine], old.point_q40[:, theirs])
        and np.array_equal(own.a_q44[:, mine], old.a_q44[:, theirs])
        and np.array_equal(own.extra_q40[:, mine], old.extra_q40[:, theirs])
    )
    if not same:
        return "a shared segment is not that of the predecessor"
    mine = slice(0, one.shared_pieces)
    theirs = slice(one.piece_shift, one.piece_shift + one.shared_pieces)
    a, b = own.pieces, old.pieces
    same = np.array_equal(a.start_q40[mine] + one.arc_shift_q40, b.start_q40[theirs]) and all(
        np.array_equal(getattr(a, name)[mine], getattr(b, name)[theirs])
        for name in (
            "duration_q32_s",
            "c_q40",
            "override_factor_q14",
            "override_rate_codes",
            "override_second_codes",
        )
    )
    if not same:
        return "a shared piece is not that of the predecessor"
    if not _same_events(one, own, old):
        return "the events of the shared part are not those of the predecessor"
    passed = sum(int(d) for d in b.duration_q32_s[: one.piece_shift])
    return None if passed == one.time_shift_q32_s else "the time shift is not that of the pieces"


def _same_events(one: ChunkHeader, own: Program, old: Program) -> bool:
    """Whether both have the same events on the shared part, up to the end of the predecessor."""
    theirs = old.events[old.events["place"] >= one.arc_shift_q40].copy()
    theirs["place"] -= one.arc_shift_q40
    mine = own.events[own.events["place"] <= old.length_q40 - one.arc_shift_q40]
    return np.array_equal(mine, theirs)
