# SPDX-License-Identifier: MIT
"""What binds a feed along a path, all sources together; docs/numerics.md 5.6."""

from __future__ import annotations

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

_PERIODS_TO_FULL_ACCELERATION = 8
"""Without any limit of the jerk the acceleration still builds up within so many periods."""

_PERIODS_TO_FULL_FEED = 16


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of a motion; inf: none. `caps` (n, 3): from_mm, to_mm, feed_mm_s.

    axis_share  the part of the axes' accelerations, jerks and volts that is meant to be used; what is said here
                of them has the reserve taken off already
    sources  whose the tangential bounds are, in words: feed, acceleration, jerk
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
    sources: tuple[str, str, str]
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
        ("format, pieces of 32 mm", 0.45 * LONGEST_PIECE_MM / period_s),
        ("feed nominal_mm_s", request.nominal_mm_s),
        ("limits feed_mm_s", limits.feed_mm_s),
        ("controller feed_mm_s less its reserve", _kept(controller, "feed_mm_s")),
    )
    acceleration, acceleration_source = _least(
        ("limits acceleration_mm_s2", limits.acceleration_mm_s2),
        ("controller acceleration_mm_s2 less its reserve", _kept(controller, "acceleration_mm_s2")),
    )
    jerk, jerk_source = _least(
        ("limits jerk_mm_s3", limits.jerk_mm_s3),
        ("controller jerk_mm_s3 less its reserve", _kept(controller, "jerk_mm_s3")),
    )
    axis = limits.axis
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
        sources = (feed_source, acceleration_source, "jerk taken for want of a limit")
        bounds = replace(bounds, jerk_mm_s3=jerk, sources=sources, notes=tuple(notes))
    return bounds


def _less(values: PerAxis, share: float) -> PerAxis:
    return values[0] * share, values[1] * share


def _weaker(plant: Plant, share: float) -> Plant:
    """A plant that may use a part only of what friction leaves of its volts."""
    left = share * (plant.volts - plant.friction_volts)
    return replace(plant, volts=plant.friction_volts + left)


def _kept(controller: ControllerLimits | None, name: str) -> float | None:
    if controller is None:
        return None
    return float(getattr(controller, name)) * (1.0 - controller.kept_free)


def _least(*candidates: tuple[str, float | None]) -> tuple[float, str]:
    given = [(value, name) for name, value in candidates if value is not None]
    return min(given, default=(inf, "no limit"))
