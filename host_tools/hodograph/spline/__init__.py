# SPDX-License-Identifier: MIT
"""C2 Pythagorean-hodograph quintic splines: from control polygons or points to exact arc lengths."""

from .build import SplineResult, from_control_polygon, line
from .curve import PHSpline

__all__ = ["PHSpline", "SplineResult", "from_control_polygon", "line"]
