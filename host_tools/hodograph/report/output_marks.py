# SPDX-License-Identifier: MIT
"""Marks of outputs in figures: places on a path in the plane or in space, and times in a run. Used by
report/path_figures, report/run_figures and report/space_figures. Draws into the Matplotlib axes that it is given; the
pipeline may read its machine file.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..config.outputs import placed_outputs, words_of
from ..pipeline import Pipeline
from ..simulate import Motion
from ..spline import coordinates
from .style import RED

_LABEL = "outputs switch"


def mark_outputs(axes: Any, pipeline: Pipeline) -> None:
    """The places where outputs of a path file switch, with their names, in a figure of the plane or of space."""
    if not pipeline.file.outputs or pipeline.machine_or_none is None:
        return
    curve = pipeline.curve
    placed = placed_outputs(pipeline.machine.outputs, pipeline.events)
    places_mm = np.minimum([one.place_mm for one in placed], curve.length_mm)
    points = coordinates(curve.point(places_mm))
    in_space = hasattr(axes, "get_zlim")
    points = points[:, : 3 if in_space else 2]
    axes.plot(*points.T, "v", color=RED, markersize=7, label=_LABEL)
    for place_mm in np.unique(places_mm):
        here = places_mm == place_mm
        words = words_of([one for one, at in zip(placed, here, strict=True) if at])
        point = points[int(np.argmax(here))]
        if in_space:
            axes.text(*point, f"  {words}", fontsize=8)
        else:
            axes.annotate(
                words, tuple(point), xytext=(7, 5), textcoords="offset points", fontsize=8
            )


def mark_switching_times(axes: Axes, motion: Motion) -> None:
    """Marks the times at which outputs of a run switched, with their names, in a figure over time in s."""
    acted = motion.acted_outputs
    for time_s in sorted({one.time_s for one in acted}):
        words = words_of([one for one in acted if one.time_s == time_s])
        axes.axvline(time_s, color=RED, linewidth=0.9, linestyle=(0, (4, 2)))
        axes.annotate(
            words,
            (time_s, 0.0),
            xycoords=("data", "axes fraction"),
            xytext=(3, 3),
            textcoords="offset points",
            color=RED,
            fontsize=8,
        )
