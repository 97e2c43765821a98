# SPDX-License-Identifier: MIT
"""Motion ahead in the ring of a small controller, and bytes of chunks by part. Used by benchmarks/streaming. Reads
machine files and toolpaths of the examples.

Paths of the examples are too short to fill a ring: the paths here repeat their shape, with their limits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hodograph.config import Machine, load_machine
from hodograph.program.image import COMPACT_PIECE_BYTES, segment_size
from hodograph.program.stops import HOLD
from hodograph.spline import PHSpline, from_control_polygon
from hodograph.spline.spatial import SpatialPHSpline, spatial_through_points
from hodograph.stream.chunk import Chunk, largest_chunk
from hodograph.stream.chunks import SectionChunks
from hodograph.stream.geometry import Block
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MACHINES = EXAMPLES / "machines"
RING, BUS_BYTES_S = 48 * 1024, 17e3
"""Bytes of the ring of a small controller; bytes per second of the bus in addition to setpoints of two axes at 1
kHz.
"""

_ALPHA = [(0, 0), (12, 18), (24, 27), (36, 9), (24, -9), (12, 0), (0, 18)]
_HEART = [(-20, -50), (0, 5), (0, -5), (-20, 50), (40, 50), (75, -5), (75, 5), (40, -50)]
_PAPER_ACCELERATION_MM_S2, _PAPER_JERK_MM_S3 = 2000.0, 50_000.0
_ALPHA_PITCH_MM, _STOP_TIME_MS = 30, 2000
_ALPHAS, _HEARTS, _HELIX_TURNS = 18, 10, 20
_TRAVEL_MM = 1000.0
_STEP_S = 0.005
_HEAD, _ALIGNMENT = 376, 8
"""Bytes that a block of the ring has before its chunk (struct stream_chunk of firmware/app/stream.c), and its unit."""
MOST = largest_chunk(RING - _HEAD)
PARTS = (
    "header",
    "shared pieces",
    "new pieces",
    "tail pieces",
    "shared segments",
    "new segments",
    "tail segments",
)


@dataclass(frozen=True, eq=False)
class Streamed:
    """A job in chunks, and the motion that each of them brings; s."""

    name: str
    axes: int
    chunks: list[Chunk]
    new_s: list[float]


def jobs(wave: Path) -> Iterator[Streamed]:
    """All jobs, in chunks of MOST bytes; `wave`: a file of the surface of short lines."""
    yield from example_jobs(MOST)
    toolpaths = EXAMPLES / "toolpaths"
    mill = load_machine(MACHINES / "mill.toml")
    for name, file in (
        ("surface of short lines", wave),
        ("engraving", toolpaths / "engraving.ngc"),
        ("surface", toolpaths / "surface.ngc"),
    ):
        sections = StreamReader(file, mill, 0.01, ReadOptions()).sections()
        made = (SectionChunks(mill, "job", one.blocks, 1, MOST) for one in sections)
        yield max((gathered(name, one) for one in made), key=lambda job: sum(job.new_s))


def example_jobs(most_bytes: int) -> Iterator[Streamed]:
    """Jobs of the density of the optimal examples, in chunks of at most so many bytes."""
    alpha = [(x, y + _ALPHA_PITCH_MM * k) for k in range(_ALPHAS) for x, y in _ALPHA]
    heart = [(x + k, y) for k in range(_HEARTS) for x, y in _HEART]
    for name, polygon in (("alpha", alpha), ("heart", heart)):
        curve = from_control_polygon(np.array(polygon, dtype=np.float64), closed=False).spline
        yield streamed(f"{name}_optimal, repeated", _paper(name), curve, most_bytes)
    turn = 0.25 * np.pi * np.arange(8 * _HELIX_TURNS + 1)
    helix = np.stack((20 * np.cos(turn), 20 * np.sin(turn), 5 * turn / np.pi), axis=1)
    space = spatial_through_points(helix, closed=False).spline
    yield streamed("helix, longer", load_machine(MACHINES / "mill.toml"), space, most_bytes)


def _paper(name: str) -> Machine:
    """The machine of a paper's example, with the limits of the example for its axes, and travel for all of it.
    They have no more for a fault stop, which may take longer then.
    """
    machine = load_machine(MACHINES / f"paper_{name}.toml")
    axes = (
        replace(
            axis,
            travel_min_mm=-_TRAVEL_MM,
            travel_max_mm=_TRAVEL_MM,
            acceleration_mm_s2=_PAPER_ACCELERATION_MM_S2,
            jerk_mm_s3=_PAPER_JERK_MM_S3,
        )
        for axis in machine.axes
    )
    return replace(machine, axes=tuple(axes), stop_time_ms=_STOP_TIME_MS)


def streamed(
    name: str, machine: Machine, curve: PHSpline | SpatialPHSpline, most_bytes: int
) -> Streamed:
    """A curve as one section, as fast as the machine can."""
    count = curve.segment_count
    block = Block(curve, np.full(count, np.inf), np.arange(1, count + 1))
    return gathered(name, SectionChunks(machine, "job", iter([block]), 1, most_bytes))


def gathered(name: str, section: SectionChunks) -> Streamed:
    """All chunks of a section."""
    made = list(section.chunks())
    axes = section.machine.path_count
    return Streamed(name, axes, [one.chunk for one in made], [one.new_s for one in made])


def parts(job: Streamed) -> dict[str, float]:
    """Bytes of a chunk on the mean, by PARTS."""
    out = dict.fromkeys(PARTS, 0.0)
    segment = segment_size(job.axes, compact=True)
    nexts = [*job.chunks[1:], None]
    for chunk, after in zip(job.chunks, nexts, strict=True):
        own, header = chunk.program, chunk.header
        kept = own.piece_count
        if after is not None:
            kept = after.header.piece_shift + after.header.shared_pieces
        starts = np.append(own.pieces.start_q40, own.length_q40)
        shared, joint = (
            int(np.searchsorted(own.start_q40, starts[at])) for at in (header.shared_pieces, kept)
        )
        pieces = (header.shared_pieces, kept - header.shared_pieces, own.piece_count - kept)
        segments = (shared, joint - shared, own.segment_count - joint)
        sizes = [n * COMPACT_PIECE_BYTES for n in pieces] + [n * segment for n in segments]
        for part, size in zip(PARTS, (chunk.size - sum(sizes), *sizes), strict=True):
            out[part] += size / len(job.chunks)
    return out


def ahead(job: Streamed, ring: int, bytes_per_s: float) -> tuple[float, float]:
    """Motion ahead up to the newest joint in the ring, on the mean and at the least, from when the ring is full for
    the first time until the last chunk is there; s.

    A chunk frees its bytes when its successor is taken over, at its joint. Another one is sent as soon as it has room,
    at `bytes_per_s`.
    """
    joint = np.concatenate(([0.0], np.cumsum(job.new_s)))
    blocks: deque[_Block] = deque()
    there: list[float] = []
    now, full = 0.0, False
    for number, chunk in enumerate(job.chunks):
        size = -(-(chunk.size + _HEAD) // _ALIGNMENT) * _ALIGNMENT
        while (at := _room(blocks, ring, size)) is None:
            full = True
            now = max(now, float(joint[blocks.popleft().number + 1]))
        blocks.append(_Block(number, at, at + size))
        now = now + chunk.size / bytes_per_s if full else 0.0
        there.append(now)
    if there[-1] < _STEP_S:
        return float(joint[-1]), float(joint[-1])
    t = np.arange(0.0, there[-1], _STEP_S)
    known = joint[np.searchsorted(np.array(there), t, side="right")]
    return float(np.mean(known - t)), float(np.min(known - t))


@dataclass(frozen=True)
class _Block:
    """A chunk in the ring: its bytes are from `begin` to before `end`."""

    number: int
    begin: int
    end: int


def _room(blocks: deque[_Block], ring: int, size: int) -> int | None:
    """Where a block of this size begins, as firmware/app/chunk_ring.c has it; None: nowhere."""
    if not blocks:
        return 0
    oldest, write = blocks[0].begin, blocks[-1].end
    if blocks[-1].begin < oldest:
        return write if oldest - write >= size else None
    if ring - write >= size:
        return write
    return 0 if oldest >= size else None


def worst_hold_s(job: Streamed) -> float:
    """The longest bound of a feed hold."""
    return max(chunk.program.stops.worst(HOLD).time_s for chunk in job.chunks)
