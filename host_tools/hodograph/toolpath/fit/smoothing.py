# SPDX-License-Identifier: MIT
"""Moves points sideways, each within its bound, so that the path through them can be passed fast. Used by fit/fitting.
No I/O.

docs/theory/toolpath-fitting.md section 3. The cost of a path is the integral of its jerk squared over time, at speeds
(n,) that are given. It is quadratic in the shifts. A barrier keeps the bounds, so every step of the search stays inside
them and no active set is needed. The search is in C.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...native.smoothing import least_squares_in_bounds

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_ORDER = 3
"""Order of the differences whose squares are minimised: the third, about the jerk."""


@dataclass(frozen=True, eq=False)
class Stations:
    """Stations of a path, which may be moved.

    point   (n, 3) mm
    normal  (n, 3, m) orthonormal directions in which a station may move: m = 1 in a plane, 2 in space
    bound   (n,) greatest shift, mm; 0: the station stays
    """

    point: Real
    normal: Real
    bound: Real

    def moved(self, shift: Real) -> Real:
        """Points (n, 3) for shifts (n, m) in mm."""
        return np.asarray(self.point + np.einsum("nkm,nm->nk", self.normal, shift))


def smoothed(
    stations: Stations, place: Real, weight: Real, group: Index, barrier: float, start: Real
) -> Real:
    """Shifts (n, m) in mm of least cost plus `barrier` times the barrier of the bounds.

    place   (n,) rising parameter of the stations
    weight  (n,) of the squared third derivative by `place`
    group   (n,) rising number of the curve that a station belongs to; third derivatives do not reach across
    start   (n, m) shifts strictly inside the bounds
    """
    coefficient = third_differences(place)
    width = (place[_ORDER:] - place[:-_ORDER]) / _ORDER
    middle = 0.5 * (weight[1:-2] + weight[2:-1])
    coefficient = coefficient * np.sqrt(width * middle)[:, None]
    shift = np.empty_like(start)
    # Each curve by itself, so that the bounds of one do not shorten the steps of another.
    edges = [0, *(np.flatnonzero(np.diff(group)) + 1).tolist(), group.size]
    for first, end in itertools.pairwise(edges):
        own, rows = slice(first, end), slice(first, max(first, end - _ORDER))
        shift[own] = least_squares_in_bounds(
            stations.point[own],
            stations.normal[own],
            stations.bound[own],
            coefficient[rows],
            barrier,
            start[own],
        )
    return shift


def third_differences(place: Real) -> Real:
    """Coefficients (n - 3, 4) of the third derivative by `place` from four neighbouring values."""
    rows = place.size - _ORDER
    x = np.stack([place[k : k + rows] for k in range(_ORDER + 1)], axis=1)
    gap = x[:, :, None] - x[:, None, :]
    gap[:, np.arange(4), np.arange(4)] = 1.0
    return np.asarray(6.0 / np.prod(gap, axis=2))
