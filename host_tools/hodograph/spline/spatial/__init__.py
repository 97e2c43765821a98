# SPDX-License-Identifier: MIT
"""C2 Pythagorean-hodograph quintic splines in space."""

from .build import SpatialSplineResult, spatial_from_control_polygon, spatial_through_points
from .curve import SpatialPHSpline

__all__ = [
    "SpatialPHSpline",
    "SpatialSplineResult",
    "spatial_from_control_polygon",
    "spatial_through_points",
]
