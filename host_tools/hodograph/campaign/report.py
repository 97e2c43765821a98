# SPDX-License-Identifier: MIT
"""The report of a campaign: one HTML file that needs nothing else, and its figures as PNG files."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from ..report.page import Figure, render, write_page
from ..report.style import styled
from .definition import Campaign
from .figures import GROUPS_SHOWN, dependence_figure, spread_figure
from .results import Results
from .summary import HEADER, Group, cells, groups
from .table import varied_numbers

GROUPS_COMPARED = 6
"""Groups in the figure of what the error depends on: more cannot be told apart."""
ERRORS_SHOWN = 20


def write_report(campaign: Campaign, results: Results, folder: Path) -> Path:
    """Writes report.html and PNG files into the folder; returns the HTML file. Raises InputError."""
    found = groups(campaign.design, results)
    with styled():
        figures = _figures(campaign, results, found)
    text = render(
        "campaign.html.j2",
        name=campaign.file.stem,
        text=campaign.text,
        runs=campaign.design.total,
        failed=len(results.errors),
        header=HEADER,
        rows=[cells(group) for group in found],
        errors=_errors(results),
        figures=figures,
    )
    return write_page(folder / "report.html", text, ((one.name, one) for one in figures))


def _errors(results: Results) -> list[tuple[str, int, int]]:
    """Each error, how often it is there and the number of the first run with it; the most frequent first."""
    first: dict[str, int] = {}
    for number, error in sorted(results.errors.items()):
        first.setdefault(error, number)
    told = Counter(results.errors.values()).most_common(ERRORS_SHOWN)
    return [(error, count, first[error]) for error, count in told]


def _figures(campaign: Campaign, results: Results, found: list[Group]) -> list[Figure]:
    design, size = campaign.design, campaign.design.group_size
    contour = results.values[:, 0].reshape(-1, size)
    good = [~np.isnan(values) for values in contour]
    if not any(mask.any() for mask in good):
        return []
    spread = spread_figure(found, [v[m] for v, m in zip(contour, good, strict=True)])
    more = f" (the first {GROUPS_SHOWN} groups)" if len(found) > GROUPS_SHOWN else ""
    figures = [
        Figure(
            "spread",
            "The greatest contour error of each run by group: median, quartiles, 5th and 95th percentile, and what "
            f"lies beyond{more}.",
            spread,
        )
    ]
    if design.varied_columns:
        some = range(min(GROUPS_COMPARED, len(found)))
        varied = [varied_numbers(design, group)[good[group]] for group in some]
        values = [contour[group][good[group]] for group in some]
        caption = "The same over each figure that varies; colours are groups."
        figures.append(
            Figure(
                "dependence",
                caption,
                dependence_figure(design.varied_columns, varied, [found[i] for i in some], values),
            )
        )
    return figures
