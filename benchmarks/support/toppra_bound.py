# SPDX-License-Identifier: MIT
"""Time-optimal feed without a jerk limit, by TOPP-RA: a lower bound of the time of every planner with a jerk limit.
Used by benchmarks/optimal. No I/O.

The path has one coordinate more than its axes, the arc length, so that feed and tangential acceleration are limits like
those of axes. The voltage limit is left out (it mixes speed and acceleration), which only lowers the bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import toppra
from numpy.typing import NDArray
from toppra import algorithm, constraint
from toppra.interpolator import AbstractGeometricPath

from hodograph.feed import Limits
from hodograph.spline import PHSpline
from hodograph.spline.frames import Curve, frames
from hodograph.spline.spatial import SpatialPHSpline

Real = NDArray[np.float64]

GRID = 4000
"""Intervals of the path."""
_FREE = 1e7
"""Stands for no limit, in mm and s."""
_PERIOD_S = 1e-3


@dataclass(frozen=True)
class Bound:
    """The time, and the greatest jerk of an axis, as third difference of positions at 1 kHz."""

    duration_s: float
    axis_jerk_mm_s3: float


class _Path(AbstractGeometricPath):  # type: ignore[misc]
    def __init__(self, spline: Curve) -> None:
        self._spline = spline

    @property
    def dof(self) -> int:
        return self._spline.axes + 1

    @property
    def path_interval(self) -> Real:
        return np.array([0.0, self._spline.length_mm])

    @property
    def waypoints(self) -> None:
        return None

    def __call__(self, path_positions: Any, order: int = 0) -> Real:
        s = np.asarray(path_positions, dtype=np.float64)
        at = np.clip(np.atleast_1d(s), 0.0, self._spline.length_mm)
        if order == 0:
            rows, along = _places(self._spline, at), at
        elif order == 1:
            rows, along = frames(self._spline, at).r1, np.ones(at.size)
        else:
            rows, along = frames(self._spline, at).r2, np.zeros(at.size)
        out = np.vstack((rows, along)).T
        return out[0] if s.ndim == 0 else out


def _places(spline: Curve, s: Real) -> Real:
    """Points (A, n)."""
    if isinstance(spline, SpatialPHSpline):
        return spline.axes_point(s).T
    assert isinstance(spline, PHSpline)
    z = spline.point(s)
    return np.stack((z.real, z.imag))


def bound(spline: Curve, limits: Limits) -> Bound:
    """From rest to rest along the whole path. Raises RuntimeError: TOPP-RA finds none."""
    toppra.setup_logging("ERROR")
    path = _Path(spline)
    axis = limits.axis
    free = (_FREE,) * spline.axes
    axis_velocity = axis.velocity_mm_s or free
    axis_acceleration = axis.acceleration_mm_s2 or free
    feed, acceleration = limits.feed_mm_s or _FREE, limits.acceleration_mm_s2 or _FREE

    def velocities(s: float) -> Real:
        at = np.array([min(max(s, 0.0), spline.length_mm)])
        kappa = abs(float(frames(spline, at).curvature[0]))
        curve = inf if limits.centripetal_mm_s2 is None else limits.centripetal_mm_s2
        most = min(feed, (curve / max(kappa, 1e-12)) ** 0.5)
        most = min([most, *(c.feed_mm_s for c in limits.zones if c.from_mm <= s <= c.to_mm)])
        high = np.array([*axis_velocity, most])
        return np.stack((-high, high), axis=1)

    high = np.array([*axis_acceleration, acceleration])
    constraints = [
        constraint.JointVelocityConstraintVarying(velocities),
        constraint.JointAccelerationConstraint(np.stack((-high, high), axis=1)),
    ]
    grid = np.linspace(0.0, spline.length_mm, GRID + 1)
    planner = algorithm.TOPPRA(constraints, path, gridpoints=grid, solver_wrapper="seidel")
    _, speed, _ = planner.compute_parameterization(0.0, 0.0)
    if speed is None or not np.all(np.isfinite(speed)):
        raise RuntimeError("TOPP-RA found no feed")
    pace = speed[1:] + speed[:-1]
    t = np.concatenate((np.zeros(1), np.cumsum(2.0 * np.diff(grid) / pace)))
    return Bound(float(t[-1]), _sampled_jerk(spline, grid, speed, t))


def _sampled_jerk(spline: Curve, grid: Real, speed: Real, t: Real) -> float:
    """Constant tangential acceleration within each interval, sampled every millisecond."""
    at = np.arange(0.0, t[-1], _PERIOD_S)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    u = at - t[k]
    pull = (speed[k + 1] - speed[k]) / (t[k + 1] - t[k])
    s = np.clip(grid[k] + speed[k] * u + 0.5 * pull * u * u, 0.0, spline.length_mm)
    rows = np.pad(_places(spline, np.append(s, spline.length_mm)), ((0, 0), (3, 3)), mode="edge")
    return float(np.abs(np.diff(rows, 3, axis=1)).max()) / _PERIOD_S**3
