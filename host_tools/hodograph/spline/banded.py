# SPDX-License-Identifier: MIT
"""Complex tridiagonal systems, plain and cyclic, in linear time (LAPACK zgtsv). Used by spline/. No I/O."""

from __future__ import annotations

import numpy as np

from .bernstein import Complex


class SingularSystem(Exception):
    """The matrix is singular to working precision; the caller changes to a safer method."""


def solve_tridiagonal(lower: Complex, diagonal: Complex, upper: Complex, rhs: Complex) -> Complex:
    """x of A x = rhs, rows `lower[i] x[i-1] + diagonal[i] x[i] + upper[i] x[i+1]`.

    All of length M (`lower[0]` and `upper[-1]` are ignored); `rhs` (M,) or (M, k).
    """
    if diagonal.size == 1:
        if diagonal[0] == 0.0:
            raise SingularSystem
        return np.asarray(rhs / diagonal[0])
    # Here, since its import takes a quarter of the start time of a command that solves nothing.
    from scipy.linalg import lapack

    _, _, _, x, info = lapack.zgtsv(lower[1:], diagonal, upper[:-1], rhs)
    if info != 0:
        raise SingularSystem
    return np.asarray(x).reshape(rhs.shape)


def solve_cyclic(lower: Complex, diagonal: Complex, upper: Complex, rhs: Complex) -> Complex:
    """Same with corners: `lower[0]` multiplies x[M-1], `upper[-1]` multiplies x[0]; M >= 3.

    Sherman-Morrison: the corners are the rank-one matrix (g, 0 … 0, upper[-1])^T (1, 0 … 0,
    lower[0] / g).
    """
    corner, other = upper[-1], lower[0]
    g = -diagonal[0] if diagonal[0] != 0.0 else 1.0 + 0.0j
    changed = diagonal.copy()
    changed[0] -= g
    changed[-1] -= corner * other / g
    both = np.zeros((diagonal.size, 2), dtype=np.complex128, order="F")
    both[:, 0] = rhs
    both[0, 1], both[-1, 1] = g, corner
    solved = solve_tridiagonal(lower, changed, upper, both)
    x, y = solved[:, 0], solved[:, 1]
    denominator = 1.0 + y[0] + other / g * y[-1]
    if denominator == 0.0:
        raise SingularSystem
    return np.asarray(x - (x[0] + other / g * x[-1]) / denominator * y)
