# SPDX-License-Identifier: MIT
"""A section as a chain of chunks: every piece is planned once, and has the same bits in all chunks that hold it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from itertools import tee

import numpy as np
from numpy.typing import NDArray

from ..config import Machine
from ..errors import PlanError
from ..events import EVENT
from ..feed import FeedZone
from ..feed.pieces import FeedPieces
from ..native.program import NativeFault, NativeLimits, NativeProgram
from ..pipeline import program_limits, stop_terms
from ..program.check import REACH_Q40, brief_pairs
from ..program.codes import ProgramError
from ..program.image import COMPACT_PIECE_BYTES, Program, encode, segment_size
from ..program.stop_planning import stop_codes, with_bounds, without_long_stops
from ..program.stops import DECELERATION, no_stops
from .chunk import HEADER_SIZE, LEAST_SHARED_PIECES, Chunk, ChunkHeader, Rest
from .geometry import Block
from .windows import (
    JOINTS,
    SectionFeed,
    Spacing,
    Stretch,
    Window,
    chained,
    last_s,
    taken,
)

Codes = NDArray[np.uint8]
Real = NDArray[np.float64]
Index = NDArray[np.intp]

CHUNK_S = 1.0
"""New motion of a chunk."""

CHUNK_BYTES = 24 * 1024 - 64
"""The largest chunk, where a third of the ring is more."""

_NEW_SHARE = 0.4
"""Of these bytes, for what is new. The rest is for the repeated part and the tail, and a ring that is full has room
sooner for a smaller chunk.
"""

LATENESS_S, SHARED_S = 0.02, 0.1
"""A takeover may be so late without effect on any change of the override, and on a motion at 100 %."""

RAMP_S = 0.2
"""Fewer pieces than LEAST_SHARED_PIECES are shared where they last so long: a change of the override whose ramp takes
longer delays the takeover.
"""

FEWEST_SHARED_PIECES = 4
"""Shared where LEAST_SHARED_PIECES take more bytes than a chunk may have: pieces that are long, with many segments. A
change of the override that looks further then delays the takeover; a motion at 100 % is the same."""

SEARCH_S, GAP_S = 0.02, 0.06
"""Stops may begin about so often, and all pieces are searched where they may not for so long."""

_TAIL_SHARE = 0.8
"""Of the last tail: a chunk for whose tail there is less room is not planned."""

_LONGEST_NAME = 32
_MOVING_FAULTS = frozenset(
    (
        ProgramError.FEED,
        ProgramError.ACCELERATION,
        ProgramError.JERK,
        ProgramError.OVERRIDE,
        ProgramError.AXIS_VELOCITY,
        ProgramError.AXIS_ACCELERATION,
        ProgramError.AXIS_JERK,
        ProgramError.AXIS_STEP,
    )
)
"""What a slower feed at a piece avoids."""

_MOST_EXCEEDED = 8
"""Pieces that are looked for at once whose motion the controller would refuse: each one needs a check of those after it."""

_REFUSED_TAILS = _MOVING_FAULTS | {ProgramError.SEGMENT_SHORT, ProgramError.PIECE_SHORT}
"""What another tail avoids."""


@dataclass(frozen=True, eq=False)
class JobPlace:
    """Where a section stands in its job, when others are before it.

    rest       what happens at rest before it
    sequence   of its first chunk
    arc_q40    arc length of the job at its start
    point_q40  (A,) where the section before it ends
    """

    rest: Rest
    sequence: int
    arc_q40: int
    point_q40: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PlannedChunk:
    """A chunk, and what it brings.

    new_s     motion from the joint before to its own joint; of the last one, to the end
    line      source line at its own joint
    arc_q40   arc length of the section at its own joint
    """

    chunk: Chunk
    new_s: float
    line: int
    arc_q40: int


@dataclass(frozen=True, eq=False)
class _Made:
    """What the next chunk has to know of the last one.

    first_segment, end_segment  numbers in the section of its first segment and of the one behind its last
    end_q40                     arc length of the section where its program ends
    pieces                      how many it has
    tail, tail_codes            its pieces behind the joint, with their stop codes
    """

    header: ChunkHeader
    first_segment: int
    end_segment: int
    end_q40: int
    pieces: int
    tail: FeedPieces
    tail_codes: Codes


@dataclass
class _Kept:
    """The pieces of the last chunk without its tail, with their stop codes; arc lengths are those of the section."""

    pieces: FeedPieces | None = None
    codes: Codes = field(default_factory=lambda: _no_codes(0))

    def with_new(self, pieces: FeedPieces, codes: Codes) -> _Kept:
        """With pieces behind them."""
        old = [] if self.pieces is None else [self.pieces]
        return _Kept(chained([*old, pieces]), np.concatenate((self.codes, codes)))

    def repeated(self, least: int) -> tuple[_Kept, int, int]:
        """The pieces that the next chunk repeats, `least` of them and what SHARED_S asks for; how many before them it
        does not, and their time in 2^-32 s.
        """
        if self.pieces is None:
            return self, 0, 0
        count = len(self.codes)
        times = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(self.pieces.duration_q32_s)))
        looked, fewest = (times[max(count - n, 0)] for n in (least, FEWEST_SHARED_PIECES))
        looked = min(max(looked, times[-1] - round(RAMP_S * 2**32)), fewest)
        late = min(looked - round(LATENESS_S * 2**32), times[-1] - round(SHARED_S * 2**32))
        shift = max(int(np.searchsorted(times, late, side="right")) - 1, 0)
        kept = _Kept(taken(self.pieces, slice(shift, None)), self.codes[shift:])
        return kept, shift, int(times[shift])


@dataclass
class _Searched:
    """Stop codes (M, 2, 3) of the pieces of a window."""

    window: Window

    def __post_init__(self) -> None:
        self.codes = _no_codes(len(self.window.stretch.pieces))


class _RefusedPartError(PlanError):
    """No chunk with the next part of the path is accepted."""


class _Tails:
    """Tails of a window, each planned once."""

    def __init__(self, feed: SectionFeed, window: Window) -> None:
        self._feed, self.window = feed, window
        self._made: dict[int, Iterator[Stretch]] = {}
        self._refused: list[Stretch] = []

    def behind(self, joint: int, least_q40: int) -> Iterator[Stretch]:
        """As SectionFeed.tails; `least_q40` is that of the first call for a joint."""
        made = self._made.get(joint) or self._feed.tails(self.window, joint, least_q40)
        self._made[joint], own = tee(made)
        return (tail for tail in own if not any(tail is one for one in self._refused))

    def refuse(self, tail: Stretch) -> None:
        """The controller would refuse the motion of a tail: it is not given again. The rest of the window is: behind it
        there is no other one.
        """
        if tail.end_q40 != self.window.stretch.end_q40:
            self._refused.append(tail)


class SectionChunks:
    """Makes the chunks of one section."""

    def __init__(
        self,
        machine: Machine,
        name: str,
        blocks: Iterator[Block],
        job: int,
        most_bytes: int = CHUNK_BYTES,
        begin_q40: int = 0,
        place: JobPlace | None = None,
        goes_on: Callable[[NDArray[np.int64]], bool] = lambda _: False,
    ) -> None:
        """`job`: number that the chunks carry; `most_bytes`: of a chunk, as the controller has room for; `begin_q40`:
        arc length of the section where the path of the blocks begins; `place`: None for the first section of a job;
        `goes_on`: whether the job goes on, after a rest, from this point (A,) in 2^-40 mm, the end of the section. It
        is asked when all blocks have been read.
        """
        self._place, self._goes_on = place, goes_on
        self.machine = machine
        self._name, self._job = name[:_LONGEST_NAME], job
        self._limits = NativeLimits(**asdict(program_limits(machine)), chunk=1)
        self._feed = SectionFeed(
            machine,
            blocks,
            Spacing(CHUNK_S, round(_NEW_SHARE * most_bytes)),
            self._exceeded,
            begin_q40,
            None if place is None else place.point_q40,
        )
        self._most = most_bytes
        self._kept = _Kept()
        self._alone_q40: int | None = None
        self._last: _Made | None = None
        self._searched: _Searched | None = None
        self._tail_bytes = 0
        self._rested_s = 0.0
        self.rest_lines: list[int] = []
        """Source lines at which the axes come to rest although the section goes on; grows with the chunks."""

    def chunks(self) -> Iterator[PlannedChunk]:
        """The chunks in order. Raises InputError and PlanError."""
        for window in self._feed.windows():
            first, joints = 0, list(window.joints)
            while joints:
                before = self._kept
                try:
                    planned, used = self._next(window, first, joints[:JOINTS])
                except _RefusedPartError:
                    self._kept = before
                    if first == 0 and self._begin_alone(window):
                        continue
                    if not self._rest() and not self._feed.halve(window):
                        raise
                    break
                yield planned
                first, joints = joints[used - 1], joints[used:]
            else:
                if window.rests and not self._feed.at_end(window):
                    self.rest_lines.append(self._feed.path.line_at(window.stretch.end_q40))
            if self._last is not None:
                self._feed.forget(self._last.first_segment)

    def _begin_alone(self, window: Window) -> bool:
        """Lets the next chunk begin at rest and share nothing, where the window begins at rest. Then it needs no bytes
        for what is before, and a short segment there does not limit the feed behind it. False: it does so already, or
        the window begins in motion.
        """
        begin_q40, last = int(window.stretch.pieces.start_q40[0]), self._last
        if last is None or self._kept.pieces is None or not self._feed.begins_at_rest:
            return False
        if last.end_q40 != begin_q40:
            return False
        self._kept, self._alone_q40 = _Kept(), begin_q40
        return True

    def _rest(self) -> bool:
        """Lets the axes rest at the end of the newest chunk, whose tail is then kept: no chunk goes on in motion. False
        where they rest there already, or the path ends there.
        """
        last, path = self._last, self._feed.path
        if last is None or not len(last.tail):
            return False
        if last.end_q40 == int(path.start_q40[-1]) and not self._feed.read_more():
            return False
        self._rested_s += last.tail.total_q32_s * 2.0**-32
        self.rest_lines.append(path.line_at(last.end_q40))
        self._kept = self._kept.with_new(last.tail, last.tail_codes)
        self._last = replace(last, tail=taken(last.tail, slice(0, 0)))
        self._feed.rest_at(last.end_q40, last_s(last.tail, len(last.tail)))
        return True

    def _next(self, window: Window, first: int, joints: list[int]) -> tuple[PlannedChunk, int]:
        """The chunk whose new pieces are those from knot `first` to the last one of these joints that there is room
        for, and which this is.
        """
        searched, before, tails = self._searched_in(window), self._kept, _Tails(self._feed, window)
        program, fault = None, None
        for used, least in [
            *((count, LEAST_SHARED_PIECES) for count in range(len(joints), 0, -1)),
            (1, FEWEST_SHARED_PIECES),
        ]:
            kept, piece_shift, time_shift = before.repeated(least)
            joint, new = joints[used - 1], slice(first, joints[used - 1])
            pieces = taken(window.stretch.pieces, new)
            self._kept = kept.with_new(pieces, searched.codes[new])
            kept_bytes = self._size_kept(window, joint)
            if used > 1 and kept_bytes + _TAIL_SHARE * self._tail_bytes > self._most:
                continue
            program, fault = self._with_tail(tails, joint, None)
            for thorough in (False, True):
                if fault is None or fault.code != ProgramError.STOP_LONG:
                    break
                self._search_kept(window, joint, fault.index if thorough else None)
                program, fault = self._with_tail(tails, joint, thorough)
            if fault is None and program.image_size + HEADER_SIZE <= self._most:
                break
        assert program is not None
        header = self._header(window, joint, program)
        if self._last is not None and header.rest is None:
            # One piece of the predecessor at least is behind the joint (docs/reference/protocol.md 1.7).
            shared = min(len(kept.codes), self._last.pieces - piece_shift - 1)
            header = replace(
                header, piece_shift=piece_shift, time_shift_q32_s=time_shift, shared_pieces=shared
            )
        self._require_room(program, header.line)
        if fault is not None and fault.code == ProgramError.EVENT_DENSE:
            raise PlanError(
                f"line {header.line}: more than 16 outputs switch within the distance of a tick at 200 %: "
                "lower the feed there, or switch fewer outputs at one place"
            )
        if fault is not None:
            raise _RefusedPartError(
                f"line {header.line}: the controller would refuse this part: {fault.text} "
                f"(code {fault.code}): lower the feed there, and please report this file"
            )
        self._last = self._made(header, program)
        self._tail_bytes = program.image_size + HEADER_SIZE - kept_bytes
        joint_q40 = window.joint_q40(joint)
        line = self._feed.path.line_at(joint_q40)
        new_s, self._rested_s = self._rested_s + pieces.total_q32_s * 2.0**-32, 0.0
        return PlannedChunk(
            Chunk(self._in_job(header), encode(program)), new_s, line, joint_q40
        ), used

    @property
    def end(self) -> JobPlace:
        """The place of the next section of the job, behind all chunks, without a rest."""
        last = self._last
        assert last is not None
        header = self._in_job(last.header)
        arc_q40 = header.job_start_q40 - last.header.job_start_q40 + last.end_q40
        return JobPlace(Rest(), header.sequence + 1, arc_q40, self._feed.path.end_point_q40)

    def _in_job(self, header: ChunkHeader) -> ChunkHeader:
        """A header that counts from the start of the section, as it is in the job."""
        place = self._place
        if header.last and self._goes_on(self._feed.path.end_point_q40):
            header = replace(header, last=False, joined=True)
        if place is None:
            return header
        return replace(
            header,
            first=False,
            rest=place.rest if header.first else header.rest,
            sequence=header.sequence + place.sequence,
            job_start_q40=header.job_start_q40 + place.arc_q40,
        )

    def _size_kept(self, window: Window, joint: int) -> int:
        """Bytes of a chunk of the kept pieces, without its tail."""
        path, pieces = self._feed.path, self._kept.pieces
        assert pieces is not None
        first = path.segment_at(int(pieces.start_q40[0]))
        joint_q40 = window.joint_q40(joint)
        segments = path.segment_at(joint_q40) + 1 - first
        events = len(path.events_on(int(path.start_q40[first]), joint_q40))
        size = HEADER_SIZE + len(pieces) * COMPACT_PIECE_BYTES
        size += segments * segment_size(path.curve.axes, compact=True)
        return size + EVENT.itemsize * events

    def _require_room(self, program: Program, line: int) -> None:
        size = program.image_size + HEADER_SIZE
        if size > self._most:
            raise _RefusedPartError(
                f"line {line}: a part of the path that the controller needs at once takes {size} bytes, and it takes "
                f"{self._most}: raise --tolerance, lower the feed there, or give the controller more memory"
            )

    def _header(self, window: Window, joint: int, program: Program) -> ChunkHeader:
        """The header, without what it says of shared pieces."""
        last, path = self._last, self._feed.path
        assert self._kept.pieces is not None
        begin_q40 = int(self._kept.pieces.start_q40[0])
        segment = path.segment_at(begin_q40)
        header = ChunkHeader(
            first=last is None,
            last=window.rests and joint == window.count and self._feed.at_end(window),
            job=self._job,
            sequence=0 if last is None else last.header.sequence + 1,
            job_start_q40=int(path.start_q40[segment]),
            line=path.line_at(begin_q40),
            rest=None if last is None or begin_q40 != last.end_q40 else Rest(),
        )
        if last is None or header.rest is not None:
            return header
        number = path.passed + segment
        return replace(
            header,
            segment_shift=number - last.first_segment,
            shared_segments=last.end_segment - number,
            arc_shift_q40=header.job_start_q40 - last.header.job_start_q40,
        )

    def _made(self, header: ChunkHeader, program: Program) -> _Made:
        path = self._feed.path
        first = path.passed + path.segment_at(header.job_start_q40)
        end_q40 = header.job_start_q40 + program.length_q40
        end = first + program.segment_count
        tail = slice(len(self._kept.codes), None)
        pieces = taken(program.pieces, tail)
        pieces = replace(pieces, start_q40=pieces.start_q40 + header.job_start_q40)
        return _Made(
            header, first, end, end_q40, program.piece_count, pieces, program.stops.codes[tail]
        )

    def _with_tail(
        self, tails: _Tails, joint: int, thorough: bool | None
    ) -> tuple[Program, NativeFault | None]:
        """The program of the kept pieces with the first tail that the controller accepts, and what it finds in it.

        `thorough`: how stops are searched that begin in the tail; None: none are. It is at rest soon anyway.
        """
        kept, codes, window = self._kept.pieces, self._kept.codes, tails.window
        assert kept is not None
        if window.rests and joint == window.count:
            program = self._program_with_events(Stretch(kept, window.stretch.end_q40), codes)
            return program, self._fault(program)
        least_q40 = 0 if self._last is None else self._last.end_q40
        for tail in tails.behind(joint, least_q40):
            whole = Stretch(chained([kept, tail.pieces]), tail.end_q40)
            own = self._tail_codes(window, tail, thorough)
            program, fault = self._program_with_events(whole, np.concatenate((codes, own))), None
            if program.image_size + HEADER_SIZE > self._most:
                continue
            fault = self._fault(program)
            if fault is not None and fault.code == ProgramError.STOP_LONG:
                program = without_long_stops(program)
                fault = self._fault(program)
            if fault is None:
                break
            if fault.code in _REFUSED_TAILS:
                tails.refuse(tail)
            if fault.code == ProgramError.EVENT_DENSE:
                break
            if fault.code == ProgramError.STOP_LONG and not thorough:
                break  # more codes are the better remedy; with them, a longer tail has more room for brakes
        return program, fault

    def _program_with_events(self, stretch: Stretch, codes: Codes) -> Program:
        """The program of a chunk: `_program` with the events of its path."""
        program = self._program(stretch, codes)
        base_q40 = stretch.end_q40 - program.length_q40
        events = self._feed.path.events_on(base_q40, stretch.end_q40)
        if base_q40 == self._alone_q40:  # those at its start are at the end of the chunk before
            events = events[events["place"] > 0]
        return replace(program, events=events)

    def _program(self, stretch: Stretch, codes: Codes) -> Program:
        """A program of pieces from inside the path in memory to an end of a segment."""
        pieces, path, machine = stretch.pieces, self._feed.path, self.machine
        first = path.segment_at(int(pieces.start_q40[0]))
        end = int(np.searchsorted(path.start_q40, stretch.end_q40))
        base = int(path.start_q40[first])
        program = Program(
            name=self._name,
            period_us=machine.period_us,
            closed=False,
            duration_q32_s=pieces.total_q32_s,
            length_q40=stretch.end_q40 - base,
            offset_q40=tuple(round(mm * 2**40) for mm in machine.offset_mm),
            feed_limit_um_s=0,
            acceleration_limit_um_s2=0,
            jerk_limit_mm_s3=0,
            start_q40=path.start_q40[first:end] - base,
            point_q40=path.point_q40[:, first:end],
            a_q44=path.a_q44[:, first:end],
            extra_q40=path.extra_q40[:, first:end],
            pieces=replace(pieces, start_q40=pieces.start_q40 - base),
            stops=replace(no_stops(len(pieces)), codes=codes),
            moving=int(pieces.start_q40[0]) not in (self._feed.begin_q40, self._alone_q40),
            compact=True,
            first_axis=machine.first_axis,
        )
        return with_bounds(program)

    def _fault(self, program: Program) -> NativeFault | None:
        return NativeProgram(encode(program)).check(self._limits)

    def _exceeded(self, stretch: Stretch) -> NDArray[np.bool_]:
        """The pieces (M,) of a stretch that the controller would refuse for their motion: all of them, or where they
        are many, the first _MOST_EXCEEDED.
        """
        pieces = stretch.pieces
        codes = np.hstack((pieces.override_rate_codes, pieces.override_second_codes))
        bad = np.asarray((codes == 0).any(axis=1))
        if bad.any():
            return bad
        first = 0
        while first < len(pieces) and np.count_nonzero(bad) < _MOST_EXCEEDED:
            later = Stretch(taken(pieces, slice(first, None)), stretch.end_q40)
            program = self._program(later, _no_codes(len(later.pieces)))
            fault = self._fault(program)
            if fault is not None and fault.code == ProgramError.SEGMENT_SHORT:
                bad[first:] |= _on_short_segments(program)
            if fault is None or fault.code not in _MOVING_FAULTS:
                break
            first += fault.index + 1
            bad[first - 1] = True
        return bad

    def _searched_in(self, window: Window) -> _Searched:
        """Codes of the pieces of a window that are kept, good for all of the path that the window knows behind them.

        Of brief pieces only some are searched: a stop that is commanded in another one begins in the next that has
        codes, a little later.
        """
        if self._searched is not None and self._searched.window is window:
            return self._searched
        searched, count = _Searched(window), window.count
        durations = window.stretch.pieces.duration_q32_s[:count]
        seconds = np.ldexp(durations.astype(np.float64), -32)
        for spacing_s in (SEARCH_S, 0.0):
            found = np.asarray(searched.codes[:count, :, DECELERATION].all(axis=1))
            self._add_codes(searched, _spaced(seconds, spacing_s, found))
        self._searched = searched
        return searched

    def _add_codes(self, searched: _Searched, wanted: NDArray[np.bool_]) -> None:
        """Searches the wanted ones of the kept pieces (count,)."""
        if wanted.any():
            window, mask = searched.window, np.zeros(len(searched.codes), dtype=np.bool_)
            mask[: wanted.size] = wanted
            searched.codes[mask] = self._codes(window, window.stretch, mask, False)[mask]

    def _search_kept(self, window: Window, joint: int, late: int | None) -> None:
        """Searches all kept pieces that have no codes, before the path of the window behind their joint; thoroughly
        those from piece `late` on, whether they have codes or not.
        """
        kept, codes = self._kept.pieces, self._kept.codes
        assert kept is not None
        rest = taken(window.stretch.pieces, slice(joint, None))
        whole = Stretch(chained([kept, rest]), window.stretch.end_q40)
        count = _kinds(codes)
        wanted = count < codes.shape[1] if late is None else np.arange(len(codes)) >= late
        mask = np.concatenate((wanted, np.zeros(len(rest), dtype=np.bool_)))
        found = self._codes(window, whole, mask, late is not None)[: len(codes)]
        better = wanted & (_kinds(found) >= count)
        self._kept.codes = np.where(better[:, None, None], found, codes)

    def _tail_codes(self, window: Window, tail: Stretch, thorough: bool | None) -> Codes:
        """Codes of a tail that takes longer than a fault stop may."""
        if thorough is None:
            return _no_codes(len(tail.pieces))
        return self._codes(window, tail, np.ones(len(tail.pieces), dtype=np.bool_), thorough)

    def _codes(
        self, window: Window, stretch: Stretch, wanted: NDArray[np.bool_], thorough: bool
    ) -> Codes:
        path = self._feed.path
        program = self._program(stretch, _no_codes(len(stretch.pieces)))
        begin = path.segment_at(int(stretch.pieces.start_q40[0]))
        base_mm = float(path.curve.segment_starts_mm[begin])
        limits = window.plan.limits
        zones = zones_behind(limits.zones, base_mm)
        plan = replace(window.plan, limits=replace(limits, zones=zones))
        terms = replace(stop_terms(self.machine, limits), quick=not thorough)
        return stop_codes(program, plan, terms, wanted)


def _on_short_segments(program: Program) -> NDArray[np.bool_]:
    """The pieces (M,) that reach into two neighbouring segments which a tick at 200 % could pass."""
    ends = np.append(program.start_q40, program.length_q40)
    pairs, _, _ = brief_pairs(ends, program.pieces, program.period_us)
    starts = program.pieces.start_q40
    bad = np.zeros(len(starts), dtype=np.bool_)
    for pair in pairs.tolist():
        first = int(np.searchsorted(starts, ends[pair] - REACH_Q40, side="left")) - 1
        last = int(np.searchsorted(starts, ends[pair + 2] + REACH_Q40, side="right"))
        bad[max(first, 0) : last] = True
    return bad


def _spaced(seconds: Real, spacing_s: float, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pieces (M,) that are searched next: one in `spacing_s`; once some are found, all in gaps of GAP_S between."""
    t = np.concatenate((np.zeros(1), np.cumsum(seconds)))
    if spacing_s > 0.0:
        return np.asarray(np.diff(np.floor(t / spacing_s)) > 0.0)
    before = np.maximum.accumulate(np.where(found, t[1:], 0.0))
    after = np.minimum.accumulate(np.where(found, t[:-1], t[-1])[::-1])[::-1]
    return np.asarray((after - before > GAP_S) & ~found)


def _kinds(codes: Codes) -> Index:
    """Of how many kinds of stops each piece (M,) has codes."""
    return np.asarray(np.count_nonzero(codes[:, :, DECELERATION], axis=1))


def _no_codes(count: int) -> Codes:
    return np.zeros((count, 2, 3), dtype=np.uint8)


def zones_behind(zones: tuple[FeedZone, ...], base_mm: float) -> tuple[FeedZone, ...]:
    """Zones of the part of a path that begins at `base_mm`, as arc lengths of that part."""
    return tuple(
        FeedZone(max(zone.from_mm - base_mm, 0.0), zone.to_mm - base_mm, zone.feed_mm_s)
        for zone in zones
        if zone.to_mm > base_mm
    )
