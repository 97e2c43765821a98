# SPDX-License-Identifier: MIT
"""The feed polynomial of least peak jerk; docs/theory/numerics.md 5.3.

The linear program "least peak of an odd polynomial g (the jerk) with a given first moment" has a Gauss
quadrature as its dual solution, so its answer is known in closed form: at the positive nodes of
the rule g takes its peak, flat where the node is an inner one. The tests solve the linear program
itself beside it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

Real = NDArray[np.float64]


def minimax_nodes(degree: int) -> tuple[Real, Real]:
    """Positive nodes and weights, on [-1, 1], of the rule that is the dual solution for `degree`.

    Gauss-Legendre for m even, Gauss-Lobatto (last node 1) for m odd, m = (degree - 1) // 2.
    """
    m = (degree - 1) // 2
    x: Real
    w: Real
    if m % 2 == 0:
        x, w = legendre.leggauss(m + 1)
        return np.asarray(x[x > 1e-9]), np.asarray(w[x > 1e-9])
    count = m + 2
    p = np.zeros(count)
    p[-1] = 1.0
    inner = np.sort(legendre.legroots(legendre.legder(p)).real)
    x = np.concatenate((inner[inner > 1e-9], (1.0,)))
    w = np.asarray(2.0 / (count * (count - 1) * legendre.legval(x, p) ** 2), dtype=np.float64)
    return x, w


def minimax_peak(degree: int) -> float:
    """Least peak jerk of `degree`, in units of V_f / T^2; 6, 4.648, 4.382 … towards 4 (bang-bang)."""
    x, w = minimax_nodes(degree)
    return float(2.0 / (w @ x))


@lru_cache(maxsize=32)
def minimax_feed(degree: int) -> Real:
    """Chebyshev coefficients, in x = 2 tau - 1, of the feed over the end feed (V(-1) = 0, V(1) = 1).

    An even degree has the same optimum as the odd one below it.
    """
    x, _ = minimax_nodes(degree)
    m = (degree - 1) // 2
    peak = minimax_peak(degree)
    basis = np.eye(2 * m)[:, 1::2]  # columns T_1, T_3 … T_(2m-1)
    inner = x[x < 1.0]
    rows = [chebyshev.chebval(x, basis).T]
    rows.append(chebyshev.chebval(inner, chebyshev.chebder(basis)).T)
    right = np.concatenate((np.full(x.size, -peak), np.zeros(inner.size)))
    jerk = basis @ np.linalg.solve(np.vstack(rows), right)
    acceleration = chebyshev.chebint(jerk, lbnd=-1.0, scl=0.5)
    feed = chebyshev.chebint(acceleration, lbnd=-1.0, scl=0.5)
    feed[0] = 0.5
    feed[2::2] = 0.0
    out: Real = np.asarray(feed / (2.0 * feed[1::2].sum()), dtype=np.float64)
    out[0] = 0.5
    out.flags.writeable = False
    return out
