# SPDX-License-Identifier: MIT
"""The limited quantities at points of a grid, as functions of the unknown feed; docs/theory/feed.md 5.6. Used by
optimal/rows and optimal/window. No I/O.

The unknown is p = (dx/dt)^2 as a function of x, the parameter of the grid (grid.py). p' and p'' are its derivatives by
x. R1, R2 and R3 are the derivatives by x of the position of an axis, mm. Then the axis has:

    velocity R1 sqrt(p)     acceleration R2 p + R1 p'/2     jerk sqrt(p) (R3 p + 3/2 R2 p' + R1 p''/2)

The same formulas hold along the path. There the arc length sigma(x) of grid.py takes the place of the position.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...spline.frames import LEFT, RIGHT, Curve, Frames, frames
from ..kinematics import axis_motion
from ..limits import Limit
from .grid import Grid, corners
from .plan_limits import PerAxis, PlanLimits

Real = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Constraint:
    """One limited quantity at points (m,).

    c1, c2, c3  derivatives by x of the position of the axis, or of the arc length
    lag_s       the limited quantity is velocity + lag_s * acceleration (limits of voltage only)
    """

    limit: Limit
    c1: Real
    c2: Real
    c3: Real
    lag_s: float = 0.0

    @property
    def name(self) -> str:
        """Name of the limited quantity."""
        return self.limit.dotted

    @property
    def most(self) -> float:
        """The limit's value."""
        return self.limit.value


@dataclass(frozen=True, eq=False)
class GridKinematics:
    """Points (m,) on a grid, with all values that do not depend on the feed.

    interval  interval of the grid that has the point
    s         arc length, mm
    basis     p, p', p'' at the point as rows (m, 4) on the four unknowns of the interval
    sigma     derivatives 1 to 3 of the arc length by x
    frame     derivatives of the curve by arc length
    zones     least feed limit of the feed zones, mm/s; inf: none
    """

    interval: Index
    s: Real
    basis: tuple[Real, Real, Real]
    sigma: tuple[Real, Real, Real]
    frame: Frames
    zones: Real
    limits: PlanLimits

    @cached_property
    def _axes(self) -> tuple[tuple[Real, Real, Real], ...]:
        """Derivatives 1 to 3 by x of the position of each axis."""
        return tuple(zip(*axis_motion(self.frame, *self.sigma), strict=True))

    @cached_property
    def jerks(self) -> tuple[Constraint, ...]:
        """Limited jerks."""
        return self._constraints(self.limits.jerk, self.limits.axis_jerk)

    @cached_property
    def accelerations(self) -> tuple[Constraint, ...]:
        """Limited accelerations."""
        return self._constraints(self.limits.acceleration, self.limits.axis_acceleration)

    @cached_property
    def volts(self) -> tuple[Constraint, ...]:
        """Limited voltages of the motors, as velocity + time constant * acceleration in mm/s."""
        plants, limits = self.limits.plants, self.limits.volts
        if plants is None or limits is None:
            return ()
        return tuple(
            Constraint(replace(limit, value=plant.reach_mm_s), *c, lag_s=plant.time_constant_s)
            for limit, plant, c in zip(limits, plants, self._axes, strict=True)
        )

    @cached_property
    def speeds(self) -> tuple[Constraint, ...]:
        """Limited velocities."""
        feed = Limit("feed_mm_s", self.limits.feed.value)
        return self._constraints(feed, self.limits.velocity)

    def _constraints(self, along: Limit, axes: PerAxis) -> tuple[Constraint, ...]:
        out = [] if along.value == inf else [Constraint(along, *self.sigma)]
        out += [
            Constraint(limit, *c)
            for limit, c in zip(axes, self._axes, strict=True)
            if limit.value < inf
        ]
        return tuple(out)

    @cached_property
    def most_p(self) -> Real:
        """Upper bound (m,) of p from the limits that depend on p alone: feed, feed zones, axis velocities, centripetal
        acceleration. It is inf at rest, where sigma' = 0.
        """
        s1 = self.sigma[0]
        with np.errstate(divide="ignore"):
            most = (self.zones / s1) ** 2
            for one in self.speeds:
                most = np.minimum(most, (one.most / np.abs(one.c1)) ** 2)
            if self.limits.centripetal.value < inf:
                bend = np.abs(self.frame.curvature) * s1**2
                most = np.minimum(most, self.limits.centripetal.value / bend)
        return np.asarray(np.where(s1 > 0.0, most, inf))

    def cubic(self, grid: Grid, q: Real, slope: Real) -> tuple[Real, Real, Real]:
        """p, p', p'' (m,) of a solution: `q` and `slope` are the unknowns at the knots."""
        values = corners(grid, self.interval, q, slope)
        p, d, dd = (np.sum(b * values, axis=-1) for b in self.basis)
        return p, d, dd

    def values(self, p: Real, d: Real, dd: Real) -> dict[str, tuple[Real, float | Real]]:
        """Magnitude (m,) and limit of each limited quantity by name. `d` and `dd` are p' and p''."""
        root = np.sqrt(np.maximum(p, 0.0))
        out: dict[str, tuple[Real, float | Real]] = {}
        for one in self.speeds:
            out[one.name] = np.abs(one.c1) * root, one.most
        if np.isfinite(self.zones).any():
            out["cap_mm_s"] = self.sigma[0] * root, self.zones
        if self.limits.centripetal.value < inf:
            out["centripetal_mm_s2"] = (
                np.abs(self.frame.curvature) * self.sigma[0] ** 2 * p,
                self.limits.centripetal.value,
            )
        for one in self.accelerations:
            out[one.name] = np.abs(acceleration(one, p, d)), one.most
        for one in self.volts:
            drive = one.c1 * root + one.lag_s * acceleration(one, p, d)
            out[one.name] = np.abs(drive), one.most
        for one in self.jerks:
            out[one.name] = np.abs(root * jerk_by_root(one, p, d, dd)), one.most
        return out


def acceleration(limited: Constraint, p: Real, d: Real) -> Real:
    """c2 p + c1 p'/2, with p' = `d`."""
    return limited.c2 * p + 0.5 * limited.c1 * d


def jerk_by_root(limited: Constraint, p: Real, d: Real, dd: Real) -> Real:
    """The jerk divided by sqrt(p)."""
    return limited.c3 * p + 1.5 * limited.c2 * d + 0.5 * limited.c1 * dd


def make_points(
    spline: Curve, limits: PlanLimits, grid: Grid, interval: Index, u: Real, zones: Real
) -> GridKinematics:
    """Points at the shares u (m,) of intervals, 0 to 1. At the ends, values that jump are those inside the interval.

    zones  feed limit (n,) of the feed zones in each interval
    """
    s, s1, s2, s3 = grid.sigma(interval, u)
    s = np.where(u == 0.0, grid.s[interval], np.where(u == 1.0, grid.s[interval + 1], s))
    side = np.where(u == 0.0, RIGHT, np.where(u == 1.0, LEFT, 0)).astype(np.int8)
    return GridKinematics(
        interval,
        s,
        grid.basis(interval, u),
        (s1, s2, s3),
        frames(spline, s, side),
        zones[interval],
        limits,
    )
