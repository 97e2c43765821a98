# SPDX-License-Identifier: MIT
"""An estimate of the speed along a path of points, with which smoothing weighs its cost;
docs/theory/toolpath-fitting.md 3. It only decides where smoothing matters: the feed itself is planned later. Used by
fit/fitting and job. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

_ACCELERATION_SHARE, _JERK_SHARE = 0.7, 0.9
_LEAST_SHARE = 1e-3
"""Least speed, at rest too, as a share of the feed; keeps times finite."""


@dataclass(frozen=True)
class MotionLimits:
    """The lowest limits of all axes: a motion that keeps them along the path keeps the limits of each axis."""

    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float


def speeds(point: Real, place: Real, feed_mm_s: Real, limits: MotionLimits) -> Real:
    """Speeds (n,) at points (n, 3) with arc lengths (n,) that rise; at most `feed_mm_s` (n,), low at both ends."""
    step = np.maximum(np.diff(place), 1e-12)
    tangent = np.diff(point, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-12)[:, None]
    bend = np.zeros_like(point)
    bend[1:-1] = np.diff(tangent, axis=0) / (0.5 * (step[1:] + step[:-1]))[:, None]
    change = np.linalg.norm(np.diff(bend, axis=0), axis=1) / step
    most = np.maximum(np.append(change, 0.0), np.append(0.0, change))
    with np.errstate(divide="ignore"):
        speed = np.minimum(
            feed_mm_s, np.sqrt(limits.acceleration_mm_s2 / np.linalg.norm(bend, axis=1))
        )
        speed = np.minimum(speed, np.cbrt(limits.jerk_mm_s3 / most))
    speed[[0, -1]] = np.minimum(speed[[0, -1]], _LEAST_SHARE * feed_mm_s[[0, -1]])
    # At constant jerk from a slow place v^(3/2) rises with the distance, at constant acceleration v^2 does.
    rise = 1.5 * _JERK_SHARE * sqrt(limits.jerk_mm_s3) * place
    speed = np.cbrt(_within(speed**1.5, rise)) ** 2
    rise = 2.0 * _ACCELERATION_SHARE * limits.acceleration_mm_s2 * place
    speed = np.sqrt(_within(speed**2, rise))
    return np.asarray(np.maximum(speed, _LEAST_SHARE * feed_mm_s))


def _within(value: Real, rise: Real) -> Real:
    """The greatest values (n,) below `value` that change by no more than `rise` does, up or down."""
    value = np.minimum.accumulate(value - rise) + rise
    value = np.minimum.accumulate((value + rise)[::-1])[::-1] - rise
    return np.asarray(np.maximum(value, 0.0))  # rounding may leave less
