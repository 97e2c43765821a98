# SPDX-License-Identifier: MIT
"""Toolpaths of other programs: a job of several sections, planned and simulated. Used by api/bus, and by programs of
users. Reads toolpath files.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path as FilePath

from .. import job as jobs
from ..job_simulation import simulate_job
from ..native import NativeProgram
from ..toolpath.files import ReadOptions, asked_tolerance_mm
from .machine import Machine
from .path import Path, Plan, path_of_section
from .program import Kernel, Program, Run


@dataclass(frozen=True, eq=False)
class Section:
    """A part of a job, from rest to rest; made by `load_job`.

    >>> from tempfile import TemporaryDirectory
    >>> from hodograph import Machine, load_job
    >>> with TemporaryDirectory() as folder:
    ...     file = FilePath(folder, "part.ngc")
    ...     _ = file.write_text("G21 G1 X20 F3000\\nX35 Y10\\nX35 Y30\\nM30\\n")
    ...     section = load_job(file, Machine.example("mill")).sections[0]
    >>> section.path.axes, section.first_line, section.last_line
    (3, 1, 3)
    """

    _section: jobs.JobSection = field(repr=False)
    machine: Machine = field(repr=False)

    @property
    def first_line(self) -> int:
        """Source line of its first move."""
        return self._section.first_line

    @property
    def last_line(self) -> int:
        """Source line of its last move."""
        return self._section.last_line

    @property
    def deviation_um(self) -> float:
        """Certified bound of the distance between the programmed path and the curve, both ways."""
        return self._section.deviation_um

    @cached_property
    def path(self) -> Path:
        """Curve of the section. `Path.plan` of it may use other limits, and needs the machine."""
        return path_of_section(self._section)

    @cached_property
    def plan(self) -> Plan:
        """The feed of the program, by the feeds of the toolpath and the limits of the machine. Raises PlanError."""
        return Plan(self.path, self.machine, self._section.pipeline)

    def program(self) -> Program:
        """The program of `plan`. Raises PlanError."""
        return Program(self._accepted.image, self.machine)

    @property
    def _accepted(self) -> NativeProgram:
        return self._section.pipeline.accepted


@dataclass(frozen=True, eq=False)
class JobRun:
    """A run of a job: `runs` has one for each section. Times are without dwells.

    bus   where it ran; None: offline
    """

    runs: tuple[Run, ...]
    bus: str | None = None

    @property
    def duration_s(self) -> float:
        """Time of all motions."""
        return sum(float(run.t_s[-1] - run.t_s[0]) for run in self.runs)

    @property
    def greatest_contour_error_um(self) -> float:
        """Of all sections: distance from the fitted curve, not from the programmed path."""
        return max(run.greatest_contour_error_um for run in self.runs)

    @property
    def greatest_following_error_um(self) -> float:
        """Of one axis, of all sections."""
        return max(run.greatest_following_error_um for run in self.runs)

    @property
    def deadline_misses(self) -> int | None:
        """Ticks that the controller missed; None offline."""
        if self.bus is None:
            return None
        return sum(run.deadline_misses or 0 for run in self.runs)

    def __repr__(self) -> str:
        where = "offline" if self.bus is None else f"on {self.bus}"
        return f"JobRun({len(self.runs)} sections, {where})"


@dataclass(frozen=True, eq=False)
class Job:
    """A toolpath on a machine: sections from rest to rest, one after the other; made by `load_job`.

    >>> from tempfile import TemporaryDirectory
    >>> from hodograph import Machine, load_job
    >>> with TemporaryDirectory() as folder:
    ...     file = FilePath(folder, "part.ngc")
    ...     _ = file.write_text("G21 G1 X20 F3000\\nG4 P0.5\\nX0 Y10\\nM30\\n")
    ...     job = load_job(file, Machine.example("mill"))
    >>> len(job.sections), job.dwell_s
    (2, 0.5)
    >>> job.simulate().greatest_contour_error_um < 1.0
    True
    """

    _job: jobs.Job = field(repr=False)
    machine: Machine

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The sections in the order in which they run."""
        return tuple(Section(section, self.machine) for section in self._job.sections)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes, one line each: elements that were left out, words that the machine does not execute."""
        return self._job.notes

    @property
    def length_mm(self) -> float:
        """Length of all curves."""
        return self._job.length_mm

    @property
    def deviation_um(self) -> float:
        """Certified bound of the distance between the programmed path and the curves, both ways."""
        return self._job.deviation_um

    @property
    def dwell_s(self) -> float:
        """Total time of the programmed dwells."""
        return self._job.dwell_s

    @cached_property
    def duration_s(self) -> float:
        """Time of all programs, without dwells. Raises PlanError."""
        return math.fsum(section.plan.duration_s for section in self.sections)

    def simulate(self, kernel: Kernel | None = None) -> JobRun:
        """Plans and runs every section with simulated drives, without a bus. `kernel` None: the machine's.

        Raises PlanError, and InputError when an axis of the machine has no drive file.
        """
        found = simulate_job(self._job, kernel)
        return JobRun(tuple(Run(motion) for motion in found.motions))

    def __repr__(self) -> str:
        return f"Job({self._job.file.name!r}, {len(self._job.sections)} sections, {self.length_mm:.6g} mm)"


def load_job(
    file: str | PathLike[str],
    machine: Machine,
    *,
    tolerance_mm: float = jobs.DEFAULT_TOLERANCE_MM,
    feed_mm_s: float | None = None,
    feeds: Mapping[str, float] | None = None,
    layers: Sequence[str] = (),
    ids: Sequence[str] = (),
    gap_mm: float | None = None,
    lift_mm: float | None = None,
    scale: float | None = None,
    unit_mm: float | None = None,
    columns: Sequence[str] = (),
    noise_mm: float | None = None,
    closed: bool = False,
    block_delete: bool = False,
    skip_optional_stops: bool = False,
) -> Job:
    """The job of a toolpath file: G-code, DXF, SVG or points, by the ending of its name.

    tolerance_mm   greatest distance between programmed path and curves; 0: stop at the end of each move
    feed_mm_s      in place of the feeds of the file; drawings need it
    feeds          drawings: feeds by layer or colour, in place of `feed_mm_s`
    layers, ids    drawings: only these layers, in this order; only elements with these identities
    gap_mm         drawings: ends of contours that are this near are joined
    lift_mm        drawings: height of rapid moves above the drawing
    scale, unit_mm drawings and points: factor of lengths; length of a unit
    columns        points: names of the columns ("-": not read)
    noise_mm       points: greatest distance of points from the curve that they sample, which is the tolerance then
    closed         points: the path returns to the first point
    block_delete   G-code: lines that begin with "/" are left out
    skip_optional_stops  G-code: M1 is left out

    Raises InputError, naming file and line, and PlanError.
    """
    reading = ReadOptions(
        feed_mm_s=feed_mm_s,
        feeds=tuple((feeds or {}).items()),
        layers=tuple(layers),
        ids=tuple(ids),
        gap_mm=gap_mm,
        lift_mm=lift_mm,
        scale=scale,
        unit_mm=unit_mm,
        columns=tuple(columns),
        noise_mm=noise_mm,
        closed=closed,
        block_delete=block_delete,
        skip_optional_stops=skip_optional_stops,
    )
    asked_mm = asked_tolerance_mm(tolerance_mm, reading)
    return Job(jobs.load_job(FilePath(file), machine._file, asked_mm, reading), machine)
