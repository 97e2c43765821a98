# SPDX-License-Identifier: MIT
"""The rules of docs/protocol.md 1.1 to 1.3, as the controller checks them (firmware/core/program_check.h).

Independent of the C code on purpose: a program is judged by both. What the format decides exactly (joints, ranges,
sums) is decided here in exact integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .check_pieces import piece_faults
from .check_segments import segment_faults
from .codes import ProgramError
from .exactmath import segment_ways
from .image import NAME_SIZE, Program, decode, open_fault, reserved_faults

Int = NDArray[np.int64]

PERIODS_US = (1000, 2000, 4000, 8000)
LONGEST_Q32_S = 2**54
LONGEST_Q40_MM = 2**62


@dataclass(frozen=True)
class ProgramLimits:
    """What a controller allows, in the units of the protocol; 0 for period, feed, acceleration, jerk: any."""

    period_us: int
    feed_um_s: int
    acceleration_um_s2: int
    jerk_mm_s3: int
    min_q40_mm: tuple[int, int]
    max_q40_mm: tuple[int, int]


@dataclass(frozen=True)
class Fault:
    """The first rule broken, and the segment or piece (0 for the header)."""

    code: ProgramError
    index: int

    @property
    def place(self) -> str:
        """Where, in words."""
        if self.code > -20:
            return "header"
        return f"{'segment' if self.code > -40 else 'piece'} {self.index}"


def check(program: Program, limits: ProgramLimits | None = None) -> Fault | None:
    """The first rule that `program` breaks, None when it may run; order: header, segments, pieces."""
    header = _header_fault(program, limits)
    if header is not None:
        return Fault(header, 0)
    ways = segment_ways(program.u_q44, program.v_q44)
    return _first(segment_faults(program, ways, limits)) or _first(piece_faults(program, limits))


def check_image(image: bytes, limits: ProgramLimits | None = None) -> Fault | None:
    """The same from the bytes, with what `decode` refuses and what `Program` does not hold."""
    broken = open_fault(image)
    if broken is not None:
        return Fault(broken, 0)
    flags, axes, name, reserved_piece = reserved_faults(image)
    program = decode(image)
    own = check(program, limits)
    found = [] if own is None else [own]
    for wrong, code in ((flags, "FLAGS"), (axes, "AXES"), (name, "NAME")):
        if wrong:
            found.append(Fault(ProgramError[code], 0))
    if reserved_piece >= 0:
        found.append(Fault(ProgramError.PIECE_RESERVED, reserved_piece))
    return min(found, key=_rank, default=None)


def _rank(fault: Fault) -> tuple[int, int, int]:
    group = 0 if fault.code > -20 else 1 if fault.code > -40 else 2
    return group, fault.index, -fault.code


def _first(found: list[tuple[NDArray[np.bool_], int, ProgramError]]) -> Fault | None:
    """The lowest index, then the first code, of masks whose element 0 is the item `offset`."""
    hits = [Fault(code, int(mask.argmax()) + offset) for mask, offset, code in found if mask.any()]
    if not hits:
        return None
    return min(hits, key=lambda hit: (hit.index, -hit.code))


def _header_fault(program: Program, limits: ProgramLimits | None) -> ProgramError | None:
    total = sum(int(d) for d in program.pieces.duration_q32_s)
    if program.period_us not in PERIODS_US:
        return ProgramError.PERIOD
    if limits is not None and limits.period_us not in (0, program.period_us):
        return ProgramError.PERIOD_USED
    if not 0 < program.duration_q32_s <= LONGEST_Q32_S or total != program.duration_q32_s:
        return ProgramError.DURATION
    if not 0 < program.length_q40 < LONGEST_Q40_MM:
        return ProgramError.LENGTH
    if len(program.name.encode()) > NAME_SIZE:
        return ProgramError.NAME
    return None
