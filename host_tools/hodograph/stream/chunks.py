# SPDX-License-Identifier: MIT
"""A section as a sequence of chunks (parts of a job): each piece is planned once and has the same bits in all chunks
that contain it; docs/reference/protocol.md 1.7. Used by plan.py, paths.py and cli/stream_command. Takes blocks of the
path from an iterator that may read the toolpath; no other I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..config import Machine
from ..errors import SectionPlanError
from ..events import EVENT
from ..feed.pieces import FeedPieces, joined_pieces
from ..fixed_point import nearest_q40
from ..machine_limits import program_limits
from ..native.program import NativeFault, NativeLimits, NativeProgram
from ..program.check import REACH_Q40, brief_pairs
from ..program.codes import ProgramError
from ..program.image import COMPACT_PIECE_BYTES, Program, encode, segment_size
from ..program.stop_planning import with_bounds, without_long_stops
from ..program.stops import no_stops
from .chunk import (
    ENOUGH_Q40,
    FARTHEST_Q40,
    HEADER_SIZE,
    LEAST_SHARED_PIECES,
    Chunk,
    ChunkHeader,
    Rest,
)
from .geometry import Block
from .stop_search import Codes, StopSearch, no_codes
from .tails import Tails
from .windows import (
    JOINTS,
    Exceeded,
    SectionFeed,
    Spacing,
    Stretch,
    Window,
    last_s,
)

CHUNK_S = 1.0
"""Most new motion of a chunk."""

CHUNK_BYTES = 24 * 1024 - 64
"""The largest chunk, however large the ring is."""

_NEW_SHARE = 0.4
"""Share of a chunk's bytes for its new part. The remainder is for the shared part and the tail. Smaller chunks fit
sooner into a full ring.
"""

LATENESS_S, SHARED_S = 0.02, 0.1
"""A takeover may be late by this without effect: LATENESS_S on an override ramp, SHARED_S on a motion at 100 %."""

RAMP_S = 0.2
"""Pieces that last this long in all are shared, even if they are fewer than LEAST_SHARED_PIECES. An override ramp that
takes longer delays the takeover.
"""

FEWEST_SHARED_PIECES = 4
"""Shared pieces if LEAST_SHARED_PIECES take too many bytes because they have many segments, or if the controller would
refuse the chunk with them. An override ramp with a larger look-ahead window then delays the takeover; a motion at 100 %
is not affected.
"""

_TAIL_SHARE = 0.8
"""A chunk is planned only if its tail has room for this share of the last tail's bytes."""

_LONGEST_NAME = 32
"""Characters of the name in a chunk."""
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
"""Faults that a lower feed at a piece avoids."""

_OVERRIDE_FAULTS = frozenset(
    (ProgramError.OVERRIDE, ProgramError.AXIS_ACCELERATION, ProgramError.AXIS_JERK)
)
"""Those of them that depend on the override bounds of a piece."""

_MOST_EXCEEDED = 8
"""Most pieces found at once whose motion the controller would refuse: each one needs a check of those after it."""

_REFUSED_TAILS = _MOVING_FAULTS | {ProgramError.SEGMENT_SHORT, ProgramError.PIECE_SHORT}
"""Faults that another tail avoids."""


@dataclass(frozen=True, eq=False)
class JobPlace:
    """The place of a section in its job, after other sections.

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
    """A chunk, and its new part.

    new_s     motion from the joint of its predecessor to its own; of the last chunk, to the end
    line      source line at its own joint
    arc_q40   arc length of the section at its own joint
    """

    chunk: Chunk
    new_s: float
    line: int
    arc_q40: int


@dataclass(frozen=True, eq=False)
class _Made:
    """What the next chunk needs of the last one.

    first_segment, end_segment  numbers in the section of its first segment and of the one after its last
    end_q40                     arc length of the section where its program ends
    pieces                      number of its pieces
    tail, tail_codes            its pieces after the joint, with their stop codes
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
    codes: Codes = field(default_factory=lambda: no_codes(0))

    def with_new(self, pieces: FeedPieces, codes: Codes) -> _Kept:
        """These pieces and new ones after them."""
        old = [] if self.pieces is None else [self.pieces]
        return _Kept(joined_pieces([*old, pieces]), np.concatenate((self.codes, codes)))

    def repeated(self, least: int) -> tuple[_Kept, int, int]:
        """The pieces that the next chunk repeats: about `least` of them, more where LATENESS_S and SHARED_S need it,
        fewer where RAMP_S allows it. Also the number of pieces before them, and the time of these in 2^-32 s.
        """
        if self.pieces is None:
            return self, 0, 0
        count = len(self.codes)
        times = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(self.pieces.duration_q32_s)))
        looked, fewest = (times[max(count - n, 0)] for n in (least, FEWEST_SHARED_PIECES))
        looked = min(max(looked, times[-1] - round(RAMP_S * 2**32)), fewest)
        late = min(looked - round(LATENESS_S * 2**32), times[-1] - round(SHARED_S * 2**32))
        shift = max(int(np.searchsorted(times, late, side="right")) - 1, 0)
        kept = _Kept(self.pieces.part(slice(shift, None)), self.codes[shift:])
        return kept, shift, int(times[shift])


class _RefusedPartError(SectionPlanError):
    """The controller would refuse each chunk with the next part of the path."""


@dataclass(frozen=True, eq=False)
class _Tried:
    """A chunk that was tried.

    fault             why the controller would refuse it; None: it accepts it
    used              number of joints that it uses
    repeated          the pieces that it repeats of its predecessor
    piece_shift       number of pieces before these, and `time_shift_q32_s` their time
    kept_bytes        its size without the tail
    new_q32_s         time of its new pieces
    """

    program: Program
    fault: NativeFault | None
    used: int
    repeated: _Kept
    piece_shift: int
    time_shift_q32_s: int
    kept_bytes: int
    new_q32_s: int


def _require_accepted(fault: NativeFault | None, line: int) -> None:
    """Raises SectionPlanError: the controller would refuse a chunk for this fault."""
    if fault is None:
        return
    if fault.code == ProgramError.EVENT_DENSE:
        raise SectionPlanError(
            line,
            "more than 16 outputs switch within the distance of a tick at 200 %: "
            "lower the feed there, or switch fewer outputs at one place",
        )
    raise _RefusedPartError(
        line,
        f"the controller would refuse this part: {fault.text} "
        f"(code {fault.code}): lower the feed there, and please report this file",
    )


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
        continues: Callable[[NDArray[np.int64]], bool] = lambda _: False,
    ) -> None:
        """name of the programs
        job         number of the job in the chunks
        most_bytes  greatest size of a chunk
        begin_q40   arc length of the section where the blocks begin
        place       place in the job; None: the section is the first one
        continues   whether the job continues after a rest at this point (A,) in 2^-40 mm, the end of the section;
                    called when all blocks have been read
        """
        self._place, self._continues = place, continues
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
        self._search = StopSearch(machine, self._feed, self._program)
        self._tail_bytes = 0
        self._rested_s = 0.0
        self.rest_lines: list[int] = []
        """Source lines at which the axes come to rest within the section; grows with the chunks."""

    def chunks(self) -> Iterator[PlannedChunk]:
        """The chunks in order. Raises InputError and SectionPlanError."""
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
                    if self._tail_ends_section():
                        yield self._closing()
                        return
                    if not self._rest() and not (first == 0 and self._feed.halve(window)):
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
        """Lets the next chunk begin at rest and share nothing, if the window begins at rest. The chunk then needs no
        bytes for the part before, and a short segment there does not limit its feed. False: it shares nothing already,
        or the window begins in motion.
        """
        begin_q40, last = int(window.stretch.pieces.start_q40[0]), self._last
        if last is None or self._kept.pieces is None or not self._feed.begins_at_rest:
            return False
        if last.end_q40 != begin_q40:
            return False
        self._kept, self._alone_q40 = _Kept(), begin_q40
        return True

    def _tail_ends_section(self) -> bool:
        """Whether the newest chunk has a tail, and the tail ends where the section does."""
        last, path = self._last, self._feed.path
        if last is None or not len(last.tail) or last.end_q40 != int(path.start_q40[-1]):
            return False
        return not self._feed.read_more()

    def _closing(self) -> PlannedChunk:
        """The last chunk of the section, if the controller accepts no other: its new pieces are the tail of the newest
        chunk. Raises SectionPlanError.
        """
        last, before = self._last, self._kept
        assert last is not None
        repeated, piece_shift, time_shift = before.repeated(LEAST_SHARED_PIECES)
        self._kept = repeated.with_new(last.tail, last.tail_codes)
        assert self._kept.pieces is not None
        stretch = Stretch(self._kept.pieces, last.end_q40)
        program, fault = self._without_long_stops(
            self._program_with_events(stretch, self._kept.codes)
        )
        size = program.image_size + HEADER_SIZE  # there is no tail
        tried = _Tried(
            program, fault, 1, repeated, piece_shift, time_shift, size, last.tail.total_q32_s
        )
        return self._finished(tried, last.end_q40, is_last=True)

    def _rest(self) -> bool:
        """Lets the axes come to rest at the end of the newest chunk, whose tail is then kept, because no chunk
        continues in motion. False: they rest there already.
        """
        last, path = self._last, self._feed.path
        if last is None or not len(last.tail):
            return False
        self._rested_s += last.tail.total_q32_s * 2.0**-32
        self.rest_lines.append(path.line_at(last.end_q40))
        self._kept = self._kept.with_new(last.tail, last.tail_codes)
        self._last = replace(last, tail=last.tail.part(slice(0, 0)))
        self._feed.rest_at(last.end_q40, last_s(last.tail, len(last.tail)))
        return True

    def _next(self, window: Window, first: int, joints: list[int]) -> tuple[PlannedChunk, int]:
        """The chunk whose new pieces go from knot `first` to the last of these joints for which there is room, and the
        number of joints that it uses. Raises SectionPlanError.
        """
        tried = self._largest(window, first, joints)
        joint = joints[tried.used - 1]
        is_last = window.rests and joint == window.count and self._feed.at_end(window)
        return self._finished(tried, window.joint_q40(joint), is_last=is_last), tried.used

    def _finished(self, tried: _Tried, arc_q40: int, *, is_last: bool) -> PlannedChunk:
        """The chunk that was tried, whose joint is at this arc length. Raises SectionPlanError: it does not fit, or the
        controller would refuse it.
        """
        program = tried.program
        header = self._shared(self._header(is_last, program), tried)
        self._require_room(program, header.line)
        _require_accepted(tried.fault, header.line)
        self._last = self._made(header, program)
        self._tail_bytes = program.image_size + HEADER_SIZE - tried.kept_bytes
        new_s, self._rested_s = self._rested_s + tried.new_q32_s * 2.0**-32, 0.0
        line = self._feed.path.line_at(arc_q40)
        return PlannedChunk(Chunk(self._in_job(header), encode(program)), new_s, line, arc_q40)

    def _largest(self, window: Window, first: int, joints: list[int]) -> _Tried:
        """The chunk with the most of these joints that fits and that the controller accepts; if there is none, the last
        one tried. `self._kept` has its pieces then.
        """
        searched, before, tails = (
            self._search.of_window(window),
            self._kept,
            Tails(self._feed, window),
        )
        tried = None
        for used, least in [
            *((count, LEAST_SHARED_PIECES) for count in range(len(joints), 0, -1)),
            (1, FEWEST_SHARED_PIECES),
        ]:
            repeated, piece_shift, time_shift = before.repeated(least)
            joint, new = joints[used - 1], slice(first, joints[used - 1])
            pieces = window.stretch.pieces.part(new)
            self._kept = repeated.with_new(pieces, searched[new])
            kept_bytes = self._size_kept(window, joint)
            if used > 1 and kept_bytes + _TAIL_SHARE * self._tail_bytes > self._most:
                continue
            program, fault = self._with_stops(tails, joint)
            new_q32_s = pieces.total_q32_s
            tried = _Tried(
                program, fault, used, repeated, piece_shift, time_shift, kept_bytes, new_q32_s
            )
            if fault is None and program.image_size + HEADER_SIZE <= self._most:
                break
        assert tried is not None
        return tried

    def _with_stops(self, tails: Tails, joint: int) -> tuple[Program, NativeFault | None]:
        """`_with_tail`; where fault stops would be late, with more stop parameters."""
        program, fault = self._with_tail(tails, joint, None)
        for thorough in (False, True):
            if fault is None or fault.code != ProgramError.STOP_LONG:
                break
            kept, late = self._kept, fault.index if thorough else None
            assert kept.pieces is not None
            kept.codes = self._search.of_kept(tails.window, joint, kept.pieces, kept.codes, late)
            program, fault = self._with_tail(tails, joint, thorough)
        return program, fault

    @property
    def end(self) -> JobPlace:
        """The place of the next section of the job, after all chunks; its rest is empty."""
        last = self._last
        assert last is not None
        header = self._in_job(last.header)
        arc_q40 = header.job_start_q40 - last.header.job_start_q40 + last.end_q40
        return JobPlace(Rest(), header.sequence + 1, arc_q40, self._feed.path.end_point_q40)

    def _in_job(self, header: ChunkHeader) -> ChunkHeader:
        """The header in the job of a header that counts from the start of the section."""
        place = self._place
        if header.last and self._job_continues():
            header = replace(header, last=False, joined=True)
        if place is None:
            return header
        job_start_q40 = header.job_start_q40 + place.arc_q40
        if job_start_q40 >= FARTHEST_Q40:
            raise SectionPlanError(
                header.line,
                "the section is longer than 2 km, and 4 km with those before it: divide it by a dwell (G4 P0)",
            )
        return replace(
            header,
            first=False,
            rest=place.rest if header.first else header.rest,
            sequence=header.sequence + place.sequence,
            job_start_q40=job_start_q40,
        )

    def _job_continues(self) -> bool:
        """Whether the controller's job continues after the section: unless it is long enough."""
        before_q40 = 0 if self._place is None else self._place.arc_q40
        path = self._feed.path
        if before_q40 + int(path.start_q40[-1]) >= ENOUGH_Q40:
            return False
        return self._continues(path.end_point_q40)

    def _size_kept(self, window: Window, joint: int) -> int:
        """Bytes of a chunk with the kept pieces and no tail."""
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
                line,
                f"a part of the path that the controller needs at once takes {size} bytes, and it takes "
                f"{self._most}: raise --tolerance, lower the feed there, or give the controller more memory",
            )

    def _shared(self, header: ChunkHeader, tried: _Tried) -> ChunkHeader:
        """The header with its fields of shared pieces. At least one piece of the predecessor is after the joint
        (docs/reference/protocol.md 1.7).
        """
        if self._last is None or header.rest is not None:
            return header
        return replace(
            header,
            piece_shift=tried.piece_shift,
            time_shift_q32_s=tried.time_shift_q32_s,
            shared_pieces=min(len(tried.repeated.codes), self._last.pieces - tried.piece_shift - 1),
        )

    def _header(self, is_last: bool, program: Program) -> ChunkHeader:
        """The header, still without its fields of shared pieces. `is_last`: the section ends with this chunk."""
        last, path = self._last, self._feed.path
        assert self._kept.pieces is not None
        begin_q40 = int(self._kept.pieces.start_q40[0])
        segment = path.segment_at(begin_q40)
        header = ChunkHeader(
            first=last is None,
            last=is_last,
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
        pieces = program.pieces.part(tail)
        pieces = replace(pieces, start_q40=pieces.start_q40 + header.job_start_q40)
        return _Made(
            header, first, end, end_q40, program.piece_count, pieces, program.stops.codes[tail]
        )

    def _with_tail(
        self, tails: Tails, joint: int, thorough: bool | None
    ) -> tuple[Program, NativeFault | None]:
        """The program of the kept pieces with the first tail that the controller accepts; if it accepts none, with the
        last one tried and its fault.

        thorough  whether stops that begin in the tail are searched with all trials; None: they are not searched, since
                  the tail comes to rest soon anyway
        """
        kept, codes, window = self._kept.pieces, self._kept.codes, tails.window
        assert kept is not None
        if window.rests and joint == window.count:
            program = self._program_with_events(Stretch(kept, window.stretch.end_q40), codes)
            return program, self._fault(program)
        least_q40 = 0 if self._last is None else self._last.end_q40
        for tail in tails.after(joint, least_q40):
            whole = Stretch(joined_pieces([kept, tail.pieces]), tail.end_q40)
            own = self._search.of_tail(window, tail, thorough)
            program, fault = self._program_with_events(whole, np.concatenate((codes, own))), None
            if program.image_size + HEADER_SIZE > self._most:
                continue
            program, fault = self._without_long_stops(program)
            if fault is None:
                break
            if fault.code in _REFUSED_TAILS:
                tails.refuse(tail)
            if fault.code == ProgramError.EVENT_DENSE:
                break
            if fault.code == ProgramError.STOP_LONG and not thorough:
                break  # more stop parameters are the better remedy; with them, a longer tail has more places for stops
        return program, fault

    def _program_with_events(self, stretch: Stretch, codes: Codes) -> Program:
        """The program of a chunk: `_program` and the events of its path."""
        program = self._program(stretch, codes)
        base_q40 = stretch.end_q40 - program.length_q40
        events = self._feed.path.events_on(base_q40, stretch.end_q40)
        if base_q40 == self._alone_q40:  # events at its start are in the chunk before
            events = events[events["place"] > 0]
        return replace(program, events=events)

    def _program(self, stretch: Stretch, codes: Codes) -> Program:
        """A program of pieces on the path in memory, to an end of a segment."""
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
            offset_q40=tuple(nearest_q40(mm) for mm in machine.offset_mm),
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

    def _without_long_stops(self, program: Program) -> tuple[Program, NativeFault | None]:
        """The program, without stop parameters that make stops late if there are such; and why the controller would
        refuse it.
        """
        fault = self._fault(program)
        if fault is None or fault.code != ProgramError.STOP_LONG:
            return program, fault
        program = without_long_stops(program)
        return program, self._fault(program)

    def _fault(self, program: Program) -> NativeFault | None:
        return NativeProgram(encode(program)).check(self._limits)

    def _exceeded(self, stretch: Stretch) -> Exceeded:
        """The pieces of a stretch that the controller would refuse for their motion; if there are many, the first
        _MOST_EXCEEDED. The check ends at its first fault, so it is repeated from the next piece on. It checks the axis
        limits last: where pieces break another rule too, those before them may be left out.
        """
        pieces = stretch.pieces
        codes = np.hstack((pieces.override_rate_codes, pieces.override_second_codes))
        bad = np.asarray((codes == 0).any(axis=1))
        by_override = np.zeros_like(bad)
        if bad.any():
            return Exceeded(bad, by_override)
        first = 0
        while first < len(pieces) and np.count_nonzero(bad) < _MOST_EXCEEDED:
            later = Stretch(pieces.part(slice(first, None)), stretch.end_q40)
            program = self._program(later, no_codes(len(later.pieces)))
            fault = self._fault(program)
            if fault is not None and fault.code == ProgramError.SEGMENT_SHORT:
                bad[first:] |= _on_short_segments(program)
            if fault is None or fault.code not in _MOVING_FAULTS:
                break
            first += fault.index + 1
            bad[first - 1] = True
            by_override[first - 1] = fault.code in _OVERRIDE_FAULTS
        return Exceeded(bad, by_override)


def _on_short_segments(program: Program) -> NDArray[np.bool_]:
    """The pieces (M,) that reach into two consecutive segments which a tick at 200 % could pass."""
    ends = np.append(program.start_q40, program.length_q40)
    pairs, _, _ = brief_pairs(ends, program.pieces, program.period_us)
    starts = program.pieces.start_q40
    bad = np.zeros(len(starts), dtype=np.bool_)
    for pair in pairs.tolist():
        first = int(np.searchsorted(starts, ends[pair] - REACH_Q40, side="left")) - 1
        last = int(np.searchsorted(starts, ends[pair + 2] + REACH_Q40, side="right"))
        bad[max(first, 0) : last] = True
    return bad
