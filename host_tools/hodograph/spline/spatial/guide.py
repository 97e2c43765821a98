# SPDX-License-Identifier: MIT
"""Guide curves in space: the cubic B-spline of a control polygon, or the C2 cubic spline through points.

Both are linear in the points, so they are the planar ones of x + iy and of z; docs/theory/spatial-splines.md 5.

Used by spatial/build. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..bernstein import Complex, Real
from ..ends import (
    END_NAMES,
    closed_derivatives,
    end_spans,
    end_speed,
    open_derivatives,
)
from ..knots import KnotSpans
from ..nodal import control_polygon_guide, hodograph_from_derivatives


@dataclass(frozen=True, eq=False)
class SpaceGuide:
    """Nodal points (M + 1, 3) and the guide's hodograph (M, 3, 3): vectors, their Bernstein coefficients last.

    The hodograph is that by a parameter from 0 to 1 on each span.
    """

    nodal_points: Real
    hodograph: Real
    closed: bool


@dataclass(frozen=True, eq=False)
class SpaceEnd:
    """One end of an open path: its direction (3,), or None and a name of END_NAMES."""

    name: str
    tangent: Real | None

    @staticmethod
    def chosen(name: str, tangent: object, key: str, closed: bool) -> SpaceEnd:
        """Checked condition; `key` names the tangent in messages. Raises InputError."""
        if name not in END_NAMES:
            raise InputError(f'ends = "{name}" is unknown: use {" or ".join(END_NAMES)}')
        if tangent is None:
            return SpaceEnd(name, None)
        if closed:
            raise InputError(f"{key} is for open paths: remove it or set closed = false")
        try:
            vector = np.array(tangent, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{key} must be three numbers [x, y, z]") from error
        if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
            raise InputError(f"{key} must be three finite numbers, not all 0")
        return SpaceEnd(name, vector)

    @property
    def level(self) -> bool:
        """Whether the direction, where there is one, keeps z."""
        return self.tangent is None or self.tangent[2] == 0.0

    @property
    def planar(self) -> complex | None:
        """The direction in the plane."""
        return None if self.tangent is None else complex(self.tangent[0], self.tangent[1])


def polygon_guide(p: Real, closed: bool) -> SpaceGuide:
    """Guide of a checked control polygon (n, 3): open of 4 points and more, closed of 3 and more."""
    plane = control_polygon_guide(_plane(p), closed)
    height = control_polygon_guide(p[:, 2].astype(np.complex128), closed)
    return SpaceGuide(
        _vectors(plane.nodal_points, height.nodal_points),
        _vectors(plane.hodograph, height.hodograph),
        closed,
    )


def points_guide(
    p: Real, closed: bool, start: SpaceEnd, end: SpaceEnd, knots: KnotSpans
) -> SpaceGuide:
    """C2 cubic spline through checked points (n, 3) on `knots`, with matching ends."""
    plane, height = _plane(p), p[:, 2].astype(np.complex128)
    if closed:
        nodes = np.vstack((p, p[:1]))
        parts = [closed_derivatives(part, knots) for part in (plane, height)]
    else:
        nodes = p
        clamps: list[Real | None] = [None, None]
        parts = _open(plane, height, start, end, clamps, knots)
        if start.tangent is not None or end.tangent is not None:
            free = _vectors(*parts)
            slopes = np.diff(p, axis=0)[[0, -1]] / np.array(end_spans(knots))[:, None]
            clamps = [
                _directed(start.tangent, free[0], slopes[0]),
                _directed(end.tangent, free[-1], slopes[1]),
            ]
            parts = _open(plane, height, start, end, clamps, knots)
    loop = _plane(nodes), nodes[:, 2].astype(np.complex128)
    hodographs = [
        hodograph_from_derivatives(q, derivative, knots)
        for q, derivative in zip(loop, parts, strict=True)
    ]
    return SpaceGuide(nodes, _vectors(*hodographs), closed)


def _open(
    plane: Complex,
    height: Complex,
    start: SpaceEnd,
    end: SpaceEnd,
    clamps: list[Real | None],
    knots: KnotSpans,
) -> list[Complex]:
    ends = [(None, None) if c is None else (complex(c[0], c[1]), complex(c[2])) for c in clamps]
    return [
        open_derivatives(part, start.name, end.name, ends[0][k], ends[1][k], knots)
        for k, part in enumerate((plane, height))
    ]


def _directed(tangent: Real | None, free: Real, chord: Real) -> Real | None:
    """Derivative in the given direction."""
    if tangent is None:
        return None
    speed = end_speed(float(np.linalg.norm(free)), float(np.linalg.norm(chord)))
    return np.asarray(tangent / np.linalg.norm(tangent) * speed)


def _plane(p: Real) -> Complex:
    return np.asarray(p[:, 0] + 1j * p[:, 1])


def _vectors(plane: Complex, height: Complex) -> Real:
    """Vectors (n, 3) or (n, 3, k) from x + iy and z."""
    return np.stack((plane.real, plane.imag, height.real), axis=1)
