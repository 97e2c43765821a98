# SPDX-License-Identifier: MIT
"""The quadratic programs of the planner, by PIQP; docs/theory/numerics.md 5.6 says why PIQP."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp
from numpy.typing import NDArray
from scipy import sparse

from .rows import Rows

Real = NDArray[np.float64]
Index = NDArray[np.intp]

TOLERANCE = 1e-8
_MOST_ITERATIONS = 120
_NEAR = 1e-3
_WAYS = ((piqp.sparse_ldlt_cond, 1), (piqp.sparse_ldlt, 10))
"""Backends and rounds of scaling, tried in order. Condensed equations are a third quicker."""

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
    """The unknowns, or None where there is no solution.

    penalty  rows may be exceeded, each interval's by a share of its own that costs this much (in units of the
    objective)
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
    found = _solved(task, tolerance)
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
    """With one more unknown for each interval, at least 0: by how much its rows are exceeded, on either side."""
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


def _solved(task: _Task, tolerance: float) -> Real | None:
    """Unknowns with one value only are equations: as bounds without an inside they keep PIQP from ending.

    A program whose rows are scaled badly may end short of the tolerance: what is near enough is taken, since the
    plan is measured anyway.
    """
    low, high = task.low.copy(), task.high.copy()
    fixed = np.flatnonzero(low == high)
    equal = sparse.csc_matrix(
        (np.ones(fixed.size), (np.arange(fixed.size), fixed)), (fixed.size, low.size)
    )
    value = low[fixed]
    low[fixed], high[fixed] = -np.inf, np.inf
    for backend, scalings in _WAYS:
        solver = piqp.SparseSolver()
        _set(solver.settings, backend, scalings, tolerance)
        solver.setup(
            task.hessian, task.gradient, equal, value, task.matrix, task.least, task.most, low, high
        )
        status = solver.solve()
        found = np.asarray(solver.result.x)
        if (status == piqp.PIQP_SOLVED or _near(solver.result.info)) and np.isfinite(found).all():
            return found
        if status == piqp.PIQP_PRIMAL_INFEASIBLE:
            return None
    return None


def _set(settings: piqp.Settings, backend: piqp.KKTSolver, scalings: int, tolerance: float) -> None:
    settings.eps_abs = settings.eps_rel = tolerance
    settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = tolerance
    settings.max_iter = _MOST_ITERATIONS
    settings.kkt_solver = backend
    settings.preconditioner_iter = scalings


def _near(info: piqp.Info) -> bool:
    """Whether the last iterate is a solution but for some digits."""
    gap = info.duality_gap / max(1.0, abs(info.primal_obj))
    return bool(max(info.primal_res, info.dual_res, gap) < _NEAR)


def _hessian(problem: Problem, unit: float) -> sparse.csc_matrix:
    """Blocks of two unknowns a knot on the diagonal and beside it, column by column."""
    pair = problem.scale.reshape(-1, 2)
    scale = np.concatenate((pair[:-1], pair[1:]), axis=1)
    blocks = problem.hessian * unit * scale[:, :, None] * scale[:, None, :]
    count = pair.shape[0]
    # Of each knot: unknowns of the knot before, its own, of the next.
    columns = np.zeros((count, 2, 6))
    columns[1:, :, :2] = blocks[:, 2:, :2]
    columns[:-1, :, 2:4] = blocks[:, :2, :2]
    columns[1:, :, 2:4] += blocks[:, 2:, 2:]
    columns[:-1, :, 4:] = blocks[:, :2, 2:]
    columns[:, (0, 1), (2, 3)] += _CURVATURE
    row = np.broadcast_to(2 * np.arange(count)[:, None, None] + np.arange(-2, 4), columns.shape)
    inside = (row >= 0) & (row < 2 * count)
    ends = np.concatenate(([0], np.cumsum(inside.sum(axis=2).ravel())))
    return sparse.csc_matrix((columns[inside], row[inside], ends), (2 * count, 2 * count))
