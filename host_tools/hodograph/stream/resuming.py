# SPDX-License-Identifier: MIT
"""Places of a job: where `stream --continue` resumes a job that the controller has lost, the place of its path nearest
to the axes; and the place of a source line or an arc length. Used by cli/stream_command. Reads the files of the job.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..config import load_paths
from ..errors import InputError
from ..fixed_point import MM_PER_Q40, nearest_q40
from ..names import is_toolpath
from ..pipeline import pipeline_of
from .geometry import Block, Chords, Curve
from .journal import Entry
from .plan import JobFiles, Place
from .reading import StreamReader

_STEP_MM = 0.05
"""Distance of the samples between which the place is searched."""
_MOST_SAMPLES = 200_000
"""Greatest number of these samples."""
_REFINED = (41, 3)
"""Samples of a refinement, and number of refinements. Each refines by half the number of samples."""
_BESIDE_MM = 0.01
"""The searched part of the job is extended by this at both ends."""
_ALIKE_MM = 2e-6
"""Of places whose distances differ by less than this, the first one is taken: cutting a part twice is better than
leaving it out.
"""

_START_MM = 1e-5

Real = NDArray[np.float64]
Point = tuple[float, ...]


@dataclass(frozen=True)
class Nearest:
    """A place of a job with its source line, its point in machine coordinates, and its distance from the axes.

    passed  the last place in the journal, which the axes have passed
    """

    place: Place
    line: int
    point_mm: tuple[float, ...]
    distance_mm: float
    passed: Nearest | None = None


def nearest_place(job: JobFiles, entry: Entry, at_mm: tuple[float, ...]) -> Nearest:
    """The place nearest to the axes, between the last place in the journal and the end of what had been sent.

    at_mm  (A,) of the axes that the path moves, machine coordinates; a degree counts as a mm
    Raises InputError and PlanError as reading the job does.
    """
    starts = dict(entry.starts) or {entry.section: 0}
    low_q40 = starts.get(entry.section, 0) + entry.arc_q40
    offset_mm = np.array(job.machine.offset_mm[: len(at_mm)])
    at = np.array(at_mm) - offset_mm
    found: list[Nearest] = []
    passed: Nearest | None = None
    for number, blocks, standing_mm in _sections(job):
        if number > max(starts):
            break
        start_q40 = starts.get(number)
        begin_mm = 0.0
        for block in blocks:
            length_mm = block.curve.length_mm
            if start_q40 is not None:
                low = (low_q40 - start_q40) * MM_PER_Q40 - _BESIDE_MM - begin_mm
                high = (entry.committed_q40 - start_q40) * MM_PER_Q40 + _BESIDE_MM - begin_mm
                if high > 0.0 and low < length_mm:
                    own = at[len(standing_mm) :]
                    low, high = max(low, 0.0), min(high, length_mm)
                    arcs = _nearest_arcs(block.curve, own, low, high)
                    if passed is None:
                        place = _place(number, begin_mm + low)
                        passed = _found(block, low, place, at, standing_mm)
                    found += [
                        _found(
                            block,
                            arc,
                            _place(number, begin_mm + arc),
                            at,
                            standing_mm,
                        )
                        for arc in arcs
                    ]
            begin_mm += length_mm
    if not found:
        raise InputError(
            "the journal names a place that the job does not have: stream it from its start"
        )
    least = min(one.distance_mm for one in found) + _ALIKE_MM
    nearest = next(one for one in found if one.distance_mm <= least)
    assert passed is not None
    return replace(_moved(nearest, offset_mm), passed=_moved(passed, offset_mm))


def place_of_line(job: JobFiles, line: int) -> Nearest:
    """Where the motion of a source line of the first file, a toolpath, begins on the path; of a line that is executed
    several times, where it begins first. If the line has no motion, where the next motion begins. Within a fitted curve
    it may be the start of the segment around this place.

    Raises InputError: no motion is at this line or after it; InputError and PlanError as reading the job does.
    """
    after: Nearest | None = None
    for number, blocks, standing_mm in _sections(job, with_chords=True):
        begin_mm = 0.0
        for block in blocks:
            assert block.chords is not None
            lines = block.chords.line
            here = np.flatnonzero(lines == line)
            later = np.flatnonzero(lines > line)
            if here.size or (later.size and after is None):
                index = int((here if here.size else later)[0])
                arc_mm = _begin_of(block.chords, index, block.curve, job.tolerance_mm)
                place = _place(number, begin_mm + arc_mm)
                found = _programmed(job, block, arc_mm, place, standing_mm)
                found = replace(found, line=int(lines[index]))
                if here.size:
                    return found
                after = found
            begin_mm += block.curve.length_mm
    if after is None:
        raise InputError(f"{job.files[0]}: there is no motion at line {line} or after it")
    return after


def _begin_of(chords: Chords, index: int, curve: Curve, tolerance_mm: float) -> float:
    """Arc length of a block's curve at which a chord begins. Where the curve is not near the programmed point there,
    the start of its segment: cutting a part twice is better than leaving it out.
    """
    arc_mm = float(chords.start_mm[index])
    if chords.off_mm[index] <= max(2.0 * tolerance_mm, _START_MM):
        return arc_mm
    starts_mm = curve.segment_starts_mm
    segment = int(np.searchsorted(starts_mm, arc_mm + _START_MM, side="right")) - 1
    return float(starts_mm[max(segment, 0)])


def place_of_arc(job: JobFiles, arc_mm: float) -> Nearest:
    """The place at an arc length of the path of the job: that of all its sections, one after the other.

    Raises InputError: the path is shorter; InputError and PlanError as reading the job does.
    """
    passed_mm = 0.0
    for number, blocks, standing_mm in _sections(job):
        begin_mm = 0.0
        for block in blocks:
            length_mm, own_mm = block.curve.length_mm, arc_mm - passed_mm
            if own_mm < length_mm - _START_MM:
                own_mm = max(own_mm, 0.0)
                place = _place(number, begin_mm + own_mm)
                return _programmed(job, block, own_mm, place, standing_mm)
            begin_mm += length_mm
            passed_mm += length_mm
    raise InputError(
        f"the path of the job has {passed_mm:.6g} mm, so there is no place at {arc_mm:g} mm"
    )


def _programmed(
    job: JobFiles, block: Block, arc_mm: float, place: Place, standing_mm: Point
) -> Nearest:
    """A place of the job, in machine coordinates. Its distance is 0: where the axes are is not known."""
    found = _found(block, arc_mm, place, None, standing_mm)
    return _moved(found, np.array(job.machine.offset_mm[: len(found.point_mm)]))


def _place(section: int, arc_mm: float) -> Place:
    """A place at the start, within the rounding of positions, is the start: commands at rest follow there."""
    return Place(section, nearest_q40(arc_mm) if arc_mm > _START_MM else 0)


def _moved(found: Nearest, offset_mm: Real) -> Nearest:
    return replace(found, point_mm=tuple((np.array(found.point_mm) + offset_mm).tolist()))


def _sections(
    job: JobFiles, *, with_chords: bool = False
) -> Iterator[tuple[int, Iterator[Block], tuple[float, ...]]]:
    """The sections of all files: number, blocks (which may be left unread), and positions of the axes before those of
    the path.
    """
    number = 0
    for file in job.files:
        if is_toolpath(file):
            reader = StreamReader(
                file, job.machine, job.tolerance_mm, job.reading, with_chords=with_chords
            )
            for section in reader.sections():
                blocks = section.blocks
                yield number, blocks, section.standing_mm
                for _ in blocks:
                    pass
                number += 1
        else:
            for line, listed in enumerate(load_paths(file), 1):
                pipeline = pipeline_of(listed.file, job.machine)
                curve = pipeline.curve
                count = curve.segment_count
                block = Block(curve, np.full(count, np.inf), np.full(count, line))
                yield number, iter([block]), pipeline.standing_mm
                number += 1


def _found(
    block: Block, arc_mm: float, place: Place, at: Real | None, standing_mm: Point
) -> Nearest:
    """A place of a block, without the work offset. `at`: where the axes are; None: not known, the distance is 0."""
    point = np.concatenate((standing_mm, block.curve.axes_point(arc_mm)))
    segment, _ = block.curve.locate(arc_mm)
    line = int(block.line[int(segment)])
    distance_mm = 0.0 if at is None else float(np.linalg.norm(point - at))
    return Nearest(place, line, tuple(point.tolist()), distance_mm)


def _nearest_arcs(curve: Curve, target: Real, low: float, high: float) -> list[float]:
    """Arc lengths of the places nearest to a point; several, in their order, if they are about equally near."""
    count = int(np.clip(np.ceil((high - low) / _STEP_MM) + 1, 2, _MOST_SAMPLES))
    s = np.linspace(low, high, count)
    d = _distances(curve, s, target)
    padded = np.concatenate(([np.inf], d, [np.inf]))
    lowest = (d <= padded[:-2]) & (d <= padded[2:]) & (d <= d.min() + (s[1] - s[0]))
    return [_refined(curve, target, s, int(k)) for k in np.flatnonzero(lowest)]


def _refined(curve: Curve, target: Real, s: Real, k: int) -> float:
    count, times = _REFINED
    for _ in range(times):
        s = np.linspace(s[max(k - 1, 0)], s[min(k + 1, s.size - 1)], count)
        k = int(np.argmin(_distances(curve, s, target)))
    return float(s[k])


def _distances(curve: Curve, s: Real, target: Real) -> Real:
    return np.asarray(np.linalg.norm(curve.axes_point(s) - target, axis=1))
