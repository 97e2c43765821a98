# SPDX-License-Identifier: MIT
"""C2 Pythagorean-hodograph quintic splines in space, with up to three extra axes (docs/theory/spatial-splines.md).

The counterpart of `spline` for points [x, y, z, …]. Lengths are in mm, in degrees for rotary axes.

Used by most modules of host_tools. No I/O.
"""

from .build import SpatialSplineResult, spatial_from_control_polygon, spatial_through_points
from .curve import SpatialPHSpline, sliced

__all__ = [
    "SpatialPHSpline",
    "SpatialSplineResult",
    "sliced",
    "spatial_from_control_polygon",
    "spatial_through_points",
]
