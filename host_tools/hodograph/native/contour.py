# SPDX-License-Identifier: MIT
"""Distance from the exact curve of a program (sim/offline/contour.h, docs/theory/drives.md section 14). Used by
simulate/, monitor/derived and faults/judge. No I/O.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .library import library
from .program import Counts, NativeProgram, counts_by_axis


class Contour:
    """The curve of a checked program, expanded once. Calls are independent of each other."""

    def __init__(self, program: NativeProgram) -> None:
        """Expand the segments; raises InputError when the program does not pass its check."""
        ffi, lib = library()
        program.require()
        self._segments = ffi.new("struct contour_segment[]", program.segment_count)
        self._program = program
        self.pointer = ffi.new("struct contour *")
        lib.contour_begin(self.pointer, program.pointer, self._segments)

    def distance_mm(
        self, arc_length_mm: float, x_mm: float, y_mm: float, z_mm: float = 0.0
    ) -> float:
        """Distance of a point from the curve near the commanded arc length, mm."""
        _, lib = library()
        return float(lib.contour_distance_mm(self.pointer, arc_length_mm, [x_mm, y_mm, z_mm]))

    def errors_um(
        self,
        arc_length_q40_mm: NDArray[np.int64],
        act_counts: NDArray[np.int32],
        counts_per_mm: Counts,
    ) -> NDArray[np.float64]:
        """Contour errors in um, (n,), of encoder positions (n, A) at commanded arc lengths (n,).

        A is 2 in the plane and at least 3 in space; axes after z are not used (`extra_errors`).
        """
        ffi, lib = library()
        arc = np.ascontiguousarray(arc_length_q40_mm, dtype=np.int64)
        act = np.ascontiguousarray(act_counts, dtype=np.int32)
        axes = int(self.pointer.axes)
        if (
            act.ndim != 2
            or act.shape[0] != arc.size
            or act.shape[1] not in ((2,) if axes == 2 else (3, 4, 5, 6))
        ):
            raise ValueError(f"act_counts has shape {act.shape}, not ({arc.size}, {axes})")
        errors = np.empty(arc.size, dtype=np.float64)
        lib.contour_errors_um(
            self.pointer,
            arc.size,
            ffi.from_buffer("int64_t[]", arc),
            ffi.from_buffer("int32_t[]", act),
            act.shape[1],
            counts_by_axis(counts_per_mm, act.shape[1]),
            ffi.from_buffer("double[]", errors),
        )
        return errors

    def extra_errors(
        self,
        arc_length_q40_mm: NDArray[np.int64],
        act_counts: NDArray[np.int32],
        counts_per_mm: Counts,
    ) -> NDArray[np.float64]:
        """Errors of the extra axes against the curve at its point nearest to the tool.

        (n, A - 3), actual less exact, in mm or degrees; arguments as above, with the counts of all axes.
        """
        ffi, lib = library()
        axes = self._program.axis_count
        arc = np.ascontiguousarray(arc_length_q40_mm, dtype=np.int64)
        act = np.ascontiguousarray(act_counts, dtype=np.int32)
        if act.shape != (arc.size, axes):
            raise ValueError(f"act_counts has shape {act.shape}, not ({arc.size}, {axes})")
        errors = np.zeros((arc.size, max(axes - 3, 0)))
        if errors.size:
            lib.contour_extra_errors(
                self.pointer,
                self._program.pointer,
                arc.size,
                ffi.from_buffer("int64_t[]", arc),
                ffi.from_buffer("int32_t[]", act),
                counts_by_axis(counts_per_mm, axes),
                ffi.from_buffer("double[]", errors),
            )
        return errors
