# SPDX-License-Identifier: MIT
"""Derivatives of a PH curve by arc length, exact and from either side of joints; docs/theory/numerics.md 5.6.

PH quintic splines are C2: the curvature is continuous, its derivative jumps at joints. There both sides count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...spline import PHSpline

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

LEFT, RIGHT = -1, 1
_AT_JOINT = 1e-9
_CLOSE = 1e-11


@dataclass(frozen=True, eq=False)
class Frames:
    """r_s, r_ss and r_sss, complex (n,), and the curvature."""

    r1: Complex
    r2: Complex
    r3: Complex
    curvature: Real


def frames(spline: PHSpline, s_mm: Real, side: NDArray[np.int8]) -> Frames:
    """At arc lengths `s_mm` (n,); at joints those of the segment to the LEFT or RIGHT, by `side` (n,)."""
    segment, xi = spline.locate(np.clip(s_mm, 0.0, spline.length_mm), _CLOSE)
    back = (xi < _AT_JOINT) & (side == LEFT) & (segment > 0)
    on = (xi > 1.0 - _AT_JOINT) & (side == RIGHT) & (segment < spline.segment_count - 1)
    segment = segment - back + on
    xi = np.where(back, 1.0, np.where(on, 0.0, xi))
    w0, w1, w2 = spline.w[segment].T
    w = w0 * (1.0 - xi) ** 2 + 2.0 * w1 * xi * (1.0 - xi) + w2 * xi * xi
    first = 2.0 * ((w1 - w0) * (1.0 - xi) + (w2 - w1) * xi)
    second = 2.0 * (w2 - 2.0 * w1 + w0)
    sigma = w.real * w.real + w.imag * w.imag
    turn = (np.conj(w) * first).imag
    growth = 2.0 * (np.conj(w) * first).real
    curvature = 2.0 * turn / sigma**2
    slope = (2.0 * (np.conj(w) * second).imag / sigma**2 - 4.0 * turn * growth / sigma**3) / sigma
    tangent = w * w / sigma
    normal = 1j * tangent
    return Frames(tangent, curvature * normal, slope * normal - curvature**2 * tangent, curvature)
