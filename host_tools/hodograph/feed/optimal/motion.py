# SPDX-License-Identifier: MIT
"""What a feed does to the machine at points of a path: every limited quantity; docs/theory/numerics.md 5.6.

With r as a function of x (grid.py) and R1, R2, R3 its derivatives, p = (dx/dt)^2:

    velocity R1 sqrt(p)     acceleration R2 p + R1 p'/2     jerk sqrt(p) (R3 p + 3/2 R2 p' + R1 p''/2)

and the same along the path with sigma in the place of r.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...spline import PHSpline
from .bounds import Bounds
from .curve import LEFT, RIGHT, Frames, frames
from .grid import Grid, corners

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

AXES = ("x", "y")


@dataclass(frozen=True, eq=False)
class Line:
    """One bounded quantity of a kind: c1, c2, c3 (m,) are derivatives by x of what moves."""

    name: str
    limit: float
    c1: Real
    c2: Real
    c3: Real
    lag_s: float = 0.0


@dataclass(frozen=True, eq=False)
class Points:
    """Points (m,) on a grid with everything that does not depend on the feed. `caps` (m,): of the feed by stretches."""

    interval: Index
    s: Real
    basis: tuple[Real, Real, Real]
    sigma: tuple[Real, Real, Real]
    frame: Frames
    caps: Real
    bounds: Bounds

    @cached_property
    def _derivatives(self) -> tuple[Complex, Complex, Complex]:
        s1, s2, s3 = self.sigma
        f = self.frame
        return f.r1 * s1, f.r1 * s2 + f.r2 * s1**2, f.r1 * s3 + 3.0 * f.r2 * s1 * s2 + f.r3 * s1**3

    def _axes(self) -> tuple[tuple[Real, Real, Real], ...]:
        d = self._derivatives
        return tuple((p(d[0]), p(d[1]), p(d[2])) for p in (np.real, np.imag))

    @cached_property
    def jerks(self) -> tuple[Line, ...]:
        """Bounded jerks."""
        return self._lines("jerk_mm_s3", self.bounds.jerk_mm_s3, self.bounds.jerk)

    @cached_property
    def accelerations(self) -> tuple[Line, ...]:
        """Bounded accelerations."""
        return self._lines(
            "acceleration_mm_s2", self.bounds.acceleration_mm_s2, self.bounds.acceleration
        )

    @cached_property
    def volts(self) -> tuple[Line, ...]:
        """Bounded velocity + lag * acceleration."""
        if self.bounds.plants is None:
            return ()
        return tuple(
            Line(f"volts.{name}", plant.reach_mm_s, *c, lag_s=plant.time_constant_s)
            for name, plant, c in zip(AXES, self.bounds.plants, self._axes(), strict=True)
        )

    @cached_property
    def speeds(self) -> tuple[Line, ...]:
        """Bounded velocities."""
        return self._lines(
            "velocity_mm_s", self.bounds.feed_mm_s, self.bounds.velocity, "feed_mm_s"
        )

    def _lines(
        self, name: str, along: float, axes: tuple[float, float], path_name: str | None = None
    ) -> tuple[Line, ...]:
        out = [] if along == inf else [Line(path_name or name, along, *self.sigma)]
        out += [
            Line(f"axis.{name}.{axis}", limit, *c)
            for axis, limit, c in zip(AXES, axes, self._axes(), strict=True)
            if limit < inf
        ]
        return tuple(out)

    @cached_property
    def most_p(self) -> Real:
        """Bound (m,) of p from all that bounds the feed alone; inf at rest."""
        s1 = self.sigma[0]
        with np.errstate(divide="ignore"):
            most = (self.caps / s1) ** 2
            for line in self.speeds:
                most = np.minimum(most, (line.limit / np.abs(line.c1)) ** 2)
            if self.bounds.centripetal_mm_s2 < inf:
                bend = np.abs(self.frame.curvature) * s1**2
                most = np.minimum(most, self.bounds.centripetal_mm_s2 / bend)
        return np.asarray(np.where(s1 > 0.0, most, inf))

    def cubic(self, grid: Grid, q: Real, slope: Real) -> tuple[Real, Real, Real]:
        """p, p', p'' (m,) of a solution."""
        values = corners(grid, self.interval, q, slope)
        p, d, dd = (np.sum(b * values, axis=-1) for b in self.basis)
        return p, d, dd

    def values(self, p: Real, d: Real, dd: Real) -> dict[str, tuple[Real, float | Real]]:
        """Every bounded quantity by name: its magnitude (m,) and its limit."""
        root = np.sqrt(np.maximum(p, 0.0))
        out: dict[str, tuple[Real, float | Real]] = {}
        for line in self.speeds:
            out[line.name] = np.abs(line.c1) * root, line.limit
        if np.isfinite(self.caps).any():
            out["cap"] = self.sigma[0] * root, self.caps
        if self.bounds.centripetal_mm_s2 < inf:
            out["centripetal_mm_s2"] = (
                np.abs(self.frame.curvature) * self.sigma[0] ** 2 * p,
                self.bounds.centripetal_mm_s2,
            )
        for line in self.accelerations:
            out[line.name] = np.abs(acceleration(line, p, d)), line.limit
        for line in self.volts:
            drive = line.c1 * root + line.lag_s * acceleration(line, p, d)
            out[line.name] = np.abs(drive), line.limit
        for line in self.jerks:
            out[line.name] = np.abs(root * jerk_by_root(line, p, d, dd)), line.limit
        return out


def acceleration(line: Line, p: Real, d: Real) -> Real:
    """c2 p + c1 p'/2."""
    return line.c2 * p + 0.5 * line.c1 * d


def jerk_by_root(line: Line, p: Real, d: Real, dd: Real) -> Real:
    """The jerk over sqrt(p)."""
    return line.c3 * p + 1.5 * line.c2 * d + 0.5 * line.c1 * dd


def make_points(
    spline: PHSpline, bounds: Bounds, grid: Grid, interval: Index, u: Real, caps: Real
) -> Points:
    """Points at u in [0, 1] of intervals; at 0 and 1 the limits from inside. `caps` (n,) by interval."""
    s, s1, s2, s3 = grid.sigma(interval, u)
    s = np.where(u == 0.0, grid.s[interval], np.where(u == 1.0, grid.s[interval + 1], s))
    side = np.where(u == 0.0, RIGHT, np.where(u == 1.0, LEFT, 0)).astype(np.int8)
    return Points(
        interval,
        s,
        grid.basis(interval, u),
        (s1, s2, s3),
        frames(spline, s, side),
        caps[interval],
        bounds,
    )


def even_points(
    spline: PHSpline, bounds: Bounds, grid: Grid, us: tuple[float, ...], caps: Real
) -> Points:
    """The same u in every interval, interval by interval."""
    interval = np.repeat(np.arange(grid.size), len(us))
    return make_points(spline, bounds, grid, interval, np.tile(np.array(us), grid.size), caps)


Quantity = Callable[[Points], Real]
