# SPDX-License-Identifier: MIT
"""Override levels, and the codes of override bounds; docs/reference/protocol.md 1.3 and 1.4. Used by feed/ and
program/. No I/O.

Each override of `LEVEL_OVERRIDES` ends a level with its own bounds of override rate and override acceleration: at an
override below 1 the motion uses less of the limits of acceleration and jerk. The last level, `FULL`, is that of all
overrides up to the factor. A bound is stored as a code of 8 bits, in steps of an eighth of an octave.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Codes = NDArray[np.uint8]
Real = NDArray[np.float64]

LEVEL_OVERRIDES = tuple(q9 / 512 for q9 in (320, 448, 488, 504, 509, 511))
"""Override at the end of each level but the last; multiples of 2^-9 as in the format."""
LEVELS = len(LEVEL_OVERRIDES) + 1
"""Number of levels."""
FULL = LEVELS - 1
"""The last level: overrides up to 100 %, and above."""

FACTOR_ONE_Q14 = 1 << 14
"""An override factor of 1 in the format."""

_RATE_UNIT, _SECOND_UNIT = 2.0**-32, 2.0**-24
"""Units of the mantissa of a rate code, 1/s, and of an override acceleration's code, 1/s^2."""

_GREATEST_CODE = 255
"""Codes are bytes."""
_EIGHTHS = np.array([65536, 71468, 77935, 84990, 92681, 101070, 110217, 120193], dtype=np.uint64)
"""2^16 2^(i/8), rounded down."""


def rates_per_s(codes: ArrayLike) -> Real:
    """Greatest override rates, 1/s, of codes of any shape."""
    return np.asarray(_mantissas(codes).astype(np.float64) * _RATE_UNIT)


def seconds_per_s2(codes: ArrayLike) -> Real:
    """Greatest override accelerations, 1/s^2."""
    return np.asarray(_mantissas(codes).astype(np.float64) * _SECOND_UNIT)


def rate_codes(rate_per_s: ArrayLike) -> Codes:
    """The greatest codes whose override rates are not above these (any shape); 0: there is none."""
    return _codes_below(np.asarray(rate_per_s) / _RATE_UNIT)


def second_codes(second_per_s2: ArrayLike) -> Codes:
    """The greatest codes whose override accelerations are not above these; 0: there is none."""
    return _codes_below(np.asarray(second_per_s2) / _SECOND_UNIT)


def _mantissas(codes: ArrayLike) -> NDArray[np.uint64]:
    """The integers m < 2^48 that codes (any shape) stand for; code 0: 0."""
    c = np.asarray(codes, dtype=np.uint64)
    return np.where(c > 0, _EIGHTHS[c & np.uint64(7)] << (c >> np.uint64(3)), np.uint64(0))


_ALL = _mantissas(np.arange(_GREATEST_CODE + 1))
"""Mantissas of all codes."""


def _codes_below(values: ArrayLike) -> Codes:
    """The greatest codes whose m is at most the values; 0: m of code 1 is more."""
    found = np.searchsorted(
        _ALL, np.floor(np.clip(values, 0.0, 2.0**62)).astype(np.uint64), "right"
    )
    return np.asarray(found - 1, dtype=np.uint8)
