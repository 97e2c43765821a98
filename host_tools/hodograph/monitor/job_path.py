# SPDX-License-Identifier: MIT
"""The contour error of a streamed job: its path is known from the chunks that have passed on the bus.

Each chunk repeats the end of the previous chunk's path. So a chunk is used only up to the start of the next one.

Used by monitor/pump. No I/O. Changes its own object only; one thread. A chunk is a part of a job (docs/glossary.md).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixed_point import MM_PER_Q40
from ..stream.bus_chunks import curve_of
from ..stream.chunk import Chunk
from ..stream.geometry import Curve
from .decoder import Floats

_ON_PATH_UM = 1.0
"""Greatest distance in um of a setpoint from the path of its job, because setpoints are rounded to counts. A setpoint
farther away belongs to another motion.
"""
_STEP_MM, _MOST_SAMPLES = 0.1, 20_000
"""Step in mm of the search for a setpoint whose place is not known."""
_BESIDE_MM = 1e-3
"""Distance of the two points by which the tangent of the path is estimated."""
_KEPT_MM = 50.0
"""Length in mm of the path kept before the last setpoint, for late frames."""
_MOST_PARTS = 500
"""Greatest number of parts of a job that are kept."""
_PROJECTIONS = 4
"""Steps that project a position onto the path."""


@dataclass(frozen=True, eq=False)
class _Part:
    begin_mm: float
    length_mm: float
    curve: Curve


class JobPath:
    """Locates the setpoints of a job on the received chunks, as ProgramPath does on a program."""

    def __init__(self, counts_per_mm: int) -> None:
        self._counts_per_mm = counts_per_mm
        self._parts: deque[_Part] = deque()
        self._job: int | None = None
        self._samples: tuple[Floats, Floats] | None = None
        self._last_mm: float | None = None
        self._last_point: Floats | None = None

    def add(self, chunk: Chunk) -> None:
        """Adds the next chunk of the job. A chunk of another job begins a new path; rotary axes alone are not drawn."""
        program = chunk.program
        if chunk.header.first or chunk.header.job != self._job:
            self._job = chunk.header.job
            self._parts.clear()
            self._last_mm = self._last_point = None
        if program.first_axis:
            return
        begin_mm = chunk.header.job_start_q40 * MM_PER_Q40
        while self._parts and self._parts[-1].begin_mm >= begin_mm:
            self._parts.pop()
        self._parts.append(_Part(begin_mm, program.length_mm, curve_of(program)))
        if len(self._parts) > _MOST_PARTS:
            self._parts.popleft()
        self._samples = None

    def contour_errors_um(self, targets: Floats, actual: Floats) -> tuple[Floats, Floats]:
        """Distances of positions (n, A) from the path, in um, near their setpoints (n, A), all in counts; and the arc
        lengths of the setpoints in the job, in mm.

        NaN: the setpoint is not on the path, or a frame is missing.
        """
        errors, places = (np.full(targets.shape[0], np.nan) for _ in range(2))
        there = np.flatnonzero(np.isfinite(targets).all(axis=1) & np.isfinite(actual).all(axis=1))
        if not there.size or not self._parts or targets.shape[1] < self._axes:
            return errors, places
        wanted = targets[there, : self._axes] / self._counts_per_mm
        reached = actual[there, : self._axes] / self._counts_per_mm
        arcs, on_path = self._followed(wanted)
        self._last_point, self._last_mm = wanted[-1:], float(arcs[-1]) if on_path[-1] else None
        at = there[on_path]
        if at.size:
            errors[at] = self._projected(arcs[on_path], reached[on_path])[1]
            places[at] = arcs[on_path]
            self._forget(float(arcs[on_path].min()))
        return errors, places

    @property
    def _axes(self) -> int:
        return self._parts[0].curve.axes

    def _followed(self, points: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Arc lengths of setpoints, and whether they are on the path."""
        guesses = []
        if self._last_mm is not None and self._last_point is not None:
            guesses.append(
                self._last_mm + _chord_lengths(np.vstack((self._last_point, points)))[1:]
            )
        passed = _chord_lengths(points)
        arcs, off_um = np.zeros(len(points)), np.full(len(points), np.inf)
        for known in (None, len(points) - 1, 0):
            if known is None and not guesses:
                continue
            guess = (
                guesses[0]
                if known is None
                else self._nearest(points[known]) + passed - passed[known]
            )
            found, away_um = self._projected(guess, points)
            better = (away_um < _ON_PATH_UM) & (off_um >= _ON_PATH_UM)
            arcs[better], off_um[better] = found[better], away_um[better]
            if (off_um < _ON_PATH_UM).all():
                break
        return arcs, off_um < _ON_PATH_UM

    def _projected(self, arcs: Floats, points: Floats) -> tuple[Floats, Floats]:
        """Arc lengths near `arcs` at which the path is nearest to points, and the distances of the points from it, in
        um.
        """
        low, high = self._parts[0].begin_mm, self._parts[-1].begin_mm + self._parts[-1].length_mm
        for _ in range(_PROJECTIONS):
            arcs = np.clip(arcs, low, high)
            before = self._at(np.maximum(arcs - _BESIDE_MM, low))
            tangent = self._at(np.minimum(arcs + _BESIDE_MM, high)) - before
            tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-12)[:, None]
            arcs = arcs + np.sum((points - self._at(arcs)) * tangent, axis=1)
        arcs = np.clip(arcs, low, high)
        return arcs, 1e3 * np.linalg.norm(points - self._at(arcs), axis=1)

    def _nearest(self, point: Floats) -> float:
        """Arc length of the sample of the path that is nearest to a point (A,)."""
        if self._samples is None:
            low = self._parts[0].begin_mm
            length = self._parts[-1].begin_mm + self._parts[-1].length_mm - low
            count = int(np.clip(np.ceil(length / _STEP_MM) + 1, 2, _MOST_SAMPLES))
            arcs = low + np.linspace(0.0, length, count)
            self._samples = arcs, self._at(arcs)
        arcs, points = self._samples
        return float(arcs[np.argmin(np.sum((points - point) ** 2, axis=1))])

    def _at(self, arcs: Floats) -> Floats:
        """Points (n, axes) of the path, mm."""
        begins = np.array([part.begin_mm for part in self._parts])
        of = np.maximum(np.searchsorted(begins, arcs, side="right") - 1, 0)
        points = np.empty((arcs.size, self._axes))
        for k in np.unique(of).tolist():
            part, own = self._parts[k], of == k
            arc_mm = np.clip(arcs[own] - begins[k], 0.0, part.length_mm)
            points[own] = part.curve.axes_point(arc_mm)
        return points

    def _forget(self, before_mm: float) -> None:
        while len(self._parts) > 1 and self._parts[1].begin_mm < before_mm - _KEPT_MM:
            self._parts.popleft()
            self._samples = None


def _chord_lengths(points: Floats) -> Floats:
    """Lengths (n,) of the chords up to each of points (n, A), 0 first."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(chords)))
