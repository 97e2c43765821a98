# SPDX-License-Identifier: MIT
"""TOPP-RA: the least time along the C2 cubic spline through the points of a program, without a limit of the jerk. Used
by peers/compare and peers/plan_alone. Reads the version of the package; no other I/O.

It plans no path and has no corners, tolerance or feed words. So it is used only for programs whose points sample a
smooth curve, with the feed word as a limit of the speed along the path.
"""

from __future__ import annotations

from importlib.metadata import version as version_of

import numpy as np
import toppra
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from toppra import algorithm, constraint

from .motion import RATE_HZ, AxisLimits, Motion

Real = NDArray[np.float64]

_GRID_A_POINT = 4
"""Intervals of the grid for each point of the program."""


def version() -> str:
    """Version of the installed TOPPRA package."""
    return version_of("toppra")


def run(point_mm: Real, feed_mm_s: float, limits: AxisLimits) -> Motion:
    """The motion through points (n, 3); the last column of the path is arc length, which the feed limits."""
    chord = np.linalg.norm(np.diff(point_mm, axis=0), axis=1)
    at = np.concatenate(([0.0], np.cumsum(chord)))
    curve = CubicSpline(at, point_mm)
    fine = np.linspace(0.0, at[-1], 16 * at.size)
    distance = np.concatenate(
        ([0.0], np.cumsum(np.linalg.norm(np.diff(curve(fine), axis=0), axis=1)))
    )
    nodes = np.column_stack((curve(at), np.interp(at, fine, distance)))
    path = toppra.SplineInterpolator(at, nodes)
    velocity = np.array([*(limits.velocity_mm_s,) * 3, feed_mm_s])
    acceleration = np.array([*(limits.acceleration_mm_s2,) * 3, 1e7])
    grid = np.linspace(0.0, at[-1], _GRID_A_POINT * at.size + 1)
    planner = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(np.stack((-velocity, velocity), axis=1)),
            constraint.JointAccelerationConstraint(np.stack((-acceleration, acceleration), axis=1)),
        ],
        path,
        gridpoints=grid,
        parametrizer="ParametrizeConstAccel",
    )
    planned = planner.compute_trajectory()
    if planned is None:
        raise RuntimeError("TOPP-RA found no motion")
    ticks = int(np.ceil(planned.duration * RATE_HZ))
    times = np.minimum(np.arange(ticks + 1) / RATE_HZ, planned.duration)
    return Motion(np.asarray(planned(times))[:, :3])
