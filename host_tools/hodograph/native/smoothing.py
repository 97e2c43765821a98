# SPDX-License-Identifier: MIT
"""Moves points sideways within bounds, in C (sim/offline/smoothing.h). Used by toolpath/fit/smoothing. No I/O."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .library import library, numbers

Real = NDArray[np.float64]


def least_squares_in_bounds(
    point: Real, normal: Real, bound: Real, coefficient: Real, barrier: float, start: Real
) -> Real:
    """Shifts (n, m) in mm of least sum of squared third differences plus `barrier` times the barrier of the bounds.

    point        (n, 3) mm
    normal       (n, 3, m) orthonormal directions of the shifts, m = 1 or 2
    bound        (n,) mm; 0: the point stays
    coefficient  (n - 3, 4) of the third differences
    start        (n, m) shifts strictly inside the bounds
    """
    ffi, lib = library()
    count, _, directions = normal.shape
    arrays = [np.ascontiguousarray(one) for one in (point, normal, bound, coefficient)]
    shift = np.array(start, dtype=np.float64, order="C")
    work = np.empty(int(lib.smoothing_work(count, directions)))

    given = ffi.new("struct smoothing *", (count, directions, *map(numbers, arrays)))
    lib.smoothing_solve(given, barrier, numbers(shift), numbers(work))
    return shift
