# SPDX-License-Identifier: MIT
"""Figures of a path in space: the curve with its given points, a run from four sides, and the axes after x, y, z. Used
by report/html. Returns PNG bytes; the pipeline may read its machine file.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from ..config import SpacePathSpec
from ..pipeline import Pipeline
from ..simulate import Motion
from ..spline.spatial import SpatialPHSpline
from .output_marks import mark_outputs
from .run_figures import error_axes
from .style import BLUE, GREY, ORANGE, RED, png

_SAMPLES = 2000
_SIDES = ((0, 1), (0, 2), (1, 2))
"""The axes of each projection."""


def space_path_figure(pipeline: Pipeline) -> bytes:
    """Given points and curve in an isometric view, and the curvature along the curve."""
    spline, given = pipeline.curve, pipeline.file.given_path.points
    assert isinstance(spline, SpatialPHSpline)
    s_mm = np.linspace(0.0, spline.length_mm, _SAMPLES)
    curve = spline.point(s_mm).T
    if given.ndim == 1:  # in the plane: x + iy
        given = np.stack([given.real, given.imag, np.zeros(given.size)], axis=1)
    figure = pyplot.figure(figsize=(9.6, 4.4))
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1))
    view = _isometric(figure, grid[0, 0], pipeline)
    view.plot(*given.T, "o", color=ORANGE, markersize=4, label="given points")
    view.plot(*curve, color=BLUE, linewidth=1.6, label="C2 PH quintic spline")
    mark_outputs(view, pipeline)
    view.legend(loc="best")
    curvature = figure.add_subplot(grid[0, 1])
    curvature.plot(s_mm, np.abs(spline.curvature(s_mm)), color=BLUE)
    for joint in spline.segment_starts_mm:
        curvature.axvline(float(joint), color=GREY, linewidth=0.7, linestyle=(0, (2, 3)), zorder=0)
    curvature.set_xlabel("arc length, mm")
    curvature.set_ylabel("curvature, 1/mm")
    curvature.set_title("Curvature; dashed: joints")
    curvature.margins(x=0)
    return png(figure)


def space_contour_figure(pipeline: Pipeline, motion: Motion) -> bytes:
    """Commanded and actual path in an isometric view and three projections, and the contour error along the run."""
    figure = pyplot.figure(figsize=(9.6, 11.0))
    grid = figure.add_gridspec(3, 2, height_ratios=(1, 1, 0.8))
    worst = int(np.argmax(motion.contour_error_um))
    set_mm, act_mm = motion.cmd_mm[:, :3].T, motion.act_mm[:, :3].T
    names = pipeline.drawing_axes
    views: list[tuple[Any, tuple[int, ...]]] = [
        (_isometric(figure, grid[0, 0], pipeline), (0, 1, 2))
    ]
    for place, (across, up) in zip((grid[0, 1], grid[1, 0], grid[1, 1]), _SIDES, strict=True):
        axes = figure.add_subplot(place)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel(names[across])
        axes.set_ylabel(names[up])
        views.append((axes, (across, up)))
    for axes, which in views:
        rows = list(which)
        axes.plot(*set_mm[rows], color=GREY, linewidth=3.0, label="commanded")
        axes.plot(*act_mm[rows], color=BLUE, linewidth=1.2, label="actual")
        at = act_mm[rows, worst]
        axes.plot(*at[:, None], "o", color=RED, markersize=7, fillstyle="none", label="worst place")
    views[1][0].legend(loc="best")
    error_axes(figure.add_subplot(grid[2, :]), motion, worst)
    return png(figure)


def extra_axes_figure(pipeline: Pipeline, motion: Motion) -> bytes:
    """The axes after x, y, z over arc length, with their given points, and their distance from it in the run."""
    spline, given = pipeline.curve, pipeline.file.given_path
    assert isinstance(spline, SpatialPHSpline)
    s_mm = np.linspace(0.0, spline.length_mm, _SAMPLES)
    exact = spline.extra_point(s_mm)
    count = spline.extra_axes
    figure, grid = pyplot.subplots(count, 2, figsize=(9.6, 2.4 * count), squeeze=False)
    names = zip(motion.extra_names, motion.units[3:], strict=True)
    for k, (name, unit) in enumerate(names):
        place, error = grid[k]
        place.plot(s_mm, exact[:, k], color=BLUE, label="axis")
        if isinstance(given, SpacePathSpec) and given.through and k < given.extra.shape[1]:
            nodes = spline.segment_starts_mm[: len(given.extra)]
            points = given.extra[: len(nodes), k]
            place.plot(nodes, points, "o", color=ORANGE, markersize=4, label="given points")
        place.set_ylabel(f"{name}, {unit}")
        error.plot(motion.arc_length_mm, 1000.0 * motion.orientation_error[:, k], color=RED)
        error.set_ylabel("actual - exact, " + ("µm" if unit == "mm" else f"m{unit}"))
    grid[0, 0].legend(loc="best")
    grid[0, 0].set_title("Axes that follow the path")
    grid[0, 1].set_title("Orientation error beside the tool")
    for axes in grid[-1]:
        axes.set_xlabel("arc length, mm")
    for axes in grid.ravel():
        axes.margins(x=0)
    return png(figure)


def _isometric(figure: Figure, place: Any, pipeline: Pipeline) -> Any:
    axes = figure.add_subplot(place, projection="3d", proj_type="ortho")
    axes.view_init(elev=float(np.degrees(np.arctan(np.sqrt(0.5)))), azim=-45.0)
    names = pipeline.drawing_axes
    axes.set(xlabel=names[0], ylabel=names[1], zlabel=names[2])
    axes.set_title(pipeline.file.name)
    axes.set_aspect("equal")
    return axes
