# SPDX-License-Identifier: MIT
"""Outputs of the program, or of a streamed job, on the live page: the places where they switch, and the times at which
setpoints passed these places.

The times are those of the setpoints on the bus, not of the frames of the I/O module. A feed override or a hold shifts
them; after a stop before a place it has no time.

Used by monitor/pump. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..config.outputs import Outputs, placed_outputs, words_of
from ..events import Events
from ..fixed_point import MM_PER_Q40
from ..stream.bus_chunks import curve_of
from ..stream.chunk import Chunk
from .decoder import Floats
from .derived import ProgramPath

_BESIDE_MM = 1e-5
"""Accuracy of the arc length of a setpoint on the bus: setpoints are rounded to counts."""

_MOST = 200
"""Most marks of a streamed job that are kept."""


@dataclass(frozen=True)
class OutputMark:
    """The outputs that switch at a place of the path: `text` has a line for each."""

    place_mm: float
    text: str


def output_marks(outputs: Outputs | None, events: Events) -> tuple[OutputMark, ...]:
    """The marks of a program, by place; empty if the outputs of the machine are not known."""
    placed = placed_outputs(outputs, events)
    return tuple(
        OutputMark(place, words_of([one for one in placed if one.place_mm == place]))
        for place in sorted({one.place_mm for one in placed})
    )


def drawn_marks(marks: tuple[OutputMark, ...], path: ProgramPath) -> list[dict[str, Any]]:
    """The marks with their points on the path, for a message."""
    if not marks:
        return []
    return _with_points(marks, path.points_mm(np.array([mark.place_mm for mark in marks])))


def _with_points(marks: tuple[OutputMark, ...], points: Floats) -> list[dict[str, Any]]:
    return [
        dict(zip("xyz", np.round(point, 5).tolist(), strict=False)) | {"text": mark.text}
        for mark, point in zip(marks, points, strict=True)
    ]


class PassedMarks:
    """Finds the marks that setpoints pass, poll by poll."""

    def __init__(self, marks: tuple[OutputMark, ...] = ()) -> None:
        self._marks = marks
        self._last_mm = np.nan

    def anew(self) -> PassedMarks:
        """Restarts with the same marks, for another source of setpoints."""
        return PassedMarks(self._marks)

    def with_marks(self, marks: tuple[OutputMark, ...]) -> PassedMarks:
        """Replaces the marks for continuing setpoints."""
        made = PassedMarks(marks)
        made._last_mm = self._last_mm
        return made

    def feed(self, t_s: Floats, arc_mm: Floats) -> list[tuple[float, str]]:
        """Time and text of each mark that these setpoints (n,) reached or passed; NaN: a setpoint off the path."""
        if not self._marks or not t_s.size:
            return []
        before = np.concatenate(([self._last_mm], arc_mm[:-1]))
        self._last_mm = float(arc_mm[-1])
        found = []
        for mark in self._marks:
            place = max(mark.place_mm - _BESIDE_MM, _BESIDE_MM)
            with np.errstate(invalid="ignore"):
                passed = (before < place) & (arc_mm >= place)
            found += [(float(t_s[row]), mark.text) for row in np.flatnonzero(passed)]
        return sorted(found)


class JobMarks:
    """The marks of a streamed job from its received chunks; of a long job the last ones."""

    def __init__(self, outputs: Outputs | None) -> None:
        self._outputs = outputs
        self._job, self._end_q40 = 0, 0
        self.marks: tuple[OutputMark, ...] = ()
        """By arc length of the job."""
        self.drawn: list[dict[str, Any]] = []
        """The marks with their points, for a message."""

    def add(self, chunk: Chunk) -> None:
        """Adds the marks of another chunk, without its shared part. The first chunk of another job replaces all
        marks.
        """
        header, program = chunk.header, chunk.program
        begin_q40 = header.job_start_q40
        new = program.events
        if header.first or header.job != self._job:
            self._job, self.marks, self.drawn = header.job, (), []
        elif header.rest is None:
            new = new[new["place"] + begin_q40 > self._end_q40]
        self._end_q40 = begin_q40 + program.length_q40
        if program.first_axis or not len(new):
            return
        made = output_marks(self._outputs, new)
        points = curve_of(program).axes_point(np.array([mark.place_mm for mark in made]))
        begin_mm = begin_q40 * MM_PER_Q40
        moved = tuple(OutputMark(begin_mm + mark.place_mm, mark.text) for mark in made)
        self.marks = (*self.marks, *moved)[-_MOST:]
        self.drawn = [*self.drawn, *_with_points(made, points)][-_MOST:]
