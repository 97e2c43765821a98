# SPDX-License-Identifier: MIT
"""The motion at given instants: derivatives of arc length and of the point, by the chain rule.

A part of `hodograph verify`: shares no code with the planner (`feed`), which it checks.

In the plane, with the unit tangent T = w / conj(w), N = 2 Im(conj(w) w') and sigma = |w|^2, the curvature is
kappa = N / sigma^2, and with kappa_s its slope along the arc

    r_s = T        r_ss = i kappa T        r_sss = (i kappa_s - kappa^2) T
    velocity  F' r_s
    acceleration  F'' r_s + F'^2 r_ss
    jerk  F''' r_s + 3 F' F'' r_ss + F'^3 r_sss

In space xi(t) follows from sigma(xi) xi' = F' by differentiation, and the axes from their polynomials in xi.

Used by verify/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cells import Cells
from .curves import PlaneCurve, SpaceCurve
from .polynomials import values

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Int = NDArray[np.int64]
PerAxis = tuple[Real, ...]


@dataclass(frozen=True, eq=False)
class Motion:
    """At K instants: derivatives 1 to 3 of arc length, feed^2 times curvature, and velocity … jerk of each axis; mm, s.

    `bounds.bends` gives bounds of the second derivatives of these, one for each cell, in the same form.
    """

    feed: Real
    acceleration: Real
    jerk: Real
    centripetal: Real
    axis_velocity: PerAxis
    axis_acceleration: PerAxis
    axis_jerk: PerAxis


def motion_at(cells: Cells, cell: Int, u: Real) -> Motion:
    """The motion in cells `cell` at u, both (K,)."""
    distance, h = cells.distance[cell], cells.duration_s[cell]
    f1, f2, f3 = (values(distance, u, order) / h**order for order in (1, 2, 3))
    segment = cells.segment[cell]
    xi = cells.curve.parameter(segment, values(distance, u))
    if isinstance(cells.curve, SpaceCurve):
        return _in_space(cells.curve, segment, xi, (f1, f2, f3))
    assert isinstance(cells.curve, PlaneCurve)
    a0, a1, a2 = cells.curve.w[segment].T
    w, w1, w2 = a0 + xi * (a1 + xi * a2), a1 + 2.0 * xi * a2, 2.0 * a2
    conj = np.conj(w)
    sigma = (w * conj).real
    turn = conj * w1
    n, n1 = 2.0 * turn.imag, 2.0 * (conj * w2).imag
    kappa = n / sigma**2
    kappa_s = (n1 - 4.0 * n * turn.real / sigma) / sigma**3
    tangent = w * w / sigma
    normal = kappa * f1 * f1
    jerk_along = f3 - kappa * normal * f1
    jerk_across = 3.0 * kappa * f1 * f2 + kappa_s * f1**3
    return Motion(
        f1,
        f2,
        f3,
        normal,
        _axes(f1 * tangent),
        _axes((f2 + 1j * normal) * tangent),
        _axes((jerk_along + 1j * jerk_across) * tangent),
    )


def _in_space(curve: SpaceCurve, segment: Int, xi: Real, feed: tuple[Real, Real, Real]) -> Motion:
    f1, f2, f3 = feed
    speed = curve.speed(segment)
    sigma, growth, bend = (values(speed, xi, order) for order in range(3))
    x1 = f1 / sigma
    x2 = (f2 - growth * x1**2) / sigma
    x3 = (f3 - 3.0 * growth * x1 * x2 - bend * x1**3) / sigma
    velocity, acceleration, jerk = [], [], []
    for one in curve.directions(segment):
        r1, r2, r3 = (values(one, xi, order) for order in range(3))
        velocity.append(r1 * x1)
        acceleration.append(r2 * x1**2 + r1 * x2)
        jerk.append(r3 * x1**3 + 3.0 * r2 * x1 * x2 + r1 * x3)
    turn = curve.turn(segment)
    size = np.hypot(values(turn.real, xi), values(turn.imag, xi))
    return Motion(f1, f2, f3, size * x1**2, tuple(velocity), tuple(acceleration), tuple(jerk))


def _axes(vector: Complex) -> PerAxis:
    return vector.real, vector.imag
