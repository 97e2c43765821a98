# SPDX-License-Identifier: MIT
"""The report of runs: one self-contained HTML file, and its figures as PNG files. Used by cli/. Writes these files;
reads the paper's examples where it compares a path with the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..bus.run import BusRun
from ..machine_limits import proved_limits
from ..paper import compare, quantity_name, shown
from ..paper.compare import CASES
from ..pipeline import Pipeline
from ..simulate import Motion
from ..spline.spatial import SpatialPHSpline
from .feed_figures import feed_figure, search_figure
from .page import Figure, file_name, render, write_page
from .path_figures import joint_figure, polygon_figure
from .run_figures import contour_figure, drive_figure
from .space_figures import extra_axes_figure, space_contour_figure, space_path_figure
from .style import styled

Case = tuple[Pipeline, Motion, BusRun | None]


def write_report(cases: Sequence[Case], directory: Path) -> Path:
    """Writes report.html and PNG files into `directory`; returns the HTML file.

    Raises InputError if a file cannot be written.
    """
    with styled():
        shown_cases = _distinct(_once([_case(*case) for case in cases]))
    text = _render(cases, shown_cases)
    figures = (
        (f"{case['anchor']}_{figure.name}", figure)
        for case in shown_cases
        for figure in case["figures"]
    )
    return write_page(directory / "report.html", text, figures)


def _once(shown_cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Removes each figure that an earlier case shows already: paths with the same profile have the same search."""
    first: dict[bytes, str] = {}
    for case in shown_cases:
        for figure in list(case["figures"]):
            owner = first.setdefault(figure.png, case["name"])
            if owner != case["name"]:
                case["figures"].remove(figure)
                case["notes"] = (*case["notes"], f"figure of the {figure.name}: as for {owner}")
    return shown_cases


def _distinct(shown_cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Numbers the anchors of later cases whose file has the same name as an earlier one in another folder."""
    taken: set[str] = set()
    for case in shown_cases:
        anchor, count = case["anchor"], 1
        while case["anchor"] in taken:
            count += 1
            case["anchor"] = f"{anchor}-{count}"
        taken.add(case["anchor"])
    return shown_cases


def _case(pipeline: Pipeline, motion: Motion, run: BusRun | None) -> dict[str, Any]:
    plan = pipeline.compilation.plan
    source = "recorded on the bus" if run is not None else "simulated"
    in_space = isinstance(pipeline.curve, SpatialPHSpline)
    figures = [
        _space_path(pipeline) if in_space else _plane_path(pipeline),
        Figure(
            "feed",
            "Feed, tangential acceleration and jerk of the plain quintic profile and of the one used "
            "(paper, figures 2 and 4); red: limits of the path file.",
            feed_figure(pipeline, plan),
        ),
    ]
    search = search_figure(plan)
    if search is not None:
        caption = "Progress of the pattern search for n_c (paper, figure 3)."
        figures.append(Figure("search", caption, search))
    figures += (
        _space_run(pipeline, motion, source) if in_space else _plane_run(pipeline, motion, source)
    )
    figures.append(
        Figure(
            "drives",
            f"Following error and voltage by axis, {source}.",
            drive_figure(pipeline, motion),
        )
    )
    return {
        "name": pipeline.file.name,
        "anchor": file_name(pipeline.file.name, "path"),
        "file": str(pipeline.file.file),
        "notes": (*_unit_note(pipeline), *pipeline.notes(plan)),
        "proof": proved_limits(pipeline.machine),
        "figures": figures,
        "load": _load(run),
    }


def _unit_note(pipeline: Pipeline) -> tuple[str, ...]:
    """A text in which mm is degrees on a path that moves rotary axes alone."""
    if pipeline.unit == "mm":
        return ()
    return ("rotary axes move alone: mm stands for degrees, µm for thousandths of a degree",)


def _plane_path(pipeline: Pipeline) -> Figure:
    return Figure(
        "path",
        "Control polygon, nodal points and the C2 PH quintic spline; curvature (paper, figure 1).",
        polygon_figure(pipeline),
    )


def _space_path(pipeline: Pipeline) -> Figure:
    caption = "Given points and the C2 PH quintic spline in an isometric view; curvature."
    return Figure("path", caption, space_path_figure(pipeline))


def _plane_run(pipeline: Pipeline, motion: Motion, source: str) -> list[Figure]:
    return [
        Figure(
            "joints",
            "First and second differences of chord speed over the period at constant feed (paper, figure 5). "
            "The dashed curve is what the shortening of chords on a curve gives by itself.",
            joint_figure(pipeline, pipeline.compilation.plan),
        ),
        Figure(
            "contour",
            f"Commanded and actual path, the worst place enlarged, and the contour error along the run, {source} "
            "(paper, figure 7).",
            contour_figure(pipeline, motion),
        ),
    ]


def _space_run(pipeline: Pipeline, motion: Motion, source: str) -> list[Figure]:
    caption = (
        "Commanded and actual path in an isometric view and three projections, and the contour error along the run, "
        f"{source}."
    )
    figures = [Figure("contour", caption, space_contour_figure(pipeline, motion))]
    if motion.extra_names:
        caption = (
            "The axes after x, y, z over arc length; and how far they are from where the curve has them beside the "
            f"point nearest to the tool, {source}."
        )
        figures.append(Figure("axes", caption, extra_axes_figure(pipeline, motion)))
    return figures


def _misses(run: BusRun | None) -> str:
    return "–" if run is None or run.deadline_misses is None else str(run.deadline_misses)


def _load(run: BusRun | None) -> dict[str, Any] | None:
    """The table of bus load, None for a simulated run."""
    if run is None:
        return None

    def share(value: float | None) -> str:
        return "–" if value is None else f"{value:.2f}"

    rows = [
        (k.kind, str(k.frames), *map(share, (k.plain_percent, k.measured_percent, k.worst_percent)))
        for k in run.load.kinds
    ]
    rows.append(("frames of the ticks", "", *map(share, run.load.cyclic())))
    return {"bitrate": run.load.bitrate, "rows": rows}


def _render(cases: Sequence[Case], shown_cases: list[dict[str, Any]]) -> str:
    buses = sorted({run.bus for _, _, run in cases if run is not None})
    return render(
        "template.html.j2",
        names=", ".join(case["name"] for case in shown_cases),
        subtitle=f"Recorded on {', '.join(buses)}." if buses else "Simulated without a bus.",
        cases=shown_cases,
        summary=_summary(cases),
        comparison=_comparison(cases),
    )


def _summary(cases: Sequence[Case]) -> list[tuple[str, list[str]]]:
    rows: dict[str, list[str]] = {}
    for pipeline, motion, run in cases:
        plan, spline = pipeline.compilation.plan, pipeline.curve
        values = {
            "path": f"{'closed' if spline.closed else 'open'}, {spline.segment_count} segments",
            "length, mm": f"{spline.length_mm:.4f}",
            "profile": plan.profile,
            "n_c": "–" if plan.n_c is None else f"{plan.n_c:.4f}",
            "feed, mm/s": f"{plan.feed_mm_s:.4g}",
            "duration, s": f"{plan.duration_s:.4f}",
            "peak acceleration, mm/s²": f"{plan.peak_acceleration_mm_s2:.1f}",
            "peak jerk, mm/s³": f"{plan.peak_jerk_mm_s3:.0f}",
            "ticks": str(motion.ticks),
            "kernel": motion.kernel,
            "greatest contour error, µm": f"{motion.max_contour_error_um:.3f}",
            **_orientation(cases, motion),
            "greatest following error, µm": f"{motion.max_following_error_um:.1f}",
            "greatest voltage, V": "–" if motion.max_volts is None else f"{motion.max_volts:.3f}",
            "bus": run.bus if run is not None else "none (simulated)",
            "pace": run.pace if run is not None else "–",
            "deadline misses": _misses(run),
            "bus load, %": f"{run.load.cyclic()[1]:.1f}" if run is not None else "–",
            "frames recorded": str(run.frames) if run is not None else "–",
            "SHA-256 of setpoints": motion.setpoints_sha256,
            "SHA-256 of encoder counts": motion.encoders_sha256,
        }
        for name, value in values.items():
            rows.setdefault(name, []).append(value)
    return list(rows.items())


def _orientation(cases: Sequence[Case], motion: Motion) -> dict[str, str]:
    """A row for the axes after x, y, z, if one of the cases has such axes."""
    if not any(one.extra_names for _, one, _ in cases):
        return {}
    every = zip(motion.extra_names, motion.units[3:], motion.max_orientation_error, strict=True)
    texts = [
        f"{name} {1000 * most:.3f} {'µm' if unit == 'mm' else 'mdeg'}" for name, unit, most in every
    ]
    return {"greatest orientation error": ", ".join(texts) or "–"}


_SIDES = ("paper", "ours", "ours_1ms")


def _comparison(cases: Sequence[Case]) -> dict[str, Any] | None:
    if not {pipeline.file.name for pipeline, _, _ in cases} & set(CASES):
        return None
    found = compare()
    curves = list(found)
    rows = [
        {
            "name": quantity_name(key),
            "unit": found[curves[0]][key]["unit"],
            "cells": [shown(found[c][key][side]) for c in curves for side in _SIDES],
        }
        for key in found[curves[0]]
    ]
    return {"curves": curves, "rows": rows}
