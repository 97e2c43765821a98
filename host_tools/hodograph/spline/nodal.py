# SPDX-License-Identifier: MIT
"""From given points to what the solver needs: nodal points and the hodograph of the guiding curve.

The guiding curve is the cubic B-spline of the control polygon (paper section 1; docs/theory/numerics.md
section 1) or, for given through points, the uniform C2 cubic spline through them. Its hodograph is
handed on as Bernstein coefficients (M, 3) per span.

Used by spline/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..errors import InputError
from .bernstein import Complex, Real
from .knots import KnotSpans

_REPEATED = 1e-12
"""Points nearer than this share of the largest coordinate are the same."""

_NEAREST_MM = 1e-9
_FARTHEST_MM = 1e9
"""Least distance of points and greatest coordinate; beyond them numbers would overflow."""


@dataclass(frozen=True)
class Guide:
    """Nodal points (M + 1,) and the guiding curve's hodograph (M, 3), Bernstein form per span."""

    nodal_points: Complex
    hodograph: Complex
    closed: bool


def checked_points(
    points: object, closed: bool, minimum: int, what: str
) -> tuple[Complex, tuple[str, ...]]:
    """`points` as a finite complex array without immediate repeats, and notes on what was dropped.

    `what` names the points in messages, e.g. "control point"; `points` may be complex (n,) or real
    (n, 2). A repeated tail of a closed path (three control points, one through point) is dropped
    with a note.

    Raises InputError: not a list of points, NaN or infinity, a repeated point, half a repeated
    tail, too few points.
    """
    return _without_repeats(_as_complex(points, what), closed, minimum, what)


def checked_space_points(
    points: object, closed: bool, minimum: int, what: str
) -> tuple[Real, tuple[str, ...]]:
    """As `checked_points`, for points in space: real (n, 3)."""
    try:
        p = np.array(points, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{what}s must be a list of [x, y, z] of numbers") from error
    if p.ndim != 2 or p.shape[1] != 3:
        raise InputError(f"{what}s must be a list of [x, y, z] of numbers")
    return _without_repeats(p, closed, minimum, what)


P = TypeVar("P", Complex, Real)


def _without_repeats(points: P, closed: bool, minimum: int, what: str) -> tuple[P, tuple[str, ...]]:
    p = _ordinary(points, what)
    near = max(_NEAREST_MM, _REPEATED * float(_size(p).max(initial=0.0)))
    notes: tuple[str, ...] = ()
    tail = 1 if what.startswith("through") else 3
    if closed and len(p) > tail + 2 and _repeated(p, tail, near):
        dropped = f"the last {tail} {what}s repeat" if tail > 1 else f"the last {what} repeats"
        p, notes = p[:-tail], (f"{dropped} the first: dropped, the path is closed",)
    if len(p) < minimum:
        kind = "a closed" if closed else "an open"
        raise InputError(f"{len(p)} {what}s: {kind} path needs at least {minimum}")
    same = np.flatnonzero(_size(p[1:] - p[:-1]) <= near)
    if same.size:
        k = int(same[0])
        raise InputError(
            f"{what} {k + 1} repeats {what} {k} at ({_place(p[k])}): remove one of them"
        )
    if closed and _repeated(p, 1, near):
        raise InputError(f"the last {what} repeats the first at ({_place(p[0])}): remove it")
    if closed and tail == 3 and len(p) > 4 and _repeated(p, 2, near):
        raise InputError(f"the last two {what}s repeat the first two: remove them")
    return p, notes


def _size(p: Complex | Real) -> Real:
    """Distance (n,) from 0."""
    return np.asarray(np.abs(p) if p.ndim == 1 else np.linalg.norm(p, axis=1))


def _ordinary(p: P, what: str) -> P:
    """`p`; raises InputError: a number is not finite, or too large."""
    bad = np.flatnonzero(~np.isfinite(_size(p)))
    if bad.size:
        raise InputError(f"{what} {bad[0]} is not finite: give ordinary numbers")
    far = np.flatnonzero(_size(p) > _FARTHEST_MM)
    if far.size:
        raise InputError(f"{what} {far[0]} is beyond {_FARTHEST_MM:g} mm: are the units mm?")
    return p


def _as_complex(points: object, what: str) -> Complex:
    try:
        p = np.asarray(points)
        if p.dtype.kind not in "iufcO":
            raise TypeError
        if p.ndim == 2 and p.shape[1] == 2 and not np.iscomplexobj(p):
            pairs = np.ascontiguousarray(p, dtype=np.float64)
            p = pairs.view(np.complex128)[:, 0]
        p = np.array(p, dtype=np.complex128)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{what}s must be a list of [x, y] pairs of numbers") from error
    if p.ndim != 1:
        raise InputError(f"{what}s must be a list of [x, y] pairs of numbers")
    return p


def _place(point: Any) -> str:
    numbers = (point.real, point.imag) if np.iscomplexobj(point) else tuple(point)
    return ", ".join(f"{value:g}" for value in numbers)


def _repeated(p: Complex | Real, tail: int, near: float) -> bool:
    """Whether the last `tail` points are the first ones."""
    return bool(np.all(_size(p[-tail:] - p[:tail]) <= near))


def control_polygon_guide(p: Complex, closed: bool) -> Guide:
    """Guide of a checked control polygon: open of 4 points and more, closed of 3 and more."""
    return _closed_polygon(p) if closed else _open_polygon(p)


def _closed_polygon(p: Complex) -> Guide:
    before, after = p, np.roll(p, -1)
    nodes = (before + 4.0 * after + np.roll(p, -2)) / 6.0
    leg = after - before
    leg1, leg2 = np.roll(leg, -1), np.roll(leg, -2)
    hodograph = np.stack(((leg + leg1) / 2.0, leg1, (leg1 + leg2) / 2.0), axis=-1)
    return Guide(np.append(nodes, nodes[0]), hodograph, True)


def open_nodal_points(p: Complex) -> Complex:
    """Nodal points q_0 … q_(n-2) of an open polygon P_0 … P_n; paper (4), de Boor for n = 3, 4."""
    n = p.size - 1
    q = np.empty(n - 1, dtype=np.complex128)
    q[0], q[-1] = p[0], p[-1]
    if n == 4:
        q[1] = (p[1] + 2.0 * p[2] + p[3]) / 4.0
    elif n >= 5:
        q[1] = (3.0 * p[1] + 7.0 * p[2] + 2.0 * p[3]) / 12.0
        q[2:-2] = (p[2 : n - 3] + 4.0 * p[3 : n - 2] + p[4 : n - 1]) / 6.0
        q[-2] = (2.0 * p[n - 3] + 7.0 * p[n - 2] + 3.0 * p[n - 1]) / 12.0
    return q


def _open_polygon(p: Complex) -> Guide:
    spans = p.size - 3
    knots = np.clip(np.arange(-3.0, spans + 4.0), 0.0, spans)
    leg = 3.0 * (p[1:] - p[:-1]) / (knots[4 : p.size + 3] - knots[1 : p.size])
    hodograph = np.empty((spans, 3), dtype=np.complex128)
    hodograph[:, 1] = leg[1:-1]
    hodograph[1:, 0] = (leg[1:-2] + leg[2:-1]) / 2.0
    hodograph[:-1, 2] = hodograph[1:, 0]
    hodograph[0, 0], hodograph[-1, 2] = leg[0], leg[-1]
    return Guide(open_nodal_points(p), hodograph, False)


def hodograph_from_derivatives(
    q: Complex, derivative: Complex, knots: KnotSpans | None = None
) -> Complex:
    """Bernstein hodograph (M, 3) of the cubic Hermite curve with these nodes and derivatives by the parameter."""
    first, last = derivative[:-1], derivative[1:]
    if knots is not None:
        first, last = knots.length * first, knots.length * last
    return np.stack((first, 3.0 * (q[1:] - q[:-1]) - first - last, last), axis=-1)
