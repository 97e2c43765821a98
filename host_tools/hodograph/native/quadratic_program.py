# SPDX-License-Identifier: MIT
"""Quadratic programs along a chain of intervals, solved in C (host_tools/numerics/quadratic_program.h). Used by
feed/optimal/solver. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .library import library, numbers

Real = NDArray[np.float64]
Index = NDArray[np.int64]


class Status(IntEnum):
    """How solving ended; enum quadratic_status. Below 0 there are no unknowns."""

    SOLVED = 0
    NEAR = 1
    INFEASIBLE = -1
    STUCK = -2


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """Least gradient @ x + x @ hessian @ x / 2 over low <= x <= high and least <= coefficients @ x <= most.

    There are two unknowns at each of n + 1 knots. Units have to make unknowns, rows and gradient about 1. Bounds may be
    infinite.
    """

    gradient: Real  # (2 n + 2,)
    hessian: Real  # (n, 4, 4), of the unknowns at both ends of an interval
    low: Real  # (2 n + 2,)
    high: Real
    coefficients: Real  # (m, 4)
    interval: Index  # (m,)
    least: Real  # (m,)
    most: Real


@dataclass(frozen=True, eq=False)
class QuadraticSolution:
    """The unknowns (2 n + 2,), and struct quadratic_report."""

    status: Status
    unknowns: Real
    iterations: int
    violated: float
    gradient: float
    gap: float


def solve_quadratic(
    program: QuadraticProgram,
    guess: Real,
    *,
    tolerance: float,
    curvature: float,
    penalty: float = 0.0,
) -> QuadraticSolution:
    """Solves from a first guess (2 n + 2,).

    curvature  above 0, added to the hessian's diagonal
    penalty    0: rows are kept. Above 0: cost of a share by which all rows of an interval may be exceeded; each
               interval has its own share
    """
    ffi, lib = library()
    intervals, rows = program.hessian.shape[0], program.interval.size
    unknowns = np.array(guess, dtype=np.float64, order="C")
    work = np.empty(int(lib.quadratic_work(intervals, rows)))
    arrays = [
        np.ascontiguousarray(one, dtype=np.float64)
        for one in (
            *(program.gradient, program.hessian, program.low, program.high, program.coefficients),
            *(program.least, program.most),
        )
    ]
    interval = np.ascontiguousarray(program.interval, dtype=np.int64)

    *first, least, most = map(numbers, arrays)
    at = numbers(interval)
    given = ffi.new(
        "struct quadratic_program *",
        (intervals, rows, penalty, curvature, tolerance, *first, at, least, most),
    )
    report = ffi.new("struct quadratic_report *")
    status = lib.quadratic_solve(given, numbers(unknowns), numbers(work), report)
    return QuadraticSolution(
        Status(status),
        unknowns,
        report.iterations,
        report.violated,
        report.gradient,
        report.gap,
    )
