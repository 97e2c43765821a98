# SPDX-License-Identifier: MIT
"""Colours, fonts and sizes of all figures, and their PNG bytes. Used by report/ and campaign/report. Sets the backend
of Matplotlib, and its settings inside `styled`, for the whole process; one thread.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, SOFT, GRID = "#22282f", "#6b7684", "#e3e7ec"
BLUE, ORANGE, GREEN, RED, GREY = "#1f6fb4", "#e07b28", "#2a9461", "#c23b3b", "#9aa4b0"
DPI = 144

_SETTINGS: Any = {
    "figure.dpi": DPI,
    "figure.facecolor": "white",
    "figure.autolayout": True,
    "font.size": 9.5,
    "font.family": "DejaVu Sans",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
}


@contextmanager
def styled() -> Iterator[None]:
    """Applies the settings to the figures made inside."""
    with matplotlib.rc_context(_SETTINGS):
        yield


def png(figure: Figure) -> bytes:
    """The figure as PNG; closes it."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    pyplot.close(figure)
    return buffer.getvalue()


def plan_axes(axes: Axes, names: Sequence[str] = ("x, mm", "y, mm")) -> None:
    """Axes that show the plane of these: equal scales."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[1])
