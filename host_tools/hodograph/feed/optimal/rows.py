# SPDX-License-Identifier: MIT
"""Limits as linear inequalities about a feed near the last one; docs/theory/feed.md 5.6. Used by optimal/solver and
optimal/window. No I/O.

A jerk is sqrt(p) times a linear function of the unknowns: |linear| <= limit / sqrt(p). The right side is convex in p,
so its tangent at the last p is below it: a feed that keeps the tangent keeps the limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .constraints import Constraint, GridKinematics, acceleration, jerk_by_root

Real = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

JERK_ROW = 1.5
"""Factors of p between which the tangent of a jerk's right side holds its greatest share, and half of it."""

_NEAR = 0.7
"""Limit usage above which a basic point makes a row."""
_LEAST_P = 0.05
"""Least p of the next feed, as a share of the present p, where a row keeps p above 0."""
_FULL = 0.99
"""Limit usage above which any point makes a row."""
_FALLEN = 0.11
"""A point makes such a row once its p has fallen below this share of the last one."""


@dataclass(frozen=True, eq=False)
class Rows:
    """low <= coefficients (m, 4) on the unknowns of `interval` <= high."""

    coefficients: Real
    interval: Index
    low: Real
    high: Real


@dataclass(frozen=True, eq=False)
class About:
    """The last feed at the points: p, and its derivatives (None: it is a first estimate)."""

    p: Real
    derivatives: tuple[Real, Real] | None = None


@dataclass(eq=False)
class Selection:
    """Selects the points that make rows, so that most limits at most points never become rows. Points of `basic` near
    their limit make rows, other points once they exceeded it; they stay.

    everything  all points make rows: safe and slow
    estimated   the points that make rows for a first estimate
    tight       (m,) factors by which limits are divided at each point; None: 1
    """

    basic: Mask
    estimated: Mask
    tight: Real | None = None
    kept: dict[str, Mask] = field(default_factory=dict)
    last: Real | None = None
    everything: bool = False
    low: Mask | None = None

    def choose(self, name: str, used: Real | None, among: Mask | None = None) -> Index:
        """Points for the rows of a quantity, from its limit usage by the last feed."""
        basic = self.estimated if used is None else self.basic
        wanted = basic if among is None else basic & among
        if used is not None and self.tight is not None:
            used = used * self.tight
        if self.everything:
            return np.flatnonzero(np.ones_like(wanted) if among is None else among)
        if used is None:
            return np.flatnonzero(wanted)
        active = (wanted & (used > _NEAR)) | (used > _FULL)
        if name in self.kept:
            active |= self.kept[name]
        self.kept[name] = active
        return np.flatnonzero(active)

    def choose_low(self, p: Real) -> Index:
        """Points where p decreased much since the last call."""
        if self.last is not None:
            self.low = (p < _FALLEN * self.last) | (self.low if self.low is not None else False)
        self.last = p
        return np.flatnonzero(np.zeros(p.size, dtype=np.bool_) if self.low is None else self.low)


def make_rows(points: GridKinematics, about: About, select: Selection, once: Mask) -> Rows:
    """All rows about a feed. `once` (m,): points for rows of accelerations, so that knots do not count twice."""
    flat: list[Rows] = []
    for limited in points.jerks:
        flat += _jerk_rows(points, limited, about, select)
    flat += [
        _acceleration_rows(points, limited, about, select, once) for limited in points.accelerations
    ]
    flat += [_volts_rows(points, limited, about, select, once) for limited in points.volts]
    flat += _speed_rows(points, about, select)
    return Rows(
        np.concatenate([row.coefficients for row in flat]),
        np.concatenate([row.interval for row in flat]),
        np.concatenate([row.low for row in flat]),
        np.concatenate([row.high for row in flat]),
    )


def _jerk_rows(
    points: GridKinematics, limited: Constraint, about: About, select: Selection
) -> Iterator[Rows]:
    used = None
    if about.derivatives is not None:
        used = jerk_by_root(limited, about.p, *about.derivatives) * np.sqrt(about.p) / limited.most
    for sign in (1.0, -1.0):
        at = select.choose(f"{limited.name}{sign:+g}", None if used is None else sign * used)
        p, d, dd = (b[at] for b in points.basis)
        by = sign * np.sqrt(about.p[at]) / limited.most
        coefficients = (
            (limited.c3[at] * by + 0.5 / about.p[at])[:, None] * p
            + (1.5 * limited.c2[at] * by)[:, None] * d
            + (0.5 * limited.c1[at] * by)[:, None] * dd
        )
        one = np.ones(at.size)
        yield Rows(coefficients, points.interval[at], -np.inf * one, JERK_ROW * one)


def _acceleration_rows(
    points: GridKinematics, limited: Constraint, about: About, select: Selection, once: Mask
) -> Rows:
    used = None
    if about.derivatives is not None:
        used = np.abs(acceleration(limited, about.p, about.derivatives[0])) / limited.most
    at = select.choose(limited.name, used, once)
    one = np.ones(at.size)
    return Rows(_acceleration(points, limited, at) / limited.most, points.interval[at], -one, one)


def _acceleration(points: GridKinematics, limited: Constraint, at: Index) -> Real:
    p, d, _ = points.basis
    return np.asarray(limited.c2[at, None] * p[at] + 0.5 * limited.c1[at, None] * d[at])


def _volts_rows(
    points: GridKinematics, limited: Constraint, about: About, select: Selection, once: Mask
) -> Rows:
    """Rows of c1 sqrt(p) + lag (acceleration), with the tangent of sqrt, which is above it."""
    used = None
    if about.derivatives is not None:
        pull = limited.lag_s * acceleration(limited, about.p, about.derivatives[0])
        used = np.abs(limited.c1 * np.sqrt(about.p) + pull) / limited.most
    at = select.choose(limited.name, used, once)
    half = 0.5 * limited.c1[at] * np.sqrt(about.p[at])
    coefficients = (half / about.p[at])[:, None] * points.basis[0][at]
    coefficients = coefficients + limited.lag_s * _acceleration(points, limited, at)
    one = np.ones(at.size)
    offset = half / limited.most
    return Rows(coefficients / limited.most, points.interval[at], -one - offset, one - offset)


def _speed_rows(points: GridKinematics, about: About, select: Selection) -> list[Rows]:
    """Rows of the bounds of p where it comes near them, and of p > 0 where p might become negative."""
    high = select.choose("feed", about.p / points.most_p)
    one = np.ones(high.size)
    rows = [
        Rows(
            points.basis[0][high] / points.most_p[high, None],
            points.interval[high],
            -np.inf * one,
            one,
        )
    ]
    if about.derivatives is not None:
        low = select.choose_low(about.p)
        one = np.ones(low.size)
        rows.append(
            Rows(
                points.basis[0][low] / about.p[low, None],
                points.interval[low],
                _LEAST_P * one,
                np.inf * one,
            )
        )
    return rows
