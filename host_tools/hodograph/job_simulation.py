# SPDX-License-Identifier: MIT
"""The offline simulation of a job: plans, compiles and runs its sections without a bus, and writes the run as a table.
Used by api/job, cli/, job_run and report/. Writes the file that it is given.

job_run.py uses `JobMotion` for the analysed recordings of a run on the bus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from .errors import InputError
from .job import Job
from .simulate import Motion, simulate_on


@dataclass(frozen=True, eq=False)
class JobMotion:
    """A run of a job: the motions of its sections, one after the other, without dwells.

    The last point of a section is the first one of the next and counts once.

    planning_s  wall time that planning and compiling took
    """

    job: Job
    motions: tuple[Motion, ...]
    planning_s: float

    @property
    def period_s(self) -> float:
        """Time between two ticks."""
        return self.motions[0].period_us / 1e6

    @property
    def ticks(self) -> int:
        """Of all sections."""
        return 1 + sum(motion.ticks - 1 for motion in self.motions)

    @property
    def duration_s(self) -> float:
        """Time of the motion, from the first tick to the last, without dwells."""
        return (self.ticks - 1) * self.period_s

    @property
    def path_motions(self) -> Iterator[Motion]:
        """Motions in which x, y or z move. The errors of the others are in degrees."""
        for section, motion in zip(self.job.sections, self.motions, strict=True):
            if section.stands_at is None:
                yield motion

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on in `--json` output."""
        return self.job.summary() | {
            "duration_s": self.duration_s,
            "ticks": self.ticks,
            "planning_s": self.planning_s,
            "fit_s": self.job.fit_s,
            "max_contour_error_um": max(
                (motion.max_contour_error_um for motion in self.path_motions), default=0.0
            ),
            "max_following_error_um": max(
                (motion.max_following_error_um for motion in self.path_motions), default=0.0
            ),
            "section": [
                section.lines_summary() | motion.summary()
                for section, motion in zip(self.job.sections, self.motions, strict=True)
            ],
        }


def simulate_job(
    job: Job,
    kernel: str | None = None,
    *,
    keep_rows: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> JobMotion:
    """Plans, compiles and runs every section.

    kernel     of the interpolation; None: that of the machine
    keep_rows  whether the motions keep their rows, one for each tick
    progress   is called with the number of finished sections and of all

    Raises InputError and PlanError, naming file and line.
    """
    begin = perf_counter()
    images = [section.pipeline.accepted for section in job.sections]
    planning_s = perf_counter() - begin
    motions = []
    for done, image in enumerate(images):
        machine = job.sections[done].pipeline.machine
        motions.append(simulate_on(machine, image, kernel, keep_rows=keep_rows))
        if progress is not None:
            progress(done + 1, len(images))
    return JobMotion(job, tuple(motions), planning_s)


def write_job_trace(run: JobMotion, file: Path) -> None:
    """Writes a row for each tick: tick, t_s, source line, arc length, feed, commanded and actual positions of the axes.

    Positions are program positions, without the work offset. Where rotary axes move alone, the arc length stays the
    same and the feed is in degrees per second. Raises InputError: the file cannot be written.
    """
    machine = run.job.machine
    named = [(axis.name, axis.unit) for axis in machine.path_axes]
    header = [
        *("tick", "t_s", "line", "arc_length_mm", "feed_mm_s"),
        *(f"{name}_cmd_{unit}" for name, unit in named),
        *(f"{name}_act_{unit}" for name, unit in named),
    ]
    try:
        with file.open("w", encoding="ascii", newline="\n") as out:
            out.write(",".join(header) + "\n")
            for row in _trace_rows(run):
                out.write(row)
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None


def _trace_rows(run: JobMotion) -> Iterator[str]:
    tick, passed_mm = 0, 0.0
    for index, (section, motion) in enumerate(zip(run.job.sections, run.motions, strict=True)):
        first = 1 if index else 0
        rows = slice(first, motion.ticks)
        own = motion.arc_length_mm[rows]
        count = own.size
        columns = [
            np.arange(tick, tick + count),
            np.arange(tick, tick + count) * run.period_s,
            section.line_at(own),
            passed_mm + (own if section.stands_at is None else np.zeros(count)),
            motion.feed_mm_s[rows],
            *section.places(motion.cmd_mm[rows]).T,
            *section.places(motion.act_mm[rows]).T,
        ]
        texts = [map(repr, column.tolist()) for column in columns]
        yield from (",".join(row) + "\n" for row in zip(*texts, strict=True))
        tick += count
        passed_mm += section.length_mm
