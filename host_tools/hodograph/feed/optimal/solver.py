# SPDX-License-Identifier: MIT
"""Scales a quadratic program of the planner and solves it in C; docs/theory/feed.md 5.6. Used by optimal/window. No
I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...native.quadratic_program import QuadraticProgram, solve_quadratic
from .rows import Rows

Real = NDArray[np.float64]

TOLERANCE = 1e-8
"""Tolerance of a quadratic program of highest effort, in limit usage; a solution stays below its limits by about as
much.
"""

_CURVATURE = 1e-8
"""A small curvature of the objective, in units of the unknowns' own scale: the solution is then unique."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Least gradient @ x + x @ hessian @ x / 2 over low <= x <= high and the rows.

    x (2 n + 2,) are q and dq/ds at each knot; their `scale` makes them about 1.
    """

    gradient: Real
    hessian: Real  # (n, 4, 4), of the unknowns of each interval
    scale: Real
    low: Real
    high: Real
    rows: Rows


def solve(
    problem: Problem, penalty: float | None = None, tolerance: float = TOLERANCE
) -> Real | None:
    """The unknowns; None: there is no solution, or none is found.

    penalty  cost (in units of the objective) of a share by which all rows of an interval may be exceeded; each interval
             has its own share
    """
    scale = problem.scale
    gradient = problem.gradient * scale
    unit = 1.0 / np.abs(gradient).max()
    found = solve_quadratic(
        _scaled(problem, gradient, unit),
        np.tile((1.0, 0.0), scale.size // 2),  # the feed before, without slopes
        tolerance=tolerance,
        curvature=_CURVATURE,
        penalty=0.0 if penalty is None else penalty * unit,
    )
    if found.status < 0 or not np.isfinite(found.unknowns).all():
        return None
    return found.unknowns * scale


def _scaled(problem: Problem, gradient: Real, unit: float) -> QuadraticProgram:
    pair = problem.scale.reshape(-1, 2)
    scale = np.concatenate((pair[:-1], pair[1:]), axis=1)
    rows = problem.rows
    return QuadraticProgram(
        gradient * unit,
        problem.hessian * unit * scale[:, :, None] * scale[:, None, :],
        problem.low / problem.scale,
        problem.high / problem.scale,
        rows.coefficients * scale[rows.interval],
        rows.interval,
        rows.low,
        rows.high,
    )
