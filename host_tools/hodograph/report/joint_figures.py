# SPDX-License-Identifier: MIT
"""Figure of the joints (paper figure 5): differences of chord speed at constant feed."""

from __future__ import annotations

from matplotlib import pyplot

from ..feed import FeedPlan
from ..paper import chord_acceleration_mm_s2, joint_disturbance
from ..pipeline import Pipeline
from .style import BLUE, GREY, ORANGE, png


def joint_figure(chain: Pipeline, plan: FeedPlan) -> bytes:
    """First and second differences of chord speed along the whole path, joints marked."""
    spline = chain.spline_result.spline
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
        f"{chain.file.name}: disturbance at constant {plan.feed_mm_s:.4g} mm/s; dashed: joints"
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
