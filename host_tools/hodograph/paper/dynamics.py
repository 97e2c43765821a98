# SPDX-License-Identifier: MIT
"""Acceleration and jerk, as vectors and by axis, at constant feed on a curved path.

With the unit tangent T, curvature kappa and its slope kappa' along the arc,
r_ss = i kappa T and r_sss = (i kappa' - kappa^2) T; at constant feed V, a = V^2 r_ss and j = V^3 r_sss.
kappa comes from w: N / sigma^2 with N = 2 Im(conj(w) w'), sigma = |w|^2 (docs/theory/numerics.md section 4).

Used by paper/compare. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..spline import PHSpline

_SAMPLES_PER_SEGMENT = 4001
"""Samples at which the paper's quantities are evaluated."""


@dataclass(frozen=True)
class Maximum:
    """A greatest value and the arc length where it is."""

    value: float
    s_mm: float


@dataclass(frozen=True)
class Dynamics:
    """Greatest acceleration (mm/s^2) and jerk (mm/s^3) at constant feed: of the vector and of single axes."""

    vector_acceleration: Maximum
    axis_acceleration: Maximum
    vector_jerk: Maximum
    axis_jerk: Maximum


def constant_feed_dynamics(spline: PHSpline, feed_mm_s: float) -> Dynamics:
    """Maxima over a dense grid in each segment, both sides of every joint included."""
    xi = np.linspace(0.0, 1.0, _SAMPLES_PER_SEGMENT)
    w0, w1, w2 = (spline.w[:, k, None] for k in range(3))
    w = w0 * (1 - xi) ** 2 + 2 * w1 * xi * (1 - xi) + w2 * xi**2
    dw = 2 * ((w1 - w0) * (1 - xi) + (w2 - w1) * xi)
    ddw = 2 * (w2 - 2 * w1 + w0)
    sigma = np.abs(w) ** 2
    dsigma = 2 * (np.conj(w) * dw).real
    n = 2 * (np.conj(w) * dw).imag
    dn = 2 * (np.conj(w) * ddw).imag
    kappa = n / sigma**2
    kappa_s = (dn / sigma**2 - 2 * n * dsigma / sigma**3) / sigma
    tangent = w**2 / sigma
    acceleration = feed_mm_s**2 * 1j * kappa * tangent
    jerk = feed_mm_s**3 * (1j * kappa_s - kappa**2) * tangent
    segment = np.arange(spline.segment_count)[:, None]
    s_mm = spline.segment_starts_mm[: spline.segment_count, None] + spline.arc_length(
        segment, np.broadcast_to(xi, kappa.shape)
    )

    def maximum(values: np.ndarray) -> Maximum:
        at = int(np.argmax(values))
        return Maximum(float(values.flat[at]), float(s_mm.flat[at]))

    return Dynamics(
        vector_acceleration=maximum(np.abs(acceleration)),
        axis_acceleration=maximum(np.maximum(np.abs(acceleration.real), np.abs(acceleration.imag))),
        vector_jerk=maximum(np.abs(jerk)),
        axis_jerk=maximum(np.maximum(np.abs(jerk.real), np.abs(jerk.imag))),
    )
