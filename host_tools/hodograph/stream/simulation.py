# SPDX-License-Identifier: MIT
"""A stream without a bus: chunks (parts of a job) one after the other through the controller's core, and their pieces
as one program. Used by cli/stream_command. Takes the chunks from an iterator that may wait for them; no other I/O.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..feed.pieces import FeedPieces, joined_pieces
from ..native.feed_override import State
from ..native.program import Counts, NativeLimits, counts_from_q40_mm
from ..native.stream import OfflineStream
from ..program.image import Program
from ..program.stop_planning import with_bounds
from ..program.stops import no_stops
from .chunk import Chunk

_SLICE_TICKS = 50
"""Less than a takeover (docs/glossary.md) may be late (LATENESS_S), at the shortest period."""


@dataclass(frozen=True)
class StreamedMotion:
    """A simulated job of the controller: sections with their rests.

    ticks              setpoints, from the first to the exact end
    setpoints_sha256   over them, as docs/reference/protocol.md section 2 has it
    outputs_sha256     over the outputs at each setpoint: u16 of the digital ones and three i16, little-endian
    takeovers          in motion, and at rest
    sections           paths with rests between them
    """

    ticks: int
    setpoints_sha256: str
    outputs_sha256: str
    takeovers: tuple[int, int]
    sections: int = 1


def simulate_chunks(
    chunks: Iterable[Chunk],
    limits: NativeLimits,
    kernel: str,
    counts_per_mm: Counts,
    setpoints: Callable[[NDArray[np.int32]], None] | None = None,
) -> StreamedMotion:
    """Runs the chunks of a job through the controller's core: each is given when its predecessor is under way.

    `counts_per_mm`: of all axes of the programs, or of each; of a degree for those that turn.

    `setpoints` gets them, (n, A), part by part.

    Raises RunError: a chunk is refused.
    """
    stream, ticks = OfflineStream(kernel, limits), 0
    digest, outputs = hashlib.sha256(), hashlib.sha256()
    axes, sections = 0, 1

    def run(*, until_rest: bool = False) -> int:
        points, values = stream.run_with_outputs(_SLICE_TICKS, until_rest=until_rest)
        outputs.update(values.tobytes())
        counts = counts_from_q40_mm(points["position_q40"][:, :axes], counts_per_mm)
        digest.update(counts.tobytes())
        if setpoints is not None:
            setpoints(counts)
        return len(points)

    for chunk in chunks:
        fault = stream.give(chunk.encode())
        if fault is not None:
            raise RunError(
                f"line {chunk.header.line}: the controller would refuse chunk {chunk.header.sequence}: {fault.text} "
                f"(code {fault.code}, number {fault.index}): please report this file"
            )
        axes = axes or chunk.program.axis_count
        sections += chunk.header.rest is not None
        while stream.sequence != chunk.header.sequence:
            waited = stream.waits and chunk.header.rest is None
            ticks += run(until_rest=True)
            if waited and stream.sequence != chunk.header.sequence:
                raise RunError(f"chunk {chunk.header.sequence} is not taken over: report a bug")
    while stream.state is not State.ENDED:
        ticks += run()
    return StreamedMotion(
        ticks, digest.hexdigest(), outputs.hexdigest(), stream.takeovers, sections
    )


class Concatenation:
    """The pieces of chunks, the first of which begins at rest, without tails and repetitions, as one program: it takes
    the memory of the whole section.
    """

    def __init__(self) -> None:
        self._pieces: list[FeedPieces] = []
        self._points: list[np.ndarray] = []
        self._a: list[np.ndarray] = []
        self._extra: list[np.ndarray] = []
        self._starts: list[np.ndarray] = []
        self._codes: list[np.ndarray] = []
        self._events: list[np.ndarray] = []
        self._end_q40 = -1
        self._base_q40: int | None = None
        self._before: tuple[Chunk, Program] | None = None

    def add(self, chunk: Chunk, next_shared_end: int | None) -> None:
        """The next chunk; `next_shared_end`: how many of its pieces are before its joint, None: all (the last one)."""
        own, header = chunk.program, chunk.header
        if self._base_q40 is None:
            self._base_q40 = header.job_start_q40
        begin_q40 = header.job_start_q40 - self._base_q40
        new = slice(header.shared_pieces, next_shared_end)
        part = own.pieces.part(new)
        self._pieces.append(replace(part, start_q40=part.start_q40 + begin_q40))
        self._codes.append(own.stops.codes[new])
        fresh = slice(header.shared_segments, None)
        self._starts.append(own.start_q40[fresh] + begin_q40)
        self._points.append(own.point_q40[:, fresh])
        self._a.append(own.a_q44[:, fresh])
        self._extra.append(own.extra_q40[:, fresh])
        events = own.events.copy()
        events["place"] += begin_q40
        self._events.append(events[events["place"] > self._end_q40])
        self._end_q40 = begin_q40 + own.length_q40
        self._before = (chunk, own)

    def program(self) -> Program:
        """The whole."""
        assert self._before is not None
        assert self._base_q40 is not None
        chunk, own = self._before
        pieces = joined_pieces(self._pieces)
        codes = np.concatenate(self._codes)
        whole = replace(
            own,
            duration_q32_s=pieces.total_q32_s,
            length_q40=own.length_q40 + chunk.header.job_start_q40 - self._base_q40,
            start_q40=np.concatenate(self._starts),
            point_q40=np.concatenate(self._points, axis=1),
            a_q44=np.concatenate(self._a, axis=1),
            extra_q40=np.concatenate(self._extra, axis=1),
            pieces=pieces,
            stops=replace(no_stops(len(pieces)), codes=codes),
            moving=False,
            compact=False,
            events=np.concatenate(self._events),
        )
        return with_bounds(whole)


def from_rest_to_rest(chunks: Iterable[Chunk]) -> Iterator[list[Chunk]]:
    """The chunks of a job in parts, each of which begins with one that shares nothing."""
    part: list[Chunk] = []
    for chunk in chunks:
        if part and chunk.header.rest is not None:
            yield part
            part = []
        part.append(chunk)
    if part:
        yield part


def concatenated(chunks: Iterable[Chunk]) -> Program:
    """The pieces of the chunks of a section as one program; of a part of it that begins at rest, too."""
    whole = Concatenation()
    before: Chunk | None = None
    for chunk in chunks:
        if before is not None:
            joint = chunk.header.piece_shift + chunk.header.shared_pieces
            whole.add(before, joint if chunk.header.rest is None else None)
        before = chunk
    assert before is not None
    whole.add(before, None)
    return whole.program()
