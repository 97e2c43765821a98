# SPDX-License-Identifier: MIT
"""Ruckig: state to state, jerk-limited and time-optimal, here from rest to rest at each point of a program. Used by
peers/compare and peers/plan_alone. Reads the version of the package; no other I/O.

Motion through intermediate points at speed is not part of the published package (a remote service plans it). So Ruckig
represents exact stops: jerk-limited motion that never leaves the path and rests in each corner. Phase synchronisation
keeps straight legs.
"""

from __future__ import annotations

from importlib.metadata import version as version_of
from itertools import pairwise

import numpy as np
import ruckig
from numpy.typing import NDArray

from .motion import RATE_HZ, AxisLimits, Motion

Real = NDArray[np.float64]


def version() -> str:
    """Version of the installed Ruckig package."""
    return version_of("ruckig")


def run(point_mm: Real, feed_mm_s: float, limits: AxisLimits) -> Motion:
    """The motion through points (n, 3), at rest in each. `feed_mm_s` bounds the axes as far as each leg asks."""
    otg = ruckig.Ruckig(3, 1.0 / RATE_HZ)
    taken = [point_mm[:1]]
    for start, end in pairwise(point_mm):
        taken.append(_leg(otg, start, end, feed_mm_s, limits))
    return Motion(np.concatenate(taken))


def _leg(otg: ruckig.Ruckig, start: Real, end: Real, feed_mm_s: float, limits: AxisLimits) -> Real:
    asked, given = ruckig.InputParameter(3), ruckig.OutputParameter(3)
    along = np.abs(end - start) / max(float(np.linalg.norm(end - start)), 1e-12)
    asked.synchronization = ruckig.Synchronization.Phase
    asked.current_position, asked.target_position = start.tolist(), end.tolist()
    asked.max_velocity = [
        min(limits.velocity_mm_s, max(feed_mm_s * one, 1e-3)) for one in along.tolist()
    ]
    asked.max_acceleration = [limits.acceleration_mm_s2] * 3
    asked.max_jerk = [limits.jerk_mm_s3 or 1e9] * 3
    rows = []
    while True:
        state = otg.update(asked, given)
        rows.append(list(given.new_position))
        if state != ruckig.Result.Working:
            break
        given.pass_to_input(asked)
    return np.array(rows)
