# SPDX-License-Identifier: MIT
"""The report of a toolpath. Its view of the path names the source line under the cursor. Used by cli/report_commands.
Reads lines of the G-code file; writes an HTML file and its figures as PNG files.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..job_simulation import JobMotion
from ..job_view import append_places, no_places, with_programmed
from ..machine_limits import proved_limits
from .page import Figure, render, write_page
from .style import styled
from .toolpath_figures import (
    corner_figure,
    feed_figure,
    path_figure,
    widest_corners,
)

MOST_POINTS = 20_000
"""Points of the view; of a longer job every n-th tick is drawn."""


def write_toolpath_report(run: JobMotion, directory: Path) -> Path:
    """Writes report.html and PNG files into `directory`; returns the HTML file. Raises InputError."""
    with styled():
        figures = _figures(run)
    text = render(
        "toolpath.html.j2",
        name=run.job.file.name,
        file=str(run.job.file),
        summary=_summary(run),
        sections=_section_rows(run),
        notes=run.job.notes,
        proof=proved_limits(run.job.machine),
        figures=figures,
        view=json.dumps(view_data(run), separators=(",", ":")).replace("</", "<\\/"),
    )
    return write_page(directory / "report.html", text, ((one.name, one) for one in figures))


def _figures(run: JobMotion) -> list[Figure]:
    figures = [
        Figure("path", "The path from above, with the feed as colour.", path_figure(run)),
        Figure("feed", "Feed along the path over time.", feed_figure(run)),
    ]
    corners = widest_corners(run.job)
    if corners:
        caption = (
            "Corners that the curve passes farthest from the programmed vertex, in the plane of their legs. "
            "The band is the tolerance."
        )
        figures.append(Figure("corners", caption, corner_figure(corners)))
    return figures


def _summary(run: JobMotion) -> list[tuple[str, str]]:
    job = run.job
    return [
        ("machine", job.machine.file.stem),
        ("lines that move", str(job.lines)),
        ("sections from rest to rest", str(len(job.sections))),
        ("PH segments", str(job.segments)),
        ("length, mm", f"{job.length_mm:.3f}"),
        ("duration without dwells, s", f"{run.duration_s:.3f}"),
        ("dwells, s", f"{job.dwell_s:g}"),
        ("certified deviation, µm", f"{job.deviation_um:.3f}"),
        ("greatest contour error, µm", _most(m.max_contour_error_um for m in run.path_motions)),
        ("greatest following error, µm", _most(m.max_following_error_um for m in run.path_motions)),
    ]


def _most(values: Iterable[float]) -> str:
    return f"{max(values, default=0.0):.3f}"


def _section_rows(run: JobMotion) -> list[tuple[str, ...]]:
    return [
        (
            str(number),
            f"{section.first_line} … {section.last_line}",
            f"{section.length_mm:.3f}",
            str(section.fitted.curve.segment_count),
            f"{section.deviation_um:.3f}",
            f"{(motion.ticks - 1) * run.period_s:.3f}",
        )
        for number, (section, motion) in enumerate(
            zip(run.job.sections, run.motions, strict=True), 1
        )
    ]


def view_data(run: JobMotion) -> dict[str, object]:
    """The data of the view: columns of ticks in program positions, their source lines, and the programmed path with its
    tolerance (0: sections have several).
    """
    step = max(1, -(-run.ticks // MOST_POINTS))
    columns = no_places()
    for section, motion in zip(run.job.sections, run.motions, strict=True):
        rows = np.unique(np.append(np.arange(0, motion.ticks, step), motion.ticks - 1))
        s_mm = motion.arc_length_mm[rows]
        at = section.places(motion.cmd_mm[rows])
        z = at[:, 2] if at.shape[1] > 2 else np.zeros(rows.size)
        values = np.column_stack((at[:, :2], z, motion.feed_mm_s[rows]))
        append_places(columns, section, s_mm, values)
    return with_programmed(run.job, columns, np.zeros(3))
