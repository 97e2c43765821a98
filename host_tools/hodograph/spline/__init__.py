# SPDX-License-Identifier: MIT
"""C2 Pythagorean-hodograph quintic splines: from points to exact arc lengths. Used by many modules of host_tools. No
I/O.
"""

from .build import SplineResult, from_control_polygon, line, through_points
from .curve import PHSpline, coordinates
from .ends import END_NAMES
from .knots import KNOT_NAMES

__all__ = [
    "END_NAMES",
    "KNOT_NAMES",
    "PHSpline",
    "SplineResult",
    "coordinates",
    "from_control_polygon",
    "line",
    "through_points",
]
