# SPDX-License-Identifier: MIT
"""The report of a tuning: one HTML file that needs nothing else, and its figures as PNG files."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2

from ..chain import Chain
from ..errors import InputError
from ..tune import Tuning
from ..tune.text import SATURATED, axis_table, case_table, poles_text
from .style import styled
from .tune_figures import contour_figure, frequency_figure, step_figure


@dataclass(frozen=True)
class _Figure:
    name: str
    caption: str
    png: bytes

    @property
    def base64(self) -> str:
        return base64.b64encode(self.png).decode()


def write_tune_report(tuning: Tuning, chains: Sequence[Chain], directory: Path) -> Path:
    """Writes tune.html and PNG files into `directory`; returns the HTML file. Raises InputError."""
    with styled():
        figures = list(_figures(tuning, chains))
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hodograph.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    text = environment.get_template("tune.html.j2").render(
        machine=str(tuning.machine.file),
        poles=poles_text(tuning),
        axes=axis_table(tuning),
        cases=case_table(tuning),
        saturated=SATURATED,
        figures=figures,
    )
    report = directory / "tune.html"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for figure in figures:
            (directory / f"{figure.name}.png").write_bytes(figure.png)
        report.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{directory}: cannot write the report: {error.strerror}") from None
    return report


def _figures(tuning: Tuning, chains: Sequence[Chain]) -> Iterator[_Figure]:
    for axis in tuning.axes:
        name = _file_name(axis.name)
        yield _Figure(
            f"frequency_{name}",
            f"Axis {axis.name}: frequency responses; orange: where the gain is 1.",
            frequency_figure(axis),
        )
        yield _Figure(f"step_{name}", f"Axis {axis.name}: step responses.", step_figure(axis))
    for path, chain in zip(tuning.paths, chains, strict=True):
        yield _Figure(
            f"contour_{_file_name(path.name)}",
            f"{path.name}: contour error along the run, the plant as modelled.",
            contour_figure(tuning, path, chain),
        )


def _file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-") or "unnamed"
