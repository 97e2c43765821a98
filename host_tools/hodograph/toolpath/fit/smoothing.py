# SPDX-License-Identifier: MIT
"""Moves points sideways, each within its bound, so that the path through them can be passed fast.

docs/theory/toolpath-fitting.md section 3. The cost of a path is the integral of its jerk squared over time, at
speeds (n,) that are given. It is quadratic in the shifts. The bounds are kept by a barrier, so that every step of the
search stays inside them and no decision has to be made which of them bind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbsv

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_ORDER = 3
_MOST_STEPS = 60
_CLOSE = 1e-3
_SHRINK = 0.2


@dataclass(frozen=True, eq=False)
class Stations:
    """Places of a path that may be moved.

    point   (n, 3) mm
    normal  (n, 3, m) orthonormal directions in which a station may move: m = 1 in a plane, 2 in space
    bound   (n,) how far, mm; 0: not at all
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
    problem = _Problem.of(stations, place, weight, group)
    shift, level = start.copy(), max(barrier, 1.0)
    while True:
        shift = problem.minimum(shift, level)
        if level <= barrier:
            return shift
        level = max(barrier, _SHRINK * level)


@dataclass(frozen=True, eq=False)
class _Shifted:
    """Shifts (n, m), and what follows from them: the remainder of the squares of the bounds (n,), the third differences
    (n - 3, 3), and the cost with the barrier at a level.
    """

    shift: Real
    room: Real
    difference: Real
    value: float


@dataclass(frozen=True, eq=False)
class _Problem:
    """The cost as |residual + linear part|^2 / 2, banded."""

    stations: Stations
    free: NDArray[np.bool_]
    square: Real  # (n,) of the bounds; 1 where they are 0
    coefficient: Real  # (n - 3, 4), weighted
    band: Real  # upper banded storage of the Hessian

    @classmethod
    def of(cls, stations: Stations, place: Real, weight: Real, group: Index) -> _Problem:
        coefficient = third_differences(place)
        width = (place[_ORDER:] - place[:-_ORDER]) / _ORDER
        middle = 0.5 * (weight[1:-2] + weight[2:-1])
        coefficient = coefficient * np.sqrt(width * middle)[:, None]
        coefficient[group[_ORDER:] != group[:-_ORDER]] = 0.0
        free = stations.bound > 0.0
        band = _hessian(stations.normal, free, coefficient)
        return cls(stations, free, np.where(free, stations.bound, 1.0) ** 2, coefficient, band)

    def minimum(self, shift: Real, level: float) -> Real:
        """Newton's method with a line search that stays inside the bounds."""
        at = self._at(shift, level)
        for _ in range(_MOST_STEPS):
            gradient = self._gradient(at, level)
            step = self._newton(at, level, gradient)
            decrease = -float(np.sum(gradient * step))
            if not decrease > _CLOSE * level:
                break
            along = min(1.0, 0.95 * self._longest(at, step))
            for _ in range(40):
                tried = self._at(at.shift + along * step, level)
                if tried.value <= at.value - 0.1 * along * decrease:
                    break
                along *= 0.5
            else:
                break
            at = tried
        return at.shift

    def _differences(self, shift: Real) -> Real:
        point = self.stations.moved(shift)
        rows = self.coefficient.shape[0]
        return np.asarray(
            sum(self.coefficient[:, k, None] * point[k : k + rows] for k in range(_ORDER + 1))
        )

    def _at(self, shift: Real, level: float) -> _Shifted:
        room = self.square - np.sum(shift * shift, axis=1)
        difference = self._differences(shift)
        if room.min() <= 0.0:
            return _Shifted(shift, room, difference, float("inf"))
        cost = 0.5 * float(np.sum(difference**2))
        value = cost - level * float(np.sum(np.log(room / self.square)))
        return _Shifted(shift, room, difference, value)

    def _gradient(self, at: _Shifted, level: float) -> Real:
        pull = np.zeros_like(self.stations.point)
        rows = at.difference.shape[0]
        for k in range(_ORDER + 1):
            pull[k : k + rows] += self.coefficient[:, k, None] * at.difference
        out = np.einsum("nkm,nk->nm", self.stations.normal, pull)
        out += 2.0 * level * at.shift / at.room[:, None]
        out[~self.free] = 0.0
        return np.asarray(out)

    def _newton(self, at: _Shifted, level: float, gradient: Real) -> Real:
        shift, room = at.shift, at.room
        size = shift.shape[1]
        band = self.band.copy()
        flat = 2.0 * level / room
        squared = room**2
        for a in range(size):
            for b in range(a, size):
                own = 4.0 * level * shift[:, a] * shift[:, b] / squared
                band[-1 - (b - a), b::size] += own + (flat if a == b else 0.0)
        scale = 1.0 / np.sqrt(band[-1])
        width = band.shape[0]
        for k in range(width):
            off = width - 1 - k
            band[k, off:] *= scale[off:] * scale[: scale.size - off]
        _, step, failed = dpbsv(band, -gradient.ravel() * scale, overwrite_ab=1, overwrite_b=1)
        if failed:
            return np.asarray(-gradient / flat[:, None])
        return np.asarray((step * scale).reshape(shift.shape))

    def _longest(self, at: _Shifted, step: Real) -> float:
        """The greatest multiple of the step that stays inside the bounds."""
        a = np.sum(step * step, axis=1)
        b = np.sum(at.shift * step, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (-b + np.sqrt(b * b + a * at.room)) / a
        return float(np.where(self.free & (a > 0.0), reach, np.inf).min(initial=np.inf))


def third_differences(place: Real) -> Real:
    """Coefficients (n - 3, 4) of the third derivative by `place` from four neighbouring values."""
    rows = place.size - _ORDER
    x = np.stack([place[k : k + rows] for k in range(_ORDER + 1)], axis=1)
    gap = x[:, :, None] - x[:, None, :]
    gap[:, np.arange(4), np.arange(4)] = 1.0
    return np.asarray(6.0 / np.prod(gap, axis=2))


def _hessian(normal: Real, free: NDArray[np.bool_], coefficient: Real) -> Real:
    count, _, size = normal.shape
    upper = _ORDER * size + size - 1
    band = np.zeros((upper + 1, count * size))
    rows = coefficient.shape[0]
    for lag in range(_ORDER + 1):
        both = np.zeros(count)
        for k in range(_ORDER + 1 - lag):
            both[k : k + rows] += coefficient[:, k] * coefficient[:, k + lag]
        first, last = normal[: count - lag], normal[lag:]
        block = np.einsum("nka,nkb->nab", first, last) * both[: count - lag, None, None]
        block[~(free[: count - lag] & free[lag:])] = 0.0
        for a in range(size):
            for b in range(size):
                distance = lag * size + b - a
                if distance >= 0:
                    at = np.arange(count - lag) * size + lag * size + b
                    band[upper - distance, at] += block[:, a, b]
    fixed = np.repeat(~free, size)
    band[upper, fixed] = 1.0
    return band
