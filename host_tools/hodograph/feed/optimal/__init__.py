# SPDX-License-Identifier: MIT
"""Profile `optimal`: the fastest feed along a whole path inside limits of path, axes and drives.

A plan begins with `plan_optimal`. In order: bounds (all limits), feasible (whether they leave any feed), curve (exact
derivatives by arc length), knots (where to cut), grid (the unknown feed^2 as a piecewise cubic), motion (limited
quantities), rows and solver (linear programs), window (their sequence), windows (any length), track (polynomials
in time), peaks (what came of it). docs/theory/numerics.md 5.6.
"""

from .bounds import gather
from .peaks import Peak, find_peaks
from .planner import OptimalPlan, plan_optimal
from .track import track_of

__all__ = ["OptimalPlan", "Peak", "find_peaks", "gather", "plan_optimal", "track_of"]
