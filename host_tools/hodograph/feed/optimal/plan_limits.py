# SPDX-License-Identifier: MIT
"""All limits of a feed along a path as one object, with reserves subtracted; docs/theory/feed.md 5.6. `gather` makes it
from path file, machine and drives; the planner reads it. Used by feed/optimal/ and stream/. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

from ..limits import (
    ControllerLimits,
    FeedZone,
    Limit,
    Limits,
    Plant,
    Plants,
    ReserveZone,
    least,
)
from ..pieces import LONGEST_PIECE_MM
from ..request import FeedRequest

PerAxis = tuple[Limit, ...]
"""Limits of the axes that follow the path; value inf: none."""

_MOST_BY_ACCELERATION, _MOST_BY_JERK = 2.0**13, 24.0
"""Greatest feed over the reserve of an acceleration, and of a jerk. They follow from the least override rate and
override acceleration of the format, 2^-16 / s and 2^-8 / s^2; a factor above 1 and the other bound use half of the
headroom each. docs/theory/feed.md section 7.
"""

_PERIODS_TO_FULL_ACCELERATION = 8
"""Periods in which the acceleration builds up if no jerk is limited."""

_PERIODS_TO_FULL_FEED = 16
"""Periods in which the feed builds up if no acceleration is limited."""


@dataclass(frozen=True, eq=False)
class PlanLimits:
    """The limits of a plan, each the least of its kind, with reserves subtracted; value inf: none.

    feed, acceleration, jerk, centripetal  along the path. That of the feed may follow from the reserve that a feed hold
                                           needs of an acceleration or a jerk
    velocity, axis_acceleration, axis_jerk, volts  of the axes; volts None: not limited
    plants         of the axes, with the volts that may be used
    zones          feed zones
    reserve_zones  places where more of accelerations and jerks stays free
    """

    feed: Limit
    acceleration: Limit
    jerk: Limit
    centripetal: Limit
    velocity: PerAxis
    axis_acceleration: PerAxis
    axis_jerk: PerAxis
    volts: PerAxis | None
    plants: Plants | None
    zones: tuple[FeedZone, ...]
    notes: tuple[str, ...] = ()
    reserve_zones: tuple[ReserveZone, ...] = ()

    @property
    def least_acceleration(self) -> float:
        """The least limit of any acceleration; inf without one."""
        volts = (p.reach_mm_s / p.time_constant_s for p in self.plants or ())
        return min(least((self.acceleration, *self.axis_acceleration)).value, *volts, inf)

    @property
    def least_jerk(self) -> float:
        """The least limit of any jerk."""
        return least((self.jerk, *self.axis_jerk)).value

    @property
    def least_feed(self) -> float:
        """The least limit of feed and axis velocities, zones aside."""
        volts = (p.reach_mm_s for p in self.plants or ())
        return min(least((self.feed, *self.velocity)).value, *volts, inf)

    def eased(self, least_s: float) -> PlanLimits:
        """The limits with jerks lowered so that full acceleration takes at least `least_s` to build up."""
        most = self.least_acceleration / least_s
        path, *axes = (
            replace(one, value=min(one.value, most)) for one in (self.jerk, *self.axis_jerk)
        )
        return replace(self, jerk=path, axis_jerk=tuple(axes))

    def with_feed(self, most_mm_s: float) -> PlanLimits:
        """The limits with the feed at most `most_mm_s`."""
        return replace(self, feed=replace(self.feed, value=min(self.feed.value, most_mm_s)))


def gather(
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    plants: Plants | None,
    period_us: int,
) -> PlanLimits:
    """The limits of a request: those of the path file, of the controller less its reserve, of the format.

    The jerk is always finite: if none is given, full acceleration, or full feed, builds up within a few periods.
    """
    period_s = 1e-6 * period_us
    longest = Limit(
        "feed_mm_s", 0.45 * LONGEST_PIECE_MM / period_s, "format", words="pieces of 32 mm"
    )
    requested = Limit("nominal_mm_s", request.nominal_mm_s, "feed")
    feeds = [*_given(limits, controller, "feed_mm_s"), *_held(limits, controller)]
    weaker = None if plants is None else _weaker(plants, limits.reserve)
    found = PlanLimits(
        least((longest, requested, *feeds)),
        least(_given(limits, controller, "acceleration_mm_s2")),
        least(_given(limits, controller, "jerk_mm_s3")),
        Limit("centripetal_mm_s2", limits.centripetal_mm_s2 or inf),
        limits.axis_limits("velocity_mm_s"),
        limits.axis_limits("acceleration_mm_s2"),
        limits.axis_limits("jerk_mm_s3"),
        None if weaker is None else _volts(limits, weaker),
        weaker,
        limits.zones,
        reserve_zones=limits.reserve_zones,
    )
    return found if found.least_jerk < inf else _with_jerk(found, period_s)


def _with_jerk(limits: PlanLimits, period_s: float) -> PlanLimits:
    """The limits with a limit of the jerk; if none is given, one of few periods."""
    peak = limits.least_acceleration
    if peak < inf:
        jerk = peak / (_PERIODS_TO_FULL_ACCELERATION * period_s)
    else:
        jerk = limits.least_feed / (_PERIODS_TO_FULL_FEED * period_s) ** 2
    note = (
        f"no limit bounds the jerk: {jerk:.4g} mm/s^3 is taken, a few periods to full acceleration"
    )
    return replace(limits, jerk=Limit("jerk_mm_s3", jerk, ""), notes=(note,))


def _weaker(plants: Plants, reserve: float) -> Plants:
    """The plants with a share of the volts that remain after friction."""
    return tuple(
        replace(one, volts=one.friction_volts + (1.0 - reserve) * (one.volts - one.friction_volts))
        for one in plants
    )


def _volts(limits: Limits, weaker: Plants) -> PerAxis:
    """Limits of the volts without friction."""
    return tuple(
        replace(limit, value=_usable_volts(plant))
        for limit, plant in zip(limits.volts_limits(weaker), weaker, strict=True)
    )


def _usable_volts(plant: Plant) -> float:
    return plant.reach_mm_s / plant.gain_mm_s_v


def _given(limits: Limits, controller: ControllerLimits | None, key: str) -> Iterator[Limit]:
    """The limit along the path of the path file, and that of the controller."""
    own = getattr(limits, key)
    yield Limit(key, inf if own is None else own)
    if controller is not None:
        yield controller.limit(key)


def _held(limits: Limits, controller: ControllerLimits | None) -> Iterator[Limit]:
    """Feeds up to which the reserve of a limit suffices for a feed hold with the least override rates of the format."""
    for key, by in (
        ("acceleration_mm_s2", _MOST_BY_ACCELERATION),
        ("jerk_mm_s3", _MOST_BY_JERK),
    ):
        share = limits.reserve * by
        for k, value in enumerate(getattr(limits.axes, key) or ()):
            held, source = value * limits.reserve * by, limits.source(key, k)
            yield Limit(key, held, source, limits.names[k], None, share, unit=limits.unit(k))
        if controller is not None:
            free = controller.kept_free
            value = float(getattr(controller, key)) * free * by
            yield Limit(key, value, "controller", share=free * by)
