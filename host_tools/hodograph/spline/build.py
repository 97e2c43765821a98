# SPDX-License-Identifier: MIT
"""The doors of the package: from points to a PHSpline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .bernstein import Complex
from .curve import PHSpline
from .nodal import Guide, checked_points, control_polygon_guide
from .start import followed_branch, root_on_branch, starting_values
from .system import System, clamped_end


@dataclass(frozen=True)
class SplineResult:
    """A spline and how it was found.

    newton_iterations  linear systems solved in all, steps of continuation and retries included
    notes              one line each, for stderr
    """

    spline: PHSpline
    newton_iterations: int
    notes: tuple[str, ...] = ()


def from_control_polygon(points: object, closed: bool) -> SplineResult:
    """C2 PH quintic spline of a cubic B-spline control polygon (paper sections 1 and 2).

    `points`: complex (n,) or real (n, 2), mm; open from 4 points on, closed from 3 on (each point once).
    """
    p, notes = checked_points(points, closed, 3 if closed else 4, "control point")
    guide = control_polygon_guide(p, closed)
    return _solved(guide, notes)


def line(start: complex, end: complex) -> PHSpline:
    """The straight segment from `start` to `end`, mm. Raises InputError when they coincide."""
    if not (np.isfinite(start) and np.isfinite(end)) or start == end:
        raise InputError("a line needs two different finite points")
    w = np.full((1, 3), np.sqrt(complex(end - start)))
    return PHSpline(np.array([start], dtype=np.complex128), w, False)


def _solved(guide: Guide, notes: tuple[str, ...]) -> SplineResult:
    branch = followed_branch(guide.hodograph)
    chords = np.diff(guide.nodal_points)
    if guide.closed:
        turns = round(float(branch.node_angle[-1] - branch.node_angle[0]) / (2.0 * np.pi))
        system = System(chords, cyclic_sign=-1 if turns % 2 else 1)
    else:
        a = root_on_branch(guide.hodograph[0, 0], branch.node_angle[0])
        b = root_on_branch(guide.hodograph[-1, 2], branch.node_angle[-1])
        system = System(chords, clamped_end(complex(a)), clamped_end(complex(b)))
    z: Complex = starting_values(guide.hodograph, branch)
    for k in range(50):
        residual = system.residual(z)
        if np.abs(residual).max() < 60e-14 * np.abs(chords).max():
            break
        z = z + system.newton_step(z, residual)
    spline = PHSpline(guide.nodal_points[:-1].copy(), system.coefficients(z), guide.closed)
    return SplineResult(spline, k, notes)
