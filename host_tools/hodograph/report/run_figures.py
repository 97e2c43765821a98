# SPDX-License-Identifier: MIT
"""Figures of a run (paper figure 7): path with the worst place enlarged, contour error, drives. Used by report/html and
report/space_figures. Returns PNG bytes; the pipeline may read its machine file.
"""

from __future__ import annotations

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes

from ..pipeline import Pipeline
from ..simulate import Motion
from .output_marks import mark_switching_times
from .style import BLUE, GREEN, GREY, ORANGE, RED, SOFT, plan_axes, png

ALLOWED_UM = 30.0
"""The contour error that the paper allows."""

_ZOOM_FACTOR = 5.0
"""Half width of the enlarged figure, as a multiple of the greatest contour error."""
_LEAST_ZOOM_UM = 5.0
"""Least half width."""
_COLORS = (BLUE, GREEN, ORANGE, RED, GREY, SOFT)


def contour_figure(pipeline: Pipeline, motion: Motion) -> bytes:
    """Commanded and actual path, the worst place enlarged, contour error along the run."""
    figure = pyplot.figure(figsize=(9.6, 8.0))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.35, 1))
    plane, zoom = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    error = figure.add_subplot(grid[1, :])
    worst = int(np.argmax(motion.contour_error_um))
    _plane(plane, pipeline, motion, worst)
    _zoom(zoom, motion, worst)
    error_axes(error, motion, worst)
    return png(figure)


def _plane(axes: Axes, pipeline: Pipeline, motion: Motion, worst: int) -> None:
    set_mm, act_mm = motion.cmd_mm, motion.act_mm
    axes.plot(set_mm[:, 0], set_mm[:, 1], color=GREY, linewidth=3.5, label="commanded")
    axes.plot(act_mm[:, 0], act_mm[:, 1], color=BLUE, linewidth=1.2, label="actual")
    axes.plot(*act_mm[worst], "o", color=RED, markersize=7, fillstyle="none", label="worst place")
    plan_axes(axes, pipeline.drawing_axes)
    axes.set_title(f"{pipeline.file.name}: commanded and actual path")
    axes.legend(loc="best")


def _zoom(axes: Axes, motion: Motion, worst: int) -> None:
    centre = motion.act_mm[worst]
    half_um = max(_ZOOM_FACTOR * float(motion.contour_error_um[worst]), _LEAST_ZOOM_UM)
    near = slice(max(0, worst - 400), worst + 400)
    curve_um = 1e3 * (motion.cmd_mm[near] - centre)
    actual_um = 1e3 * (motion.act_mm[near] - centre)
    axes.plot(*curve_um.T, color=GREY, linewidth=2.5, label="commanded")
    axes.plot(*actual_um.T, ".-", color=BLUE, linewidth=1.2, markersize=3.5, label="actual")
    foot = _foot(curve_um)
    axes.plot([0, foot[0]], [0, foot[1]], color=RED, linewidth=1.6)
    label = f"contour error {motion.contour_error_um[worst]:.2f} µm"
    axes.text(0.97, 0.04, label, transform=axes.transAxes, ha="right", color=RED)
    axes.legend(loc="upper right")
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(-half_um, half_um)
    axes.set_ylim(-half_um, half_um)
    axes.set_xlabel(f"x from {centre[0]:.4f} mm, µm")
    axes.set_ylabel(f"y from {centre[1]:.4f} mm, µm")
    axes.set_title("worst place, enlarged")


def _foot(curve_um: np.ndarray) -> np.ndarray:
    """The point of the polyline nearest to 0."""
    a, step = curve_um[:-1], np.diff(curve_um, axis=0)
    length2 = np.maximum(np.sum(step * step, axis=1), 1e-300)
    t = np.clip(-np.sum(a * step, axis=1) / length2, 0.0, 1.0)
    feet = a + t[:, None] * step
    return np.asarray(feet[np.argmin(np.sum(feet * feet, axis=1))])


def error_axes(axes: Axes, motion: Motion, worst: int) -> None:
    """The contour error over the time of a run; `worst` is its greatest row."""
    t_s, error = motion.t_s, motion.contour_error_um
    axes.fill_between(t_s, error, color=BLUE, alpha=0.18, linewidth=0)
    axes.plot(t_s, error, color=BLUE, linewidth=1.3)
    axes.plot(t_s[worst], error[worst], "o", color=RED, markersize=6, fillstyle="none")
    axes.annotate(
        f"{error[worst]:.2f} µm at {motion.arc_length_mm[worst]:.2f} mm",
        xy=(t_s[worst], error[worst]),
        xytext=(8, -4),
        textcoords="offset points",
        color=RED,
    )
    if error[worst] > 0.4 * ALLOWED_UM:
        axes.axhline(ALLOWED_UM, color=ORANGE, linestyle=(0, (5, 3)), linewidth=1.0)
        axes.annotate(
            "allowed by the paper", xy=(0, ALLOWED_UM), xytext=(4, 3),
            textcoords="offset points", color=ORANGE,
        )  # fmt: skip
    end_s = motion.ticks * motion.period_us / 1e6
    axes.axvline(end_s, color=SOFT, linewidth=0.9, linestyle=(0, (2, 3)))
    axes.set_ylim(bottom=0)
    axes.margins(x=0)
    axes.set_xlabel("time, s (dashed: last setpoint, then settling)")
    axes.set_ylabel("contour error, µm")
    axes.set_title("distance of the encoder position from the exact curve")
    mark_switching_times(axes, motion)


def drive_figure(pipeline: Pipeline, motion: Motion) -> bytes:
    """Following error and voltage of each axis."""
    figure, (following, volts) = pyplot.subplots(2, 1, figsize=(9.6, 4.8), sharex=True)
    path_axes = pipeline.machine.path_axes
    for i, (axis, color) in enumerate(zip(path_axes, _COLORS, strict=False)):
        following.plot(motion.t_s, motion.following_error_um[:, i], color=color, label=axis.name)
        volts.plot(motion.t_s, motion.volts[:, i], color=color, label=axis.name)
    limits = [axis.drive.volts_limit for axis in path_axes if axis.drive is not None]
    if limits and (motion.max_volts or 0.0) > 0.5 * (limit := min(limits)):
        for sign in (-1, 1):
            volts.axhline(sign * limit, color=RED, linewidth=0.9, linestyle=(0, (5, 3)))
    turning = any(axis.turns for axis in path_axes)
    following.set_ylabel(f"setpoint - position, µm{', mdeg' if turning else ''}")
    volts.set_ylabel("drive voltage, V" if motion.max_volts is not None else "voltage not reported")
    volts.set_xlabel("time, s")
    following.set_title(f"{pipeline.file.name}: following error and voltage of the axes")
    following.legend(loc="upper right", ncols=len(path_axes))
    for axes in (following, volts):
        axes.margins(x=0)
    return png(figure)
