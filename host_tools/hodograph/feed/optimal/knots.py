# SPDX-License-Identifier: MIT
"""The first estimate of the feed, and the knots that follow from it; docs/theory/feed.md 5.6. Used by optimal/sequence,
optimal/window and stream/windows. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...spline.frames import LEFT, RIGHT, Curve, frames
from ..limits import least_in_zones
from ..pieces import LONGEST_PIECE_MM
from .plan_limits import PlanLimits

Real = NDArray[np.float64]

_SHARE = 0.6
"""Share of the acceleration limits that the estimate uses, since jerk limits do not allow all of it all the time."""

FEWEST_INTERVALS = 12
"""Least number of intervals of a plan, if its time is enough."""

_SAMPLES = 16
"""Least number of samples of a segment for the first estimate."""
_END_SAMPLES = 24
"""Samples of the first and last part of a window; their distances from the end are proportional to k^3."""
_PER_SEGMENT = 4
"""Intervals in the time of a segment next to a sudden change of the acceleration, if it is a short segment."""
_PER_RAMP = 0.4
"""Longest interval there, as a share of the time in which full acceleration builds up."""
_MANY_SEGMENTS = 256
"""Segments from which a path counts as one of many segments."""
_BRIEFEST = 0.25
"""On a path of many segments, an interval contains several segments if they are passed in less than this share of its
longest time. Limits are also evaluated at the joints inside it. With four times as many intervals a program is 0.02 %
faster.
"""
_LEAST_PERIODS = 1.7
"""Least planned duration of an interval, in periods."""
_FLAT_STRETCH = 8.0
"""Longest interval far from sudden changes, as a multiple of the longest one next to them."""
_PER_FLAT_SEGMENT = 32
"""An interval far from sudden changes may last at least the time of its segment divided by this."""
_GROWTH = 0.25
"""Seconds by which an interval may be longer for each second between it and the nearest sudden change."""
_KINK = 0.05
"""Change of the acceleration that counts as sudden in the first estimate, as a share of the assumed acceleration."""
_SUDDEN = 0.5
"""The same in a plan."""
_LEAST_Q = 1e-14
"""Least q of the first estimate, as a share of its greatest; keeps times finite."""


@dataclass(frozen=True, eq=False)
class FirstEstimate:
    """q (n,) at rising arc lengths s (n,), with times t (n,).

    step_s  (n,) longest duration of intervals
    pull    the assumed acceleration
    fine_s  (n,) longest duration of intervals where it changes suddenly
    """

    s: Real
    q: Real
    t: Real
    step_s: Real
    fine_s: Real
    pull: float

    def squared_feed(self, s: Real) -> Real:
        """q at arc lengths between."""
        return np.asarray(np.interp(s, self.s, self.q))


def steady_limit(spline: Curve, limits: PlanLimits, s: Real) -> Real:
    """The greatest q at which a constant feed keeps each limit."""
    q = _steady_limit(spline, limits, s, LEFT)
    joint = np.flatnonzero(np.isin(s, spline.segment_starts_mm))
    q[joint] = np.minimum(q[joint], _steady_limit(spline, limits, s[joint], RIGHT))
    return q


def _steady_limit(spline: Curve, limits: PlanLimits, s: Real, side: int) -> Real:
    q: Real = np.full(s.size, limits.feed.value**2)
    f = frames(spline, s, np.full(s.size, side, dtype=np.int8))
    with np.errstate(divide="ignore"):
        q = np.minimum(q, limits.centripetal.value / np.abs(f.curvature))
        for r1, r2, r3, velocity, acceleration, jerk in zip(
            f.r1,
            f.r2,
            f.r3,
            limits.velocity,
            limits.axis_acceleration,
            limits.axis_jerk,
            strict=True,
        ):
            q = np.minimum(q, (velocity.value / np.abs(r1)) ** 2)
            q = np.minimum(q, acceleration.value / np.abs(r2))
            q = np.minimum(q, (jerk.value / np.abs(r3)) ** (2.0 / 3.0))
    for plant in limits.plants or ():
        q = np.minimum(q, plant.reach_mm_s**2)
    squares = [zone.feed_mm_s**2 for zone in limits.zones]
    return np.minimum(q, least_in_zones(s, limits.zones, squares, with_ends=True))


def first_estimate(
    spline: Curve,
    limits: PlanLimits,
    low: float,
    high: float,
    q_start: float | None,
    period_s: float,
) -> FirstEstimate:
    """The estimate from `low`, at rest (q_start None) or moving, to rest at `high`."""
    s = _samples(spline, limits, low, high)
    most = steady_limit(spline, limits, s)
    jerk = limits.least_jerk
    reach = (jerk * (high - low) ** 2) ** (1.0 / 3.0)
    slowness = 1.0 / np.minimum(np.sqrt(most), reach)
    typical = (high - low) / float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(s)))
    pull = min(_SHARE * limits.least_acceleration, (jerk * typical) ** 0.5)
    q = most.copy()
    q = np.minimum(q, _from_rest(high - s, jerk))
    if q_start is None:
        q = np.minimum(q, _from_rest(s - low, jerk))
    else:
        q[0] = min(q[0], q_start)
    rise = 2.0 * pull * (s - low)
    q = np.minimum.accumulate(q - rise) + rise
    fall = 2.0 * pull * (high - s)
    q = (np.minimum.accumulate((q - fall)[::-1]))[::-1] + fall
    q = np.maximum(q, _LEAST_Q * q.max())
    feed = np.sqrt(q)
    time = 2.0 * np.diff(s) / (feed[1:] + feed[:-1])
    if q_start is None:
        time[0] = np.cbrt(6.0 * (s[1] - s[0]) / jerk)
    time[-1] = np.cbrt(6.0 * (s[-1] - s[-2]) / jerk)
    t = np.concatenate((np.zeros(1), np.cumsum(time)))
    return FirstEstimate(s, q, t, *_steps(spline, s, q, t, pull, jerk, period_s), pull)


def _from_rest(distance: Real, jerk: float) -> Real:
    """q after a distance from rest at constant jerk."""
    return np.asarray(0.25 * jerk**2 * (6.0 * np.maximum(distance, 0.0) / jerk) ** (4.0 / 3.0))


def _samples(spline: Curve, limits: PlanLimits, low: float, high: float) -> Real:
    joints = spline.segment_starts_mm
    first = int(np.searchsorted(joints, low, side="right"))
    last = int(np.searchsorted(joints, high, side="left"))
    edges = np.unique(
        np.concatenate(([low], joints[first:last], zone_ends(limits, low, high), [high]))
    )
    fine = np.linspace(0.0, 1.0, _SAMPLES + 1)[1:]
    count = max(1, min(16, 96 // max(1, edges.size)))
    fine = np.linspace(0.0, 1.0, _SAMPLES * count + 1)[1:]
    s = np.concatenate((edges[:1], (edges[:-1, None] + np.diff(edges)[:, None] * fine).ravel()))
    end = (np.arange(1, _END_SAMPLES) / _END_SAMPLES) ** 3
    s = np.concatenate((s, s[0] + (s[1] - s[0]) * end, s[-1] - (s[-1] - s[-2]) * end, edges))
    s = np.unique(s)
    s = s[np.append(True, np.diff(s) > 1e-12 * (high - low))]
    s[-1] = high  # a zone may end a little before it
    return np.asarray(s)


def zone_ends(limits: PlanLimits, low: float, high: float) -> Real:
    """Starts and ends of feed zones between two arc lengths."""
    ends = np.array([end for zone in limits.zones for end in (zone.from_mm, zone.to_mm)])
    return np.asarray(ends[(ends > low) & (ends < high)])


def _steps(
    spline: Curve, s: Real, q: Real, t: Real, pull: float, jerk: float, period_s: float
) -> tuple[Real, Real]:
    """Longest duration of intervals, which grows with the distance from sudden changes of the acceleration; and the
    longest duration at such changes, a share of the time in which full acceleration builds up.
    """
    ramp = pull / _SHARE / jerk
    fine = _PER_RAMP * min(ramp, t[-1] / 6.0)
    acceleration = 0.5 * np.diff(q) / np.diff(s)
    kinks = np.abs(np.diff(acceleration)) > _KINK * pull
    marked = np.concatenate(([True], kinks, [True]))
    joint_t = np.interp(spline.segment_starts_mm, s, t)
    joints = np.searchsorted(spline.segment_starts_mm, s, side="right")
    spans = np.maximum(np.diff(joint_t), 1e-9)[np.clip(joints - 1, 0, spline.segment_count - 1)]
    away = np.maximum(_distance(t, t[marked]) - 2.0 * ramp, 0.0)
    least = _LEAST_PERIODS * period_s
    briefest = _BRIEFEST * fine if spline.segment_count >= _MANY_SEGMENTS else 0.0
    beside = np.minimum(fine, np.maximum(spans / _PER_SEGMENT, briefest))
    steps = np.minimum(
        beside + _GROWTH * away, np.maximum(_FLAT_STRETCH * fine, spans / _PER_FLAT_SEGMENT)
    )
    steps = np.where(away > 0.0, steps, beside)
    return np.maximum(steps, least), np.maximum(beside, least)


def refined(estimate: FirstEstimate, s: Real, t: Real, acceleration: Real) -> FirstEstimate:
    """The estimate with shorter steps near intervals of a plan in which the acceleration changed much; accelerations
    (n,) at arc lengths s (n,), passed at t (n,).
    """
    changed = np.abs(np.diff(acceleration)) > _SUDDEN * estimate.pull
    marked = np.append(changed, False) | np.append(False, changed)
    if not marked.any():
        return estimate
    away = _distance(np.interp(estimate.s, s, t), t[marked])
    return replace(estimate, step_s=np.minimum(estimate.step_s, estimate.fine_s + _GROWTH * away))


def _distance(t: Real, places: Real) -> Real:
    """Distances to the nearest of rising places."""
    after = places[np.clip(np.searchsorted(places, t), 0, places.size - 1)]
    before = places[np.clip(np.searchsorted(places, t, side="right") - 1, 0, places.size - 1)]
    return np.asarray(np.minimum(np.abs(after - t), np.abs(t - before)))


def choose_knots(
    spline: Curve,
    limits: PlanLimits,
    s: Real,
    t: Real,
    step_s: Real,
    period_s: float,
    fewest: int = FEWEST_INTERVALS,
) -> Real:
    """Knots in arc length: at joints and ends of zones that are far enough apart in time, and evenly between them.
    `fewest`: least number of intervals, if the time is enough.
    """
    low, high = float(s[0]), float(s[-1])
    density = 1.0 / step_s
    count = np.concatenate(
        (np.zeros(1), np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(t)))
    )
    least = min(float(fewest), max(3.0, t[-1] / (1.7 * period_s)))
    if count[-1] < least:
        count *= least / count[-1]
    joints = spline.segment_starts_mm
    joints = joints[(joints > low) & (joints < high)]
    marks = np.unique(np.concatenate((joints, zone_ends(limits, low, high))))
    at = np.interp(marks, s, count)
    kept, places, last = [low], [0.0], 0.0
    for mark, place in zip(marks.tolist(), at.tolist(), strict=True):
        if place - last >= 0.62 and count[-1] - place >= 0.62:
            kept.append(mark)
            places.append(place)
            last = place
    kept.append(high)
    places.append(float(count[-1]))
    parts = np.maximum(1, np.ceil(np.diff(places) - 0.3)).astype(np.int64)
    first = np.repeat(np.array(places[:-1]), parts)
    width = np.repeat(np.diff(places) / parts, parts)
    inner = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    knots = np.interp(first + inner * width, count, s)
    knots[np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(parts)[:-1]))] = kept[:-1]
    return _short_enough(np.append(knots, high))


def _short_enough(knots: Real) -> Real:
    """Cuts intervals that are longer than a piece may be into equal parts."""
    parts = np.ceil(np.diff(knots) / LONGEST_PIECE_MM).astype(np.int64)
    if parts.max() == 1:
        return knots
    inner = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    cut = np.repeat(knots[:-1], parts) + inner * np.repeat(np.diff(knots) / parts, parts)
    return np.append(cut, knots[-1])
