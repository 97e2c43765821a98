# SPDX-License-Identifier: MIT
"""The program image: reads it from a file, decodes it to arrays, encodes it to bytes, and gives the memory that it
needs in the controller. Format: docs/reference/protocol.md 1.1 to 1.4.

Used by many modules of host_tools. `read_image` reads the file that it is given; no other I/O.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..events import EVENT, Events, no_events
from ..feed.override_levels import LEVELS
from ..feed.pieces import FeedPieces
from ..fixed_point import MM_PER_Q40
from ..names import FIRST_AXIS_SHIFT
from .codes import ProgramError
from .stops import Stops

Int = NDArray[np.int64]

MAGIC = b"HDGP"
VERSION = 2
HEADER_SIZE, SEGMENT_SIZE, PIECE_SIZE, STOP_SIZE = 128, 72, 88, 16
"""Sizes of header and segment of a program in the plane; `header_size` and `segment_size` give those of others."""
PLANE_AXES, SPACE_AXES, MOST_AXES = 2, 3, 6
FLAG_CLOSED, FLAG_MOVING, FLAG_COMPACT = 1, 2, 4
_FIRST_AXIS_FLAGS = 7 << FIRST_AXIS_SHIFT
NAME_SIZE = 32

_HEADER = struct.Struct("<4sHHII III HH Q qqq III I 32s 4I".replace(" ", ""))
_CRC_FROM = 16
_PIECE = np.dtype(
    [
        ("duration", "<u8"),
        ("start", "<i8"),
        ("c", "<i8", 7),
        ("factor", "<u2"),
        ("rate", "u1", LEVELS),
        ("second", "u1", LEVELS),
    ]
)
_I48 = np.dtype([("low", "<u4"), ("high", "<i2")])
_PLANAR_SEGMENT = np.dtype([("start", "<i8"), ("point", "<i8", 2), ("a", "<i8", (3, 2))])
_SPATIAL_SEGMENT = [("start", "<i8"), ("point", "<i8", 3), ("a", _I48, (3, 4))]
_EXTRA_AXIS = np.dtype([("start", "<i8"), ("b", _I48, 5)])
_STOP = np.dtype([("codes", "u1", (2, 3)), ("reserved", "<u2"), ("bound_us", "<u4", 2)])

_I56, _U24 = ("u1", 7), ("u1", 3)
_COMPACT_PIECE = np.dtype(
    [
        ("duration", "<u4"),
        ("start", *_I56),
        ("c", _I48, 7),
        ("factor", "<u2"),
        ("rate", "u1", LEVELS),
        ("second", "u1", LEVELS),
    ]
)
_COMPACT_PLANAR = np.dtype([("start", *_I56), ("point", "u1", (2, 7)), ("a", _I48, (3, 2))])
_COMPACT_SPATIAL = [("start", *_I56), ("point", "u1", (3, 7)), ("a", _I48, (3, 4))]
_COMPACT_EXTRA = np.dtype([("start", *_I56), ("b", _I48, 5)])
_COMPACT_STOP = np.dtype([("codes", "u1", (2, 3)), ("bound_us", "u1", (2, 3))])
COMPACT_PIECE_SIZE, COMPACT_STOP_SIZE = _COMPACT_PIECE.itemsize, _COMPACT_STOP.itemsize
COMPACT_PIECE_BYTES = COMPACT_PIECE_SIZE + COMPACT_STOP_SIZE
"""Bytes of a compact piece with its stop."""


@dataclass(frozen=True, eq=False)
class Program:
    """A program as the image has it: integers in the Q formats of docs/reference/protocol.md.

    start_q40  (N,) arc length at the start of each segment, mm
    point_q40  (A, N) the point there, by axis: x, y in the plane; x, y, z and the extra axes in space
    a_q44      Bernstein coefficients of the preimage, mm^(1/2): in the plane (2, N, 3) those of w = u + iq, in space
               (4, N, 3) those of A = u + v i + p j + q k
    extra_q40  (A - 3, N, 5) Bezier coefficients 1 … 5 of the extra axes from the segment's start; mm, degrees
    offset_q40 work offset of each axis, which the points include
    pieces     the M feed pieces, and `stops` for each of them
    moving     it begins in motion: only in a chunk of a stream
    compact    its image has compact records if its numbers fit them: only in a chunk of a stream
    events     outputs that switch on the path, by place
    first_axis the machine's number of the program's first axis
    Limits of 0 mean none.
    """

    name: str
    period_us: int
    closed: bool
    duration_q32_s: int
    length_q40: int
    offset_q40: tuple[int, ...]
    feed_limit_um_s: int
    acceleration_limit_um_s2: int
    jerk_limit_mm_s3: int
    start_q40: Int
    point_q40: Int
    a_q44: Int
    pieces: FeedPieces
    stops: Stops
    extra_q40: Int = field(default_factory=lambda: np.zeros((0, 0, 5), dtype=np.int64))
    moving: bool = False
    compact: bool = False
    events: Events = field(default_factory=no_events)
    first_axis: int = 0

    def __post_init__(self) -> None:
        if not len(self.extra_q40):
            none = np.zeros((0, self.segment_count, 5), dtype=np.int64)
            object.__setattr__(self, "extra_q40", none)

    @property
    def axis_count(self) -> int:
        """A: number of axes that follow the path."""
        return int(self.point_q40.shape[0])

    @property
    def segment_count(self) -> int:
        """N."""
        return int(self.start_q40.size)

    @property
    def piece_count(self) -> int:
        """M."""
        return len(self.pieces)

    @property
    def image_size(self) -> int:
        """Bytes of the image."""
        return self._layout.size(self.segment_count, self.piece_count, len(self.events))

    @cached_property
    def has_compact_image(self) -> bool:
        """Whether its image has compact records."""
        return self.compact and _fits_compact(self)

    @property
    def _layout(self) -> _Layout:
        return _Layout(self.axis_count, self.has_compact_image)

    @property
    def ticks(self) -> int:
        """Setpoints: ceil(duration / period) + 1, in exact arithmetic."""
        return -(-self.duration_q32_s * 1_000_000 // (self.period_us << 32)) + 1

    @property
    def duration_s(self) -> float:
        """Time of the program."""
        return self.duration_q32_s * 2.0**-32

    @property
    def length_mm(self) -> float:
        """Arc length of the path."""
        return self.length_q40 * MM_PER_Q40

    @property
    def piece_starts_mm(self) -> NDArray[np.float64]:
        """Arc length (M,) at the start of each piece."""
        return np.ldexp(self.pieces.start_q40.astype(np.float64), -40)

    def tick_times_q42_s(self) -> NDArray[np.uint64]:
        """Program time (ticks,) of each setpoint in 2^-42 s: min(floor(k period + 1/2), duration)."""
        k = np.arange(self.ticks, dtype=np.uint64)
        whole_s, rest_us = np.divmod(k * np.uint64(self.period_us), np.uint64(1_000_000))
        part = ((rest_us << np.uint64(42)) + np.uint64(500_000)) // np.uint64(1_000_000)
        return np.minimum((whole_s << np.uint64(42)) + part, np.uint64(self.duration_q32_s << 10))


def encode(program: Program) -> bytes:
    """The image. Numbers are written as they are, right or wrong (`check` judges them). Raises InputError: a field
    cannot hold its value.
    """
    layout, own = program._layout, program.pieces
    pieces = np.zeros(program.piece_count, dtype=layout.piece)
    _put(pieces["duration"], own.duration_q32_s)
    _put(pieces["start"], own.start_q40)
    _put(pieces["c"], own.c_q40)
    pieces["factor"], pieces["rate"] = own.override_factor_q14, own.override_rate_codes
    pieces["second"] = own.override_second_codes
    stops = np.zeros(program.piece_count, dtype=layout.stop)
    stops["codes"] = program.stops.codes
    _put(stops["bound_us"], program.stops.bound_us)
    segments = _segments(program)
    body = segments.tobytes() + pieces.tobytes() + stops.tobytes() + program.events.tobytes()
    return with_crc(_header(program) + body)


def _header(program: Program) -> bytes:
    """The header with a CRC of 0. Raises InputError: a field cannot hold its value."""
    name = program.name.encode()
    if len(name) > NAME_SIZE:
        raise InputError(
            f"program: name {program.name!r} is longer than {NAME_SIZE} bytes of UTF-8"
        )
    try:
        return _HEADER.pack(
            MAGIC,
            VERSION,
            header_size(program.axis_count),
            program.image_size,
            0,
            program.period_us,
            program.segment_count,
            program.piece_count,
            FLAG_CLOSED * program.closed
            | FLAG_MOVING * program.moving
            | FLAG_COMPACT * program.has_compact_image
            | program.first_axis << FIRST_AXIS_SHIFT,
            program.axis_count,
            program.duration_q32_s,
            program.length_q40,
            *program.offset_q40[:PLANE_AXES],
            program.feed_limit_um_s,
            program.acceleration_limit_um_s2,
            program.jerk_limit_mm_s3,
            len(program.events),
            name,
            program.stops.worst_us[0],
            program.stops.worst_um[0],
            program.stops.worst_us[1],
            program.stops.worst_um[1],
        ) + struct.pack(f"<{program.axis_count - PLANE_AXES}q", *program.offset_q40[PLANE_AXES:])
    except struct.error as error:
        raise InputError(f"program: a header field does not fit the format: {error}") from None


def with_crc(image: bytes) -> bytes:
    """The image with its CRC-32 (bytes 12 … 15) computed."""
    crc = zlib.crc32(image[_CRC_FROM:])
    return image[: _CRC_FROM - 4] + struct.pack("<I", crc) + image[_CRC_FROM:]


def decode(image: bytes) -> Program:
    """The program in an image. Raises InputError, with the code of docs/reference/protocol.md 1.5, for what
    `program_open` of the controller refuses (sizes, magic, version, CRC, counts); the rest is for `check`.
    """
    fault = open_fault(image)
    if fault is not None:
        raise InputError(f"program image: {fault.text} ({fault.name}): compile it again")
    head = _HEADER.unpack_from(image)
    segment_count, piece_count, axes = head[6], head[7], head[9]
    begin, layout = header_size(axes), _Layout(axes, bool(head[8] & FLAG_COMPACT))
    after = begin + layout.segment.itemsize * segment_count
    segments = np.frombuffer(image, layout.segment, segment_count, begin)
    extra = [segments[f"extra{k}"] for k in range(axes - SPACE_AXES)]
    points = [_taken(segments["point"]).T, *(_taken(one["start"])[None] for one in extra)]
    stops_at = after + layout.piece.itemsize * piece_count
    stops_end = stops_at + layout.stop.itemsize * piece_count
    return Program(
        name=head[18].rstrip(b"\0").decode(errors="replace"),
        period_us=head[5],
        closed=bool(head[8] & FLAG_CLOSED),
        moving=bool(head[8] & FLAG_MOVING),
        compact=bool(head[8] & FLAG_COMPACT),
        first_axis=(head[8] & _FIRST_AXIS_FLAGS) >> FIRST_AXIS_SHIFT,
        duration_q32_s=head[10],
        length_q40=head[11],
        offset_q40=(
            *head[12:14],
            *struct.unpack_from(f"<{axes - PLANE_AXES}q", image, HEADER_SIZE),
        ),
        feed_limit_um_s=head[14],
        acceleration_limit_um_s2=head[15],
        jerk_limit_mm_s3=head[16],
        start_q40=_taken(segments["start"]),
        point_q40=np.concatenate(points),
        a_q44=np.ascontiguousarray(np.moveaxis(_taken(segments["a"]), 2, 0)),
        pieces=_decode_pieces(np.frombuffer(image, layout.piece, piece_count, after)),
        stops=_decode_stops(image, np.frombuffer(image, layout.stop, piece_count, stops_at)),
        extra_q40=np.array([_taken(one["b"]) for one in extra], dtype=np.int64).reshape(
            max(axes - SPACE_AXES, 0), segment_count, 5
        ),
        events=np.frombuffer(image, EVENT, head[17], stops_end).copy(),
    )


def _decode_pieces(raw: NDArray[np.void]) -> FeedPieces:
    return FeedPieces(
        _taken(raw["duration"]),
        _taken(raw["start"]),
        _taken(raw["c"]),
        raw["factor"].astype(np.uint32),
        raw["rate"].copy(),
        raw["second"].copy(),
    )


def _decode_stops(image: bytes, table: NDArray[np.void]) -> Stops:
    head = _HEADER.unpack_from(image)
    return Stops(
        table["codes"].copy(),
        _taken(table["bound_us"], signed=False).astype(np.uint32),
        (head[19], head[21]),
        (head[20], head[22]),
    )


def header_size(axes: int) -> int:
    """Bytes of the header of a program that so many axes follow."""
    return HEADER_SIZE + 8 * (axes - PLANE_AXES)


def segment_size(axes: int, *, compact: bool = False) -> int:
    """Bytes of a segment of a program that so many axes follow."""
    return _Layout(axes, compact).segment.itemsize


@dataclass(frozen=True)
class _Layout:
    """The records of an image whose program so many axes follow."""

    axes: int
    compact: bool

    @property
    def segment(self) -> np.dtype[np.void]:
        """Of a segment."""
        if self.axes == PLANE_AXES:
            return _COMPACT_PLANAR if self.compact else _PLANAR_SEGMENT
        curve = _COMPACT_SPATIAL if self.compact else _SPATIAL_SEGMENT
        one = _COMPACT_EXTRA if self.compact else _EXTRA_AXIS
        return np.dtype([*curve, *((f"extra{k}", one) for k in range(self.axes - SPACE_AXES))])

    @property
    def piece(self) -> np.dtype[np.void]:
        """Of a feed piece."""
        return _COMPACT_PIECE if self.compact else _PIECE

    @property
    def stop(self) -> np.dtype[np.void]:
        """Of a stop."""
        return _COMPACT_STOP if self.compact else _STOP

    def size(self, segments: int, pieces: int, events: int) -> int:
        """Bytes of the image."""
        body = self.segment.itemsize * segments
        body += (self.piece.itemsize + self.stop.itemsize) * pieces
        return header_size(self.axes) + body + EVENT.itemsize * events


def _fits_compact(program: Program) -> bool:
    """Whether all numbers fit compact records; protocol.md 1.7.1.

    Durations are below 1 s and bounds below 2^24 us. Arc lengths and places are within 32768 mm, coefficients within
    128 mm, those of the preimage within 8 mm^(1/2). For extra axes the unit may be degrees.
    """
    pieces = program.pieces
    powers = (pieces.c_q40, program.a_q44, program.extra_q40)
    places = (program.start_q40, pieces.start_q40, program.point_q40)
    return bool(
        pieces.duration_q32_s.max(initial=0) < 1 << 32
        and all(_within(one, 1 << 47) for one in powers)
        and program.length_q40 < 1 << 55
        and all(_within(one, 1 << 55) for one in places)
        and program.stops.bound_us.max(initial=0) < 1 << 24
    )


def _within(values: Int, limit: int) -> bool:
    return bool(values.min(initial=0) >= -limit and values.max(initial=0) < limit)


def _segments(program: Program) -> NDArray[np.void]:
    """The segments as records of the image."""
    axes = program.axis_count
    out = np.zeros(program.segment_count, dtype=program._layout.segment)
    drawn = PLANE_AXES if axes == PLANE_AXES else SPACE_AXES
    _put(out["start"], program.start_q40)
    _put(out["point"], program.point_q40[:drawn].T)
    _put(out["a"], np.moveaxis(program.a_q44, 0, 2))
    for k in range(axes - SPACE_AXES):
        _put(out[f"extra{k}"]["start"], program.point_q40[SPACE_AXES + k])
        _put(out[f"extra{k}"]["b"], program.extra_q40[k])
    return out


def _put(field: NDArray[Any], values: NDArray[Any]) -> None:
    """Writes integers to a field of records: of 4 or 8 bytes, as _I48, or as bytes."""
    if field.dtype == _I48:
        if not _within(values, 1 << 47):
            raise InputError("program: a coefficient does not fit the 48 bits of the format")
        field["low"], field["high"] = values & 0xFFFFFFFF, values >> 32
    elif field.ndim == values.ndim:
        field[...] = values
    else:
        whole = np.ascontiguousarray(values, dtype="<i8").view(np.uint8)
        field[...] = whole.reshape(*values.shape, 8)[..., : field.shape[-1]]


def _taken(field: NDArray[Any], *, signed: bool = True) -> Int:
    """The integers of such a field."""
    if field.dtype == _I48:
        low, high = field["low"].astype(np.int64), field["high"].astype(np.int64)
        return np.asarray((high << 32) | low)
    if field.dtype != np.uint8:
        return field.astype(np.int64)
    width = field.shape[-1]
    whole = np.zeros((*field.shape[:-1], 8), dtype=np.uint8)
    whole[..., 8 - width :] = field
    shifted = whole.view("<i8" if signed else "<u8")[..., 0]
    return np.asarray(shifted >> shifted.dtype.type(8 * (8 - width))).astype(np.int64)


def open_fault(image: bytes) -> ProgramError | None:
    """The reason why `program_open` of the controller refuses an image; None: it does not."""
    if len(image) < HEADER_SIZE:
        return ProgramError.SIZE
    head = _HEADER.unpack_from(image)
    if head[0] != MAGIC:
        return ProgramError.MAGIC
    axes = head[9]
    if head[1] != VERSION:
        return ProgramError.VERSION
    if not PLANE_AXES <= axes <= MOST_AXES:
        return ProgramError.AXES
    if head[2] != header_size(axes):
        return ProgramError.VERSION
    size = _Layout(axes, bool(head[8] & FLAG_COMPACT)).size(head[6], head[7], head[17])
    if head[3] != size or len(image) < size:
        return ProgramError.SIZE
    if head[6] == 0 or head[7] == 0:
        return ProgramError.COUNT
    if head[4] != zlib.crc32(image[_CRC_FROM:size]):
        return ProgramError.CRC
    return None


@dataclass(frozen=True, eq=False)
class ReservedFields:
    """Content of an image that is not in `Program`: whether flags of the header and the padding of the name are
    correct, and the first stop whose reserved fields are not 0 (None: none).
    """

    flags: bool
    name: bool
    stops: NDArray[np.bool_] | None


def reserved_fields(image: bytes) -> ReservedFields:
    """The reserved fields of an image that opens."""
    head = _HEADER.unpack_from(image)
    name = head[18]
    compact, stops = bool(head[8] & FLAG_COMPACT), None
    if not compact:
        after = header_size(head[9]) + segment_size(head[9]) * head[6]
        table = np.frombuffer(image, _STOP, head[7], after + PIECE_SIZE * head[7])
        stops = table["reserved"] != 0
    return ReservedFields(
        flags=not head[8] & ~(FLAG_CLOSED | FLAG_MOVING | FLAG_COMPACT | _FIRST_AXIS_FLAGS),
        name=not any(name[name.find(b"\0") :]) if b"\0" in name else True,
        stops=stops,
    )


@dataclass(frozen=True)
class ProgramLimits:
    """The limits of a controller, in the units of the protocol; 0, except for the travel: no limit.

    stop_time_ms  greatest bound of a fault stop
    axis_count    path axes of the machine; 0: any

    Limits of the axes are in the order of the path. Only the controller's own check proves them
    (firmware/core/limit_check.h).
    """

    period_us: int
    feed_um_s: int
    acceleration_um_s2: int
    jerk_mm_s3: int
    min_q40_mm: tuple[int, ...]
    max_q40_mm: tuple[int, ...]
    stop_time_ms: int = 0
    axis_velocity_um_s: tuple[int, ...] = (0, 0)
    axis_acceleration_um_s2: tuple[int, ...] = (0, 0)
    axis_jerk_mm_s3: tuple[int, ...] = (0, 0)
    axis_count: int = 0


def read_image(file: Path) -> bytes | None:
    """The bytes of a program image; None: the file is of another kind, such as a path file. Raises InputError: it
    cannot be read.
    """
    try:
        with file.open("rb") as source:
            if source.read(4) != MAGIC and file.suffix != ".hdgp":
                return None
            source.seek(0)
            return source.read()
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None


@dataclass(frozen=True)
class RecordBytes:
    """Bytes of the coefficient cache by kernel: for each segment in the plane, each piece, each segment in space, and
    each extra axis of such a segment (docs/reference/protocol.md 1.6; 0x2041 subs 2 to 5).
    """

    segment: int
    piece: int
    spatial_segment: int
    extra_axis: int


RECORD_BYTES = {
    "fixed": RecordBytes(296, 256, 384, 56),
    "float": RecordBytes(280, 256, 344, 56),
    "double": RecordBytes(256, 224, 320, 48),
}
"""By kernel."""
LARGEST_BANK = 64 * 2**20 - 16
"""Bytes for a program in the largest program store of all ports (Linux); those of boards are smaller."""
_COUNTS = struct.Struct("<20xIIxxH")


def record_bytes(records: RecordBytes, axes: int) -> tuple[int, int]:
    """Bytes of the coefficient records of a segment of a program with so many axes, and of a piece."""
    extra = max(0, axes - SPACE_AXES) * records.extra_axis
    return records.segment if axes <= PLANE_AXES else records.spatial_segment + extra, records.piece


def memory_bytes(image: bytes, records: RecordBytes) -> int:
    """Bytes of an image and its coefficient records. The image needs a whole header."""
    segments, pieces, axes = _COUNTS.unpack_from(image[:HEADER_SIZE])
    segment, piece = record_bytes(records, axes)
    return len(image) + int(segments) * segment + int(pieces) * piece
