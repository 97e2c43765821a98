# SPDX-License-Identifier: MIT
"""Feed pieces in halves: the same feed in more pieces, where a piece has to be short;
docs/theory/numerics.md section 7.

A half is the polynomial of its piece about its own start, rounded as every piece is: its end is the next start to the
last bit, its feed is off by less than 2^-30 mm/s. The bounds of the override are those of the piece.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from .pieces import DEGREE, FeedPieces, exponents
from .quantise import round_pieces

Real = NDArray[np.float64]
Int = NDArray[np.int64]


def halved(pieces: FeedPieces, chosen: NDArray[np.bool_], length_q40: int) -> FeedPieces:
    """The pieces, the `chosen` (M,) of them each as two that last half as long. `length_q40` is the end of the last."""
    rows = np.repeat(np.arange(len(pieces)), 1 + chosen)
    duration, start, c = pieces.duration_q32_s[rows], pieces.start_q40[rows], pieces.c_q40[rows]
    ends = np.append(pieces.start_q40[1:], length_q40)
    first = np.flatnonzero(chosen) + np.arange(int(chosen.sum()))
    for at, row in zip(first.tolist(), np.flatnonzero(chosen).tolist(), strict=True):
        whole = int(pieces.duration_q32_s[row])
        times = np.array([0, whole // 2, whole], dtype=np.int64)
        shape = _shape(whole, pieces.c_q40[row])
        low, high = _parts(shape, times[1] / whole)
        begin = int(pieces.start_q40[row])
        middle = begin + round(float(low.sum()) * 2.0**40)
        starts = np.array([begin, middle, ends[row]], dtype=np.int64)
        duration[at : at + 2] = np.diff(times)
        start[at : at + 2] = starts[:2]
        c[at : at + 2] = round_pieces(times, starts, np.stack((low, high)))
    return FeedPieces(
        duration,
        start,
        c,
        pieces.override_factor_q14[rows],
        pieces.override_rate_codes[rows],
        pieces.override_second_codes[rows],
    )


def _shape(duration_q32_s: int, c_q40: Int) -> Real:
    """Powers (8,) of u = 0 … 1 over a piece, from its start; mm."""
    e = int(exponents(np.array([duration_q32_s], dtype=np.int64))[0])
    end = float(np.ldexp(float(duration_q32_s), -(e + 32)))
    shape: Real = np.zeros(DEGREE + 1)
    shape[1:] = np.ldexp(c_q40.astype(np.float64), -40) * end ** np.arange(1, DEGREE + 1)
    return shape


def _parts(shape: Real, middle: float) -> tuple[Real, Real]:
    """The same polynomial before and behind u = middle, each in powers of its own 0 … 1 from its own start."""
    k = np.arange(DEGREE + 1)
    behind = np.array(
        [
            sum(comb(n, i) * shape[n] * middle ** (n - i) for n in range(i, DEGREE + 1))
            for i in range(DEGREE + 1)
        ]
    )
    behind[0] = 0.0
    return shape * middle**k, behind * (1.0 - middle) ** k
