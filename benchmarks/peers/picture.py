# SPDX-License-Identifier: MIT
"""Draws the figure of `make compare`. It shows three things for each planner: a corner of the toolpath zigzag, and the
speed and the jerk of x at the beginning of its motion. Used by peers/compare. Writes the file that it is given.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from hodograph.report.style import BLUE, GREEN, GREY, INK, ORANGE, RED, styled

from .motion import RATE_HZ, Motion, Real

COLOURS = {"Hodograph": BLUE, "LinuxCNC": ORANGE, "Klipper": RED, "TOPP-RA": GREY, "Ruckig": GREEN}
CORNER_MM = (10.0, 0.0)
"""The corner that is drawn: the first of the zigzag."""
REACH_MM = 0.06
"""Shown length of the programmed path before and after the corner."""
SHOWN_S = 0.5
"""Shown time of speed and jerk, from the start of the motion."""


def draw(motions: Mapping[str, Motion], tolerance_mm: float, jerk_mm_s3: float, file: Path) -> None:
    """Writes the figure as SVG. `motions`: the motion along the zigzag by name of the planner."""
    with styled():
        figure, (corner, speed, jerk) = pyplot.subplots(
            1, 3, figsize=(12.0, 4.0), layout="constrained"
        )
        _draw_corner(corner, motions, tolerance_mm)
        for name, motion in motions.items():
            velocity = np.linalg.norm(motion.derivative(1), axis=1)
            speed.plot(*_over_time(velocity), color=COLOURS[name], label=name)
            x_jerk = motion.derivative(3)[:, 0]
            jerk.plot(*_over_time(x_jerk), color=COLOURS[name], linewidth=1.0)
        speed.set(xlabel="time, s", title="Speed, mm/s")
        figure.legend(*speed.get_legend_handles_labels(), loc="outside lower center", ncols=5)
        jerk.set_yscale("symlog", linthresh=jerk_mm_s3)
        jerk.set_yticks([-1e6, -jerk_mm_s3, 0.0, jerk_mm_s3, 1e6])
        for limit in (-jerk_mm_s3, jerk_mm_s3):
            jerk.axhline(limit, color=INK, linestyle=":", linewidth=1.0)
        jerk.set(xlabel="time, s", title="Jerk of x, mm/s³ (dotted: the limit)")
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
        pyplot.close(figure)
    lines = (line.rstrip() for line in buffer.getvalue().splitlines())
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _over_time(values: Real) -> tuple[Real, Real]:
    """Times (s) and values in the first SHOWN_S of a motion."""
    shown = values[: int(SHOWN_S * RATE_HZ)]
    return np.arange(shown.size) / RATE_HZ, shown


def _draw_corner(axes: Axes, motions: Mapping[str, Motion], tolerance_mm: float) -> None:
    """Draws the setpoints near the corner (um), the programmed path, and a circle with the tolerance as radius."""
    corner = np.array(CORNER_MM)
    legs = 1000.0 * REACH_MM * np.array([[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    axes.plot(*legs.T, color=INK, linestyle=":", linewidth=1.0)
    circle = Circle((0.0, 0.0), 1000.0 * tolerance_mm, color=INK, fill=False, linewidth=0.6)
    axes.add_patch(circle)
    for name, motion in motions.items():
        away_um = 1000.0 * (motion.position_mm[:, :2] - corner)
        # More setpoints than the axes show, so that the lines go on to their edges.
        near = np.flatnonzero(np.abs(away_um).max(axis=1) < 4000.0 * REACH_MM)
        axes.plot(*away_um[near[0] : near[-1] + 1].T, ".-", color=COLOURS[name], markersize=4)
    reach_um = 1000.0 * REACH_MM
    axes.set(xlim=(-reach_um, 0.4 * reach_um), ylim=(-0.4 * reach_um, reach_um))
    axes.set(xlabel="x from the corner, µm", ylabel="y, µm", aspect="equal")
    axes.set_title("A corner (circle: the tolerance)")
