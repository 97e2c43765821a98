# SPDX-License-Identifier: MIT
"""Finds infeasible limits: which ones, where, and the values that would suffice; docs/theory/feed.md 5.6. Used by
optimal/planner and stream/windows. No I/O.

Each path without corners can be run inside any limits, if slowly enough. A program needs at least LEAST_FEED_MM_S at
each place, and has a longest time. The feed that a limit allows is computed for constant feed; for acceleration and
jerk along the path, from the fastest motion from rest to rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cbrt, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline.frames import LEFT, RIGHT, Curve, frames
from ..limits import FeedZone, Limit, Plant
from ..request import LEAST_FEED_MM_S
from .plan_limits import PlanLimits

Real = NDArray[np.float64]

_SAMPLES = 32
"""Parts into which each segment is divided; a limit is evaluated at both ends of each part."""
_MARGIN = 1e-6
"""Share by which a rounded value in a message has to be above the exact one, so that it suffices."""
_BEYOND = 2.0
"""The feed is bounded to this multiple of what acceleration and jerk along the path can reach."""


@dataclass(frozen=True, eq=False)
class LimitedFeed:
    """The feed (n,) that one limit alone allows at points (inf: any), and the time of the whole path with it.

    `given` is the value in its file. For k times the feed everywhere, the limit would have to be offset + (given -
    offset) k^power.
    """

    limit: Limit
    given: float
    feed: Real
    time_s: float
    power: int
    offset: float

    @property
    def name(self) -> str:
        """Section, key and value, for messages."""
        limit = self.limit
        less = "" if limit.share == 1.0 else " (less its reserve)"
        return f"{limit.source}: {limit.words or limit.entry} = {self.given:g}{less}"

    def rounded(self, value: float) -> str:
        """A value of the limit whose part above `offset` is rounded up to three digits."""
        return f"{self.offset + float(rounded_up(value - self.offset)):.9g}"

    def times(self, k: float) -> float:
        """The limit at which the feed may be k times as fast."""
        return self.offset + (self.given - self.offset) * k**self.power

    def needed(self, feed_mm_s: float, place: int) -> float:
        """The least value that allows a feed at a point."""
        return self.times(feed_mm_s / float(self.feed[place]))


@dataclass(frozen=True, eq=False)
class _VoltsFeed(LimitedFeed):
    """Volts: |c1| and T |c2| (n,), the volts per feed and per feed^2 at points."""

    plant: Plant
    speed: Real
    bend: Real

    def needed(self, feed_mm_s: float, place: int) -> float:
        reach = self.speed[place] * feed_mm_s + self.bend[place] * feed_mm_s**2
        return self.offset + float(reach) / (self.plant.gain_mm_s_v * self.limit.share)


def check_feasible(spline: Curve, limits: PlanLimits, longest_s: float) -> None:
    """Raises PlanError: a limit by itself allows less than LEAST_FEED_MM_S somewhere, or makes the path take longer
    than `longest_s`. The message names all such limits, the worst place of each, and the least values that suffice.
    """
    s = _places(spline)[0]
    slow: dict[str, tuple[float, str]] = {}
    long: dict[str, tuple[float, str]] = {}
    for one in allowed(spline, limits):
        worst = int(np.argmin(one.feed))
        feed = float(one.feed[worst])
        if feed < LEAST_FEED_MM_S:
            least = one.needed(LEAST_FEED_MM_S, worst)
            text = (
                f"{one.name} allows {feed:.3g} mm/s at arc length {s[worst]:.6g} mm, less than the "
                f"{LEAST_FEED_MM_S:g} mm/s that a feed has to be: {one.rounded(least)} would do there"
            )
            slow[one.limit.entry] = max(slow.get(one.limit.entry, (0.0, "")), (least, text))
        elif one.time_s >= longest_s:
            k = one.time_s / longest_s
            text = too_long(one, s[worst], one.time_s, longest_s, k)
            long[one.limit.entry] = max(long.get(one.limit.entry, (0.0, "")), (one.times(k), text))
    if slow or long:
        raise PlanError("; ".join(text for _, text in (slow or long).values()))


def too_long(one: LimitedFeed, s_mm: float, time_s: float, longest_s: float, k: float) -> str:
    """The message for a limit that makes a program too long; k times its feed would be enough."""
    return (
        f"{one.name}, lowest at arc length {s_mm:.6g} mm, makes the path take {time_s:.4g} s, longer than the "
        f"{longest_s:.7g} s of a program: {one.rounded(one.times(1.02 * k))} would do"
    )


def rounded_up(value: float) -> str:
    """Three digits, not below the value."""
    text = f"{value:.3g}"
    return text if float(text) >= value * (1.0 + _MARGIN) else f"{value * 1.0051:.3g}"


def binding_most(spline: Curve, limits: PlanLimits) -> tuple[LimitedFeed, float]:
    """The limit with the longest time, and the arc length where it allows the least feed."""
    found = max(allowed(spline, limits), key=lambda one: one.time_s)
    return found, float(_places(spline)[0][int(np.argmin(found.feed))])


def least_time_s(spline: Curve, limits: PlanLimits) -> float:
    """The least time of the path."""
    return max(one.time_s for one in allowed(spline, limits))


def within_reach(spline: Curve, limits: PlanLimits) -> PlanLimits:
    """The limits with the feed bounded to what acceleration and jerk along the path can reach: a far higher bound would
    make the quadratic programs ill-conditioned.
    """
    s, _ = _places(spline)
    reach = min(
        float(_reached(s, limits.acceleration, 1.0, 2).feed.min()),
        float(_reached(s, limits.jerk, 1.0, 3).feed.min()),
    )
    return limits.with_feed(_BEYOND * reach)


def allowed(spline: Curve, limits: PlanLimits) -> Iterator[LimitedFeed]:
    """The feed that each limit alone allows, at points of the path."""
    s, side = _places(spline)
    yield from _along(s, limits)
    f = frames(spline, s, side)
    with np.errstate(divide="ignore"):
        bend = limits.centripetal.value / np.abs(f.curvature)
    yield _steady(s, limits.centripetal, np.sqrt(bend), 2)
    for k, vectors in enumerate(zip(f.r1, f.r2, f.r3, strict=True)):
        one, two, three = map(np.abs, vectors)
        for limit, vector, power in (
            (limits.velocity[k], one, 1),
            (limits.axis_acceleration[k], two, 2),
            (limits.axis_jerk[k], three, 3),
        ):
            with np.errstate(divide="ignore"):
                yield _steady(s, limit, (limit.value / vector) ** (1.0 / power), power)
            if power > 1:
                yield _reached(s, limit, float(one.max()), power)
        if limits.plants is not None and limits.volts is not None:
            yield _volts(s, limits.plants[k], limits.volts[k], one, two)


def _places(spline: Curve) -> tuple[Real, NDArray[np.int8]]:
    u = np.linspace(0.0, 1.0, _SAMPLES + 1)
    joints = spline.segment_starts_mm
    s = (joints[:-1, None] + np.diff(joints)[:, None] * u).ravel()
    side = np.tile(np.where(u == 0.0, RIGHT, np.where(u == 1.0, LEFT, 0)), joints.size - 1)
    return s, side.astype(np.int8)


def _along(s: Real, limits: PlanLimits) -> Iterator[LimitedFeed]:
    yield _steady(s, limits.feed, limits.feed.value * np.ones(s.size), 1)
    for zone in _least_zones(limits.zones, float(s[0]), float(s[-1])):
        within = np.where((s >= zone.from_mm) & (s <= zone.to_mm), zone.feed_mm_s, inf)
        if not np.isfinite(within).any():  # between two points
            middle = 0.5 * (zone.from_mm + zone.to_mm)
            within[int(np.argmin(np.abs(s - middle)))] = zone.feed_mm_s
        yield _steady(s, Limit("feed_mm_s", zone.feed_mm_s, zone=zone), within, 1)
    yield _reached(s, limits.acceleration, 1.0, 2)
    if limits.jerk.source:
        yield _reached(s, limits.jerk, 1.0, 3)


def _least_zones(zones: Sequence[FeedZone], low_mm: float, high_mm: float) -> list[FeedZone]:
    """Of the zones those that can be named: the one with the lowest feed, and the one that takes the longest time."""

    def time_s(zone: FeedZone) -> float:
        return (min(zone.to_mm, high_mm) - max(zone.from_mm, low_mm)) / zone.feed_mm_s

    if not zones:
        return []
    slowest, longest = min(zones, key=lambda zone: zone.feed_mm_s), max(zones, key=time_s)
    return [slowest] if slowest is longest else [slowest, longest]


def _steady(s: Real, limit: Limit, feed: Real, power: int) -> LimitedFeed:
    slowness = 1.0 / feed
    time_s = float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(s)))
    return LimitedFeed(limit, limit.given, feed, time_s, power, 0.0)


def _reached(s: Real, limit: Limit, part: float, power: int) -> LimitedFeed:
    """From rest to rest inside one acceleration (power 2) or jerk (3), of which the path has at most `part`."""
    length = float(s[-1] - s[0])
    most = limit.value / max(part, 1e-12)
    peak = sqrt(most * length) if power == 2 else cbrt(most * length**2 / 4.0)
    feed = np.full(s.size, inf)
    feed[int(np.searchsorted(s, s[0] + 0.5 * length))] = peak
    return LimitedFeed(limit, limit.given, feed, 2.0 * length / peak, power, 0.0)


def _volts(s: Real, plant: Plant, limit: Limit, one: Real, two: Real) -> LimitedFeed:
    """Reach >= |c1| v + T |c2| v^2 at constant feed v."""
    reach, bend = max(plant.reach_mm_s, 0.0), plant.time_constant_s * two
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = 2.0 * reach / (one + np.sqrt(one**2 + 4.0 * bend * reach))
        feed = np.where(np.isnan(feed), inf, feed)
        slowness = 1.0 / feed
    time_s = float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(s)))
    given = plant.friction_volts + (plant.volts - plant.friction_volts) / limit.share
    return _VoltsFeed(limit, given, feed, time_s, 2, plant.friction_volts, plant, one, bend)
