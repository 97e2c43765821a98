# SPDX-License-Identifier: MIT
"""The quadratic programs of the planner, by PIQP; docs/numerics.md 5.6 says why PIQP."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp
from numpy.typing import NDArray
from scipy import sparse

from .rows import Rows

Real = NDArray[np.float64]

_TOLERANCE = 1e-8
_CURVATURE = 1e-8
"""A hair of curvature in the objective, in units of the unknowns' own scale: the solution is then unique."""


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


def solve(problem: Problem) -> Real | None:
    """The unknowns, or None where there is no solution."""
    scale = problem.scale
    gradient = problem.gradient * scale
    unit = 1.0 / np.abs(gradient).max()
    columns = 2 * problem.rows.interval[:, None] + np.arange(4)
    values = problem.rows.coefficients * scale[columns]
    count = columns.shape[0]
    matrix = sparse.csr_matrix(
        (values.ravel(), columns.ravel(), np.arange(0, 4 * count + 1, 4)), shape=(count, scale.size)
    ).tocsc()
    solver = piqp.SparseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = _TOLERANCE
    settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = _TOLERANCE
    solver.setup(
        _hessian(problem, unit),
        gradient * unit,
        None,
        None,
        matrix,
        problem.rows.low,
        problem.rows.high,
        problem.low / scale,
        problem.high / scale,
    )
    status = solver.solve()
    if status != piqp.PIQP_SOLVED:
        return None
    found = np.asarray(solver.result.x * scale)
    return found if np.isfinite(found).all() else None


def _hessian(problem: Problem, unit: float) -> sparse.csc_matrix:
    size = problem.scale.size
    first = 2 * np.arange(problem.hessian.shape[0])[:, None, None]
    row = np.broadcast_to(first + np.arange(4)[:, None], problem.hessian.shape)
    column = np.broadcast_to(first + np.arange(4), problem.hessian.shape)
    values = problem.hessian * unit * problem.scale[row] * problem.scale[column]
    hair = sparse.diags(np.full(size, _CURVATURE))
    whole = sparse.coo_matrix((values.ravel(), (row.ravel(), column.ravel())), shape=(size, size))
    return sparse.csc_matrix(whole + hair)
