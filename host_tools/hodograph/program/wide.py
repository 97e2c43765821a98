# SPDX-License-Identifier: MIT
"""Arrays of integers of more than 64 bits: high * 2^52 + low, exact like Python's own and about 50 times as fast.

For sums of products of q44 numbers (docs/theory/numerics.md section 8). Products are taken of halves of 26 bits, whose
weighted sums stay within 64 bits as long as the factors are below 2^50 in magnitude. The caller ensures this; beyond it
results are wrong.

Used by program/check and program/geometry. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

_HALF, _WHOLE = 26, 52
_LOW = (1 << _HALF) - 1


@dataclass(frozen=True, eq=False)
class Wide:
    """Numbers high * 2^52 + low, 0 <= low < 2^52; arrays of any one shape."""

    high: Int
    low: Int

    def __add__(self, other: Wide) -> Wide:
        return _carried(self.high + other.high, self.low + other.low)

    def __sub__(self, other: Wide) -> Wide:
        return _carried(self.high - other.high, self.low - other.low)

    def __le__(self, other: Wide) -> Bool:
        """The comparison by element."""
        same = (self.high == other.high) & (self.low <= other.low)
        return np.asarray((self.high < other.high) | same)

    def __getitem__(self, index: int | slice) -> Wide:
        return Wide(np.asarray(self.high[index]), np.asarray(self.low[index]))

    def doubled(self) -> Wide:
        """The doubles by element."""
        return _carried(2 * self.high, 2 * self.low)

    def within(self, limit: Wide) -> Bool:
        """Whether each number is from -limit to limit."""
        return (self <= limit) & (
            Wide(np.zeros_like(self.high), np.zeros_like(self.low)) <= self + limit
        )

    def sums(self) -> Wide:
        """The sums of the first 0, 1, … n numbers, (n + 1,)."""
        middle, low = self.low >> _HALF, self.low & _LOW
        high, middle, low = (np.append(0, np.cumsum(part)) for part in (self.high, middle, low))
        middle = middle + (low >> _HALF)
        return Wide(
            np.asarray(high + (middle >> _HALF)),
            np.asarray(((middle & _LOW) << _HALF) | (low & _LOW)),
        )

    def exact(self) -> NDArray[np.object_]:
        """The numbers as Python's integers."""
        return np.asarray(self.high.astype(object) * (1 << _WHOLE) + self.low)


def wide(value: int) -> Wide:
    """One number."""
    return Wide(np.asarray(value >> _WHOLE), np.asarray(value & ((1 << _WHOLE) - 1)))


def product(a: Int, b: Int, weights: Int) -> Wide:
    """Sums of weights[j, k] a[…, j] b[…, k] over j and k."""
    a_high, a_low, b_high, b_low = a >> _HALF, a & _LOW, b >> _HALF, b & _LOW
    from_high, from_low = a_high @ weights, a_low @ weights
    middle = np.sum(from_high * b_low + from_low * b_high, axis=-1)
    low = np.sum(from_low * b_low, axis=-1)
    middle = middle + (low >> _HALF)
    high = np.sum(from_high * b_high, axis=-1) + (middle >> _HALF)
    return Wide(np.asarray(high), np.asarray(((middle & _LOW) << _HALF) | (low & _LOW)))


def scaled(values: Int, factor: int, shift: int) -> Wide:
    """values * factor * 2^shift, shift from 26 to 52; |values * factor| below 2^63."""
    times = values * factor
    return Wide(
        np.asarray(times >> (_WHOLE - shift)), np.asarray((times << shift) & ((1 << _WHOLE) - 1))
    )


def _carried(high: Int, low: Int) -> Wide:
    return Wide(np.asarray(high + (low >> _WHOLE)), np.asarray(low & ((1 << _WHOLE) - 1)))
