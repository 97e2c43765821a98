# SPDX-License-Identifier: MIT
"""Lengths as the integers of programs and of the controller's objects: multiples of 2^-40 mm (of a rotary axis, 2^-40
degrees); docs/reference/protocol.md 1.2. Names of such integers end in `_q40`. Used by many modules of host_tools. No
I/O.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

Q40_PER_MM = 2.0**40
"""Steps in a mm, or in a degree."""

MM_PER_Q40 = 2.0**-40
"""Length of a step in mm, or in degrees."""


def to_q40(mm: ArrayLike) -> NDArray[np.int64]:
    """Lengths of any shape rounded to steps, halves to even. Each has to be below 2^23 mm, which 64 bits hold."""
    import numpy as np  # here, so that commands without arrays start quickly

    return np.rint(np.asarray(mm, dtype=np.float64) * Q40_PER_MM).astype(np.int64)


def nearest_q40(mm: float | Fraction) -> int:
    """One length of any size rounded to steps, halves to even; that of a fraction is exact."""
    return round(mm * 2**40)
