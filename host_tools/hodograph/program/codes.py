# SPDX-License-Identifier: MIT
"""Reasons for refusing a program: the codes of the controller, with its names and numbers.

The same table as `enum program_error` in firmware/core/program_rules.h (a test compares them).

Used by program/, stream/chunks, bus/sdo/upload and pipeline. No I/O.
"""

from __future__ import annotations

from enum import IntEnum


class ProgramError(IntEnum):
    """Code of a refusal (object 0x2000 sub 3). `text`: the reason in English."""

    SIZE = -1
    MAGIC = -2
    VERSION = -3
    CRC = -4
    COUNT = -5
    STORE = -6
    ROOM = -7
    KERNEL = -8
    PERIOD = -10
    PERIOD_USED = -11
    FLAGS = -12
    AXES = -13
    DURATION = -14
    LENGTH = -15
    NAME = -16
    W_RANGE = -20
    POINT_RANGE = -21
    ARC_RANGE = -22
    SIGMA = -23
    SIGMA_RATIO = -24
    SEGMENT_LONG = -25
    SEGMENT_FIRST = -26
    JOIN_POINT = -27
    JOIN_ARC = -28
    JOIN_DIRECTION = -29
    SEGMENT_END = -30
    NOT_CLOSED = -31
    SEGMENT_SHORT = -32
    TRAVEL = -33
    PIECE_DURATION = -40
    COEFFICIENT = -41
    PIECE_LONG = -42
    PIECE_FIRST = -43
    JOIN_LENGTH = -44
    JOIN_FEED = -45
    JOIN_ACCELERATION = -46
    START_MOVING = -47
    END_MOVING = -48
    PIECE_END = -49
    PIECE_SHORT = -50
    BACKWARDS = -51
    FEED = -52
    ACCELERATION = -53
    JERK = -54
    OVERRIDE = -55
    AXIS_VELOCITY = -70
    AXIS_ACCELERATION = -71
    AXIS_JERK = -72
    AXIS_STEP = -73
    STOP_ENTRY = -60
    STOP_NUMBERS = -61
    STOP_BOUND = -62
    STOP_LONG = -63
    STOP_WORST = -64
    EVENT_KIND = -100
    EVENT_VALUE = -101
    EVENT_PLACE = -102
    EVENT_DENSE = -103
    CHUNK_FORMAT = -80
    CHUNK_CRC = -81
    CHUNK_JOB = -82
    CHUNK_SEQUENCE = -83
    CHUNK_FIRST = -84
    CHUNK_PROGRAM = -85
    CHUNK_SHARED = -86
    CHUNK_SEGMENT = -87
    CHUNK_PIECE = -88
    CHUNK_OVER = -89
    CHUNK_REST = -79
    CHUNK_EVENT = -78

    @property
    def text(self) -> str:
        """The reason in one line of English."""
        return _TEXTS[self]


_TEXTS = {
    ProgramError.SIZE: "truncated, or sizes and counts do not fit each other",
    ProgramError.MAGIC: 'does not begin with "HDGP"',
    ProgramError.VERSION: "version or header size unknown",
    ProgramError.CRC: "CRC-32 of the contents is wrong",
    ProgramError.COUNT: "no segment or no piece",
    ProgramError.STORE: "the program store did not keep it",
    ProgramError.ROOM: "with its precomputed coefficients too large for the program store",
    ProgramError.KERNEL: "the controller does not have the kernel configured",
    ProgramError.PERIOD: "period not 1000, 2000, 4000 or 8000 us",
    ProgramError.PERIOD_USED: "period is not the one configured in the controller",
    ProgramError.FLAGS: "unknown flag, or one that only a chunk may have",
    ProgramError.AXES: "axis count is not 2 ... 6, or not that of the machine",
    ProgramError.DURATION: "not the sum of the pieces, or not below 2^22 s",
    ProgramError.LENGTH: "length not in (0, 2^22) mm",
    ProgramError.NAME: "name not padded with zeros",
    ProgramError.W_RANGE: "a component of the preimage is 64 or more, in space 8 or more",
    ProgramError.POINT_RANGE: "coordinate is 4096 mm or more",
    ProgramError.ARC_RANGE: "arc length is negative or 2^22 mm or more",
    ProgramError.SIGMA: "a Bernstein coefficient of the parametric speed is not positive",
    ProgramError.SIGMA_RATIO: "the largest is more than twice the smallest",
    ProgramError.SEGMENT_LONG: "longer than 32 mm",
    ProgramError.SEGMENT_FIRST: "the first segment does not start at arc length 0",
    ProgramError.JOIN_POINT: "points differ by more than 2^-34 mm",
    ProgramError.JOIN_ARC: "arc lengths differ by more than 2^-34 mm",
    ProgramError.JOIN_DIRECTION: "directions differ by more than 2^-20 rad",
    ProgramError.SEGMENT_END: "the last segment does not end at the length of the header",
    ProgramError.NOT_CLOSED: 'flag "closed", but end and start are more than 2^-24 mm apart',
    ProgramError.SEGMENT_SHORT: "a tick at 200 % could cross more than two segment ends",
    ProgramError.TRAVEL: "leaves the travel limits",
    ProgramError.PIECE_DURATION: "duration 0, or above 2^22 s",
    ProgramError.COEFFICIENT: "a coefficient is above 2^14 mm",
    ProgramError.PIECE_LONG: "longer than 32 mm",
    ProgramError.PIECE_FIRST: "the first piece does not start at arc length 0",
    ProgramError.JOIN_LENGTH: "F differs by more than 2^-34 mm",
    ProgramError.JOIN_FEED: "F' differs by more than 2^-16 mm/s",
    ProgramError.JOIN_ACCELERATION: "F'' differs by more than 2^-6 mm/s^2",
    ProgramError.START_MOVING: "the program does not begin at rest",
    ProgramError.END_MOVING: "the program does not end at rest",
    ProgramError.PIECE_END: "the last piece does not end at the length of the header",
    ProgramError.PIECE_SHORT: "two adjacent pieces last two periods or less",
    ProgramError.BACKWARDS: "feed below -2^-10 mm/s",
    ProgramError.FEED: "above the feed limit of the controller",
    ProgramError.ACCELERATION: "above its acceleration limit",
    ProgramError.JERK: "above its jerk limit",
    ProgramError.OVERRIDE: "override factor not in 1.0 ... 2.0, or an override bound is 0",
    ProgramError.AXIS_VELOCITY: "above the velocity limit of an axis",
    ProgramError.AXIS_ACCELERATION: "above the acceleration limit of an axis",
    ProgramError.AXIS_JERK: "above the jerk limit of an axis",
    ProgramError.AXIS_STEP: "velocity or acceleration of an axis jumps at a joint",
    ProgramError.STOP_ENTRY: "some codes of a stop are 0 and some are not, or a reserved field is not 0",
    ProgramError.STOP_NUMBERS: "a path stop would be above the limits of the controller",
    ProgramError.STOP_BOUND: "a stop can take longer than its bound",
    ProgramError.STOP_LONG: "a fault stop can take longer than the controller allows",
    ProgramError.STOP_WORST: "the worst stops of the header are not those of the table",
    ProgramError.EVENT_KIND: "kind or channel of an event is unknown",
    ProgramError.EVENT_VALUE: "an event changes outputs outside its mask, or its value is too large",
    ProgramError.EVENT_PLACE: "an event is before the one before it, or not on the path",
    ProgramError.EVENT_DENSE: "a tick at 200 % could pass more than 16 events",
    ProgramError.CHUNK_FORMAT: "chunk: wrong magic, version, size or flag, or a reserved field is not 0",
    ProgramError.CHUNK_CRC: "chunk: CRC-32 is wrong",
    ProgramError.CHUNK_JOB: "chunk: of another job, or job 0",
    ProgramError.CHUNK_SEQUENCE: "chunk: sequence number is not the next one",
    ProgramError.CHUNK_FIRST: 'chunk: its flag "first" contradicts its predecessor or its start',
    ProgramError.CHUNK_PROGRAM: "chunk: period, axis count or first axis is not that of its predecessor",
    ProgramError.CHUNK_SHARED: "chunk: shifts or shared counts do not fit its predecessor",
    ProgramError.CHUNK_SEGMENT: "chunk: a shared segment is not that of its predecessor",
    ProgramError.CHUNK_PIECE: "chunk: a shared piece is not that of its predecessor",
    ProgramError.CHUNK_OVER: "chunk: of a job that is over, or checked under another configuration",
    ProgramError.CHUNK_REST: "chunk: does not begin at rest where its predecessor ends",
    ProgramError.CHUNK_EVENT: "chunk: events of the shared part are not those of its predecessor",
}
