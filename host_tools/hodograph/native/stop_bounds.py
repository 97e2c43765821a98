# SPDX-License-Identifier: MIT
"""Bounds of the stops of a program, as the controller computes them (firmware/core/stop_check.h). Used by
program/stop_planning. No I/O.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .library import library
from .program import NativeProgram


def stop_bounds(program: NativeProgram, kind: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Bounds (M,) of time in us and distance in um from the command to rest, with the stop parameters of the program.

    kind  HOLD or FAULT of hodograph.program.stops
    """
    ffi, lib = library()
    count = int(program.pointer.header.piece_count)
    time_us, distance_um = np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32)
    walk = ffi.new("struct stop_walk *")
    lib.stop_walk_begin(walk, program.pointer, kind)
    for piece in range(count - 1, -1, -1):
        bound = lib.stop_walk_back(walk, piece)
        time_us[piece], distance_um[piece] = bound.time_us, bound.distance_um
    return time_us, distance_um
