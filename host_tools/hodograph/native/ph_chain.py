# SPDX-License-Identifier: MIT
"""Locates places on a chain of PH segments by arc length, and computes derivatives there, in C
(host_tools/numerics/ph_chain.h). Used by spline/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .library import library, numbers

Real = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PhChain:
    """Bernstein coefficients of N segments: struct ph_chain.

    start     (N + 1,) arc length at the joints, mm
    arc       (N, 6) arc length from the start of each segment, speed (N, 5) its derivative
    preimage  (N, 3) complex in the plane, (N, 4, 3) in space
    extra     (N, E, 6) of extra axes; None in the plane
    """

    start: Real
    arc: Real
    speed: Real
    preimage: Real | NDArray[np.complex128]
    extra: Real | None = None

    def locate(self, arc_mm: Real, tolerance: float) -> tuple[Index, Real]:
        """Segment and xi (n,) at arc lengths (n,) on the path, to `tolerance` of the segment's length."""
        s = np.ascontiguousarray(arc_mm, dtype=np.float64)
        segment, xi = np.empty(s.size, dtype=np.int64), np.empty(s.size)
        given, kept = self._struct()
        _, lib = library()
        lib.ph_locate(given, s.size, numbers(s), tolerance, numbers(segment), numbers(xi))
        del kept
        return segment, xi

    def frames(self, segment: Index, xi: Real) -> tuple[Real, Real, Real, Real]:
        """r_s, r_ss, r_sss (A, n), and the curvature (n,), of segments at xi (n,)."""
        axes = 2 if self.extra is None else 3 + self.extra.shape[1]
        at = np.ascontiguousarray(segment, dtype=np.int64)
        x = np.ascontiguousarray(xi, dtype=np.float64)
        r1, r2, r3 = (np.empty((axes, x.size)) for _ in range(3))
        curvature = np.empty(x.size)
        given, kept = self._struct()
        _, lib = library()
        lib.ph_frames(given, x.size, *map(numbers, (at, x, r1, r2, r3, curvature)))
        del kept
        return r1, r2, r3, curvature

    def _struct(self) -> tuple[Any, list[Any]]:
        """A struct ph_chain, and the arrays that it refers to."""
        ffi, _ = library()
        extra = np.zeros((0, 0, 6)) if self.extra is None else self.extra
        arrays = [
            np.ascontiguousarray(one)
            for one in (self.start, self.arc, self.speed, self.preimage, extra)
        ]
        counts = (self.arc.shape[0], int(self.extra is None), extra.shape[1])
        return ffi.new("struct ph_chain *", (*counts, *map(numbers, arrays))), arrays
