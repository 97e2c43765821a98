# SPDX-License-Identifier: MIT
"""Random polygons for tests and benchmarks, each a pure function of a seed. Used by the tests of this folder and by
benchmarks. No I/O.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Polygon = tuple[NDArray[np.complex128], bool]

ALPHA = np.array([0, 12 + 18j, 24 + 27j, 36 + 9j, 24 - 9j, 12, 18j])
HEART = np.array([-20 - 50j, 5j, -5j, -20 + 50j, 40 + 50j, 75 - 5j, 75 + 5j, 40 - 50j])


def from_turns(legs: NDArray[np.float64], turns: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Open polygon from the lengths of its legs and the angles (rad) between them."""
    heading = np.concatenate(([0.0], np.cumsum(turns)))
    return np.concatenate(([0.0], np.cumsum(legs * np.exp(1j * heading))))


def smooth(seed: int) -> Polygon:
    """4 to 200 points, open or closed, of one of four kinds.

    walk    open; legs 5 to 15 mm, turns up to a bound of 10 to 70 degrees, independent
    drift   open; legs drift, turns are a random walk within 50 degrees
    wave    sum of up to 9 harmonics, at least 8 points to the fastest
    blob    radius about a centre in up to 9 harmonics
    """
    rng = np.random.default_rng([seed, 1])
    n, closed = int(rng.integers(4, 201)), bool(rng.integers(2))
    kind = rng.integers(4)
    if not closed and kind == 0:
        bound = rng.uniform(0.17, 1.22)
        return from_turns(rng.uniform(5, 15, n - 1), rng.uniform(-bound, bound, n - 2)), False
    if not closed and kind == 1:
        turns = np.cumsum(rng.normal(0, 0.2, n - 2))
        legs = 10 * np.exp(np.clip(np.cumsum(rng.normal(0, 0.1, n - 1)), -1, 1))
        return from_turns(legs, np.clip(turns - turns.mean(), -0.87, 0.87)), False
    harmonics = np.arange(1, int(rng.integers(1, max(2, min(n // 8, 9) + 1))) + 1)
    t = np.arange(n) / n if closed else np.linspace(0, rng.uniform(0.4, 1), n)
    phase = 2 * np.pi * np.outer(t, harmonics)
    if kind == 2:
        a, b, c, d = rng.normal(size=(4, harmonics.size)) / harmonics**1.5
        return 100 * (np.cos(phase) @ (a + 1j * b) + np.sin(phase) @ (c + 1j * d)), closed
    size = rng.uniform(-0.5, 0.5, harmonics.size) / harmonics
    offset = 2 * np.pi * rng.uniform(size=harmonics.size)
    return 100 * (1 + np.cos(phase + offset) @ size) * np.exp(2j * np.pi * t), closed


def uniform(seed: int) -> Polygon:
    """4 to 200 points anywhere in a square of 100 mm, open or closed: reversals, near-cusps."""
    rng = np.random.default_rng([seed, 2])
    n, closed = int(rng.integers(4, 201)), bool(rng.integers(2))
    return rng.uniform(0, 100, n) + 1j * rng.uniform(0, 100, n), closed


def walk(seed: int, most_turn_rad: float, sigma: float | None = None) -> NDArray[np.float64]:
    """5 to 60 points in space; legs of 3 to 15 mm or log-normal, each turned by at most `most_turn_rad`."""
    rng = np.random.default_rng([seed, 3])
    count = int(rng.integers(5, 61))
    direction, points = np.array([1.0, 0.0, 0.0]), [np.zeros(3)]
    for _ in range(count - 1):
        across = np.cross(direction, rng.normal(size=3))
        angle = rng.uniform(0, most_turn_rad)
        aside = across / np.linalg.norm(across)
        direction = np.cos(angle) * direction + np.sin(angle) * aside
        leg = rng.uniform(3, 15) if sigma is None else np.exp(sigma * rng.normal())
        points.append(points[-1] + leg * direction)
    return np.array(points)


def torus_knot(count: int, p: int = 2, q: int = 3) -> NDArray[np.float64]:
    """Closed: p times round a torus of radii 30 and 10 mm, q times through its hole; the trefoil by default."""
    t = 2 * np.pi * np.arange(count) / count
    ring = 3 + np.cos(q * t)
    return 10 * np.stack((ring * np.cos(p * t), ring * np.sin(p * t), np.sin(q * t)), axis=-1)


def helix(per_turn: int, turns: int = 2) -> NDArray[np.float64]:
    """Radius 20 mm, rise 2 mm a radian."""
    t = 2 * np.pi * np.arange(per_turn * turns + 1) / per_turn
    return np.stack((20 * np.cos(t), 20 * np.sin(t), 2 * t), axis=-1)
