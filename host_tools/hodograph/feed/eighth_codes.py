# SPDX-License-Identifier: MIT
"""Numbers as codes of 8 bits, in steps of an eighth of an octave; docs/reference/protocol.md 1.4."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

GREATEST_CODE = 255
_EIGHTHS = np.array([65536, 71468, 77935, 84990, 92681, 101070, 110217, 120193], dtype=np.uint64)
"""2^16 2^(i/8), rounded down."""


def mantissas(codes: ArrayLike) -> NDArray[np.uint64]:
    """The integers m < 2^48 that codes (any shape) stand for; code 0: 0."""
    c = np.asarray(codes, dtype=np.uint64)
    return np.where(c > 0, _EIGHTHS[c & np.uint64(7)] << (c >> np.uint64(3)), np.uint64(0))


_ALL = mantissas(np.arange(GREATEST_CODE + 1))


def codes_below(values: ArrayLike) -> NDArray[np.uint8]:
    """The greatest codes whose m is at most the values; 0: even that of code 1 is more."""
    found = np.searchsorted(
        _ALL, np.floor(np.clip(values, 0.0, 2.0**62)).astype(np.uint64), "right"
    )
    return np.asarray(found - 1, dtype=np.uint8)
