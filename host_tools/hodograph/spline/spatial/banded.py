# SPDX-License-Identifier: MIT
"""Block tridiagonal systems of 3 x 3 blocks, plain and closed to a ring, in linear time (LAPACK gbsv). Used by
spatial/system. No I/O.
"""

from __future__ import annotations

import numpy as np

from ..banded import SingularSystem
from ..bernstein import Real

_BLOCK = 3
"""Unknowns of a span."""
_REACH = 2 * _BLOCK - 1
"""Greatest distance of an entry from the diagonal, on either side."""


def solve_blocks(lower: Real, diagonal: Real, upper: Real, rhs: Real) -> Real:
    """x (M, 3) with lower[i] x[i-1] + diagonal[i] x[i] + upper[i] x[i+1] = rhs[i].

    Blocks (M, 3, 3), of which lower[0] and upper[-1] are ignored; `rhs` (M, 3). Raises SingularSystem.
    """
    return _solve(lower, diagonal, upper, rhs.reshape(-1, 1)).reshape(rhs.shape)


def solve_ring(lower: Real, diagonal: Real, upper: Real, rhs: Real) -> Real:
    """Same where lower[0] multiplies x[M-1] and upper[-1] multiplies x[0]; M >= 3.

    The band alone is solved for the right side and for unit columns in its first and last block rows; six unknowns, the
    ends of x, remain (Woodbury).
    """
    size = rhs.size
    both = np.zeros((size, 1 + 2 * _BLOCK), order="F")
    both[:, 0] = rhs.ravel()
    unit = np.arange(_BLOCK)
    both[unit, 1 + unit] = both[size - _BLOCK + unit, 1 + _BLOCK + unit] = 1.0
    solved = _solve(lower, diagonal, upper, both)
    corners = np.zeros((2 * _BLOCK, 2 * _BLOCK))
    corners[:_BLOCK, _BLOCK:], corners[_BLOCK:, :_BLOCK] = lower[0], upper[-1]
    ends = np.vstack((solved[:_BLOCK], solved[-_BLOCK:]))
    try:
        found = np.linalg.solve(np.eye(2 * _BLOCK) + ends[:, 1:] @ corners, ends[:, 0])
    except np.linalg.LinAlgError as error:
        raise SingularSystem from error
    return np.asarray(solved[:, 0] - solved[:, 1:] @ (corners @ found)).reshape(rhs.shape)


def _solve(lower: Real, diagonal: Real, upper: Real, rhs: Real) -> Real:
    """x (3 M, k) for right sides (3 M, k)."""
    band = np.zeros((3 * _REACH + 1, _BLOCK * diagonal.shape[0]), order="F")
    _place(band, diagonal, 0)
    _place(band, lower[1:], -1)
    _place(band, upper[:-1], 1)
    # Here, since its import takes a quarter of the start time of a command that solves nothing.
    from scipy.linalg import lapack

    _, _, x, info = lapack.dgbsv(_REACH, _REACH, band, rhs, overwrite_ab=1)
    if info != 0 or not np.isfinite(x).all():
        raise SingularSystem
    return np.asarray(x)


def _place(band: Real, blocks: Real, offset: int) -> None:
    """Writes blocks (n, 3, 3), `offset` block columns on either side of the diagonal, into the band storage."""
    first = max(offset, 0) * _BLOCK
    for row in range(_BLOCK):
        for column in range(_BLOCK):
            at = 2 * _REACH + row - column - _BLOCK * offset
            stop = first + column + _BLOCK * blocks.shape[0]
            band[at, first + column : stop : _BLOCK] = blocks[:, row, column]
