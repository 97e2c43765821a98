# SPDX-License-Identifier: MIT
"""Greatest magnitudes of all quantities, by samples close enough for a certain bound; docs/theory/proofs.md 16. Used by
verify/verification. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bounds import bends
from .cells import Cells
from .instants import Motion, motion_at
from .quantities import Quantity

Real = NDArray[np.float64]
Int = NDArray[np.int64]

GAP = 1e-4
"""Greatest rise of a quantity between samples, over its least limit or its peak, whichever is greater."""

_MOST_INTERVALS = 48
"""A cell that needs more sampling intervals than this is divided."""
_ROUNDS = 8
"""How often cells are divided."""
_CHUNK = 1 << 16
"""Approximate number of samples that are evaluated at once, to bound the memory."""


@dataclass(frozen=True, eq=False)
class CellMaxima:
    """By quantity and cell, (Q, C): the greatest magnitude among samples, its place (u), and a bound of the
    magnitude.
    """

    found: Real
    at: Real
    at_most: Real
    samples: int


def scales(cells: Cells, rows: Sequence[Quantity]) -> Real:
    """Scale of each quantity, (Q,): its least limit, or its magnitude at ends and middles of cells if that is
    greater.
    """
    top = np.full(len(rows), 1e-12)
    for k, row in enumerate(rows):
        if row.limits is not None and np.isfinite(row.limits).any():
            top[k] = row.limits.min()
    for u in (0.0, 0.5, 1.0):
        for first in range(0, len(cells), _CHUNK):
            cell = np.arange(first, min(first + _CHUNK, len(cells)))
            motion = motion_at(cells, cell, np.full(cell.size, u))
            top = np.maximum(top, [np.abs(row.of(motion)).max() for row in rows])
    return top


def refine(cells: Cells, rows: Sequence[Quantity], scale: Real) -> tuple[Cells, Motion]:
    """Cells cut until their bounds need few samples each, and these bounds."""
    for _ in range(_ROUNDS):
        bend = bends(cells)
        need = intervals(cells, bend, rows, scale)
        parts = np.where(need > _MOST_INTERVALS, np.minimum(need // 16, 16), 1)
        if not np.any(parts > 1):
            break
        cells = cells.divided(parts)
    return cells, bends(cells)


def intervals(cells: Cells, bend: Motion, rows: Sequence[Quantity], scale: Real) -> Int:
    """Number of intervals (C,) in which each quantity rises by at most GAP of its scale between samples."""
    worst = np.zeros(len(cells))
    for row, one in zip(rows, scale, strict=True):
        worst = np.maximum(worst, row.of(bend) / one)
    return np.ceil(cells.duration_s * np.sqrt(worst / (8.0 * GAP)) + 1e-3).astype(np.int64)


def cell_peaks(cells: Cells, bend: Motion, rows: Sequence[Quantity], scale: Real) -> CellMaxima:
    """The samples of each cell at the ends of its intervals."""
    need = intervals(cells, bend, rows, scale)
    found, at = np.zeros((len(rows), len(cells))), np.zeros((len(rows), len(cells)))
    for first, last in _spans(need + 1):
        count = need[first:last] + 1
        begin = np.cumsum(count) - count
        cell = np.repeat(np.arange(first, last), count)
        u = (np.arange(cell.size) - np.repeat(begin, count)) / need[cell]
        motion = motion_at(cells, cell, u)
        for k, row in enumerate(rows):
            size = np.abs(row.of(motion))
            top = np.maximum.reduceat(size, begin)
            found[k, first:last] = top
            where = np.where(size == np.repeat(top, count), u, np.inf)
            at[k, first:last] = np.minimum.reduceat(where, begin)
    rise = np.stack([row.of(bend) for row in rows]) * (cells.duration_s / need) ** 2 / 8.0
    return CellMaxima(found, at, found + rise, int((need + 1).sum()))


def _spans(count: Int) -> Iterator[tuple[int, int]]:
    """Consecutive cells whose samples together are about _CHUNK."""
    total = np.cumsum(count)
    first = 0
    while first < count.size:
        before = total[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(total, before + _CHUNK, side="right")))
        yield first, last
        first = last
