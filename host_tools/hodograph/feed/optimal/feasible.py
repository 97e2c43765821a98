# SPDX-License-Identifier: MIT
"""Limits that leave no feed worth the name: which, where, and what would do; docs/numerics.md 5.6."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline import PHSpline
from ..request import LEAST_FEED_MM_S
from .bounds import Bounds
from .curve import LEFT, RIGHT, frames

Real = NDArray[np.float64]

_SAMPLES = 32


@dataclass(frozen=True, eq=False)
class _Constant:
    """What a limit allows at constant feed: feed (n,) at points, and how the limit goes with it."""

    name: str
    limit: float
    feed: Real
    power: int


def check_feasible(spline: PHSpline, bounds: Bounds) -> None:
    """Raises PlanError where a limit allows less than LEAST_FEED_MM_S even at constant feed.

    Every path without corners can be run inside any limits, if slowly enough; this is the bound of slowness.
    """
    u = np.linspace(0.0, 1.0, _SAMPLES + 1)
    joints = spline.segment_starts_mm
    s = (joints[:-1, None] + np.diff(joints)[:, None] * u).ravel()
    side = np.tile(np.where(u == 0.0, RIGHT, np.where(u == 1.0, LEFT, 0)), joints.size - 1)
    for limit in _limits(spline, bounds, s, side.astype(np.int8)):
        worst = int(np.argmin(limit.feed))
        feed = float(limit.feed[worst])
        if feed < LEAST_FEED_MM_S:
            least = limit.limit * (LEAST_FEED_MM_S / feed) ** limit.power * (1.0 + 1e-6)
            raise PlanError(
                f"limits: {limit.name} = {limit.limit:g} allows {feed:.3g} mm/s at arc length {s[worst]:.6g} mm, "
                f"less than the {LEAST_FEED_MM_S:g} mm/s that a feed has to be: {_rounded_up(least)} would do there"
            )


def _rounded_up(value: float) -> str:
    """Three digits, not below the value."""
    text = f"{value:.3g}"
    return text if float(text) >= value else f"{value * 1.005:.3g}"


def _limits(spline: PHSpline, bounds: Bounds, s: Real, side: NDArray[np.int8]) -> list[_Constant]:
    f = frames(spline, s, side)
    flat = np.ones(s.size)
    with np.errstate(divide="ignore"):
        out = [
            _Constant("feed_mm_s", bounds.feed_mm_s, bounds.feed_mm_s * flat, 1),
            _Constant(
                "centripetal_mm_s2",
                bounds.centripetal_mm_s2,
                np.sqrt(bounds.centripetal_mm_s2 / np.abs(f.curvature)),
                2,
            ),
        ]
        for low, high, feed in bounds.caps:
            within = (s >= low) & (s <= high)
            out.append(_Constant("cap feed_mm_s", float(feed), np.where(within, feed, np.inf), 1))
        for k, of in enumerate((np.real, np.imag)):
            for name, limit, vector, power in (
                ("axis.velocity_mm_s", bounds.velocity[k], f.r1, 1),
                ("axis.acceleration_mm_s2", bounds.acceleration[k], f.r2, 2),
                ("axis.jerk_mm_s3", bounds.jerk[k], f.r3, 3),
            ):
                allowed = (limit / np.abs(of(vector))) ** (1.0 / power)
                out.append(_Constant(f"{name} of {'xy'[k]}", limit, allowed, power))
    return out
