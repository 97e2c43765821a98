# SPDX-License-Identifier: MIT
"""Figures of a campaign: how the contour error is spread in each group, and what it depends on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from ..report.style import BLUE, GREEN, GREY, INK, ORANGE, RED, png
from .summary import Group

GROUPS_SHOWN = 40
POINTS_SHOWN = 3000
"""Of a group in a scatter plot: every n-th where there are more."""
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
    """Contour error over each figure that varies: `varied[group]` is (runs, names), beside `contour_um[group]`."""
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
