# SPDX-License-Identifier: MIT
"""What a browser draws of a job: the programmed path, and the curves with feed and source line at each place.

Used by report/toolpath_report and cli/monitor_command. Reads lines of the G-code file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from .job import Job, JobSection
from .toolpath.files import is_gcode

Real = NDArray[np.float64]

MOST_PROGRAMMED = 20_000
"""Points of the programmed path; of a longer one every n-th chord is drawn."""

MOST_CURVE = 10_000
"""Points of the curves on the live page."""

_LONGEST_LINE = 100
"""Characters of a source line that a view shows."""


def curve_view(job: Job) -> dict[str, object]:
    """The curves at equal steps of time of the feed plan, in machine coordinates: columns x, y, z in mm, f in mm/s, l
    (source line), r (1: rapid move); the programmed path, and the tolerance (0: sections have several). Sections of
    rotary axes alone are left out.

    Plans the feed of all sections. Raises PlanError.
    """
    sections = [section for section in job.sections if section.stands_at is None]
    offset_mm = np.array([*job.machine.offset_mm, 0.0][:3])
    whole_s = sum(section.pipeline.plan.duration_s for section in sections)
    columns = no_places()
    for section in sections:
        plan = section.pipeline.plan
        share = plan.duration_s / max(whole_s, 1e-9)
        count = min(round(plan.duration_s * 1e6 / job.machine.period_us), round(MOST_CURVE * share))
        t_s = np.linspace(0.0, plan.duration_s, max(count, 2))
        s_mm = plan.arc_length(t_s)
        at = section.fitted.curve.point(s_mm) + offset_mm
        append_places(columns, section, s_mm, np.column_stack((at, plan.feed(t_s))))
    return with_programmed(job, columns, offset_mm)


def no_places() -> dict[str, list[object]]:
    """The columns of `append_places`, empty: x, y, z in mm, f (feed in mm/s), l (source line), r (1: rapid move)."""
    return {name: [] for name in "xyzflr"}


def with_programmed(
    job: Job, columns: dict[str, list[object]], offset_mm: Real
) -> dict[str, object]:
    """Columns of places, with the source lines that they name, the programmed path and its tolerance (0: several)."""
    tolerances = {one.tolerance_mm for one in job.sections if one.stands_at is None}
    return {
        **columns,
        "text": _source_lines(job, columns["l"]),
        "programmed": _programmed(job, offset_mm),
        "tolerance": tolerances.pop() if len(tolerances) == 1 else 0.0,
    }


def append_places(
    columns: dict[str, list[object]], section: JobSection, s_mm: Real, values: Real
) -> None:
    """Adds places of a section at arc lengths (n,) with their x, y, z and feed (n, 4)."""
    for name, column in zip("xyzf", values.T, strict=True):
        columns[name] += np.round(column, 4).tolist()
    columns["l"] += section.line_at(s_mm).tolist()
    columns["r"] += section.is_rapid_at(s_mm).astype(int).tolist()


def _programmed(job: Job, offset_mm: Real) -> dict[str, list[float]]:
    """Points of the programmed path, `offset_mm` (3,) added: columns x, y, z in mm."""
    points = [one.fitted.reference.point for one in job.sections if one.stands_at is None]
    every = np.concatenate([np.zeros((0, 3)), *points]) + offset_mm
    step = max(1, -(-len(every) // MOST_PROGRAMMED))
    rows = np.unique(np.append(np.arange(0, len(every), step), max(len(every) - 1, 0)))
    shown = every[rows] if len(every) else every
    return {name: np.round(column, 4).tolist() for name, column in zip("xyz", shown.T, strict=True)}


def _source_lines(job: Job, wanted: Iterable[object]) -> dict[str, str]:
    """Text of source lines by number; empty where the file has no lines, or came from standard input."""
    if not is_gcode(job.file) or not job.file.is_file():
        return {}
    return dict(_lines(job, {int(str(line)) for line in wanted}))


def _lines(job: Job, wanted: set[int]) -> Iterator[tuple[str, str]]:
    with job.file.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if number in wanted:
                yield str(number), line.strip()[:_LONGEST_LINE]
