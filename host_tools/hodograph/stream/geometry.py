# SPDX-License-Identifier: MIT
"""The part of a section's path that is in memory: integer segments as in a program image, and their curve. Used by
stream/ and monitor/job_path. Passes on blocks from an iterator that may read the toolpath; no other I/O.

Blocks of segments are added at its end as they are fitted and removed from its start as they are passed. A segment
never changes: chunks (parts of the job) that were sent have its bits.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SectionPlanError
from ..events import EVENTS_A_TICK, Events, SwitchedOutputs, events_after, no_events
from ..feed import FeedZone
from ..feed.request import GREATEST_FEED_MM_S, LEAST_FEED_MM_S
from ..fixed_point import MM_PER_Q40, nearest_q40
from ..program.check import REACH_Q40
from ..program.geometry import LONGEST_SEGMENT_MM, arc_to_q40, quantise, segment_arcs
from ..spline import PHSpline
from ..spline.quintics import part_of_quintics
from ..spline.spatial import SpatialPHSpline, sliced
from ..spline.splitting import cut_segments, part_of

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Curve = PHSpline | SpatialPHSpline

SEGMENT_S = 0.1
"""A segment is halved until it takes about this time at its feed, since tails (brakes of chunks) end at ends of
segments.
"""

_LEAST_HALVED_MM = 0.25
"""Segments are not cut shorter than this for their duration."""
_SPEED_RATIO = 2.0
"""Greatest speed ratio of a segment, as of any program."""
_PAIR_SHARE = 0.997
"""Share of the least feed at which a tick at 200 % would cross more than two ends of segments."""

_PAIR_BESIDE_MM = REACH_Q40 * MM_PER_Q40 + 1e-6
"""How far the feed zone of short segments reaches beyond them. The controller counts a piece that ends this near as one
on them.
"""

_BESIDE_MM = 1e-6
"""A begin nearer than this to an end of a segment counts as that end. Tails end at ends of segments, and the rounding
of arc lengths would leave some 1e-12 mm of a segment: there the rounded numbers of the format are no curve.
"""
LEAST_REST_MM = 0.002
"""A section with a shorter remainder counts as done."""
_FARTHEST_Q40 = 1 << 62
"""Arc lengths of a job have to stay below this, the end of the format, 2^-40 mm."""


@dataclass(frozen=True, eq=False)
class Chords:
    """The chords of the programmed path that a block was fitted to, in their order.

    line      (m,) source line of each
    start_mm  (m,) arc length of the block that belongs to its start
    off_mm    (m,) distance between the curve there and the programmed point
    """

    line: Int
    start_mm: Real
    off_mm: Real


@dataclass(frozen=True, eq=False)
class Block:
    """Consecutive segments of a section's path, as they were fitted.

    curve      their curve, which begins where that of the block before ends
    feed_mm_s  (n,) programmed feed of each segment; inf: as fast as the machine can
    line       (n,) source line of each
    events     outputs that switch on it; arc lengths from its start
    chords     of the programmed path; None: they were not requested, or the path is of another kind
    """

    curve: Curve
    feed_mm_s: Real
    line: Int
    events: Events = field(default_factory=no_events)
    chords: Chords | None = None


def short_segments(block: Block) -> Block:
    """The block with its curve cut into segments that the format allows and that take about SEGMENT_S."""
    feed = np.minimum(block.feed_mm_s, GREATEST_FEED_MM_S)
    longest = np.clip(SEGMENT_S * feed, _LEAST_HALVED_MM, LONGEST_SEGMENT_MM)
    longest = np.minimum(2.0 ** np.floor(np.log2(longest)), LONGEST_SEGMENT_MM)
    edges = [0, *(np.flatnonzero(np.diff(longest)) + 1).tolist(), longest.size]
    curves, feeds, lines = [], [], []
    for first, last in itertools.pairwise(edges):
        part = sliced(block.curve, first, last)
        split = part.split(float(longest[first]), _SPEED_RATIO)
        ends = np.searchsorted(split.segment_starts_mm, part.segment_starts_mm - 1e-9)
        source = np.repeat(np.arange(first, last), np.diff(ends))
        curves.append(split)
        feeds.append(block.feed_mm_s[source])
        lines.append(block.line[source])
    return Block(joined(curves), np.concatenate(feeds), np.concatenate(lines), block.events)


def joined(curves: Sequence[Curve]) -> Curve:
    """Curves one after the other, all of the same kind and with the same axes."""
    origin = np.concatenate([one.origin for one in curves])
    if isinstance(curves[0], PHSpline):
        return PHSpline(origin, np.concatenate([one.w for one in curves]), False)  # type: ignore[union-attr]
    return SpatialPHSpline(
        origin,
        np.concatenate([one.preimage for one in curves]),  # type: ignore[union-attr]
        False,
        np.concatenate([one.extra for one in curves]),  # type: ignore[union-attr]
    )


def blocks_from(
    blocks: Iterator[Block], begin_mm: float, switched: SwitchedOutputs
) -> Iterator[Block]:
    """The blocks of a section from an arc length on; none if the remainder is shorter than LEAST_REST_MM. Events before
    it are applied to `switched`. Raises InputError: the section is shorter than that.
    """
    short: Block | None = None
    for block in blocks:
        length = block.curve.length_mm
        if begin_mm > 0.0 and begin_mm >= length - _BESIDE_MM:
            begin_mm = max(begin_mm - length, 0.0)
            switched.act(block.events)
            continue
        if begin_mm > 0.0:
            block, begin_mm = _after(block, begin_mm, switched), 0.0
            if block.curve.length_mm < LEAST_REST_MM:
                short = block
                continue
        if short is not None:
            yield short
            short = None
        yield block
    if short is not None:
        switched.act(short.events)
    if begin_mm > _BESIDE_MM:
        raise InputError(f"the section ends {begin_mm:g} mm before the place where it shall go on")


def begun_with(block: Block, events: Events) -> Block:
    """The block with these events at its start, in front of its own."""
    return replace(block, events=np.concatenate((events, block.events)))


def switching(blocks: Iterator[Block], switched: SwitchedOutputs) -> Iterator[Block]:
    """The blocks; the events of each are applied to `switched`."""
    for block in blocks:
        switched.act(block.events)
        yield block


def _after(block: Block, begin_mm: float, switched: SwitchedOutputs) -> Block:
    """A block without its first part; the events of that part are applied."""
    first, made = curve_after(block.curve, begin_mm)
    passed, events = events_after(block.events, nearest_q40(begin_mm))
    switched.act(passed)
    return Block(made, block.feed_mm_s[first:], block.line[first:], events)


def curve_after(curve: Curve, begin_mm: float) -> tuple[int, Curve]:
    """A curve without its first part, after the number of whole segments in that part."""
    near = int(np.argmin(np.abs(curve.segment_starts_mm - begin_mm)))
    if near < curve.segment_count and abs(curve.segment_starts_mm[near] - begin_mm) < _BESIDE_MM:
        return near, sliced(curve, near)
    segment, xi = curve.locate(begin_mm)
    first, x = int(segment), float(xi)
    if isinstance(curve, PHSpline):
        start = np.append(curve.position(first, x), curve.origin[first + 1 :])
        return first, PHSpline(start, _after_at(curve.w[first:], x), False)
    origin = np.concatenate((curve.position(first, x)[None], curve.origin[first + 1 :]))
    begin = part_of_quintics(curve.extra[first : first + 1], np.array([x]), np.ones(1))
    extra = np.concatenate((begin, curve.extra[first + 1 :]))
    return first, SpatialPHSpline(origin, _after_at(curve.preimage[first:], x), False, extra)


def with_joints(curve: Curve, at_mm: Real) -> Curve:
    """The curve with further joints at arc lengths (n,), rising, none of them at a joint."""
    if not at_mm.size:
        return curve
    segment, xi = curve.locate(at_mm)
    origin: Any = np.insert(curve.origin, segment + 1, curve.position(segment, xi), axis=0)
    if isinstance(curve, PHSpline):
        return PHSpline(origin, cut_segments(curve.w, segment, xi)[2], False)
    owner, begin, preimage = cut_segments(curve.preimage, segment, xi)
    if not curve.extra_axes:
        return SpatialPHSpline(origin, preimage, False)
    end = np.where(np.append(np.diff(owner) == 0, False), np.append(begin[1:], 1.0), 1.0)
    extra = part_of_quintics(curve.extra[owner], begin, end)
    return SpatialPHSpline(origin, preimage, False, extra)


def _after_at(w: Any, x: float) -> Any:
    """Preimages (n, …, 3), of the first one only the part from parameter x on."""
    return np.concatenate((part_of(w[:1], np.array([x]), np.ones(1)), w[1:]))


class StreamPath:
    """The segments in memory. Arc lengths of `curve` and of zones count from the first segment, those in q40 from the
    start of the section.

    passed     number of segments of the section that were removed
    start_q40  (N + 1,) starts of the segments, and the end
    point_q40  (A, N), a_q44 (2 or 4, N, 3), extra_q40 (A - 3, N, 5): as in a program
    events     outputs that switch on the path; arc lengths from the start of the section
    """

    def __init__(
        self,
        offset_mm: Sequence[float],
        period_us: int,
        begin_q40: int = 0,
        begin_point_q40: Int | None = None,
    ) -> None:
        """offset_mm work offset of each axis of the path
        begin_q40        arc length of the section at the start of the path
        begin_point_q40  exact start point of the path; None: that of its first block
        """
        self._offset_mm = tuple(offset_mm)
        self._period_s = 1e-6 * period_us
        self._curve: Curve | None = None
        self._end_point = begin_point_q40
        self.start_q40: Int = np.array([begin_q40], dtype=np.int64)
        self.feed_mm_s: Real = np.zeros(0)
        self.line: Int = np.zeros(0, dtype=np.int64)
        self.events = no_events()
        self.complete = False
        self.passed = 0

    @property
    def end_point_q40(self) -> Int:
        """Where the path ends, in machine coordinates (A,)."""
        assert self._end_point is not None, "a block comes first"
        return self._end_point

    @property
    def curve(self) -> Curve:
        """The curve of the segments."""
        assert self._curve is not None, "a block comes first"
        return self._curve

    @property
    def count(self) -> int:
        """Segments."""
        return int(self.line.size)

    def append(self, block: Block) -> None:
        """Adds a block. Raises InputError and SectionPlanError: it is beyond the format."""
        block = short_segments(block)
        made = quantise(block.curve, self._offset_mm)
        point = made.point_q40
        if self._end_point is not None:
            # The block is shifted to the exact end of the path: rounding leaves some 1e-11 mm between them.
            point = point + (self._end_point - point[:, 0])[:, None]
        self._append_events(block.events, int(made.start_q40[-1]))
        if self._curve is None:
            self._curve, self.point_q40, self.a_q44 = block.curve, point, made.a_q44
            self.extra_q40 = made.extra_q40
        else:
            self._curve = joined((self._curve, block.curve))
            self.point_q40 = np.concatenate((self.point_q40, point), axis=1)
            self.a_q44 = np.concatenate((self.a_q44, made.a_q44), axis=1)
            self.extra_q40 = np.concatenate((self.extra_q40, made.extra_q40), axis=1)
        arcs = segment_arcs(made.a_q44[:, -1:])
        moved = [int(arc_to_q40(one)[0]) for one in arcs[:-1]]
        self._end_point = point[:, -1] + np.array([*moved, *made.extra_q40[:, -1:, -1].ravel()])
        if int(self.start_q40[-1]) + int(made.start_q40[-1]) >= _FARTHEST_Q40:
            raise SectionPlanError(
                int(block.line[-1]), "the section is longer than 4 km: divide it by a dwell (G4 P0)"
            )
        self.start_q40 = np.concatenate((self.start_q40, self.start_q40[-1] + made.start_q40[1:]))
        self.feed_mm_s = np.concatenate((self.feed_mm_s, block.feed_mm_s))
        self.line = np.concatenate((self.line, block.line))

    def _append_events(self, events: Events, length_q40: int) -> None:
        """Adds the events of a block of this length. Events at its start are moved 2^-40 mm later, except in the first
        block: a chunk that ends there was made without them.
        """
        if not len(events):
            return
        first = 0 if self._curve is None else 1
        own = events.copy()
        own["place"] = np.clip(events["place"], first, length_q40) + self.start_q40[-1]
        self.events = np.concatenate((self.events, own))

    def events_on(self, begin_q40: int, end_q40: int) -> Events:
        """The events from one arc length of the section to another, both included; their places count from the
        first.
        """
        at = np.searchsorted(self.events["place"], begin_q40, side="left")
        own = self.events[at : self._events_until(end_q40)].copy()
        own["place"] -= begin_q40
        return own

    def events_before(self, s_mm: Real) -> NDArray[np.intp]:
        """Number of events (n,) up to places (n,) of the curve."""
        place_mm = np.ldexp((self.events["place"] - self.start_q40[0]).astype(np.float64), -40)
        return np.searchsorted(place_mm, s_mm, side="right")

    def _events_until(self, place_q40: int) -> int:
        return int(np.searchsorted(self.events["place"], place_q40, side="right"))

    def _slow_for_events(self, feed: Real) -> None:
        """Lowers the feed (N,) of segments where a tick at 200 % would pass more than EVENTS_A_TICK events."""
        place = self.events["place"]
        gap_mm = np.ldexp((place[EVENTS_A_TICK:] - place[:-EVENTS_A_TICK]).astype(np.float64), -40)
        most = gap_mm * (_PAIR_SHARE / (2.0 * self._period_s))
        for i in np.flatnonzero(most < feed.max()).tolist():
            first, last = (self.segment_at(int(place[k])) for k in (i, i + EVENTS_A_TICK))
            feed[first : last + 1] = np.minimum(feed[first : last + 1], most[i])

    def drop(self, count: int) -> float:
        """Removes the first `count` segments. Returns their length: arc lengths of `curve` decrease by it."""
        if count == 0:
            return 0.0
        self.passed += count
        passed_mm = float(self.curve.segment_starts_mm[count])
        self._curve = sliced(self.curve, count)
        self.start_q40 = self.start_q40[count:]
        self.point_q40, self.a_q44 = self.point_q40[:, count:], self.a_q44[:, count:]
        self.extra_q40 = self.extra_q40[:, count:]
        self.feed_mm_s, self.line = self.feed_mm_s[count:], self.line[count:]
        self.events = self.events[self._events_until(int(self.start_q40[0]) - 1) :]
        return passed_mm

    def segment_at(self, s_q40: int) -> int:
        """The segment that holds an arc length of the section."""
        return int(np.searchsorted(self.start_q40[1:-1], s_q40, side="right"))

    def line_at(self, s_q40: int) -> int:
        """The source line of an arc length of the section."""
        return int(self.line[self.segment_at(s_q40)])

    def feeds(self, most_mm_s: float) -> tuple[float, tuple[FeedZone, ...]]:
        """The greatest feed, and zones with a lower one, from the programmed feeds and from what short segments allow.
        Zones of short segments reach a little beyond them (_PAIR_BESIDE_MM).
        """
        starts = self.curve.segment_starts_mm
        pair = (starts[2:] - starts[:-2]) * (_PAIR_SHARE / (2.0 * self._period_s))
        asked = np.minimum(self.feed_mm_s, most_mm_s)
        feed = asked.copy()
        if pair.size:
            feed[:-1] = np.minimum(feed[:-1], pair)
            feed[1:] = np.minimum(feed[1:], pair)
        self._slow_for_events(feed)
        short = feed < asked
        feed = np.clip(feed, LEAST_FEED_MM_S, GREATEST_FEED_MM_S)
        nominal = float(feed.max())
        edges = [0, *(np.flatnonzero(np.diff(feed)) + 1).tolist(), feed.size]
        zones = []
        for first, last in itertools.pairwise(edges):
            if feed[first] < nominal:
                beside = _PAIR_BESIDE_MM if short[first:last].any() else 0.0
                low = max(float(starts[first]) - beside, 0.0)
                zones.append(FeedZone(low, float(starts[last]) + beside, float(feed[first])))
        return nominal, tuple(zones)
