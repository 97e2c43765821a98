# SPDX-License-Identifier: MIT
"""What a streamed job that was cut has done, against the job planned in one piece: distance from its path, outputs at
its places. Used by stream_cuts.py and tests/system/test_stream_cuts.py. Runs the controller's core; no other I/O.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.capture.decode import RPDO1, SYNC_ID, decode_outputs
from hodograph.bus.capture.frames import Frames
from hodograph.config import Machine
from hodograph.native.feed_override import State
from hodograph.native.program import NativeLimits, counts_from_q40_mm
from hodograph.native.stream import OfflineStream
from hodograph.stream.chunk import Chunk

PER_UM = 1000.0
"""Counts, of the axes of the example machines that move along a line."""
NEAR_UM = 1.0
"""Greatest distance from the path, as lines between setpoints 1 ms apart."""
_WINDOW, _BLOCK = 1500, 64
_BESIDE = 3
"""Setpoints of the job before and after a place, of which the outputs at the place may be."""
_REST_TICKS = 3
"""Ticks without motion after which the axes rest."""
_STOP_S = 1.5
"""Longest stop along the path, whose outputs are off while the axes brake."""
_BACK_UM = 5.0
"""How far axes beside the path go back along it before the job goes on (docs/guides/streaming.md, "Loss of power"). The
outputs are off then, as before each start.
"""
_TICKS = 2000
_OFF: tuple[int, ...] = (0, 0, 0, 0)

Counts = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class JobLine:
    """A job as it is executed undisturbed.

    points   (n, A) setpoints in counts, each one that differs from that before
    outputs  (m, 4) outputs at each tick: digital ones, three analogue ones
    first    (n + 1,) number of the tick in which each point is reached; the last one is m
    per_um   (A,) counts of a micrometre; of an axis that turns, those of a thousandth of a degree
    """

    points: Counts
    outputs: NDArray[np.int64]
    first: Index
    per_um: Counts

    def outputs_near(self, segment: int) -> set[tuple[int, ...]]:
        """The outputs that the job has about a segment between two of its points."""
        last = len(self.points) - 1
        begin = self.first[max(segment - _BESIDE, 0)]
        end = self.first[min(segment + _BESIDE + 1, last) + 1]
        own = self.outputs[begin:end]
        changed = np.flatnonzero((np.diff(own, axis=0) != 0).any(axis=1)) + 1
        return {tuple(own[k].tolist()) for k in (0, *changed.tolist())}


def line_of(
    jobs: Iterable[Iterable[Chunk]], limits: NativeLimits, counts_per_unit: tuple[int, ...]
) -> JobLine:
    """The line of the jobs of a controller, one after the other. Raises AssertionError: a chunk is refused."""
    points, outputs = [], []
    for chunks in jobs:
        for positions, values in _executed_offline(chunks, limits):
            points.append(counts_from_q40_mm(positions, counts_per_unit).astype(np.float64))
            outputs.append(_columns(values))
    whole = np.concatenate(points)
    first = np.flatnonzero(_differs(whole))
    per_um = np.array(counts_per_unit, dtype=np.float64) * 1e-3
    ends = np.append(first, len(whole))
    return JobLine(whole[first], np.concatenate(outputs), ends, per_um)


def _executed_offline(
    chunks: Iterable[Chunk], limits: NativeLimits
) -> Iterable[tuple[NDArray[np.int64], NDArray[np.void]]]:
    """Positions (n, A) and outputs (n,), part by part."""
    stream, axes = OfflineStream("fixed", limits), 0
    for chunk in chunks:
        fault = stream.give(chunk.encode())
        assert fault is None, f"the job is refused offline: {fault}"
        axes = axes or chunk.program.axis_count
    while stream.state is not State.ENDED:
        made, values = stream.run_with_outputs(_TICKS)
        yield made["position_q40"][:, :axes], values


def away_um(points: Counts, line: Counts, per_um: Counts | float = PER_UM) -> float:
    """How far points (n, A) are from a polyline (m, A) at most, um. They come to its places about in order."""
    apart = places(points, line, per_um)[1]
    return float(apart.max(initial=0.0))


def places(points: Counts, line: Counts, per_um: Counts | float = PER_UM) -> tuple[Index, Counts]:
    """The segment of a polyline (m, A) that is nearest to each of the points (n, A), and its distance in um. The points
    come to its places about in order.
    """
    points, line = points / per_um, line[_differs(line)] / per_um
    if len(line) < 2:
        line = np.repeat(line, 2, axis=0)
    at, segments, distances = 0, np.zeros(len(points), dtype=np.intp), np.zeros(len(points))
    for first in range(0, len(points), _BLOCK):
        block = points[first : first + _BLOCK]
        low = min(max(at - _WINDOW, 0), len(line) - 2)
        part = line[low : at + _WINDOW + _BLOCK]
        begin, step = part[:-1], np.diff(part, axis=0)
        length = np.maximum((step * step).sum(axis=1), 1e-12)
        relative = block[:, None, :] - begin[None, :, :]
        share = np.clip((relative * step).sum(axis=2) / length, 0.0, 1.0)
        apart = np.linalg.norm(relative - share[:, :, None] * step, axis=2)
        nearest = apart.argmin(axis=1)
        segments[first : first + _BLOCK] = low + nearest
        distances[first : first + _BLOCK] = apart.min(axis=1)
        at = low + int(nearest[-1])
    return segments, distances


def changing(points: Counts) -> Counts:
    """Without points that repeat the one before."""
    return points[_differs(points)]


def _differs(points: Counts) -> NDArray[np.bool_]:
    keep = np.ones(len(points), dtype=np.bool_)
    keep[1:] = (np.diff(points, axis=0) != 0).any(axis=1)
    return keep


def executed(frames: Frames, nodes: Iterable[int]) -> tuple[Counts, Index]:
    """Targets (n, A) at each SYNC at which all drives are enabled, and the numbers (n,) of these SYNCs."""
    syncs = frames["id"] == SYNC_ID
    own = [_at_syncs(frames, node, syncs) for node in nodes]
    known = np.flatnonzero(np.logical_and.reduce([enabled for _, enabled in own]))
    return np.stack([targets[known] for targets, _ in own], axis=1), known


def _at_syncs(
    frames: Frames, node: int, syncs: NDArray[np.bool_]
) -> tuple[Counts, NDArray[np.bool_]]:
    """The last target before each SYNC, and whether it came with the command to follow."""
    setpoints = frames["id"] == RPDO1 + node
    latest = np.maximum.accumulate(np.where(setpoints, np.arange(len(frames)), -1))[syncs]
    data = np.ascontiguousarray(frames["data"][np.maximum(latest, 0)])
    control = np.ascontiguousarray(data[:, 0:2]).view("<u2")[:, 0]
    targets = np.ascontiguousarray(data[:, 2:6]).view("<i4")[:, 0].astype(np.float64)
    return targets, (latest >= 0) & ((control & 0x1F) == 0x0F)


def outputs_trouble(frames: Frames, machine: Machine, line: JobLine) -> str | None:
    """Where outputs on the bus differ from those of the job at the place of the axes, while these move on its path;
    None: nowhere. A stop switches them off while the axes brake; the motion after it has to begin with those of its
    place.
    """
    assert machine.outputs is not None
    targets, syncs = executed(frames, machine.nodes[: machine.path_count])
    seen = _columns(decode_outputs(frames, machine.outputs)[syncs])
    moving = np.flatnonzero(_differs(targets))
    segments, apart = places(targets[moving], line.points, line.per_um)
    judge, rest = OutputJudge(round(_STOP_S * 1e6 / machine.period_us)), targets[0]
    for k, segment, distance in zip(moving.tolist(), segments.tolist(), apart, strict=True):
        if distance > NEAR_UM:
            judge.rest(k)
            continue
        if judge.rests_before(k):
            rest = targets[k - 1]
        own = tuple(seen[k].tolist())
        if (
            own == _OFF
            and not judge.begun
            and np.linalg.norm((targets[k] - rest) / line.per_um) < _BACK_UM
        ):
            judge.last = k
            continue
        if not judge.accepts(k, own, line.outputs_near(segment)):
            place = ", ".join(f"{one:.4f}" for one in targets[k] / line.per_um / 1000.0)
            wanted = sorted(line.outputs_near(segment))
            return f"outputs {own} at {place} (SYNC {syncs[k]}), those of the job: {wanted}"
    return None


def final_outputs(frames: Frames, machine: Machine) -> tuple[int, ...]:
    """The outputs at the end of a recording."""
    assert machine.outputs is not None
    last = _columns(decode_outputs(frames, machine.outputs)[-1:])
    return tuple(last[0].tolist())


def _columns(values: NDArray[np.void]) -> NDArray[np.int64]:
    """Outputs (n, 4) as `JobLine` has them."""
    return np.column_stack((values["digital"], values["analogue"])).astype(np.int64)


@dataclass
class OutputJudge:
    """Follows the outputs from moving tick to moving tick."""

    longest_ticks: int
    last: int = -1
    begun: bool = False
    off_at: int | None = None

    def rest(self, tick: int) -> None:
        """The axes rest before this tick, or move beside the path."""
        self.last, self.begun, self.off_at = tick, False, None

    def rests_before(self, tick: int) -> bool:
        """Whether the axes have rested before this tick, so that another motion begins."""
        if tick <= self.last + _REST_TICKS:
            return False
        self.rest(tick)
        return True

    def accepts(self, tick: int, own: tuple[int, ...], wanted: set[tuple[int, ...]]) -> bool:
        """Whether the outputs at a tick may be these."""
        self.last = tick
        if self.off_at is not None:
            return own == _OFF and tick - self.off_at <= self.longest_ticks
        if own in wanted:
            self.begun = True
            return True
        if own == _OFF and self.begun:
            self.off_at = tick
            return True
        return False
