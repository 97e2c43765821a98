# SPDX-License-Identifier: MIT
"""The report of a campaign: one self-contained HTML file, and its figures as PNG files. Used by cli/campaign_command.
Writes these files.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from ..report.page import Figure, render, write_page
from ..report.style import BLUE, GREEN, GREY, INK, ORANGE, RED, png, styled
from .definition import Campaign
from .results import Results, varied_numbers
from .summary import HEADER, Group, cells, groups

GROUPS_SHOWN = 40
POINTS_SHOWN = 3000
"""Most points of a group in a scatter plot; of more, every n-th is drawn."""
_COLORS = (BLUE, ORANGE, GREEN, RED, GREY, INK)
_ROW_IN = 0.28
_COLUMNS = 3


def spread_figure(groups: Sequence[Group], contour_um: Sequence[NDArray[np.float64]]) -> bytes:
    """Boxes of the greatest contour error: quartiles, whiskers from the 5th to the 95th percentile, dots beyond."""
    shown = [(g, c) for g, c in zip(groups, contour_um, strict=True) if c.size][:GROUPS_SHOWN]
    figure, axes = pyplot.subplots(figsize=(9.6, 1.2 + _ROW_IN * len(shown)))
    boxes = axes.boxplot(
        [values for _, values in shown],
        orientation="horizontal",
        whis=(5, 95),
        widths=0.6,
        patch_artist=True,
        flierprops={"marker": ".", "markersize": 2, "markeredgecolor": GREY},
        medianprops={"color": INK},
        tick_labels=[group.label for group, _ in shown],
    )
    for box in boxes["boxes"]:
        box.set(facecolor=BLUE, alpha=0.45, edgecolor=BLUE)
    axes.invert_yaxis()
    _scale(axes, "x", np.concatenate([values for _, values in shown]))
    axes.set_xlabel("greatest contour error of a run, µm")
    return png(figure)


def _scale(axes: Axes, name: str, values: NDArray[np.float64]) -> None:
    """Logarithmic, with plain numbers, where values differ by more than a factor of ten."""
    if values.size and values.min() > 0 and values.max() > 10 * values.min():
        axes.set(**{f"{name}scale": "log"})
        axis = axes.xaxis if name == "x" else axes.yaxis
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())


def dependence_figure(
    names: Sequence[str],
    varied: Sequence[NDArray[np.float64]],
    groups: Sequence[Group],
    contour_um: Sequence[NDArray[np.float64]],
) -> bytes:
    """Contour error over each figure that varies: `varied[group]` is (runs, names), `contour_um[group]` (runs,)."""
    rows = -(-len(names) // _COLUMNS)
    figure, grid = pyplot.subplots(
        rows,
        _COLUMNS,
        figsize=(9.6, 0.4 + 3.0 * rows),
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    for place, axes in enumerate(grid.flat):
        if place >= len(names):
            axes.set_visible(False)
            continue
        for i, (group, values) in enumerate(zip(groups, contour_um, strict=True)):
            every = max(1, values.size // POINTS_SHOWN)
            axes.plot(
                varied[i][::every, place],
                values[::every],
                ".",
                markersize=2.5,
                alpha=0.6,
                color=_COLORS[i % len(_COLORS)],
                label=group.label,
            )
        axes.set_xlabel(names[place])
    for axes in grid[:, 0]:
        axes.set_ylabel("contour error, µm")
        _scale(axes, "y", np.concatenate(list(contour_um)))
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3, markerscale=4
    )
    return png(figure)


GROUPS_COMPARED = 6
"""Most groups in the scatter plot: more cannot be distinguished."""
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
    """Each error with its frequency and the number of the first run that has it; the most frequent first."""
    first: dict[str, int] = {}
    for number, error in sorted(results.errors.items()):
        first.setdefault(error, number)
    shown = Counter(results.errors.values()).most_common(ERRORS_SHOWN)
    return [(error, count, first[error]) for error, count in shown]


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
