# SPDX-License-Identifier: MIT
"""The rules of docs/reference/protocol.md 1.1 to 1.4, as the controller checks them (firmware/core/program_check.h).

Independent of the C code on purpose: a program is judged by both. What the format decides exactly (joints, ranges,
sums) is decided here in exact integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .check_pieces import last_piece_faults, piece_faults
from .check_segments import Rule, end_faults, segment_faults, too_short
from .check_stops import stop_fault
from .codes import ProgramError
from .exactmath import segment_ways
from .image import Program, ReservedFields, decode, open_fault, reserved_fields
from .limits import ProgramLimits

Int = NDArray[np.int64]

PERIODS_US = (1000, 2000, 4000, 8000)
LONGEST_Q32_S = 2**54
LONGEST_Q40_MM = 2**62


@dataclass(frozen=True)
class Fault:
    """The first rule broken, and the segment or piece (0 for the header)."""

    code: ProgramError
    index: int

    @property
    def place(self) -> str:
        """Where, in words."""
        if self.code > -20 or self.code == ProgramError.STOP_WORST:
            return "header"
        return f"{'segment' if self.code > -40 else 'piece'} {self.index}"


def check(program: Program, limits: ProgramLimits | None = None) -> Fault | None:
    """The first rule that `program` breaks, None when it may run.

    The order is that of the controller: header, segments one by one, their end, pieces one by one, their
    end and sum, then what two segments have to do with the pieces over them, and last the stops.
    """
    return _check(program, limits, _CLEAN)


def check_image(image: bytes, limits: ProgramLimits | None = None) -> Fault | None:
    """The same from the bytes, with what `decode` refuses and what `Program` does not hold."""
    broken = open_fault(image)
    if broken is not None:
        return Fault(broken, 0)
    return _check(decode(image), limits, reserved_fields(image))


_CLEAN = ReservedFields(flags=True, axes=True, name=True, stops=None)


def _check(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields
) -> Fault | None:
    header = _header_fault(program, limits, reserved)
    if header is not None:
        return Fault(header, 0)
    ways = segment_ways(program.u_q44, program.v_q44)
    return (
        _first(segment_faults(program, ways, limits))
        or _first(end_faults(program, ways))
        or _first(piece_faults(program, limits))
        or _first(last_piece_faults(program))
        or _duration_fault(program)
        or _first([(too_short(program), 0, ProgramError.SEGMENT_SHORT)])
        or _stop_fault(program, limits, reserved)
    )


def _stop_fault(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields
) -> Fault | None:
    found = stop_fault(program, limits, reserved.stops)
    return None if found is None else Fault(*found)


def _first(rules: list[Rule]) -> Fault | None:
    """The lowest index, then the first rule in order, of the masks."""
    hits = [
        (int(mask.argmax()) + offset, rank, code)
        for rank, (mask, offset, code) in enumerate(rules)
        if mask.any()
    ]
    if not hits:
        return None
    index, _, code = min(hits)
    return Fault(code, index)


def _header_fault(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields
) -> ProgramError | None:
    if program.period_us not in PERIODS_US:
        return ProgramError.PERIOD
    if limits is not None and limits.period_us not in (0, program.period_us):
        return ProgramError.PERIOD_USED
    if not reserved.flags:
        return ProgramError.FLAGS
    if not reserved.axes:
        return ProgramError.AXES
    if not 0 < program.length_q40 < LONGEST_Q40_MM:
        return ProgramError.LENGTH
    if not reserved.name:
        return ProgramError.NAME
    return None


def _duration_fault(program: Program) -> Fault | None:
    total = sum(int(d) for d in program.pieces.duration_q32_s)
    if total == program.duration_q32_s and total < LONGEST_Q32_S:
        return None
    return Fault(ProgramError.DURATION, 0)
