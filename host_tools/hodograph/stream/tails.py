# SPDX-License-Identifier: MIT
"""Tails of a planning window (docs/glossary.md): brakes along the path from a joint to rest, of which a chunk gets the
first one that the controller accepts; docs/theory/feed.md 5.6, "Tails". Used by chunks.py. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import tee

import numpy as np

from ..feed.optimal.brake import brake_to_rest
from ..feed.optimal.plan_limits import PlanLimits
from ..feed.optimal.sequence import measured
from ..feed.optimal.track import ends_of, make_track, piece_usage
from ..feed.optimal.window import Solution, State, plan_window
from ..fixed_point import MM_PER_Q40
from .windows import TAIL_EFFORT, SectionFeed, Stretch, Window, begun, last_s, touched

_BRAKE_DISTANCES = (1.1, 1.2, 1.3, 1.4, 1.5)
"""Distances of brakes without a quadratic program, which are tried first, as multiples of the least braking
distance.
"""

_TAIL_DISTANCES = (1.15, 1.5, 2.2, 3.3, 1.3, 1.85, 2.7)
"""Distances of tails in the order in which they are tried, as multiples of the least braking distance."""

_LOWERED = (1.04, 1.04)
"""Factors by which the limits of an interval that the controller would refuse are lowered, one after the other."""

_MOST_USAGE = 1.0075
"""Greatest limit usage of a tail, of the limits less RESERVE; the controller's check decides whether the tail is
accepted.
"""


@dataclass(frozen=True)
class _Start:
    """Where tails begin: number of the joint, arc length, state, and the least arc length of their ends, mm."""

    joint: int
    low_mm: float
    state: State
    least_mm: float


class Tails:
    """The tails of a window, each planned once."""

    def __init__(self, feed: SectionFeed, window: Window) -> None:
        self._feed, self.window = feed, window
        self._made: dict[int, Iterator[Stretch]] = {}
        self._refused: list[Stretch] = []

    def after(self, joint: int, least_q40: int) -> Iterator[Stretch]:
        """Tails from a joint of the window to rest, without refused ones.

        Each ends at an end of a segment, at arc length `least_q40` of the section or later; the first call for a joint
        sets `least_q40`. First comes the shortest brake that keeps the limits, if any. For each distance in
        _TAIL_DISTANCES a planned tail follows, and the same with lower limits where the controller would refuse it. The
        last tail is the remainder of the window.
        """
        made = self._made.get(joint) or self._planned(joint, least_q40)
        self._made[joint], own = tee(made)
        return (tail for tail in own if not any(tail is one for one in self._refused))

    def refuse(self, tail: Stretch) -> None:
        """Excludes a tail whose motion the controller would refuse. The remainder of the window is never excluded: no
        other tail follows it.
        """
        if tail.end_q40 != self.window.stretch.end_q40:
            self._refused.append(tail)

    def _planned(self, joint: int, least_q40: int) -> Iterator[Stretch]:
        feed, window = self._feed, self.window
        found, knot = window.solution, window.first + joint
        start = _Start(
            joint,
            float(found.grid.s[knot]),
            State(float(found.q[knot]), float(found.slope[knot])),
            (least_q40 - int(feed.path.start_q40[0])) * MM_PER_Q40,
        )
        yield from self._brakes(start)
        for high_mm in self._ends(_TAIL_DISTANCES, start):
            one = self._solved(start, high_mm)
            if one is None or one.excess > _MOST_USAGE - 1.0:
                continue

            def made(found: Solution) -> Stretch:
                return self._stretch(start, found)

            yield made(one)
            yield feed.lowered(one, made, _whole, lambda _, own: own, _LOWERED)[0]
        yield Stretch(window.stretch.pieces.part(slice(joint, None)), window.stretch.end_q40)

    def _solved(self, start: _Start, high_mm: float) -> Solution | None:
        """The feed of a tail that ends at rest at this arc length; None: none is found."""
        feed, window = self._feed, self.window
        found = plan_window(
            feed.path.curve,
            self._limits(start, high_mm),
            start.low_mm,
            high_mm,
            start.state,
            feed.period_s,
            hurried=True,
            before_s=last_s(window.stretch.pieces, start.joint),
            effort=TAIL_EFFORT,
        )
        return None if found is None else measured(feed.path.curve, found)

    def _stretch(self, start: _Start, found: Solution) -> Stretch:
        feed = self._feed
        ends = begun(ends_of(found, found.grid.size), start.state)
        track = make_track(ends, 1.0, feed.path.curve.segment_starts_mm)
        return feed.stretch(track, self.window.plan, self.window.joint_q40(start.joint))

    def _brakes(self, start: _Start) -> Iterator[Stretch]:
        """The shortest brake to rest, over the distances in _BRAKE_DISTANCES, that keeps the limits of the window;
        empty: none does.
        """
        feed, window = self._feed, self.window
        curve = feed.path.curve
        for high_mm in self._ends(_BRAKE_DISTANCES, start):
            brake = brake_to_rest(start.state, start.low_mm, high_mm, feed.period_s)
            if brake is None:
                continue
            track = make_track(brake, 1.0, curve.segment_starts_mm)
            if piece_usage(curve, self._limits(start, high_mm), track).max() <= 1.0:
                yield feed.stretch(track, window.plan, window.joint_q40(start.joint))
                return

    def _limits(self, start: _Start, high_mm: float) -> PlanLimits:
        limits = self.window.limits
        return replace(limits, zones=touched(limits.zones, start.low_mm, high_mm))

    def _ends(self, distances: Sequence[float], start: _Start) -> Iterator[float]:
        """The first end of a segment at each of these distances or later, within the window and not before
        `start.least_mm`; each end once.
        """
        window, ends, tried = self.window, self._feed.path.curve.segment_starts_mm, set[int]()
        for distance in distances:
            wanted_mm = start.low_mm + distance * _braking_mm(start.state, window.limits)
            at = int(np.searchsorted(ends, max(wanted_mm, start.least_mm - 1e-6)))
            if at in tried or at >= ends.size or ends[at] >= window.solution.grid.s[-1]:
                continue
            tried.add(at)
            yield float(ends[at])


def _whole(stretch: Stretch) -> tuple[Stretch, int]:
    """A stretch all of whose pieces are kept."""
    return stretch, len(stretch.pieces)


def _braking_mm(state: State, limits: PlanLimits) -> float:
    """Estimate of the least braking distance."""
    feed = state.q**0.5
    pull = min(0.7 * limits.least_acceleration, (limits.least_jerk * feed) ** 0.5)
    lead_s = max(0.5 * state.slope, 0.0) / limits.least_jerk
    peak = feed + 0.25 * state.slope * lead_s if state.slope > 0.0 else feed
    return float(peak * (lead_s + 0.5 * (peak / pull + pull / limits.least_jerk)))
