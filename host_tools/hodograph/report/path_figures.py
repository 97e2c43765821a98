# SPDX-License-Identifier: MIT
"""Figures of the path: polygon, nodes and curve (paper figure 1), curvature, and differences of chord speed at constant
feed (figure 5). Used by report/html. Returns PNG bytes; the pipeline may read its machine file.
"""

from __future__ import annotations

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes

from ..feed import FeedPlan
from ..paper import chord_acceleration_mm_s2, joint_disturbance
from ..pipeline import Pipeline
from ..spline import PHSpline
from .output_marks import mark_outputs
from .style import BLUE, GREEN, GREY, ORANGE, plan_axes, png

_SAMPLES = 2000


def polygon_figure(pipeline: Pipeline) -> bytes:
    """Control polygon or given points, nodal points, PH curve, and the curvature along it."""
    spline = pipeline.spline_result.spline
    figure, (plane, curve) = pyplot.subplots(1, 2, figsize=(9.6, 4.4), width_ratios=(1.15, 1))
    _plane(plane, pipeline)
    s_mm = np.linspace(0.0, spline.length_mm, _SAMPLES)
    curve.plot(s_mm, spline.curvature(s_mm), color=BLUE)
    for joint in spline.segment_starts_mm:
        curve.axvline(float(joint), color=GREY, linewidth=0.7, linestyle=(0, (2, 3)), zorder=0)
    curve.set_xlabel("arc length, mm")
    curve.set_ylabel("curvature, 1/mm (left turns positive)")
    curve.set_title("Curvature; dashed: joints")
    curve.margins(x=0)
    return png(figure)


def _plane(axes: Axes, pipeline: Pipeline) -> None:
    path, spline = pipeline.file.path, pipeline.spline_result.spline
    given = path.points
    if not path.through:
        polygon = np.append(given, given[0]) if path.closed else given
        axes.plot(polygon.real, polygon.imag, color=GREY, linewidth=1.0, linestyle=(0, (4, 2)))
        axes.plot(
            given.real,
            given.imag,
            "s",
            color=GREY,
            markersize=4.5,
            label=f"{given.size} control points",
        )
    points = spline.point(np.linspace(0.0, spline.length_mm, _SAMPLES))
    axes.plot(points.real, points.imag, color=BLUE, linewidth=2.0, label="C2 PH quintic spline")
    nodes = spline.nodal_points
    axes.plot(
        nodes.real,
        nodes.imag,
        "o",
        color=ORANGE,
        markersize=5,
        markeredgecolor="white",
        label="nodal points" if not path.through else "given points",
    )
    mark_outputs(axes, pipeline)
    _start(axes, spline)
    plan_axes(axes, pipeline.drawing_axes)
    axes.margins(0.06)
    axes.set_title(f"{pipeline.file.name}: polygon, nodes, curve")
    axes.legend(loc="best")


def _start(axes: Axes, spline: PHSpline) -> None:
    """The start point, and an arrow in the direction of travel."""
    start, ahead = spline.point(np.array([0.0, 0.045 * spline.length_mm]))
    axes.plot(start.real, start.imag, "o", color=GREEN, markersize=7, label="start")
    axes.annotate(
        "",
        xy=(ahead.real, ahead.imag),
        xytext=(start.real, start.imag),
        arrowprops={"arrowstyle": "-|>", "color": GREEN, "linewidth": 2.2, "mutation_scale": 15},
    )


def joint_figure(pipeline: Pipeline, plan: FeedPlan) -> bytes:
    """First and second differences of chord speed along the whole path, joints marked."""
    spline = pipeline.spline_result.spline
    period_s = plan.period_us / 1e6
    found = joint_disturbance(spline, plan.feed_mm_s, period_s)
    s_mm = found.s_mm
    figure, (top, bottom) = pyplot.subplots(2, 1, figsize=(9.6, 5.2), sharex=True)
    top.plot(s_mm[1:-1], found.acceleration_mm_s2, color=BLUE, label="difference of chord speed")
    top.plot(
        s_mm[1:-1],
        chord_acceleration_mm_s2(spline, s_mm[1:-1], plan.feed_mm_s, period_s),
        color=ORANGE,
        linewidth=1.2,
        linestyle=(0, (4, 3)),
        label="chords shorter than arcs, nothing else",
    )
    bottom.plot(s_mm[1:-2], found.jerk_mm_s3, color=BLUE)
    for axes, label in ((top, "acceleration, mm/s²"), (bottom, "jerk, mm/s³")):
        axes.set_ylabel(label)
        axes.margins(x=0)
        for joint in found.joints_mm:
            axes.axvline(float(joint), color=GREY, linewidth=0.8, linestyle=(0, (2, 3)), zorder=0)
    top.set_title(
        f"{pipeline.file.name}: disturbance at constant {plan.feed_mm_s:.4g} mm/s; dashed: joints"
    )
    bottom.legend(
        *top.get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=2,
        borderaxespad=0.1,
    )
    bottom.set_xlabel("arc length, mm")
    return png(figure)
