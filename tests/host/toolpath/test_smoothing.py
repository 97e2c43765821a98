# SPDX-License-Identifier: MIT
"""Points moved sideways within bounds: the search in C finds the minimum, and keeps the bounds. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from hodograph.toolpath.fit.smoothing import Stations, smoothed, third_differences

BARRIER = 1e-4


def _stations(seed: int, count: int, ways: int) -> Stations:
    """Noisy points along x; the first, the last and one between do not move."""
    draw = np.random.default_rng(seed)
    point = np.zeros((count, 3))
    point[:, 0] = np.arange(count) + draw.uniform(-0.2, 0.2, count)
    point[:, 1:] = draw.normal(0.0, 0.3, (count, 2))
    bound = 10.0 ** draw.uniform(-2.0, 0.5, count)
    bound[[0, count // 2, -1]] = 0.0
    normal = np.zeros((count, 3, ways))
    normal[:, 1:, :] = np.eye(2)[:, :ways]
    return Stations(point, normal, bound)


def _value(
    stations: Stations, coefficient: NDArray[np.float64], shift: NDArray[np.float64]
) -> float:
    point, rows = stations.moved(shift), coefficient.shape[0]
    difference = sum(coefficient[:, k, None] * point[k : k + rows] for k in range(4))
    free = stations.bound > 0.0
    room = 1.0 - np.sum(shift[free] ** 2, axis=1) / stations.bound[free] ** 2
    assert room.min() > 0.0
    return float(0.5 * np.sum(np.square(difference)) - BARRIER * np.log(room).sum())


@pytest.mark.parametrize("ways", [1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_no_shift_nearby_is_better(seed: int, ways: int) -> None:
    stations = _stations(seed, 24, ways)
    place, weight = stations.point[:, 0], np.ones(24)
    group = np.repeat([0, 1], [10, 14])
    found = smoothed(stations, place, weight, group, BARRIER, np.zeros((24, ways)))
    assert (found[stations.bound == 0.0] == 0.0).all()
    coefficient = third_differences(place) * np.sqrt((place[3:] - place[:-3]) / 3.0)[:, None]
    coefficient[group[3:] != group[:-3]] = 0.0
    least, draw = _value(stations, coefficient, found), np.random.default_rng(100 + seed)
    assert least < _value(stations, coefficient, np.zeros_like(found))
    reach = np.maximum(stations.bound - np.linalg.norm(found, axis=1), 0.0)[:, None]
    for share in (0.5, 0.1, 1e-2, 1e-3):
        for _ in range(50):
            step = share * reach * draw.uniform(-1.0, 1.0, found.shape) / np.sqrt(ways)
            assert _value(stations, coefficient, found + step) > least - 1e-3 * BARRIER


def test_fewer_than_four_points_move_to_the_middle_of_their_bounds() -> None:
    stations = Stations(np.zeros((3, 3)), np.ones((3, 3, 1)) / np.sqrt(3.0), np.ones(3))
    place, weight = np.arange(3.0), np.ones(3)
    start = np.array([[0.5], [-0.9], [0.0]])
    found = smoothed(stations, place, weight, np.zeros(3, dtype=np.intp), BARRIER, start)
    assert np.abs(found).max() < 0.05
