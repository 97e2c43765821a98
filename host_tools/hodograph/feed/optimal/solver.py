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
Index = NDArray[np.intp]

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


def solve(problem: Problem, penalty: float | None = None) -> Real | None:
    """The unknowns, or None where there is no solution.

    penalty  rows give way, each interval's by a share of its own that costs this much (in units of the objective)
    """
    scale = problem.scale
    gradient = problem.gradient * scale
    unit = 1.0 / np.abs(gradient).max()
    task = _Task(
        _hessian(problem, unit),
        gradient * unit,
        _matrix(problem),
        problem.rows.low,
        problem.rows.high,
        problem.low / scale,
        problem.high / scale,
    )
    if penalty is not None:
        task = _elastic(task, problem.rows.interval, penalty * unit)
    found = _solved(task)
    return None if found is None else found[: scale.size] * scale


@dataclass(frozen=True, eq=False)
class _Task:
    """As PIQP takes it: least x @ hessian @ x / 2 + gradient @ x, least <= matrix @ x <= most, low <= x <= high."""

    hessian: sparse.csc_matrix
    gradient: Real
    matrix: sparse.csc_matrix
    least: Real
    most: Real
    low: Real
    high: Real


def _matrix(problem: Problem) -> sparse.csc_matrix:
    columns = 2 * problem.rows.interval[:, None] + np.arange(4)
    values = problem.rows.coefficients * problem.scale[columns]
    count = columns.shape[0]
    return sparse.csr_matrix(
        (values.ravel(), columns.ravel(), np.arange(0, 4 * count + 1, 4)),
        shape=(count, problem.scale.size),
    ).tocsc()


def _elastic(task: _Task, interval: Index, penalty: float) -> _Task:
    """With one more unknown for each interval, at least 0: by how much its rows give way, on either side."""
    size = int(interval.max()) + 1
    ones = np.ones(interval.size)
    give = sparse.csr_matrix((ones, interval, np.arange(interval.size + 1)), (ones.size, size))
    sides = []
    for sign, bound in ((1.0, task.most), (-1.0, -task.least)):
        kept = np.isfinite(bound)
        side = sparse.csr_matrix(sparse.hstack((sign * task.matrix, -give)))[kept]
        sides.append((side, bound[kept]))
    most = np.concatenate([bound for _, bound in sides])
    return _Task(
        sparse.csc_matrix(sparse.block_diag((task.hessian, _CURVATURE * sparse.identity(size)))),
        np.append(task.gradient, np.full(size, penalty)),
        sparse.csc_matrix(sparse.vstack([side for side, _ in sides])),
        np.full(most.size, -np.inf),
        most,
        np.append(task.low, np.zeros(size)),
        np.append(task.high, np.full(size, np.inf)),
    )


def _solved(task: _Task) -> Real | None:
    """Unknowns with one value only are equations: as bounds without an inside they keep PIQP from ending."""
    solver = piqp.SparseSolver()
    settings = solver.settings
    settings.eps_abs = settings.eps_rel = _TOLERANCE
    settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = _TOLERANCE
    low, high = task.low.copy(), task.high.copy()
    fixed = np.flatnonzero(low == high)
    equal = sparse.csc_matrix(
        (np.ones(fixed.size), (np.arange(fixed.size), fixed)), (fixed.size, low.size)
    )
    value = low[fixed]
    low[fixed], high[fixed] = -np.inf, np.inf
    solver.setup(
        task.hessian, task.gradient, equal, value, task.matrix, task.least, task.most, low, high
    )
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    found = np.asarray(solver.result.x)
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
