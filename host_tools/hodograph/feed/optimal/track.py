# SPDX-License-Identifier: MIT
"""The track: arc length over time in polynomials of degree 7, and its peaks; docs/theory/feed.md 5.6. Used by
feed/optimal/ and stream/. No I/O.

Each interval becomes a piece with the exact F, F', F'' and F''' at both ends (two-point Hermite): C2, and
F''' jumps only where the plan's does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf, perm

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...fixed_point import MM_PER_Q40, nearest_q40, to_q40
from ...spline.frames import LEFT, RIGHT, Curve, frames
from ..kinematics import axis_motion
from ..limits import Limit, Peak, least_in_zones
from ..pieces import RawPieces, derivative_peaks, exponents, round_pieces
from ..ramp import Ramp
from .plan_limits import PlanLimits
from .window import Solution

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_DRIFT_Q40 = 1024
"""Greatest distance of a program's joints from those of its path, in 2^-40 mm (1e-9 mm)."""

_US = np.linspace(0.0, 1.0, 33)
"""Places of a piece, as shares of its time, at which peaks are found."""
_FEW_US = np.sort(np.append(np.linspace(0.0, 1.0, 17), (1.0 / 32.0, 31.0 / 32.0)))
"""Fewer places, for the limit usage of pieces while a window is planned."""
_CHUNK = 2000
"""Pieces that are evaluated at once, to bound the memory."""


@dataclass(frozen=True, eq=False)
class Ends:
    """F, F', F'' (n + 1,) at knots, F''' (n,) at the start and end of each interval, times (n,)."""

    s: Real
    feed: Real
    acceleration: Real
    jerk: tuple[Real, Real]
    times: Real


def ends_of(found: Solution, count: int) -> Ends:
    """The state at the knots of the first `count` intervals of a window."""
    grid, interval = found.grid, np.arange(count)
    sides = []
    for u in (0.0, 1.0):
        at = np.full(count, u)
        _, s1, s2, s3 = grid.sigma(interval, at)
        values = np.stack(
            (
                found.q[interval],
                found.slope[interval],
                found.q[interval + 1],
                found.slope[interval + 1],
            ),
            axis=-1,
        )
        p, d, dd = (np.sum(b * values, axis=-1) for b in grid.basis(interval, at))
        root = np.sqrt(np.maximum(p, 0.0))
        sides.append(
            (s1 * root, s2 * p + 0.5 * s1 * d, root * (s3 * p + 1.5 * s2 * d + 0.5 * s1 * dd))
        )
    (v0, a0, j0), (v1, a1, j1) = sides
    return Ends(
        grid.s[: count + 1],
        np.append(v0, v1[-1]),
        np.append(a0, a1[-1]),
        (j0, j1),
        found.times[:count],
    )


def joined(parts: Sequence[Ends]) -> Ends:
    """The states of consecutive windows, joined."""
    last = parts[-1]
    return Ends(
        np.concatenate([*(p.s[:-1] for p in parts), last.s[-1:]]),
        np.concatenate([*(p.feed[:-1] for p in parts), last.feed[-1:]]),
        np.concatenate([*(p.acceleration[:-1] for p in parts), last.acceleration[-1:]]),
        (
            np.concatenate([p.jerk[0] for p in parts]),
            np.concatenate([p.jerk[1] for p in parts]),
        ),
        np.concatenate([p.times for p in parts]),
    )


@dataclass(frozen=True, eq=False)
class Track:
    """The curve of a plan with profile "optimal".

    t_q32, s   knots (n + 1,) in time, 2^-32 s, and in arc length, mm
    shape      (n, 8): powers of u over each piece, mm, from the piece's start
    joints_mm  arc lengths of the path's joints, from 0 to its length
    stretch    factor of time by which the plan was slowed at the end; 1.0003 is 0.03 %
    """

    t_q32: Int
    s: Real
    shape: Real
    joints_mm: Real
    stretch: float = 1.0

    @property
    def seconds(self) -> Real:
        """Durations (n,)."""
        return np.asarray(np.diff(self.t_q32) * 2.0**-32)

    @property
    def time_s(self) -> float:
        """Duration of the whole."""
        return float(self.t_q32[-1]) * 2.0**-32

    @property
    def length_mm(self) -> Fraction:
        """Length of the path, exactly."""
        return Fraction(float(self.joints_mm[-1]))

    @property
    def ramp(self) -> Ramp | None:
        """None: the feed has no ramp of a profile."""
        return None

    @property
    def follows_joints(self) -> bool:
        """Pieces begin at joints of segments."""
        return True

    def peaks(self) -> tuple[float, float, float]:
        """Greatest feed, acceleration and jerk along the path, of the pieces."""
        raw = self.raw_pieces(nearest_q40(self.length_mm))
        v, a, j = (float(p.max()) for p in derivative_peaks(raw.duration_q32_s, raw.c_q40))
        return v, a, j

    def raw_pieces(
        self, length_q40: int, period_us: int = 0, joints_q40: Int | None = None
    ) -> RawPieces:
        """The pieces in integers over exactly `length_q40`, for any period.

        joints_q40  (segments + 1,) of the program: pieces that begin at a joint begin exactly there
        """
        starts = to_q40(self.s)
        if joints_q40 is not None:
            near = joints_q40[
                np.clip(np.searchsorted(joints_q40, starts - _DRIFT_Q40), 0, joints_q40.size - 1)
            ]
            moved = np.isin(self.s, self.joints_mm) & (np.abs(near - starts) <= _DRIFT_Q40)
            starts = np.where(moved, near, starts)
        starts[-1] = length_q40
        c = round_pieces(self.t_q32, starts, self.shape)
        return RawPieces(np.diff(self.t_q32), starts[:-1], c, 0.0, 0.0)

    def value(self, order: int, t_s: ArrayLike) -> Real:
        """F or a derivative of it at times, clipped to the motion; where F''' jumps, the value after the jump."""
        t = np.clip(np.asarray(t_s, dtype=np.float64), 0.0, self.time_s)
        knots = self.t_q32 * 2.0**-32
        piece = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, self.shape.shape[0] - 1)
        h = self.seconds[piece]
        out = powers(self.shape[piece], order, (t - knots[piece]) / h) / h**order
        return np.asarray(out + self.s[piece] if order == 0 else out)


def powers(shape: Real, order: int, u: Real) -> Real:
    """A derivative by u of the polynomials (…, 8) at u (…,).

    Own code: scipy's PPoly takes 0.4 to 0.9 of the time, but evaluates u = 1 in the next piece, and its import takes
    over 100 times what a plan would save.
    """
    out = np.zeros(np.broadcast_shapes(shape.shape[:-1], u.shape))
    for k in range(7, order - 1, -1):
        out = out * u + float(perm(k, order)) * shape[..., k]
    return out


def track_of(raw: RawPieces, length_mm: float) -> Track:
    """Pieces of any plan."""
    t_q32 = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(raw.duration_q32_s)))
    unit = np.ldexp(raw.duration_q32_s.astype(np.float64), -32 - exponents(raw.duration_q32_s))
    shape = np.zeros((unit.size, 8))
    shape[:, 1:] = raw.c_q40 * MM_PER_Q40 * unit[:, None] ** np.arange(1, 8)
    ends = np.array([0.0, length_mm])
    return Track(t_q32, np.append(raw.start_q40 * MM_PER_Q40, length_mm), shape, ends)


def make_track(ends: Ends, stretch: float, joints: Real) -> Track:
    """Pieces of the plan with all times multiplied by `stretch` >= 1, which lowers the usage of all limits.

    joints  arc lengths of the path's joints; knots there stay exact, since limited quantities jump
    """
    t = np.concatenate((np.zeros(1), np.cumsum(ends.times.astype(np.longdouble) * stretch)))
    t_q32 = np.rint(t * 2.0**32).astype(np.int64)
    late = (t_q32 * np.longdouble(2.0**-32) - t).astype(np.float64)
    h = np.diff(t_q32) * 2.0**-32
    j0, j1 = (j / stretch**3 for j in ends.jerk)
    # The states at the rounded times: an error of the length of feed * 2^-33 s would cost brief pieces much jerk.
    late[np.isin(ends.s, joints)] = 0.0
    feed, acceleration = ends.feed / stretch, ends.acceleration / stretch**2
    s = ends.s + feed * late
    feed = feed + acceleration * late
    acceleration = acceleration + np.append(j0, 0.0) * late
    feed[-1] = acceleration[-1] = 0.0
    shape = _hermite(np.diff(s), h, feed, acceleration, j0, j1)
    return Track(t_q32, s, shape, joints, stretch)


def _hermite(distance: Real, h: Real, feed: Real, acceleration: Real, j0: Real, j1: Real) -> Real:
    out = np.zeros((h.size, 8))
    out[:, 1], out[:, 2], out[:, 3] = feed[:-1] * h, acceleration[:-1] * h**2 / 2.0, j0 * h**3 / 6.0
    c1, c2, c3 = out[:, 1], out[:, 2], out[:, 3]
    p = distance - c1 - c2 - c3
    v = feed[1:] * h - c1 - 2.0 * c2 - 3.0 * c3
    a = acceleration[1:] * h**2 - 2.0 * c2 - 6.0 * c3
    j = (j1 - j0) * h**3
    out[:, 4] = 35.0 * p - 15.0 * v + 2.5 * a - j / 6.0
    out[:, 5] = -84.0 * p + 39.0 * v - 7.0 * a + j / 2.0
    out[:, 6] = 70.0 * p - 34.0 * v + 6.5 * a - j / 2.0
    out[:, 7] = -20.0 * p + 10.0 * v - 2.0 * a + j / 6.0
    return out


def find_peaks(spline: Curve, limits: PlanLimits, track: Track) -> dict[str, Peak]:
    """The peak of each limited quantity by its dotted name, from 33 places of each piece with one-sided values at its
    ends. Volts are without friction.
    """
    out: dict[str, Peak] = {}
    for first in range(0, track.shape.shape[0], _CHUNK):
        part = slice(first, first + _CHUNK)
        for one in _limited(spline, limits, track, part, _US):
            usage = one.value / one.most
            worst = int(np.argmax(usage))
            most = float(np.broadcast_to(one.most, usage.shape)[worst])
            found = Peak(
                replace(one.limit, value=most), float(one.value[worst]), float(one.s[worst])
            )
            name = one.limit.dotted
            if name not in out or found.usage > out[name].usage:
                out[name] = found
    return out


def piece_usage(spline: Curve, limits: PlanLimits, track: Track) -> Real:
    """The greatest limit usage (n,) of each piece."""
    out = np.zeros(track.shape.shape[0])
    for one in _limited(spline, limits, track, slice(None), _FEW_US):
        out = np.maximum(out, (one.value / one.most).reshape(-1, _FEW_US.size).max(axis=1))
    return out


@dataclass(frozen=True, eq=False)
class _Limited:
    """Magnitudes (k,) of a quantity at arc lengths (k,), and its limit there: one value, or (k,)."""

    limit: Limit
    value: Real
    s: Real
    most: Real | float


def _limited(
    spline: Curve, limits: PlanLimits, track: Track, part: slice, us: Real
) -> Iterator[_Limited]:
    shape, h = track.shape[part, None, :], track.seconds[part, None]
    distance, v, a, j = ((powers(shape, k, us) / h**k).ravel() for k in range(4))
    starts, ends = track.s[:-1][part], track.s[1:][part]
    s = (starts[:, None] + distance.reshape(-1, us.size)).ravel()
    side = np.tile(np.where(us == 0.0, RIGHT, np.where(us == 1.0, LEFT, 0)), starts.size)
    s = np.where(side == RIGHT, np.repeat(starts, us.size), s)
    s = np.where(side == LEFT, np.repeat(ends, us.size), s)
    f = frames(spline, s, side.astype(np.int8))
    velocity, acceleration, jerk = axis_motion(f, v, a, j)
    for limit, value in (
        (Limit("feed_mm_s", limits.feed.value), v),
        (Limit("acceleration_mm_s2", limits.acceleration.value), a),
        (Limit("jerk_mm_s3", limits.jerk.value), j),
        (limits.centripetal, f.curvature * v * v),
    ):
        if limit.value < inf:
            yield _Limited(limit, np.abs(value), s, limit.value)
    for k in range(len(velocity)):
        for limit, values in (
            (limits.velocity[k], velocity),
            (limits.axis_acceleration[k], acceleration),
            (limits.axis_jerk[k], jerk),
        ):
            if limit.value < inf:
                yield _Limited(limit, np.abs(values[k]), s, limit.value)
        if limits.plants is not None and limits.volts is not None:
            plant = limits.plants[k]
            drive = velocity[k] + plant.time_constant_s * acceleration[k]
            volts = np.abs(drive / plant.gain_mm_s_v)
            yield _Limited(limits.volts[k], volts, s, limits.volts[k].value)
    if limits.zones:
        yield from _in_zones(limits, np.abs(v), s)


def _in_zones(limits: PlanLimits, feed: Real, s: Real) -> Iterator[_Limited]:
    feeds = [zone.feed_mm_s for zone in limits.zones]
    most = least_in_zones(s, limits.zones, feeds, with_ends=True)
    if np.isfinite(most).any():
        yield _Limited(Limit("feed_mm_s", inf, zone=limits.zones[0]), feed, s, most)
