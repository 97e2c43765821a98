# SPDX-License-Identifier: MIT
"""The greatest value of every limited quantity of a track, on the pieces themselves; docs/theory/numerics.md 5.6."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...spline import PHSpline
from .bounds import Bounds
from .curve import LEFT, RIGHT, frames
from .motion import AXES
from .track import Track, powers

Real = NDArray[np.float64]

_US = np.linspace(0.0, 1.0, 33)
_FEW_US = np.sort(np.append(np.linspace(0.0, 1.0, 17), (1.0 / 32.0, 31.0 / 32.0)))
_CHUNK = 2000
_WITH_RESERVE = ("axis.acceleration", "axis.jerk", "volts")


@dataclass(frozen=True)
class Peak:
    """Where a quantity comes nearest to its limit, as given; a plan means to use the share `kept` of it only."""

    value: float
    limit: float
    s_mm: float
    kept: float = 1.0

    @property
    def share(self) -> float:
        """Of the limit."""
        return self.value / self.limit

    @property
    def strain(self) -> float:
        """Of what is meant to be used of the limit."""
        return self.share / self.kept


def find_peaks(spline: PHSpline, bounds: Bounds, track: Track) -> dict[str, Peak]:
    """By name, at 33 places of each piece, its ends from inside; volts are those beside friction."""
    out: dict[str, Peak] = {}
    for first in range(0, track.shape.shape[0], _CHUNK):
        part = slice(first, first + _CHUNK)
        for name, (value, limit, s) in _values(spline, bounds, track, part).items():
            share = value / limit
            worst = int(np.argmax(share))
            kept = bounds.axis_share if name.startswith(_WITH_RESERVE) else 1.0
            bound = float(np.broadcast_to(limit, share.shape)[worst])
            peak = Peak(float(value[worst]), bound / kept, float(s[worst]), kept)
            if name not in out or peak.share > out[name].share:
                out[name] = peak
    return out


def piece_strains(spline: PHSpline, bounds: Bounds, track: Track) -> Real:
    """The greatest share (n,) that each piece uses of what is meant to be used of any limit."""
    out = np.zeros(track.shape.shape[0])
    for value, limit, _ in _values(spline, bounds, track, slice(None), _FEW_US).values():
        out = np.maximum(out, (value / limit).reshape(-1, _FEW_US.size).max(axis=1))
    return out


def _values(
    spline: PHSpline, bounds: Bounds, track: Track, part: slice, us: Real = _US
) -> dict[str, tuple[Real, Real | float, Real]]:
    shape, h = track.shape[part, None, :], track.seconds[part, None]
    way, v, a, j = ((powers(shape, k, us) / h**k).ravel() for k in range(4))
    starts = track.s[:-1][part]
    s = (starts[:, None] + way.reshape(-1, us.size)).ravel()
    side = np.tile(np.where(us == 0.0, RIGHT, np.where(us == 1.0, LEFT, 0)), starts.size)
    ends = track.s[1:][part]
    s = np.where(
        side == RIGHT,
        np.repeat(starts, us.size),
        np.where(side == LEFT, np.repeat(ends, us.size), s),
    )
    f = frames(spline, s, side.astype(np.int8))
    velocity, acceleration = f.r1 * v, f.r1 * a + f.r2 * v * v
    jerk = f.r1 * j + 3.0 * f.r2 * v * a + f.r3 * v**3
    out: dict[str, tuple[Real, Real | float, Real]] = {
        "feed_mm_s": (np.abs(v), bounds.feed_mm_s, s)
    }
    if bounds.acceleration_mm_s2 < inf:
        out["acceleration_mm_s2"] = np.abs(a), bounds.acceleration_mm_s2, s
    if bounds.jerk_mm_s3 < inf:
        out["jerk_mm_s3"] = np.abs(j), bounds.jerk_mm_s3, s
    if bounds.centripetal_mm_s2 < inf:
        out["centripetal_mm_s2"] = np.abs(f.curvature) * v * v, bounds.centripetal_mm_s2, s
    for k, (axis, of) in enumerate(zip(AXES, (np.real, np.imag), strict=True)):
        for name, limits, vector in (
            ("velocity_mm_s", bounds.velocity, velocity),
            ("acceleration_mm_s2", bounds.acceleration, acceleration),
            ("jerk_mm_s3", bounds.jerk, jerk),
        ):
            if limits[k] < inf:
                out[f"axis.{name}.{axis}"] = np.abs(of(vector)), limits[k], s
        if bounds.plants is not None:
            plant = bounds.plants[k]
            drive = of(velocity) + plant.time_constant_s * of(acceleration)
            reach = plant.reach_mm_s / plant.gain_mm_s_v
            out[f"volts.{axis}"] = np.abs(drive / plant.gain_mm_s_v), reach, s
    if bounds.caps.size:
        caps = np.full(s.size, inf)
        for low, high, feed in bounds.caps:
            within = (s >= low) & (s <= high)
            caps[within] = np.minimum(caps[within], feed)
        if np.isfinite(caps).any():
            out["cap_mm_s"] = np.abs(v), caps, s
    return out
