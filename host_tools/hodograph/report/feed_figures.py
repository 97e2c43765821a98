# SPDX-License-Identifier: MIT
"""Figures of the feed: plain and modified ramp (paper figures 2 and 4), pattern search (figure 3). Used by report/html.
Returns PNG bytes; the pipeline may read its machine file.
"""

from __future__ import annotations

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from ..feed import FeedPlan
from ..feed.ramp import JERK, N_C_HIGH, N_C_LOW, exponential_ramp
from ..paper import plain_plan
from ..pipeline import Pipeline
from .style import BLUE, GREEN, GREY, ORANGE, RED, png

_SAMPLES = 1600


def feed_figure(pipeline: Pipeline, plan: FeedPlan) -> bytes:
    """Feed, acceleration and jerk of the profile; whole run and first ramp, with the plain quintic for comparison.

    Of profile `optimal`, which has no ramps: whole run and first quarter.
    """
    ramps = plan.ramp_time_s is not None
    plain: FeedPlan = plain_plan(pipeline) if ramps else plan
    figure, grid = pyplot.subplots(3, 2, figsize=(9.6, 7.2), width_ratios=(1.5, 1), sharey="row")
    name = plan.profile if plan.n_c is None else f"{plan.profile}, n_c {plan.n_c:.3f}"
    ramp_end_s = 0.25 * plan.duration_s
    if plan.ramp_time_s is not None:
        ramp_end_s = 1.15 * max(plan.ramp_time_s, plain.ramp_time_s or 0.0)
    curves = [(plain, ORANGE, "plain quintic"), (plan, BLUE, name)][0 if ramps else 1 :]
    for column, end_s in enumerate((max(plan.duration_s, plain.duration_s), ramp_end_s)):
        t_s = np.linspace(0.0, end_s, _SAMPLES)
        for shown, color, label in curves:
            inside = np.unique(np.minimum(t_s, shown.duration_s))
            for axes, value in zip(
                grid[:, column],
                (shown.feed(inside), shown.acceleration(inside), shown.jerk(inside)),
                strict=True,
            ):
                axes.plot(1e3 * inside, value, color=color, label=label, linewidth=1.4)
        for axes in grid[:, column]:
            axes.set_xlim(0, 1e3 * end_s)
        grid[2, column].set_xlabel("time, ms")
    _limits(grid[1], pipeline.file.limits.acceleration_mm_s2)
    _limits(grid[2], pipeline.file.limits.jerk_mm_s3)
    for axes, label in zip(
        grid[:, 0], ("feed, mm/s", "acceleration, mm/s²", "jerk, mm/s³"), strict=True
    ):
        axes.set_ylabel(label)
    grid[0, 0].set_title(f"{pipeline.file.name}: feed along the path")
    grid[0, 1].set_title("first ramp" if ramps else "first quarter")
    grid[0, 1].legend(loc="lower right")
    return png(figure)


def _limits(row: np.ndarray, limit: float | None) -> None:
    if limit is None:
        return
    for axes in row:
        for sign in (-1, 1):
            axes.axhline(sign * limit, color=RED, linewidth=0.9, linestyle=(0, (5, 3)))


def search_figure(plan: FeedPlan) -> bytes | None:
    """Progress of the pattern search for n_c, and the function that it minimises; None: there was no search."""
    if not plan.history:
        return None
    figure, (progress, function) = pyplot.subplots(1, 2, figsize=(9.6, 3.8))
    _progress(progress, plan)
    n_c = np.linspace(N_C_LOW, N_C_HIGH, 161)
    jerk = [exponential_ramp(plan.feed_mm_s, plan.ramp_time_s or 0.0, v).peak(JERK) for v in n_c]
    best = plan.history[-1]
    function.plot(n_c, jerk, color=BLUE, label="peak jerk")
    function.plot(
        [step.best for step in plan.history],
        [step.value for step in plan.history],
        "o",
        color=ORANGE,
        markersize=3.5,
        label="best so far",
    )
    function.plot(
        best.best, best.value, "*", color=GREEN, markersize=12, label=f"n_c {best.best:.4f}"
    )
    top = 1.25 * plan.history[0].value
    function.set_ylim(0.95 * best.value, min(max(jerk), top))
    function.set_xlabel("slope coefficient n_c")
    function.set_ylabel("peak jerk, mm/s³")
    function.set_title("What is minimised")
    function.legend()
    return png(figure)


def _progress(axes: Axes, plan: FeedPlan) -> None:
    iterations = [step.iteration for step in plan.history]
    axes.step(iterations, [step.value for step in plan.history], where="post", color=BLUE)
    axes.set_xlabel(f"iteration ({plan.evaluations} evaluations in all)")
    axes.set_ylabel("least peak jerk so far, mm/s³", color=BLUE)
    axes.set_title("Pattern search")
    mesh = axes.twinx()
    mesh.semilogy(iterations, [step.mesh for step in plan.history], color=GREY, linewidth=1.0)
    mesh.set_ylabel("mesh size", color=GREY)
    mesh.yaxis.set_minor_locator(NullLocator())
    mesh.grid(False)
    mesh.spines["right"].set_visible(True)
