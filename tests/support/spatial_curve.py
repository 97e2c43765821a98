# SPDX-License-Identifier: MIT
"""Random curves in space, for tests of code that takes any curve. Used by tests/host. No I/O."""

from __future__ import annotations

import numpy as np

from hodograph.spline.spatial import SpatialPHSpline, spatial_through_points


def walk(seed: int, count: int = 14) -> SpatialPHSpline:
    """A curve through random points 3 to 9 mm apart, whose direction changes by steps of about 0.5 rad."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0.0, 0.5, (count, 3)), axis=0) + np.array([2.0, 0.0, 0.0])
    heading /= np.linalg.norm(heading, axis=1, keepdims=True)
    points = np.cumsum(rng.uniform(3.0, 9.0, (count, 1)) * heading, axis=0)
    return spatial_through_points(points, False).spline
