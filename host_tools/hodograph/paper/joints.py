# SPDX-License-Identifier: MIT
"""The paper's disturbance at the joints: differences of chord speed at constant feed.

The paper does not define it. This is a reading of paper section 6: with points r_k at a distance of one period at
constant feed, the chord speed |r_{k+1} - r_k| / dt and its first and second differences over dt. Both would be zero on
a straight line. On a curve they are not, even for an exact interpolator: a chord is shorter than its arc by kappa^2 (V
dt)^3 / 24, so that the chord speed follows V^3 dt^2 kappa^2 / 24 (`chord_acceleration_mm_s2`).

Used by paper/compare and report/path_figures. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..spline import PHSpline

Real = NDArray[np.float64]
_NEAR_TICKS = 3
"""Ticks before and after a joint that are compared."""


@dataclass(frozen=True, eq=False)
class JointDisturbance:
    """Chord differences over a whole path at constant feed.

    s_mm                  (n,) arc length of each tick
    acceleration_mm_s2    (n - 2,) first differences of chord speed over dt
    jerk_mm_s3            (n - 3,) second differences
    joints_mm             arc lengths of the joints between segments
    """

    feed_mm_s: float
    period_s: float
    s_mm: Real
    acceleration_mm_s2: Real
    jerk_mm_s3: Real
    joints_mm: Real

    def largest(self, values: Real) -> float:
        """Greatest magnitude along the path."""
        return float(np.abs(values).max())

    def largest_at_joints(self, values: Real) -> float:
        """Greatest magnitude within three ticks of a joint."""
        near = [int(s / (self.feed_mm_s * self.period_s)) for s in self.joints_mm]
        windows = [values[max(0, k - _NEAR_TICKS) : k + _NEAR_TICKS] for k in near]
        return max((float(np.abs(w).max()) for w in windows if w.size), default=0.0)


def joint_disturbance(spline: PHSpline, feed_mm_s: float, period_s: float) -> JointDisturbance:
    """Samples the exact curve every period at constant feed and takes the differences."""
    step_mm = feed_mm_s * period_s
    s_mm: Real = np.arange(int(spline.length_mm / step_mm) + 1, dtype=np.float64) * step_mm
    speed = np.abs(np.diff(spline.point(s_mm))) / period_s
    ends = spline.segment_starts_mm
    return JointDisturbance(
        feed_mm_s=feed_mm_s,
        period_s=period_s,
        s_mm=s_mm,
        acceleration_mm_s2=np.diff(speed) / period_s,
        jerk_mm_s3=np.diff(speed, 2) / period_s**2,
        joints_mm=np.asarray(ends[(ends > 0) & (ends < spline.length_mm * (1 - 1e-12))]),
    )


def chord_acceleration_mm_s2(
    spline: PHSpline, s_mm: Real, feed_mm_s: float, period_s: float
) -> Real:
    """The part from the shortening of chords alone: d/dt of -V^3 dt^2 kappa(s)^2 / 24, at arc lengths `s_mm`."""
    shortening = -(feed_mm_s**3) * period_s**2 / 24.0 * spline.curvature(s_mm) ** 2
    return np.asarray(np.gradient(shortening, s_mm) * feed_mm_s)
