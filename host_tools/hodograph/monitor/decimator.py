# SPDX-License-Identifier: MIT
"""Many rows to few groups, so that no peak is lost and no browser is swamped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def group_starts(count: int, size: int, most: int) -> NDArray[np.intp]:
    """First rows of groups over `count` rows: `size` rows each, more when that would make over `most` groups."""
    if count == 0:
        return np.empty(0, dtype=np.intp)
    size = max(1, size, -(-count // most))
    return np.arange(0, count, size)


def extremes(values: Floats, starts: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Least and greatest value of each group, by column where there are several; NaN where there is no value."""
    if starts.size == 0:
        empty = np.empty((0, *values.shape[1:]))
        return empty, empty
    return (
        np.fmin.reduceat(values, starts, axis=0),
        np.fmax.reduceat(values, starts, axis=0),
    )
