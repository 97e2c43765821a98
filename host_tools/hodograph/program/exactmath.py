# SPDX-License-Identifier: MIT
"""Exact integer arithmetic on quantised segments; docs/theory/numerics.md section 8.

Products of q44 numbers are q88 and need up to 104 bits: numpy object arrays of Python integers, about
1 us a segment and product.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Int = NDArray[np.int64]
Big = NDArray[np.object_]

WAY_SCALE = 15
"""Ways of segments are exact multiples of 2^-88 / 15 mm."""


def segment_ways(u_q44: Int, v_q44: Int) -> tuple[Big, Big, Big]:
    """Integral over [0, 1] of Re w^2, Im w^2 and |w|^2 of each segment (N,), times 15 * 2^88.

    15 times the integral of a b is, for quadratics in Bernstein form,
    3 a0 b0 + 3 a2 b2 + 2 a1 b1 + 3/2 (a0 b1 + a1 b0 + a1 b2 + a2 b1) + 1/2 (a0 b2 + a2 b0).
    """
    u, v = u_q44.astype(object), v_q44.astype(object)
    uu, vv, uv2 = _double_inner(u, u), _double_inner(v, v), _double_inner(u, v)
    return (uu - vv) // 2, uv2, (uu + vv) // 2


def _double_inner(a: Big, b: Big) -> Big:
    """30 times the integral of the product; even when a is b."""
    cross = a[:, 0] * b[:, 1] + a[:, 1] * (b[:, 0] + b[:, 2]) + a[:, 2] * b[:, 1]
    ends = a[:, 0] * b[:, 2] + a[:, 2] * b[:, 0]
    return np.asarray(
        6 * (a[:, 0] * b[:, 0] + a[:, 2] * b[:, 2]) + 4 * a[:, 1] * b[:, 1] + 3 * cross + ends
    )


def way_to_q40(way: Big) -> Int:
    """Ways (integers over 15 * 2^88) rounded to 2^-40 mm."""
    unit = WAY_SCALE << 48
    return np.asarray((2 * way + unit) // (2 * unit), dtype=np.int64)


def cumulative(way: Big) -> Big:
    """Ways at the joints (N + 1,), 0 first, exactly."""
    out = np.zeros(way.size + 1, dtype=object)
    out[1:] = np.add.accumulate(way)
    return out
