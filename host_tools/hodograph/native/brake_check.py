# SPDX-License-Identifier: MIT
"""The proof that stops keep the limits of the axes, as the controller makes it (firmware/core/brake_check.h). Used by
machine_limits. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence

from .library import library
from .program import NativeLimits, NativeProgram, limits_fields


class BrakeCheck:
    """The proof for a program on a machine. The program has to keep the other rules of program_check; its stop table is
    not read.
    """

    def __init__(self, program: NativeProgram, limits: NativeLimits) -> None:
        ffi, lib = library()
        self._program = program
        self._limits = ffi.new("struct program_limits *", limits_fields(limits))
        self._check = ffi.new("struct brake_check *")
        lib.brake_check_begin(self._check, program.pointer, self._limits)

    @property
    def evaluations(self) -> int:
        """Number of stretches of path stops that the last proof evaluated: its cost."""
        return int(self._check.evaluations)

    def proves(self, piece: int, kind: int, codes: Sequence[int]) -> bool:
        """Whether stops of a kind (HOLD or FAULT of hodograph.program.stops) that begin in a feed piece keep the limits
        with these three codes.
        """
        ffi, lib = library()
        own = ffi.new("struct program_stop *", tuple(int(code) for code in codes))
        return bool(lib.brake_check_piece(self._check, piece, kind, own))
