# SPDX-License-Identifier: MIT
"""Parts of segments: halves them until they fit the program format (docs/theory/numerics.md 4.5), or cuts them at
places. Used by spline/, stream/geometry and toolpath/fit/turning. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, PlanError
from .bernstein import Real, halves, restricted, square, square_modulus
from .quintics import halved

_HAIR = 1.0 - 2.0**-20
"""The speed ratio is kept with this margin, so that rounding of the program does not exceed it."""
_SHORTEST_MM = 2.0**-20
"""A part that is shorter and still uneven cannot be split: an error."""
_MOST_ROUNDS = 64
"""Greatest number of rounds in which uneven parts are split."""
_MOST_EXTRA = 127.0
"""Greatest move of an extra axis in a segment; the format allows 128 mm or degrees."""


@dataclass(frozen=True)
class Image:
    """The image of preimages: Bernstein coefficients of r' and of sigma; last axis: the five coefficients."""

    hodograph: Callable[[Any], Any]
    speed: Callable[[Any], Real]


PLANAR = Image(square, square_modulus)


def split_segments(
    origin: Any,
    w: Any,
    max_length_mm: float,
    max_speed_ratio: float,
    image: Image = PLANAR,
    max_component: float = inf,
    extra: Real | None = None,
) -> tuple[Any, Any, Real | None]:
    """Origins (K,) and w (K, 3) of the halved segments, in order; see PHSpline.split.

    max_component  greatest magnitude of a component of the preimage, mm^(1/2)
    extra          (N, E, 6), Bezier coefficients of extra axes, which are halved too and come back (K, E, 6)

    In space, origins (K, 3) and preimages (K, 4, 3) with their `image`. Each start of a part is the origin of its
    segment + the integral of r', so no error accumulates along the path. Raises InputError: no halving can reach the
    limits. Raises PlanError: the speed within a part of 1 nm is still uneven, as near a cusp.
    """
    if not (max_length_mm > 0.0 and max_speed_ratio > 1.0):
        raise InputError("split: max_length_mm must be above 0 and max_speed_ratio above 1")
    source = np.arange(len(origin))
    for _ in range(_MOST_ROUNDS):
        sigma = image.speed(w)
        length = sigma.mean(axis=1)
        uneven = sigma.max(axis=1) > max_speed_ratio * _HAIR * sigma.min(axis=1)
        stuck = np.flatnonzero(uneven & (length < _SHORTEST_MM))
        if stuck.size:
            k = int(stuck[0])
            raise PlanError(
                f"span {source[k]}: the curve all but stops at ({_place(origin[k])}) mm (a cusp): "
                "move the points around it"
            )
        wide = np.abs(w).reshape(len(w), -1).max(axis=1) > max_component
        split = uneven | (length > max_length_mm) | wide
        if extra is not None:
            split |= np.abs(extra - extra[..., :1]).max(axis=(1, 2)) > _MOST_EXTRA
        if not split.any():
            return origin, w, extra
        extra = None if extra is None else _halved_extra(extra, split)
        origin, w, source = _halved(origin, w, source, split, image)
    raise PlanError("split: the segments cannot be made short enough: is the path absurdly long?")


def cut_segments(w: Any, segment: NDArray[np.intp], xi: Real) -> tuple[NDArray[np.intp], Real, Any]:
    """Segments cut at places. For each part: its segment (K,), the xi (K,) of that segment at which it begins, and its
    preimage.

    w            (N, 3) in the plane, (N, 4, 3) in space
    segment, xi  (n,) of the places, xi inside 0 … 1
    """
    whole = np.arange(len(w))
    owner = np.concatenate((whole, segment))
    begin = np.concatenate((np.zeros(whole.size), xi))
    order = np.lexsort((begin, owner))
    owner, begin = owner[order], begin[order]
    end = np.where(np.append(np.diff(owner) == 0, False), np.append(begin[1:], 1.0), 1.0)
    return owner, begin, part_of(w[owner], begin, end)


def part_of(w: Any, low: Real, high: Real) -> Any:
    """The preimages of the parts from xi = low to high (n,) of segments, (n, 3) in the plane, (n, 4, 3) in space."""
    low, high = (np.reshape(one, (-1,) + (1,) * (w.ndim - 2)) for one in (low, high))
    # dr/dxi shrinks with the interval, so w by the root of it
    return np.sqrt(high - low)[..., None] * restricted(w, low, high)


def _place(point: Any) -> str:
    numbers = (point.real, point.imag) if np.iscomplexobj(point) else tuple(point)
    return ", ".join(f"{value:.6g}" for value in numbers)


def _halved(
    origin: Any, w: Any, source: np.ndarray, split: np.ndarray, image: Image
) -> tuple[Any, Any, np.ndarray]:
    repeats = 1 + split.astype(np.intp)
    first = np.cumsum(repeats) - repeats
    new_origin, new_w = np.repeat(origin, repeats, axis=0), np.repeat(w, repeats, axis=0)
    left, right = halves(w[split])
    at = first[split]
    # dr/dxi halves with the interval, so w shrinks by sqrt(1/2)
    new_w[at], new_w[at + 1] = left * np.sqrt(0.5), right * np.sqrt(0.5)
    new_origin[at + 1] = origin[split] + image.hodograph(left).mean(axis=-1) / 2.0
    return new_origin, new_w, np.repeat(source, repeats)


def _halved_extra(extra: Real, split: np.ndarray) -> Real:
    repeats = 1 + split.astype(np.intp)
    at = (np.cumsum(repeats) - repeats)[split]
    out = np.repeat(extra, repeats, axis=0)
    out[at], out[at + 1] = halved(extra[split])
    return np.asarray(out)
