# SPDX-License-Identifier: MIT
"""Halving segments until they suit the program format; docs/theory/numerics.md 4.5."""

from __future__ import annotations

import numpy as np

from ..errors import InputError, PlanError
from .bernstein import Complex, halves, square, square_modulus

_HAIR = 1.0 - 2.0**-20
_SHORTEST_MM = 2.0**-20
_MOST_ROUNDS = 64


def split_segments(
    origin: Complex, w: Complex, max_length_mm: float, max_speed_ratio: float
) -> tuple[Complex, Complex]:
    """Origins (K,) and w (K, 3) of the halved segments, in order; see PHSpline.split.

    The pieces of one segment carry on from its own origin: each start is origin + integral of w^2,
    so nothing drifts along the path. Raises InputError for limits that no halving can reach and
    PlanError where a piece of 1 nm is still uneven (a cusp in all but name).
    """
    if not (max_length_mm > 0.0 and max_speed_ratio > 1.0):
        raise InputError("split: max_length_mm must be above 0 and max_speed_ratio above 1")
    source = np.arange(origin.size)
    for _ in range(_MOST_ROUNDS):
        sigma = square_modulus(w)
        length = sigma.mean(axis=1)
        uneven = sigma.max(axis=1) > max_speed_ratio * _HAIR * sigma.min(axis=1)
        stuck = np.flatnonzero(uneven & (length < _SHORTEST_MM))
        if stuck.size:
            k = int(stuck[0])
            raise PlanError(
                f"span {source[k]}: the curve all but stops at ({origin[k].real:.6g}, "
                f"{origin[k].imag:.6g}) mm (a cusp): move the points around it"
            )
        split = uneven | (length > max_length_mm)
        if not split.any():
            return origin, w
        origin, w, source = _halved(origin, w, source, split)
    raise PlanError("split: the segments cannot be made short enough: is the path absurdly long?")


def _halved(
    origin: Complex, w: Complex, source: np.ndarray, split: np.ndarray
) -> tuple[Complex, Complex, np.ndarray]:
    repeats = 1 + split.astype(np.intp)
    first = np.cumsum(repeats) - repeats
    new_origin, new_w = np.repeat(origin, repeats), np.repeat(w, repeats, axis=0)
    left, right = halves(w[split])
    at = first[split]
    # dr/dxi halves with the interval, so w shrinks by sqrt(1/2)
    new_w[at], new_w[at + 1] = left * np.sqrt(0.5), right * np.sqrt(0.5)
    new_origin[at + 1] = origin[split] + square(left).mean(axis=-1) / 2.0
    return new_origin, new_w, np.repeat(source, repeats)
