# SPDX-License-Identifier: MIT
"""The report of a tuning: one HTML file that needs nothing else, and its figures as PNG files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ..pipeline import Pipeline
from ..tune import Tuning
from ..tune.text import SATURATED, axis_table, case_table, poles_text
from .page import Figure, file_name, render, write_page
from .style import styled
from .tune_figures import contour_figure, frequency_figure, step_figure


def write_tune_report(tuning: Tuning, chains: Sequence[Pipeline], directory: Path) -> Path:
    """Writes tune.html and PNG files into `directory`; returns the HTML file. Raises InputError."""
    with styled():
        figures = list(_figures(tuning, chains))
    text = render(
        "tune.html.j2",
        machine=str(tuning.machine.file),
        poles=poles_text(tuning),
        axes=axis_table(tuning),
        cases=case_table(tuning),
        saturated=SATURATED,
        figures=figures,
    )
    return write_page(directory / "tune.html", text, ((one.name, one) for one in figures))


def _figures(tuning: Tuning, chains: Sequence[Pipeline]) -> Iterator[Figure]:
    for axis in tuning.axes:
        name = file_name(axis.name, "unnamed")
        yield Figure(
            f"frequency_{name}",
            f"Axis {axis.name}: frequency responses; orange: where the gain is 1.",
            frequency_figure(axis),
        )
        yield Figure(f"step_{name}", f"Axis {axis.name}: step responses.", step_figure(axis))
    for path, chain in zip(tuning.paths, chains, strict=True):
        yield Figure(
            f"contour_{file_name(path.name, 'unnamed')}",
            f"{path.name}: contour error along the run, the plant as modelled.",
            contour_figure(tuning, path, chain),
        )
