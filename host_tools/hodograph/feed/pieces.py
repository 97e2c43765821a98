# SPDX-License-Identifier: MIT
"""Feed pieces of the program format (docs/reference/protocol.md 1.3) as arrays; docs/theory/numerics.md section 6."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from .override_levels import FACTOR_ONE_Q14, FULL, Codes, rates_per_s, seconds_per_s2

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Unsigned = NDArray[np.uint32]

DEGREE = 7


@dataclass(frozen=True)
class FeedPiece:
    """F(t) = start + c1 tau + … + c7 tau^7, tau = t / 2^e; the integers of the format."""

    duration_q32_s: int
    start_q40: int
    c_q40: tuple[int, ...]
    override_factor_q14: int
    override_rate_codes: tuple[int, ...]
    override_second_codes: tuple[int, ...]

    @property
    def exponent(self) -> int:
        """e: 2^e s is the least power of two not below the duration."""
        return (self.duration_q32_s - 1).bit_length() - 32


@dataclass(frozen=True, eq=False)
class FeedPieces:
    """All pieces of a program, in order; arrays of length M, `c_q40` (M, 7), codes of the override (M, LEVELS)."""

    duration_q32_s: Int
    start_q40: Int
    c_q40: Int
    override_factor_q14: Unsigned
    override_rate_codes: Codes
    override_second_codes: Codes

    def __len__(self) -> int:
        return int(self.duration_q32_s.size)

    def __getitem__(self, index: int) -> FeedPiece:
        return FeedPiece(
            int(self.duration_q32_s[index]),
            int(self.start_q40[index]),
            tuple(int(c) for c in self.c_q40[index]),
            int(self.override_factor_q14[index]),
            tuple(int(c) for c in self.override_rate_codes[index]),
            tuple(int(c) for c in self.override_second_codes[index]),
        )

    def __iter__(self) -> Iterator[FeedPiece]:
        return (self[i] for i in range(len(self)))

    @property
    def override_factor(self) -> Real:
        """Greatest override (M,)."""
        return self.override_factor_q14 / FACTOR_ONE_Q14

    def override_rate_per_s(self, level: int = FULL) -> Real:
        """Greatest slope of the rate of program time (M,) up to the rate of a level."""
        return rates_per_s(self.override_rate_codes[:, level])

    def override_second_per_s2(self, level: int = FULL) -> Real:
        """Its greatest second derivative (M,)."""
        return seconds_per_s2(self.override_second_codes[:, level])

    @property
    def total_q32_s(self) -> int:
        """Duration of the program, exactly."""
        return int(self.duration_q32_s.sum(dtype=np.int64))


def exponents(duration_q32_s: Int) -> Int:
    """e of each piece, so that 2^e s is the least power of two not below the duration."""
    mantissa, e = np.frexp(duration_q32_s.astype(np.float64))
    # frexp gives duration = mantissa 2^e with mantissa in [1/2, 1): an exact power of two is one too high.
    # Above 2^53 the conversion could round up to a power of two; durations end at 2^54.
    exact = (mantissa == 0.5) & (duration_q32_s <= (np.int64(1) << (e - 1).astype(np.int64)))
    return np.asarray(e - exact - 32, dtype=np.int64)


def derivative_bounds(duration_q32_s: Int, c_q40: Int) -> tuple[Real, Real, Real]:
    """Bernstein coefficients of F' (M, 7), F'' (M, 6) and F''' (M, 5); mm, s.

    The extremes of each row bound the derivative over its piece; the first and last are its end values.
    """
    e = exponents(duration_q32_s)
    end = np.ldexp(duration_q32_s.astype(np.float64), -(e + 32))
    k = np.arange(1, DEGREE + 1)
    unit = c_q40.astype(np.float64) * 2.0**-40 * end[:, None] ** k
    seconds = np.ldexp(duration_q32_s.astype(np.float64), -32)[:, None]
    out = []
    power = unit * k
    for order in (1, 2, 3):
        out.append(power @ _TO_BERNSTEIN[power.shape[1] - 1].T / seconds**order)
        power = power[:, 1:] * np.arange(1, power.shape[1])
    return out[0], out[1], out[2]


def part_bounds(duration_q32_s: Int, c_q40: Int, order: int, halvings: int) -> Real:
    """Bernstein coefficients (M, 2^halvings, n) of a derivative of F (1 to 3) over equal parts of each piece."""
    parts = derivative_bounds(duration_q32_s, c_q40)[order - 1][:, None, :]
    for _ in range(halvings):
        parts = _halved(parts).reshape(parts.shape[0], -1, parts.shape[-1])
    return parts


def derivative_extremes(
    duration_q32_s: Int, c_q40: Int, halvings: int = 4
) -> tuple[tuple[Real, Real, Real], tuple[Real, Real, Real]]:
    """Lower and upper bounds (M,) of feed, acceleration and jerk over each piece, close to the true extremes.

    From Bernstein coefficients after halving the piece n times: what they overstate is 1/4^n of what
    `derivative_bounds` does (Farouki 2012, section 5). Memory for a curved piece: about 250 bytes times 2^n.
    """
    curved = np.flatnonzero(c_q40[:, 1:].any(axis=1))
    lows, highs = [], []
    for plain in derivative_bounds(duration_q32_s, c_q40):
        low, high = plain.min(axis=1), plain.max(axis=1)
        parts = plain[curved]
        for _ in range(halvings):
            parts = _halved(parts)
        axes = tuple(range(1, parts.ndim))
        low[curved], high[curved] = parts.min(axis=axes), parts.max(axis=axes)
        lows.append(low)
        highs.append(high)
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])


def way_excess(duration_q32_s: Int, c_q40: Int, halvings: int = 4) -> Real:
    """How far (M,) each piece goes at most behind its start or beyond its end, in mm, of its bounds after halving."""
    seconds = np.ldexp(duration_q32_s.astype(np.float64), -32)
    feed = derivative_bounds(duration_q32_s, c_q40)[0]
    way = np.zeros((len(seconds), DEGREE + 1))
    way[:, 1:] = np.cumsum(feed, axis=1) * (seconds / DEGREE)[:, None]
    low, high = np.minimum(way[:, -1], 0.0), np.maximum(way[:, -1], 0.0)
    curved = np.flatnonzero(c_q40[:, 1:].any(axis=1))
    parts = way[curved]
    for _ in range(halvings):
        parts = _halved(parts)
    axes = tuple(range(1, parts.ndim))
    excess: Real = np.zeros(len(seconds))
    excess[curved] = np.maximum(
        low[curved] - parts.min(axis=axes), parts.max(axis=axes) - high[curved]
    )
    return excess


def derivative_peaks(duration_q32_s: Int, c_q40: Int) -> tuple[Real, Real, Real]:
    """Bounds (M,) of the magnitudes of feed, acceleration and jerk over each piece."""
    lows, highs = derivative_extremes(duration_q32_s, c_q40)
    v, a, j = (np.maximum(-low, high) for low, high in zip(lows, highs, strict=True))
    return v, a, j


def _halved(coefficients: Real) -> Real:
    """Bernstein coefficients (…, n) on both halves of the interval, (…, 2, n); de Casteljau."""
    n = coefficients.shape[-1]
    out = np.empty((*coefficients.shape[:-1], 2, n))
    level = coefficients
    for k in range(n):
        out[..., 0, k], out[..., 1, n - 1 - k] = level[..., 0], level[..., -1]
        level = 0.5 * (level[..., 1:] + level[..., :-1])
    return out


def _to_bernstein(degree: int) -> Real:
    return np.array(
        [
            [comb(j, i) / comb(degree, i) if i <= j else 0.0 for i in range(degree + 1)]
            for j in range(degree + 1)
        ]
    )


_TO_BERNSTEIN = {degree: _to_bernstein(degree) for degree in range(DEGREE)}
