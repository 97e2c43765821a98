# SPDX-License-Identifier: MIT
"""Feed over arc length turned into arc length over time: polynomials of degree 7; docs/theory/numerics.md 5.6.

Each interval becomes a piece with the exact F, F', F'' and F''' at both ends (two-point Hermite): C2, and
F''' jumps only where the plan's does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..pieces import exponents
from ..quantise import RawPieces
from .window import Solution

Real = NDArray[np.float64]
Int = NDArray[np.int64]


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
    """Windows one after the other, each beginning where the last ends."""
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
    """Pieces: knots in time (n + 1,) in 2^-32 s and in arc length; shape (n, 8): powers of u over each piece, mm,
    from the piece's start.
    """

    t_q32: Int
    s: Real
    shape: Real

    @property
    def seconds(self) -> Real:
        """Durations (n,)."""
        return np.asarray(np.diff(self.t_q32) * 2.0**-32)

    @property
    def duration_s(self) -> float:
        """Of the whole."""
        return float(self.t_q32[-1]) * 2.0**-32

    def value(self, order: int, t_s: ArrayLike) -> Real:
        """F or a derivative of it at times, held within the motion; where F''' jumps, from after the jump."""
        t = np.clip(np.asarray(t_s, dtype=np.float64), 0.0, self.duration_s)
        knots = self.t_q32 * 2.0**-32
        piece = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, self.shape.shape[0] - 1)
        h = self.seconds[piece]
        out = powers(self.shape[piece], order, (t - knots[piece]) / h) / h**order
        return np.asarray(out + self.s[piece] if order == 0 else out)


def powers(shape: Real, order: int, u: Real) -> Real:
    """A derivative by u of the polynomials (…, 8) at u (…,)."""
    out = np.zeros(np.broadcast_shapes(shape.shape[:-1], u.shape))
    for k in range(7, order - 1, -1):
        factor = float(np.prod(np.arange(k - order + 1, k + 1)))
        out = out * u + factor * shape[..., k]
    return out


def track_of(raw: RawPieces, length_mm: float) -> Track:
    """Pieces of any plan."""
    t_q32 = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(raw.duration_q32_s)))
    unit = np.ldexp(raw.duration_q32_s.astype(np.float64), -32 - exponents(raw.duration_q32_s))
    shape = np.zeros((unit.size, 8))
    shape[:, 1:] = raw.c_q40 * 2.0**-40 * unit[:, None] ** np.arange(1, 8)
    return Track(t_q32, np.append(raw.start_q40 * 2.0**-40, length_mm), shape)


def make_track(ends: Ends, stretch: float, joints: Real) -> Track:
    """Pieces of the plan run slower by the factor `stretch` >= 1: what it uses of all limits falls with it.

    joints  arc lengths where knots have to stay exactly, since limited quantities jump there
    """
    t = np.concatenate((np.zeros(1), np.cumsum(ends.times.astype(np.longdouble) * stretch)))
    t_q32 = np.rint(t * 2.0**32).astype(np.int64)
    late = (t_q32 * np.longdouble(2.0**-32) - t).astype(np.float64)
    h = np.diff(t_q32) * 2.0**-32
    j0, j1 = (j / stretch**3 for j in ends.jerk)
    # The states at the rounded times: a length that is off by feed * 2^-33 s would cost brief pieces much jerk.
    late[np.isin(ends.s, joints)] = 0.0
    feed, acceleration = ends.feed / stretch, ends.acceleration / stretch**2
    s = ends.s + feed * late
    feed = feed + acceleration * late
    acceleration = acceleration + np.append(j0, 0.0) * late
    feed[-1] = acceleration[-1] = 0.0
    return Track(t_q32, s, _hermite(np.diff(s), h, feed, acceleration, j0, j1))


def _hermite(way: Real, h: Real, feed: Real, acceleration: Real, j0: Real, j1: Real) -> Real:
    out = np.zeros((h.size, 8))
    out[:, 1], out[:, 2], out[:, 3] = feed[:-1] * h, acceleration[:-1] * h**2 / 2.0, j0 * h**3 / 6.0
    c1, c2, c3 = out[:, 1], out[:, 2], out[:, 3]
    p = way - c1 - c2 - c3
    v = feed[1:] * h - c1 - 2.0 * c2 - 3.0 * c3
    a = acceleration[1:] * h**2 - 2.0 * c2 - 6.0 * c3
    j = (j1 - j0) * h**3
    out[:, 4] = 35.0 * p - 15.0 * v + 2.5 * a - j / 6.0
    out[:, 5] = -84.0 * p + 39.0 * v - 7.0 * a + j / 2.0
    out[:, 6] = 70.0 * p - 34.0 * v + 6.5 * a - j / 2.0
    out[:, 7] = -20.0 * p + 10.0 * v - 2.0 * a + j / 6.0
    return out
