# SPDX-License-Identifier: MIT
"""What binds a feed along a path, all sources together; docs/theory/numerics.md 5.6."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..limits import ControllerLimits, Limits, PerAxis
from ..plant import Plant, Plants
from ..quantise import LONGEST_PIECE_MM
from ..request import FeedRequest

Real = NDArray[np.float64]

FREE: PerAxis = (inf, inf)

_MOST_BY_ACCELERATION, _MOST_BY_JERK = 2.0**13, 24.0
"""Greatest feed over what is left of an acceleration, of a jerk: rates of 2^-16 / s and 2^-8 / s^2 are the least of the
format, and a factor above 1 and the other rate take half of the room each; docs/theory/numerics.md section 7."""

_PERIODS_TO_FULL_ACCELERATION = 8
"""Without any limit of the jerk the acceleration still builds up within so many periods."""

_PERIODS_TO_FULL_FEED = 16


@dataclass(frozen=True)
class Source:
    """Whose a bound is: section and key, and the part of the value given there that may be used."""

    section: str
    key: str
    share: float = 1.0


_NONE = Source("", "no limit")
TAKEN = Source("", "taken for want of a limit")


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of a motion; inf: none. `caps` (n, 3): from_mm, to_mm, feed_mm_s.

    axis_share  the part of the axes' accelerations, jerks and volts that is meant to be used; what is said here
                of them has the reserve taken off already
    sources  whose the tangential bounds are: feed, acceleration, jerk
    axis_source  whose those of an axis are, by key and axis: section of a Source
    """

    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    centripetal_mm_s2: float
    velocity: PerAxis
    acceleration: PerAxis
    jerk: PerAxis
    plants: Plants | None
    axis_share: float
    caps: Real
    sources: tuple[Source, Source, Source]
    axis_source: Callable[[str, int], str]
    notes: tuple[str, ...] = ()

    @property
    def least_acceleration(self) -> float:
        """The least bound of any acceleration; inf without one."""
        volts = (p.reach_mm_s / p.time_constant_s for p in self.plants or ())
        return min(self.acceleration_mm_s2, *self.acceleration, *volts)

    @property
    def least_jerk(self) -> float:
        """The least bound of any jerk."""
        return min(self.jerk_mm_s3, *self.jerk)

    @property
    def least_feed(self) -> float:
        """The least bound of feed and axis velocities, caps aside."""
        return min(self.feed_mm_s, *self.velocity, *(p.reach_mm_s for p in self.plants or ()))

    def eased(self, least_s: float) -> Bounds:
        """The same with jerks that let all acceleration build up within `least_s` at the soonest."""
        most = self.least_acceleration / least_s
        x, y = self.jerk
        return replace(
            self, jerk_mm_s3=min(self.jerk_mm_s3, most), jerk=(min(x, most), min(y, most))
        )

    def with_caps(self, caps: Real) -> Bounds:
        """The same with further caps."""
        return Bounds(**{**self.__dict__, "caps": np.concatenate((self.caps, caps.reshape(-1, 3)))})


def gather(
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    plants: Plants | None,
    period_us: int,
) -> Bounds:
    """The bounds of a request: those of the path file, of the controller less its reserve, of the format.

    Always with a finite jerk: where none is given, one that lets full acceleration, or full feed, build up
    within a few periods.
    """
    period_s = 1e-6 * period_us
    feed, feed_source = _least(
        (Source("format", "pieces of 32 mm"), 0.45 * LONGEST_PIECE_MM / period_s),
        (Source("feed", "nominal_mm_s"), request.nominal_mm_s),
        (Source("limits", "feed_mm_s"), limits.feed_mm_s),
        *_kept(controller, "feed_mm_s"),
        *_held(limits, controller),
    )
    acceleration, acceleration_source = _least(
        (Source("limits", "acceleration_mm_s2"), limits.acceleration_mm_s2),
        *_kept(controller, "acceleration_mm_s2"),
    )
    jerk, jerk_source = _least(
        (Source("limits", "jerk_mm_s3"), limits.jerk_mm_s3),
        *_kept(controller, "jerk_mm_s3"),
    )
    axis = limits.axes
    notes = []
    share = 1.0 - limits.reserve
    bounds = Bounds(
        feed,
        acceleration,
        jerk,
        limits.centripetal_mm_s2 or inf,
        axis.velocity_mm_s or FREE,
        _less(axis.acceleration_mm_s2 or FREE, share),
        _less(axis.jerk_mm_s3 or FREE, share),
        None if plants is None else (_weaker(plants[0], share), _weaker(plants[1], share)),
        share,
        np.array([[c.from_mm, c.to_mm, c.feed_mm_s] for c in limits.caps]).reshape(-1, 3),
        (feed_source, acceleration_source, jerk_source),
        limits.source,
    )
    if bounds.jerk_mm_s3 == inf and max(bounds.jerk) == inf:
        peak = bounds.least_acceleration
        if peak < inf:
            jerk = peak / (_PERIODS_TO_FULL_ACCELERATION * period_s)
        else:
            jerk = bounds.least_feed / (_PERIODS_TO_FULL_FEED * period_s) ** 2
        notes.append(
            f"no limit bounds the jerk: {jerk:.4g} mm/s^3 is taken, a few periods to full acceleration"
        )
        sources = (feed_source, acceleration_source, TAKEN)
        bounds = replace(bounds, jerk_mm_s3=jerk, sources=sources, notes=tuple(notes))
    return bounds


def _less(values: PerAxis, share: float) -> PerAxis:
    return values[0] * share, values[1] * share


def _weaker(plant: Plant, share: float) -> Plant:
    """A plant that may use a part only of what friction leaves of its volts."""
    left = share * (plant.volts - plant.friction_volts)
    return replace(plant, volts=plant.friction_volts + left)


def _kept(controller: ControllerLimits | None, key: str) -> list[tuple[Source, float]]:
    if controller is None:
        return []
    share = 1.0 - controller.kept_free
    return [(Source("controller", key, share), float(getattr(controller, key)) * share)]


def _held(limits: Limits, controller: ControllerLimits | None) -> list[tuple[Source, float]]:
    """Feeds up to which the reserve of a limit leaves the rates of a hold room that the format knows."""
    given = [
        (Source(limits.source(key, k), f"axis.{key} of {'xy'[k]}"), value, limits.reserve, by)
        for key, both, by in (
            ("acceleration_mm_s2", limits.axes.acceleration_mm_s2, _MOST_BY_ACCELERATION),
            ("jerk_mm_s3", limits.axes.jerk_mm_s3, _MOST_BY_JERK),
        )
        for k, value in enumerate(both or ())
    ]
    if controller is not None:
        for key, by in (
            ("acceleration_mm_s2", _MOST_BY_ACCELERATION),
            ("jerk_mm_s3", _MOST_BY_JERK),
        ):
            source = Source("controller", key)
            given.append((source, float(getattr(controller, key)), controller.kept_free, by))
    return [
        (replace(source, share=free * by), value * free * by) for source, value, free, by in given
    ]


def _least(*candidates: tuple[Source, float | None]) -> tuple[float, Source]:
    given = [(value, source) for source, value in candidates if value is not None]
    return min(given, default=(inf, _NONE), key=lambda one: one[0])
