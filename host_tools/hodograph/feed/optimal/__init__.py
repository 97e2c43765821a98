# SPDX-License-Identifier: MIT
"""Profile `optimal`: the fastest feed along a whole path inside limits of path, axes and drives. Used by pipeline,
stream/tails and stream/windows. No I/O.

A plan begins with `plan_optimal`. In order: plan_limits (all limits), feasible (whether they allow any feed), knots
(first estimate, and knots), grid (the unknown feed^2 as a piecewise cubic), constraints (limited quantities), rows and
solver (quadratic programs), window (their rounds), sequence (windows for any length), track (polynomials in time and
their peaks). docs/theory/feed.md 5.6.
"""

from .planner import plan_optimal, plan_peaks, replan_optimal

__all__ = ["plan_optimal", "plan_peaks", "replan_optimal"]
