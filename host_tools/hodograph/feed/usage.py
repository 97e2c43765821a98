# SPDX-License-Identifier: MIT
"""Limit usage: the peaks of feed pieces, and the limits along a path that a plan has to keep; docs/theory/feed.md 5.5.
Used by feed/planning. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

import numpy as np
from numpy.typing import NDArray

from .kinematics import PathBounds, PathKinematics, Pieces, raised, sample
from .limits import Limit, Peak

Real = NDArray[np.float64]


def limit_peaks(bounds: PathBounds, pieces: Pieces) -> list[Peak]:
    """The peak of every limited quantity along the path: zones, curvature, axes and volts."""
    motion = sample(bounds, pieces)
    limited = (*_along(bounds, motion), *_of_axes(bounds, motion), *_volts(bounds, motion))
    return [_peak(motion, limit, values) for limit, values in limited]


Limited = Iterator[tuple[Limit, Real]]
"""The limits, each with the magnitudes (C, K) of its quantity."""


def _along(bounds: PathBounds, motion: PathKinematics) -> Limited:
    limits = bounds.limits
    for zone in limits.zones:
        inside = (motion.arc_mm > zone.from_mm) & (motion.arc_mm < zone.to_mm)
        feed = np.where(inside, np.abs(motion.feed), 0.0)
        yield Limit("feed_mm_s", zone.feed_mm_s, zone=zone), feed
    if limits.centripetal_mm_s2 is not None:
        limit = Limit("centripetal_mm_s2", limits.centripetal_mm_s2)
        yield limit, raised(motion.centripetal)


def _of_axes(bounds: PathBounds, motion: PathKinematics) -> Limited:
    for key, values in (
        ("velocity_mm_s", motion.velocity),
        ("acceleration_mm_s2", motion.acceleration),
        ("jerk_mm_s3", motion.jerk),
    ):
        limits = bounds.limits.axis_limits(key)
        for limit, one in zip(limits, values, strict=True):
            if limit.value < inf:
                yield limit, raised(one)


def _volts(bounds: PathBounds, motion: PathKinematics) -> Limited:
    if bounds.plants is None:
        return
    limits = bounds.limits.volts_limits(bounds.plants)
    axes = zip(motion.velocity, motion.acceleration, strict=True)
    for limit, plant, (v, a) in zip(limits, bounds.plants, axes, strict=True):
        yield limit, raised(v + plant.time_constant_s * a) / plant.gain_mm_s_v


def _peak(motion: PathKinematics, limit: Limit, values: Real) -> Peak:
    worst = np.unravel_index(int(values.argmax()), values.shape)
    feed = max(float(abs(motion.feed[worst])), 1e-12)
    return Peak(
        limit,
        float(values[worst]),
        float(motion.arc_mm[worst]),
        curvature_per_mm=float(abs(motion.centripetal[worst])) / feed**2,
    )
