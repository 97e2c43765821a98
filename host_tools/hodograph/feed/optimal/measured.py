# SPDX-License-Identifier: MIT
"""A window planned again where its pieces, not only the feed they stand for, pass a limit; docs/theory/numerics.md 5.6.

Next to rest and at sudden changes a polynomial of degree 7 strays from the feed over arc length that it is made from.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...spline import PHSpline
from .peaks import piece_strains
from .track import ends_of, make_track
from .window import Solution, tightened

Real = NDArray[np.float64]

_STRAINED = 1.003
_MOST_TRIALS = 3
_INHERITED = 2
"""Intervals that what a window begins with binds: their limits stay."""


def measured(spline: PHSpline, found: Solution) -> Solution:
    """A window, with tighter limits on intervals whose piece is above one by more than 0.3 %."""
    best, trial = found, found
    strain = _strains(spline, found)
    least, tight = strain.max(), np.ones(strain.size)
    for _ in range(_MOST_TRIALS):
        if strain.max() <= _STRAINED:
            break
        tight *= np.where(strain > 1.0 + 0.3 * (_STRAINED - 1.0), strain, 1.0)
        tried = tightened(trial, tight)
        if tried is None:
            break
        trial, strain = tried, _strains(spline, tried)
        if strain.max() < least:
            best, least = trial, strain.max()
    return best


def _strains(spline: PHSpline, found: Solution) -> Real:
    track = make_track(ends_of(found, found.grid.size), 1.0, spline.segment_starts_mm)
    strain = piece_strains(spline, found.setting.bounds, track)
    if found.setting.start is not None:
        strain[:_INHERITED] = 0.0
    if found.grid.s[-1] < spline.length_mm:
        strain[found.grid.grade < 0] = 0.0  # the stop at the end of a window is not kept
    return strain
