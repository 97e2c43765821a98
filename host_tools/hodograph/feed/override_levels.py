# SPDX-License-Identifier: MIT
"""The levels of the override bounds and their codes; docs/reference/protocol.md 1.3.

Up to each rate of `LEVEL_RATES` the bounds of slope and second derivative are given apart: at a rate below 1 much of
acceleration and jerk is free. The last level, `FULL`, is that of all rates up to the factor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .eighth_codes import codes_below, mantissas

Codes = NDArray[np.uint8]
Real = NDArray[np.float64]

LEVEL_RATES = tuple(q9 / 512 for q9 in (320, 448, 488, 504, 509, 511))
LEVELS = len(LEVEL_RATES) + 1
FULL = LEVELS - 1

FACTOR_ONE_Q14 = 1 << 14

_RATE_UNIT, _SECOND_UNIT = 2.0**-32, 2.0**-24


def rates_per_s(codes: ArrayLike) -> Real:
    """Greatest slopes of the rate of program time, 1/s, of codes of any shape."""
    return np.asarray(mantissas(codes).astype(np.float64) * _RATE_UNIT)


def seconds_per_s2(codes: ArrayLike) -> Real:
    """Greatest second derivatives, 1/s^2."""
    return np.asarray(mantissas(codes).astype(np.float64) * _SECOND_UNIT)


def rate_codes(rate_per_s: ArrayLike) -> Codes:
    """The greatest codes that are not above; 0 where there is none."""
    return codes_below(np.asarray(rate_per_s) / _RATE_UNIT)


def second_codes(second_per_s2: ArrayLike) -> Codes:
    """The same of second derivatives."""
    return codes_below(np.asarray(second_per_s2) / _SECOND_UNIT)
