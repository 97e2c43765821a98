# SPDX-License-Identifier: MIT
"""Feed pieces of the program format (docs/reference/protocol.md 1.3) as arrays; docs/theory/feed.md section 6. Used by
feed/, program/, section_pipeline and stream/. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..fixed_point import MM_PER_Q40, to_q40
from .limits import FeedZone
from .override_levels import FACTOR_ONE_Q14, FULL, Codes, rates_per_s, seconds_per_s2
from .request import LEAST_FEED_MM_S

Real = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int = NDArray[np.int64]
Unsigned = NDArray[np.uint32]

DEGREE = 7
"""Degree of the polynomial of arc length over time."""

LONGEST_PIECE_MM = 31.875
"""Below the 32 mm of the format."""

JERK_GOAL_MM_S3 = 1.0
"""Greatest error of the jerk of pieces that replace an exact profile; more pieces are tried until it is kept."""
LENGTH_GOAL_MM = 2e-10
"""The same of the arc length."""


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
        """Greatest override rate (M,) up to the override of a level."""
        return rates_per_s(self.override_rate_codes[:, level])

    def override_second_per_s2(self, level: int = FULL) -> Real:
        """Greatest override acceleration (M,) up to the override of a level."""
        return seconds_per_s2(self.override_second_codes[:, level])

    @property
    def duration_s(self) -> Real:
        """Durations (M,)."""
        return np.ldexp(self.duration_q32_s.astype(np.float64), -32)

    @property
    def total_q32_s(self) -> int:
        """Duration of the program, exactly."""
        return int(self.duration_q32_s.sum(dtype=np.int64))

    def part(self, taken: slice) -> FeedPieces:
        """Some consecutive pieces."""
        return FeedPieces(*(getattr(self, one.name)[taken] for one in fields(self)))

    def slower_zones(self, chosen: Bool, share: float, length_q40: int) -> list[FeedZone]:
        """Feed zones over the chosen (M,) pieces of a path of this length. Each has a share, below 1, of the mean feed
        of its piece, but LEAST_FEED_MM_S at least. Pieces that are no faster than that, or have no length, have none.
        """
        ends_mm = np.ldexp(np.append(self.start_q40, length_q40).astype(np.float64), -40)
        length_mm = np.diff(ends_mm)
        slower = np.maximum(share * length_mm / self.duration_s, LEAST_FEED_MM_S)
        faster = length_mm > LEAST_FEED_MM_S * self.duration_s
        return [
            FeedZone(float(ends_mm[k]), float(ends_mm[k + 1]), float(slower[k]))
            for k in np.flatnonzero(chosen & faster)
        ]


def joined_pieces(parts: Sequence[FeedPieces]) -> FeedPieces:
    """Pieces one after the other."""
    columns = ([getattr(part, one.name) for part in parts] for one in fields(FeedPieces))
    return FeedPieces(*(np.concatenate(column) for column in columns))


@dataclass(frozen=True, eq=False)
class RawPieces:
    """Durations (M,), starts (M,) and coefficients (M, 7) of pieces, and bounds of their errors against the timeline.
    The errors exceed the goals only if the ramp has too few periods.
    """

    duration_q32_s: Int
    start_q40: Int
    c_q40: Int
    jerk_error_mm_s3: float
    length_error_mm: float

    @property
    def faithful(self) -> bool:
        """Whether the errors are within JERK_GOAL_MM_S3 and LENGTH_GOAL_MM."""
        return self.jerk_error_mm_s3 < JERK_GOAL_MM_S3 and self.length_error_mm < LENGTH_GOAL_MM


def exponents(duration_q32_s: Int) -> Int:
    """e of each piece, so that 2^e s is the least power of two not below the duration."""
    mantissa, e = np.frexp(duration_q32_s.astype(np.float64))
    # frexp gives duration = mantissa 2^e with mantissa in [1/2, 1): an exact power of two is one too high.
    # Above 2^53 the conversion could round up to a power of two; durations end at 2^54.
    exact = (mantissa == 0.5) & (duration_q32_s <= (np.int64(1) << (e - 1).astype(np.int64)))
    return np.asarray(e - exact - 32, dtype=np.int64)


def round_pieces(times: Int, starts: Int, shapes: Real) -> Int:
    """Coefficients c1 … c7 in tau; c1 is such that each end is exactly the next start.

    times (n + 1,) in 2^-32 s, starts (n + 1,) in 2^-40 mm; shapes (n, 8): powers of u = 0 … 1 over a piece, mm
    """
    return _rounded(np.diff(times), np.diff(starts), shapes)


def _rounded(duration: Int, distance: Int, shapes: Real) -> Int:
    """As `round_pieces`, from durations (n,) and distances (n,)."""
    e = exponents(duration)
    stretch = np.ldexp(1.0, e + 32) / duration
    k = np.arange(1, DEGREE + 1)
    c = to_q40(shapes[:, 1:] * stretch[:, None] ** k)
    curved = np.any(c[:, 1:] != 0, axis=1)
    each = (duration, e + 32, distance, curved, c)
    c[:, 0] = [_linear_term(*one) for one in zip(*(one.tolist() for one in each), strict=True)]
    return c


def _linear_term(d: int, shift: int, distance: int, curved: bool, c: list[int]) -> int:
    """The c1 with which a piece of duration `d` comes nearest to this distance; `shift` is e + 32."""
    rest = 0
    if curved:  # the other terms by Horner's rule, times 2^(shift * DEGREE)
        for n in range(DEGREE, 1, -1):
            rest = rest * d + (c[n - 1] << shift * (DEGREE - n))
        rest *= d * d
    rest = (distance << shift * DEGREE) - rest
    below = d << shift * (DEGREE - 1)
    return (2 * rest + below) // (2 * below)


def derivative_bounds(duration_q32_s: Int, c_q40: Int) -> tuple[Real, Real, Real]:
    """Bernstein coefficients of F' (M, 7), F'' (M, 6) and F''' (M, 5); mm, s.

    The extremes of each row bound the derivative over its piece; the first and last are its end values.
    """
    e = exponents(duration_q32_s)
    end = np.ldexp(duration_q32_s.astype(np.float64), -(e + 32))
    k = np.arange(1, DEGREE + 1)
    unit = c_q40.astype(np.float64) * MM_PER_Q40 * end[:, None] ** k
    seconds = np.ldexp(duration_q32_s.astype(np.float64), -32)[:, None]
    out = []
    power = unit * k
    for order in (1, 2, 3):
        out.append(power @ _TO_BERNSTEIN[power.shape[1] - 1].T / seconds**order)
        power = power[:, 1:] * np.arange(1, power.shape[1])
    return out[0], out[1], out[2]


def part_bounds(duration_q32_s: Int, c_q40: Int, order: int, halvings: int) -> Real:
    """Bernstein coefficients (M, 2^halvings, n) of a derivative of F (1 to 3) over equal parts of each piece."""
    parts = _halved(derivative_bounds(duration_q32_s, c_q40)[order - 1], halvings)
    return np.asarray(parts.T)


def derivative_extremes(
    duration_q32_s: Int, c_q40: Int, halvings: int = 4
) -> tuple[tuple[Real, Real, Real], tuple[Real, Real, Real]]:
    """Lower and upper bounds (M,) of feed, acceleration and jerk over each piece, close to the true extremes.

    From Bernstein coefficients after halving the piece n times: they overestimate by 1/4^n of what `derivative_bounds`
    does (Farouki 2012, section 5). Memory for a curved piece: about 250 bytes times 2^n.
    """
    curved = np.flatnonzero(c_q40[:, 1:].any(axis=1))
    lows, highs = [], []
    for plain in derivative_bounds(duration_q32_s, c_q40):
        low, high = plain.min(axis=1), plain.max(axis=1)
        parts = _halved(plain[curved], halvings)
        low[curved], high[curved] = parts.min(axis=(0, 1)), parts.max(axis=(0, 1))
        lows.append(low)
        highs.append(high)
    return (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])


def distance_excess(duration_q32_s: Int, c_q40: Int, halvings: int = 4) -> Real:
    """Bound (M,) of how far each piece moves before its start or beyond its end, in mm, from its bounds after
    halving.
    """
    seconds = np.ldexp(duration_q32_s.astype(np.float64), -32)
    feed = derivative_bounds(duration_q32_s, c_q40)[0]
    distance = np.zeros((len(seconds), DEGREE + 1))
    distance[:, 1:] = np.cumsum(feed, axis=1) * (seconds / DEGREE)[:, None]
    low, high = np.minimum(distance[:, -1], 0.0), np.maximum(distance[:, -1], 0.0)
    curved = np.flatnonzero(c_q40[:, 1:].any(axis=1))
    parts = _halved(distance[curved], halvings)
    excess: Real = np.zeros(len(seconds))
    excess[curved] = np.maximum(
        low[curved] - parts.min(axis=(0, 1)), parts.max(axis=(0, 1)) - high[curved]
    )
    return excess


def derivative_peaks(duration_q32_s: Int, c_q40: Int) -> tuple[Real, Real, Real]:
    """Bounds (M,) of the magnitudes of feed, acceleration and jerk over each piece."""
    lows, highs = derivative_extremes(duration_q32_s, c_q40)
    v, a, j = (np.maximum(-low, high) for low, high in zip(lows, highs, strict=True))
    return v, a, j


def halved(pieces: FeedPieces, chosen: NDArray[np.bool_], length_q40: int) -> FeedPieces:
    """These pieces, the `chosen` (M,) pieces each as two that last half as long; docs/theory/feed.md section 7.

    A half is the polynomial of its piece about its own start, rounded like each piece: its end is exactly the next
    start, and its feed differs by less than 2^-30 mm/s. Override bounds are those of the piece.

    length_q40  end of the last piece
    """
    rows = np.repeat(np.arange(len(pieces)), 1 + chosen)
    duration, start, c = pieces.duration_q32_s[rows], pieces.start_q40[rows], pieces.c_q40[rows]
    ends = np.append(pieces.start_q40[1:], length_q40)
    old = np.flatnonzero(chosen)
    first = old + np.arange(old.size)
    whole, begin = pieces.duration_q32_s[old], pieces.start_q40[old]
    half = whole // 2
    low, high = _parts(_powers(whole, pieces.c_q40[old]), half / whole)
    middle = begin + to_q40(low.sum(axis=1))
    both = ((first, half, middle - begin, low), (first + 1, whole - half, ends[old] - middle, high))
    start[first + 1] = middle
    for at, seconds, distance, shape in both:
        duration[at] = seconds
        c[at] = _rounded(seconds, distance, shape)
    return FeedPieces(
        duration,
        start,
        c,
        pieces.override_factor_q14[rows],
        pieces.override_rate_codes[rows],
        pieces.override_second_codes[rows],
    )


def _powers(duration_q32_s: Int, c_q40: Int) -> Real:
    """Powers (n, 8) of u = 0 … 1 over each piece, from its start; mm."""
    e = exponents(duration_q32_s)
    end = np.ldexp(duration_q32_s.astype(np.float64), -(e + 32))
    shape: Real = np.zeros((duration_q32_s.size, DEGREE + 1))
    k = np.arange(1, DEGREE + 1)
    shape[:, 1:] = np.ldexp(c_q40.astype(np.float64), -40) * end[:, None] ** k
    return shape


def _parts(shape: Real, middle: Real) -> tuple[Real, Real]:
    """The same polynomials (n, 8) before and after u = middle (n,), each in powers of its own 0 … 1 from its own
    start.
    """
    k = np.arange(DEGREE + 1)
    power = middle[:, None] ** k
    after: Real = np.zeros_like(shape)
    for i in range(1, DEGREE + 1):
        for n in range(i, DEGREE + 1):
            after[:, i] += comb(n, i) * shape[:, n] * power[:, n - i]
    return shape * power, after * (1.0 - middle[:, None]) ** k


def _halved(coefficients: Real, times: int) -> Real:
    """Bernstein coefficients (M, n) of M polynomials after a number of halvings of their interval: (n, 2^times, M); de
    Casteljau. The polynomials are the last axis, so that each operation of numpy is one long loop.

    Own code, since scipy's BPoly cannot subdivide: equally close bounds from its values would take 65 times as long.
    """
    parts: Real = np.ascontiguousarray(coefficients.T)[:, None, :]
    for _ in range(times):
        n, count, size = parts.shape
        out = np.empty((n, count, 2, size))
        level = parts
        for k in range(n):
            out[k, :, 0], out[n - 1 - k, :, 1] = level[0], level[-1]
            level = 0.5 * (level[1:] + level[:-1])
        parts = out.reshape(n, 2 * count, size)
    return parts


def _to_bernstein(degree: int) -> Real:
    return np.array(
        [
            [comb(j, i) / comb(degree, i) if i <= j else 0.0 for i in range(degree + 1)]
            for j in range(degree + 1)
        ]
    )


_TO_BERNSTEIN = {degree: _to_bernstein(degree) for degree in range(DEGREE)}
"""Matrices from powers to Bernstein coefficients, by degree."""
