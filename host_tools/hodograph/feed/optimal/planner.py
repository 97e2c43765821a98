# SPDX-License-Identifier: MIT
"""The profile `optimal`: least time along a path inside all its limits; docs/theory/feed.md 5.6. Used by pipeline. No
I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from math import inf

import numpy as np

from ...errors import InputError, PlanError
from ...spline.frames import Curve
from ..kinematics import PathBounds
from ..limits import ControllerLimits, FeedZone, Limits, Peak, Plants
from ..plan import FeedPlan, assumed_controller
from ..request import LONGEST_S, FeedRequest, check_length, check_period
from .feasible import binding_most, check_feasible, least_time_s, rounded_up, within_reach
from .plan_limits import PlanLimits, gather
from .sequence import NothingFoundError, plan_windows
from .track import Ends, Track, find_peaks, joined, make_track, track_of

_ABOVE = 3e-4
"""A plan may exceed a limit by this share; to remove a greater excess, it runs slower."""

_ZONE_SHARE, _BESIDE_MM = 0.998, 2.0**-12
"""A zone that caps a finished plan: the share of its feed that is used, since pieces may exceed a limit a little; and
the distance from a knot within which the zone also covers the interval beyond.
"""

_EASED = (1e-5, 1e-4, 1e-3)
"""Further attempts: times in which the acceleration builds up, as shares of three times the mean least time of a
segment.
"""
_POOR = 1.02
"""An attempt whose plan has to be slowed by less than this factor is final."""
_MANY_PERIODS = 100.0
"""If the second share of _EASED is longer than this number of periods, the attempt without easing is left out."""

_POWER = {"acceleration_mm_s2": 2, "centripetal_mm_s2": 2, "jerk_mm_s3": 3}
"""Power of the feed to which a limited quantity is proportional; 1 for other keys."""


def plan_optimal(
    spline: Curve,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None = None,
    plants: Plants | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """The fastest feed along `spline` from rest to rest.

    plants  of the axes, where `limits.volts` is given Raises InputError (length, period) and PlanError: no useful feed
    keeps the limits. The message names the limits, the places, and values that would suffice.
    """
    check_period(period_us)
    check_length(spline.length_mm)
    limits = limits.of_axes(spline.axes)
    if not limits.bind:
        raise InputError(
            'feed: profile "optimal" has no limit to keep: name a machine, or add one to [limits]'
        )
    found = gather(request, limits, controller, plants, period_us)
    check_feasible(spline, found, LONGEST_S)
    track = _run(spline, found, 1e-6 * period_us)
    if track.time_s >= LONGEST_S:
        raise PlanError(_too_long(spline, found, track.time_s))
    return FeedPlan(
        request,
        limits,
        controller or assumed_controller(*track.peaks()),
        period_us,
        track,
        found.notes,
        paths=(PathBounds(spline, limits, plants),),
        assumed=controller is None,
    )


def replan_optimal(plan: FeedPlan, zones: Sequence[FeedZone], reason: str) -> FeedPlan:
    """A plan of `plan_optimal` made again with further feed zones; `reason` goes to the notes.

    A zone applies to whole pieces: it is widened to those that it meets, and its feed is lowered by 0.2 %.
    """
    assert isinstance(plan.curve, Track)
    (path,) = plan.paths
    widened = (_widened(plan.curve, zone) for zone in zones)
    limits = replace(plan.limits, zones=(*plan.limits.zones, *widened))
    controller = None if plan.assumed else plan.controller
    again = plan_optimal(
        path.spline, plan.request, limits, controller, path.plants, period_us=plan.period_us
    )
    return replace(again, notes=(*again.notes, f"feed capped: {reason}"))


def _widened(track: Track, zone: FeedZone) -> FeedZone:
    s = track.s
    first = int(np.searchsorted(s, zone.from_mm - _BESIDE_MM, side="right")) - 1
    last = int(np.searchsorted(s, zone.to_mm + _BESIDE_MM, side="left"))
    return FeedZone(
        float(s[max(first, 0)]), float(s[min(last, s.size - 1)]), zone.feed_mm_s * _ZONE_SHARE
    )


def plan_peaks(
    plan: FeedPlan,
    spline: Curve,
    limits: Limits,
    controller: ControllerLimits | None,
    plants: Plants | None,
) -> dict[str, Peak]:
    """The peaks of all limited quantities of a plan of any profile, by name."""
    found = gather(plan.request, limits.of_axes(spline.axes), controller, plants, plan.period_us)
    return find_peaks(spline, found, track_of(plan.raw, spline.length_mm))


def _run(spline: Curve, limits: PlanLimits, period_s: float) -> Track:
    """The curve of the plan.

    If limits are so far apart that no feed is found, or a poor one, jerks are lowered: the acceleration then takes a
    small share of the mean time of three segments to build up.
    """
    near = within_reach(spline, limits)
    tries = [near]
    if near.least_acceleration < inf:
        time_s = 3.0 * least_time_s(spline, limits) / spline.segment_count
        # If that costs little, it is tried first: with limits far apart the attempt also takes long to fail.
        slow = _EASED[1] * time_s > _MANY_PERIODS * period_s
        eased = [near.eased(max(period_s, share * time_s)) for share in _EASED]
        tries = eased[1:] if slow else [near, *eased]
    best: Track | None = None
    for one in tries:
        with suppress(NothingFoundError):
            found = _track(spline, limits, joined(list(plan_windows(spline, one, period_s))))
            if best is None or found.time_s < best.time_s:
                best = found
        if best is not None and best.stretch < _POOR:
            return best
    if best is None:
        raise PlanError(
            "feed: the planner found no feed at all: please report this path and its limits"
        )
    return best


def _track(spline: Curve, limits: PlanLimits, ends: Ends) -> Track:
    track = make_track(ends, 1.0, spline.segment_starts_mm)
    stretch = _needed_stretch(find_peaks(spline, limits, track))
    return track if stretch == 1.0 else make_track(ends, stretch, spline.segment_starts_mm)


def _too_long(spline: Curve, limits: PlanLimits, duration_s: float) -> str:
    """The message if several limits together make the path take too long. Raising all of them accordingly makes it
    faster by the factor.
    """
    one, s_mm = binding_most(spline, limits)
    k = 1.05 * duration_s / LONGEST_S
    return (
        f"{one.name}, lowest at arc length {s_mm:.6g} mm, takes most of {duration_s:.4g} s, longer than the "
        f"{LONGEST_S:.7g} s of a program: with all limits it has to be raised, feeds and velocities by "
        f"{rounded_up(k)}, accelerations and volts by {rounded_up(k**2)}, jerks by {rounded_up(k**3)}"
    )


def _needed_stretch(peaks: dict[str, Peak]) -> float:
    """The factor of time by which the plan has to be slower, so that no limit is exceeded by more than the
    tolerance.
    """
    stretch = 1.0
    for peak in peaks.values():
        power = _POWER.get(peak.limit.key, 1)
        stretch = max(stretch, (peak.usage / (1.0 + _ABOVE)) ** (1.0 / power))
    return stretch
