# SPDX-License-Identifier: MIT
"""The feed of a section in planning windows (docs/glossary.md); docs/theory/feed.md 5.6. Used by chunks.py,
stop_search.py and tails.py. Takes blocks of the path from an iterator that may read the toolpath; no other I/O.

A window begins where the kept part of the last window ends, in motion or at rest, and is planned to rest at its own
end. Kept pieces that are in a chunk never change again. A chunk ends with a tail, a fast brake from its last joint to
rest at the end of a segment, unless the path rests at that joint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..config import Machine
from ..errors import SectionPlanError
from ..events import EVENT
from ..feed import FeedPlan, FeedRequest, FeedZone, Limits
from ..feed.kinematics import PathBounds
from ..feed.limits import Plants
from ..feed.optimal.feasible import check_feasible, within_reach
from ..feed.optimal.knots import first_estimate
from ..feed.optimal.plan_limits import PlanLimits, gather
from ..feed.optimal.sequence import kept, measured, stopping_s, trusted_to
from ..feed.optimal.track import Ends, Track, ends_of, make_track
from ..feed.optimal.window import Effort, Solution, State, plan_window, tightened
from ..feed.override import with_override
from ..feed.pieces import FeedPieces, RawPieces, round_pieces
from ..feed.plan import FeedCurve
from ..feed.request import LONGEST_S, OPTIMAL
from ..fixed_point import to_q40
from ..machine_limits import axis_limits, controller_limits, plants
from ..program.image import COMPACT_PIECE_BYTES, segment_size
from .geometry import Block, StreamPath

Real = NDArray[np.float64]
Int = NDArray[np.int64]
_Made = TypeVar("_Made")

FIRST_WINDOW_S, WINDOW_S = 0.3, 3.0
"""Motion that a window keeps. The first window of a job keeps little, so that the job starts soon; each next one keeps
twice as much, up to WINDOW_S.
"""

_STOPS = 4.0
"""The part of a window that is not kept, as a multiple of the stopping time."""

_END_SHARE = 0.5
"""A window includes the remainder of a section if that adds less than this share."""

RESERVE = 0.01
"""Share of the axis limits that windows leave free, since kept pieces are not planned again if a later one needs
more.
"""

_EASED = (1e-3, 1e-2)
"""Least times in which the acceleration builds up, as shares of the stopping time; tried where no feed is found
otherwise.
"""

_EFFORT = Effort(gain=1e-3, patience=9, tolerance=1e-5, spacing=2.0, fewest=24)
"""Effort of windows, less than that of other plans. Feeds a little below their limits leave path stops more places to
begin. Half as many pieces take half of the bytes and cost 0.1 to 0.2 % of the time of the motion.
"""

TAIL_EFFORT = replace(_EFFORT, spacing=3.0, fewest=6)
"""Effort of tails, which need not be the fastest, and of windows that have to take few bytes."""

_LOWERED = (1.01, 1.01, 1.02, 1.04, 1.08)
"""Factors by which the limits of an interval that the controller would refuse are lowered, one after the other."""

_FEWER_CODES = (1, 2, 4, 8, 16)
"""Numbers of codes by which the override bounds of pieces that the controller would still refuse are reduced, one after
the other: 8 are a factor of 2.
"""

_DRIFT_Q40 = 1024
"""Greatest distance of a planned joint from that of the path, in 2^-40 mm (1e-9 mm)."""
_SAME_MM = 1e-9
"""Arc lengths nearer than this are the same."""


JOINTS = 4
"""Possible joints in the new part of a chunk; the last one for which there is room is taken."""

_SLIGHTLY_MORE = 0.25
"""The new part of a chunk may exceed its wanted size by this share, to save another chunk."""


@dataclass(frozen=True)
class Spacing:
    """Greatest distance of joints: in time, and in bytes of pieces and segments."""

    time_s: float
    bytes: int


@dataclass(frozen=True, eq=False)
class Stretch:
    """Feed pieces with arc lengths from the start of the section, and the arc length where the last one ends."""

    pieces: FeedPieces
    end_q40: int


@dataclass(frozen=True, eq=False)
class Window:
    """A planned window.

    count   number of kept intervals; all of them if `rests`
    rests   whether the kept part ends at rest
    joints  (j,) numbers of the knots at which tails may begin, JOINTS for a chunk; the last one is `count`
    end_mm  end of the kept part, as an arc length of the path in memory
    first   number of the solution's knot at which the stretch begins
    """

    solution: Solution
    limits: PlanLimits
    plan: FeedPlan
    stretch: Stretch
    count: int
    joints: tuple[int, ...]
    rests: bool
    end_mm: float
    first: int = 0

    def joint_q40(self, joint: int) -> int:
        """Arc length of the section at a knot."""
        pieces = self.stretch.pieces
        return int(pieces.start_q40[joint]) if joint < len(pieces) else self.stretch.end_q40


@dataclass(frozen=True, eq=False)
class _Estimate:
    """A first estimate of the feed: arc lengths s (n,), times t (n,) at which they are passed, and the stopping
    time.
    """

    s: Real
    t: Real
    stop_s: float


@dataclass(frozen=True, eq=False)
class Exceeded:
    """The pieces (M,) of a stretch that the controller would refuse for their motion, as far as its check names them;
    and those of them for which lower override bounds may help.
    """

    pieces: NDArray[np.bool_]
    by_override: NDArray[np.bool_]


class SectionFeed:
    """Plans the windows of a section. It reads the path from blocks as far as a window needs it."""

    def __init__(
        self,
        machine: Machine,
        blocks: Iterator[Block],
        joint: Spacing,
        exceeded: Callable[[Stretch], Exceeded],
        begin_q40: int = 0,
        begin_point_q40: NDArray[np.int64] | None = None,
    ) -> None:
        """blocks the path of the section
        joint            greatest distance of joints
        exceeded         the pieces of a stretch that the controller would refuse for their motion
        begin_q40        arc length of the section where the blocks begin
        begin_point_q40  exact point there; None: that of the first block
        """
        self.machine = machine
        self.path = StreamPath(machine.offset_mm, machine.period_us, begin_q40, begin_point_q40)
        self.begin_q40 = begin_q40
        self._blocks = blocks
        self._joint = joint
        self._effort = replace(
            _EFFORT,
            fewest=int(
                np.clip(joint.bytes // COMPACT_PIECE_BYTES, TAIL_EFFORT.fewest, _EFFORT.fewest)
            ),
        )
        self._exceeded = exceeded
        self.period_s = 1e-6 * machine.period_us
        self._estimated: tuple[tuple[int, int], _Estimate] | None = None
        self._held: Solution | None = None
        self._last: Window | None = None
        self._moving: State | None = None
        self._before_s = LONGEST_S
        self._low_q40 = begin_q40
        self._low_mm = 0.0
        self._wanted_s = FIRST_WINDOW_S if begin_point_q40 is None else WINDOW_S
        self._needed = 0
        self._rest: tuple[int, float] | None = None
        self._rest_mm: float | None = None
        self._again = False

    def windows(self) -> Iterator[Window]:
        """The windows in order; the last one ends the section. Raises SectionPlanError."""
        while True:
            window = self._next()
            yield window
            if self._again:
                self._again = False
                continue
            if self._rest is not None:
                self._begin_at_rest(*self._rest)
            elif window.rests and self.at_end(window):
                return
            else:
                self._advance(window)
            self._drop()

    @property
    def begins_at_rest(self) -> bool:
        """Whether the present window begins at rest."""
        return self._moving is None

    def at_end(self, window: Window) -> bool:
        """Whether a window ends where the section does."""
        return self.path.complete and window.stretch.end_q40 == int(self.path.start_q40[-1])

    def rest_at(self, end_q40: int, last_s: float) -> None:
        """Lets the next window begin at rest at this end of a segment, in place of the end of the present window;
        `last_s`: duration of the piece before.
        """
        self._rest = end_q40, last_s

    def halve(self, window: Window) -> bool:
        """Lets the present window, of which no chunk is made yet, be planned again, to a rest within the first half of
        its kept part. False: it begins in motion, or keeps one segment.
        """
        ends, low = self.path.curve.segment_starts_mm, self._low_mm + _SAME_MM
        first = int(np.searchsorted(ends, low, side="right"))
        half = int(np.searchsorted(ends, 0.5 * (low + window.end_mm), side="right")) - 1
        end_mm = float(ends[max(first, half)])
        if self._moving is not None or end_mm > window.end_mm - _SAME_MM:
            return False
        self._rest_mm, self._again = end_mm, True
        return True

    def _begin_at_rest(self, low_q40: int, before_s: float) -> None:
        at = int(np.searchsorted(self.path.start_q40, low_q40))
        self._low_q40, self._low_mm = low_q40, float(self.path.curve.segment_starts_mm[at])
        self._before_s, self._rest, self._rest_mm = before_s, None, None
        self._last, self._held, self._moving = None, None, None

    def _advance(self, window: Window) -> None:
        found, count = window.solution, window.count
        self._last, self._wanted_s = window, min(2.0 * self._wanted_s, WINDOW_S)
        self._rest_mm = None
        self._low_mm = window.end_mm
        self._low_q40 = window.joint_q40(count)
        self._before_s = last_s(window.stretch.pieces, count)
        if window.rests:
            self._held, self._moving = None, None
            return
        self._held = found
        self._moving = State(float(found.q[count]), float(found.slope[count]))

    def forget(self, segment: int) -> None:
        """Releases the segments of the section before this one at the end of the present window."""
        self._needed = segment

    def _drop(self) -> None:
        """Removes the released segments."""
        passed_mm = self.path.drop(self._needed - self.path.passed)
        self._low_mm -= passed_mm
        if self._held is not None and passed_mm > 0.0:
            self._held = _shifted(self._held, passed_mm)

    def _next(self) -> Window:
        self._read()
        limits, given = self._limits()
        high, stop_s = self._high(limits)
        if self._rest_mm is not None:
            high = self._rest_mm
        found = self._solved(limits, high, stop_s)
        if found is None:
            return self._to_rest(limits, given)
        made, bad = self.lowered(
            found,
            lambda one: self._window(one, limits, given, high, stop_s),
            lambda window: (window.stretch, window.count),
            _with_stretch,
        )
        if self._moving is not None and bad[: made.count].any():
            return self._to_rest(limits, given)
        return made

    def lowered(
        self,
        found: Solution,
        made: Callable[[Solution], _Made],
        stretch_of: Callable[[_Made], tuple[Stretch, int]],
        with_stretch: Callable[[_Made, Stretch], _Made],
        steps: Sequence[float] = _LOWERED,
    ) -> tuple[_Made, NDArray[np.bool_]]:
        """What `made` makes of a solution: first with lower limits on intervals that the controller would refuse, then
        with lower override bounds of these pieces; and the pieces (M,) that it would still refuse. `stretch_of` gives
        the pieces of that, and how many of them are kept; `with_stretch` the same with other pieces.
        """
        tight, out = np.ones(found.grid.size), made(found)
        stretch, count = stretch_of(out)
        over = self._exceeded(stretch)
        for step in steps:
            if not over.pieces[:count].any():
                return out, over.pieces
            bad = over.pieces
            tight[bad | np.append(bad[1:], False) | np.append(False, bad[:-1])] *= step
            lower = tightened(found, tight)
            if lower is None:
                break
            found = lower
            out = made(found)
            stretch, count = stretch_of(out)
            over = self._exceeded(stretch)
        for fewer in _FEWER_CODES:
            if not (over.pieces[:count].any() and over.by_override.any()):
                break
            out = with_stretch(out, _with_fewer_codes(stretch, over.by_override, fewer))
            stretch, count = stretch_of(out)
            over = self._exceeded(stretch)
        return out, over.pieces

    def _window(
        self,
        found: Solution,
        limits: PlanLimits,
        given: tuple[FeedRequest, Limits, Plants | None],
        high: float,
        stop_s: float,
    ) -> Window:
        complete = high >= self.path.curve.length_mm and self.path.complete
        rests = complete or self._rest_mm is not None
        count = found.grid.size if rests else kept(found, stop_s)
        joints = self._joints(found, count)
        marks = found.grid.s[list(joints)]
        track = make_track(
            begun(ends_of(found, found.grid.size), self._moving),
            1.0,
            np.concatenate((self.path.curve.segment_starts_mm, marks)),
        )
        plan = self._plan(given, track)
        stretch = self.stretch(track, plan, self._low_q40)
        end_mm = float(found.grid.s[count])
        return Window(found, limits, plan, stretch, count, joints, rests, end_mm)

    def _to_rest(
        self, limits: PlanLimits, given: tuple[FeedRequest, Limits, Plants | None]
    ) -> Window:
        """The remainder of the last window, to its rest: no feed was found that continues in motion."""
        last, held = self._last, self._held
        assert last is not None
        assert held is not None
        first = last.first + last.count
        pieces = last.stretch.pieces.part(slice(last.count, None))
        stretch, count = Stretch(pieces, last.stretch.end_q40), len(pieces)
        return Window(
            held,
            limits,
            self._plan(given, last.plan.curve),
            stretch,
            count,
            self._joints(held, count, first),
            rests=True,
            end_mm=float(held.grid.s[-1]),
            first=first,
        )

    def _read(self) -> None:
        """Reads blocks until the known path takes longer than a window."""
        while not self.path.complete:
            if self.path.count and self._ahead_s() > self._wanted_s * (1.0 + _END_SHARE):
                return
            self.read_more()

    def read_more(self) -> bool:
        """Reads a block; False: there is none."""
        block = None if self.path.complete else next(self._blocks, None)
        if block is None:
            self.path.complete = True
            return False
        self.path.append(block)
        return True

    def _estimate(self, limits: PlanLimits) -> _Estimate:
        """The estimate for the whole known path; made again when more of it is read, or for the next window."""
        key = (self.path.passed + self.path.count, self._low_q40)
        if self._estimated is None or self._estimated[0] != key:
            self._estimated = key, self._estimate_of(limits)
        return self._estimated[1]

    def _estimate_of(self, limits: PlanLimits) -> _Estimate:
        curve, moving = self.path.curve, self._moving
        length = curve.length_mm
        if length - self._low_mm < 1e-6:
            return _Estimate(np.array([self._low_mm, length]), np.zeros(2), 0.0)
        q = None if moving is None else moving.q
        found = first_estimate(curve, limits, self._low_mm, length, q, self.period_s)
        return _Estimate(found.s, found.t, stopping_s(limits, float(np.sqrt(found.q.max()))))

    def _ahead_s(self) -> float:
        found = self._estimate(self._limits()[0])
        return float(found.t[-1]) - (_STOPS + 2.0) * found.stop_s

    def _high(self, limits: PlanLimits) -> tuple[float, float]:
        """The end of the next window, at an end of a segment, and the stopping time."""
        found = self._estimate(limits)
        s, t, stop_s = found.s, found.t, found.stop_s
        wanted_s = self._wanted_s + _STOPS * stop_s
        curve = self.path.curve
        if self.path.complete and t[-1] < wanted_s * (1.0 + _END_SHARE):
            return curve.length_mm, stop_s
        ends = curve.segment_starts_mm
        at = int(np.searchsorted(ends, float(np.interp(wanted_s, t, s))))
        return float(ends[min(at, ends.size - 1)]), stop_s

    def _limits(self) -> tuple[PlanLimits, tuple[FeedRequest, Limits, Plants | None]]:
        machine = self.machine
        nominal, zones = self.path.feeds(machine.feed_mm_s)
        limits = Limits(zones=zones, reserve=RESERVE).on_machine(
            machine.path_names, axis_limits(machine), machine.path_units
        )
        limits = limits.of_axes(self.path.curve.axes)
        request, own = FeedRequest(OPTIMAL, nominal), plants(machine, limits)
        found = gather(request, limits, controller_limits(machine), own, machine.period_us)
        return found, (request, limits, own)

    def _plan(self, given: tuple[FeedRequest, Limits, Plants | None], track: FeedCurve) -> FeedPlan:
        request, limits, own = given
        machine = self.machine
        bounds = PathBounds(self.path.curve, limits, own)
        controller = controller_limits(machine)
        return FeedPlan(request, limits, controller, machine.period_us, track, paths=(bounds,))

    def _solved(self, limits: PlanLimits, high: float, stop_s: float) -> Solution | None:
        """The window to `high`, from rest or from the state at the end of the last one. None: no feed was found in
        motion.
        """
        curve, low, moving = self.path.curve, self._low_mm, self._moving
        held = self._held
        if moving is None:
            # Without zones: there are many of them, and none is below the least feed.
            check_feasible(curve, replace(limits, zones=()), LONGEST_S)
            limits = within_reach(curve, limits)
        limits = replace(limits, zones=touched(limits.zones, low, high))
        known_to = 0.0 if held is None else trusted_to(held, stop_s)
        for share in (0.0, *_EASED):
            tried = limits if share == 0.0 else limits.eased(max(self.period_s, share * stop_s))
            with suppress(FloatingPointError):
                found = plan_window(
                    curve,
                    tried,
                    low,
                    high,
                    moving,
                    self.period_s,
                    held,
                    known_to,
                    before_s=self._before_s,
                    effort=self._effort if self._rest_mm is None else TAIL_EFFORT,
                )
                if found is not None:
                    return measured(curve, found)
        if moving is None:
            line = self.path.line_at(self._low_q40)
            raise SectionPlanError(line, "the planner found no feed: please report this file")
        return None

    def _joints(self, found: Solution, count: int, first: int = 0) -> tuple[int, ...]:
        """Knots for joints up to `count`, counted from knot `first`: JOINTS of them for each chunk, at equal steps of
        time or of bytes, whichever needs more chunks.
        """
        part = slice(first, first + count + 1)
        t = np.concatenate((np.zeros(1), np.cumsum(found.times)))[part]
        segments = np.searchsorted(self.path.curve.segment_starts_mm, found.grid.s[part])
        own = np.arange(count + 1) * COMPACT_PIECE_BYTES + segments * segment_size(
            self.path.curve.axes, compact=True
        )
        own = own + EVENT.itemsize * self.path.events_before(found.grid.s[part])
        share = np.maximum((t - t[0]) / self._joint.time_s, (own - own[0]) / self._joint.bytes)
        parts = JOINTS * max(1, ceil(float(share[-1]) - _SLIGHTLY_MORE))
        at = np.searchsorted(share, share[-1] * np.arange(1, parts) / parts)
        inner = [int(k) for k in np.unique(at) if 2 < k < count - 2]
        return (*inner, count)

    def stretch(self, track: Track, plan: FeedPlan, start_q40: int) -> Stretch:
        """The feed pieces of a track that begins at an arc length of the section."""
        path = self.path
        base = int(path.start_q40[0])
        joints = path.start_q40 - base
        starts = to_q40(track.s)
        near = joints[np.clip(np.searchsorted(joints, starts - _DRIFT_Q40), 0, joints.size - 1)]
        moved = np.isin(track.s, path.curve.segment_starts_mm) & (
            np.abs(near - starts) <= _DRIFT_Q40
        )
        starts = np.where(moved, near, starts)
        starts[0] = start_q40 - base
        c = round_pieces(track.t_q32, starts, track.shape)
        raw = RawPieces(np.diff(track.t_q32), starts[:-1], c, 0.0, 0.0)
        zones = touched(plan.limits.zones, float(track.s[0]), float(track.s[-1]))
        limits = replace(plan.limits, zones=zones)
        paths = [replace(one, limits=replace(one.limits, zones=zones)) for one in plan.paths]
        own = with_override(raw, plan.controller, limits, paths)
        return Stretch(replace(own, start_q40=own.start_q40 + base), int(starts[-1]) + base)


def _with_stretch(window: Window, stretch: Stretch) -> Window:
    return replace(window, stretch=stretch)


def _with_fewer_codes(stretch: Stretch, bad: NDArray[np.bool_], fewer: int) -> Stretch:
    """Some pieces (M,) with lower override bounds; what they leave of the axis limits is found from samples, and the
    controller's proof may find less between them.
    """
    pieces = stretch.pieces
    by = np.where(bad, fewer, 0)[:, None]
    rate, second = (
        np.where(codes > by, codes - by, np.minimum(codes, 1)).astype(np.uint8)
        for codes in (pieces.override_rate_codes, pieces.override_second_codes)
    )
    lower = replace(pieces, override_rate_codes=rate, override_second_codes=second)
    return replace(stretch, pieces=lower)


def last_s(pieces: FeedPieces, count: int) -> float:
    """Duration of the last of the first `count` pieces."""
    return float(pieces.duration_q32_s[count - 1]) * 2.0**-32


def touched(zones: tuple[FeedZone, ...], low: float, high: float) -> tuple[FeedZone, ...]:
    """The zones that meet an interval of arc length."""
    return tuple(zone for zone in zones if zone.from_mm <= high and zone.to_mm >= low)


def begun(ends: Ends, state: State | None) -> Ends:
    """The ends, begun in exactly this state; None: at rest."""
    if state is not None:
        ends.feed[0], ends.acceleration[0] = np.sqrt(state.q), 0.5 * state.slope
    return ends


def _shifted(found: Solution, passed_mm: float) -> Solution:
    """The solution on a curve whose first `passed_mm` are removed."""
    grid = found.grid
    x0 = np.where(grid.grade == 0, grid.x0 - passed_mm, grid.x0)
    return replace(found, grid=replace(grid, s=grid.s - passed_mm, x0=x0))
