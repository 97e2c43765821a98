# SPDX-License-Identifier: MIT
"""Cuts quintics in Bezier form into parts. Such quintics are the extra axes of a path, in the parameter of its
segments. Used by spline/splitting and stream/geometry. Pure functions.
"""

from __future__ import annotations

import numpy as np

from .bernstein import Real


def halved(extra: Real) -> tuple[Real, Real]:
    """Quintics (…, 6) on [0, 1/2] and [1/2, 1] in their own [0, 1], by de Casteljau."""
    left, right, rest = [extra[..., 0]], [extra[..., -1]], extra
    for _ in range(5):
        rest = (rest[..., :-1] + rest[..., 1:]) / 2.0
        left.append(rest[..., 0])
        right.append(rest[..., -1])
    return np.stack(left, axis=-1), np.stack(right[::-1], axis=-1)


def part_of_quintics(extra: Real, low: Real, high: Real) -> Real:
    """Quintics (n, E, 6) on [low, high] (n,) in their own [0, 1], by de Casteljau; low is below 1."""
    low, high = low[:, None], high[:, None]
    return _part_before(_part_after(extra, low), (high - low) / (1.0 - low))


def _part_after(extra: Real, xi: Real) -> Real:
    """Quintics (…, 6) on [xi, 1]; xi (…,)."""
    kept, rest = [extra[..., -1]], extra
    for _ in range(5):
        rest = rest[..., :-1] * (1.0 - xi)[..., None] + rest[..., 1:] * xi[..., None]
        kept.append(rest[..., -1])
    return np.stack(kept[::-1], axis=-1)


def _part_before(extra: Real, xi: Real) -> Real:
    """Quintics (…, 6) on [0, xi]; xi (…,)."""
    return _part_after(extra[..., ::-1], 1.0 - xi)[..., ::-1]
