#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""draw_figures.py [--check] [--output DIR]: the figures of the manual (docs/images), from the programs themselves.

Run by `make figures`. Reads the tutorial and the examples; writes to DIR only.

Draws path, feed, outputs, phase plane of a stop, state machine, bus timing and the figures of the tutorial as SVG
files. With --check nothing is written; the exit status is 1 when a figure in DIR is not the one that would be drawn.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

import tutorial
from hodograph.bustime.frame_bits import worst_bits
from hodograph.native import NativeProgram
from hodograph.native.feed_override import FeedOverride, State
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.program import encode
from hodograph.report.output_marks import mark_outputs
from hodograph.report.style import BLUE, GREEN, GREY, INK, ORANGE, RED, SOFT, styled
from hodograph.simulate import simulate_on
from hodograph.toolpath.files import ReadOptions, read_toolpath
from hodograph.toolpath.fit.sections import divided

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
SAMPLES = 300
BIT_US = 1.0
"""At 1 Mbit/s."""


def svg(figure: Figure) -> str:
    """The figure as text that is the same on every run: no date, fixed identifiers."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    pyplot.close(figure)
    return "\n".join(line.rstrip() for line in buffer.getvalue().splitlines()) + "\n"


def example(name: str) -> Pipeline:
    """The pipeline of an example path."""
    return load_pipeline(ROOT / "examples" / name)


# --- Path and feed ---


def draw_path(axes: Axes, pipeline: Pipeline) -> None:
    """Control polygon, nodal points, and the PH segments of the program in alternating colours."""
    spline = pipeline.spline_result.spline
    polygon, nodes = pipeline.file.path.points, spline.nodal_points
    axes.plot(polygon.real, polygon.imag, "s--", color=GREY, linewidth=1.0, markersize=4)
    axes.text(polygon[2].real, polygon[2].imag + 1.2, "control polygon", color=SOFT, ha="center")
    for k in range(spline.segment_count):
        points = spline.position(np.full(SAMPLES // 4, k), np.linspace(0.0, 1.0, SAMPLES // 4))
        axes.plot(points.real, points.imag, color=(BLUE, GREEN)[k % 2], linewidth=2.4)
    axes.plot(nodes.real, nodes.imag, "o", color=ORANGE, markeredgecolor="white", markersize=7)
    for k, node in enumerate(nodes):
        axes.annotate(f"$q_{k}$", (node.real, node.imag), xytext=(6, 5), textcoords="offset points")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x, mm", ylabel="y, mm", title="Path: one PH quintic for each colour")
    axes.margins(0.08)


@dataclass(frozen=True, eq=False)
class Trace:
    """Path motion of a program by its setpoints: time, feed and acceleration along the path; s, mm."""

    time_s: np.ndarray
    feed: np.ndarray
    acceleration: np.ndarray


def trace(program: NativeProgram, stop: str = "", tick: int = 0) -> Trace:
    """A run by ticks; `stop` (hold or fault_stop) is commanded before this tick."""
    motion, arc = FeedOverride(program), [0.0]
    while motion.state not in (State.ENDED, State.STOPPED, State.HELD):
        if stop and len(arc) == tick:
            getattr(motion, stop)()
        arc.append(motion.step().arc_mm)
    period_s = 1e-6 * program.period_us
    feed = np.append(np.diff(arc), 0.0) / period_s
    acceleration = np.diff(feed, prepend=0.0) / period_s
    return Trace(period_s * np.arange(feed.size), feed, acceleration)


def native(pipeline: Pipeline) -> NativeProgram:
    """The program of a path, as the controller runs it."""
    return NativeProgram(encode(pipeline.compilation.program))


def path_figure() -> Figure:
    """The alpha: its path, and its feed by two profiles."""
    paper, optimal = example("alpha.toml"), example("alpha_optimal.toml")
    figure, (plane, feed) = pyplot.subplots(1, 2, figsize=(9.6, 4.2))
    draw_path(plane, paper)
    for pipeline, color, name in ((paper, BLUE, "exponential"), (optimal, ORANGE, "optimal")):
        run = trace(native(pipeline))
        feed.plot(run.time_s, run.feed, color=color, label=f"profile {name}")
    feed.set(xlabel="time, s", ylabel="feed, mm/s", title="Feed of the same path by two profiles")
    feed.legend()
    feed.margins(x=0)
    return figure


# --- Outputs ---


def output_figure() -> Figure:
    """A bead of glue: where outputs switch, and the outputs over time."""
    pipeline = example("dispense.toml")
    motion = simulate_on(pipeline.machine, pipeline.image)
    figure, (plane, times) = pyplot.subplots(1, 2, figsize=(9.6, 4.2))
    spline = pipeline.spline_result.spline
    points = spline.point(np.linspace(0.0, spline.length_mm, SAMPLES))
    plane.plot(points.real, points.imag, color=BLUE, linewidth=2.4)
    plane.set(xlabel="x, mm", ylabel="y, mm", title="Path, and where outputs switch")
    plane.set_aspect("equal", adjustable="datalim")
    mark_outputs(plane, pipeline)
    time_s = motion.t_s[: motion.ticks]
    times.plot(time_s, motion.feed_mm_s[: motion.ticks], color=BLUE, label="feed, mm/s")
    for k, (name, color) in enumerate((("valve", RED), ("needle", GREEN))):
        level = motion.output_columns[name][: motion.ticks]
        times.step(time_s, 8.0 * level - 12.0 * (k + 1), color=color, where="post", label=name)
    times.set(xlabel="time, s", title="Feed and outputs", yticks=range(0, 61, 20))
    times.legend(loc="center")
    times.margins(x=0)
    return figure


# --- Stops ---

STOPS = (
    ("hold", 50, ORANGE, "feed hold while accelerating"),
    ("hold", 500, BLUE, "feed hold at constant feed"),
    ("fault_stop", 500, RED, "fault stop at constant feed"),
    ("hold", 1030, GREEN, "feed hold while decelerating"),
)


def stop_figure() -> Figure:
    """Path stops of the alpha over time, and in the phase plane of feed and acceleration."""
    program = native(example("alpha.toml"))
    figure, (times, phase) = pyplot.subplots(1, 2, figsize=(9.6, 4.2))
    for stop, tick, color, label in STOPS:
        run = trace(program, stop, tick)
        after = slice(tick - 1, None)
        since_ms = 1e3 * (run.time_s[after] - run.time_s[tick - 1])
        times.plot(since_ms, run.feed[after], color=color, label=label)
        phase.plot(run.feed[after], run.acceleration[after], color=color)
        phase.plot(run.feed[tick - 1], run.acceleration[tick - 1], "o", color=color, markersize=5)
    times.set(
        xlabel="time since the command, ms", ylabel="feed, mm/s", title="Path stops of the alpha"
    )
    phase.set(
        xlabel="feed, mm/s",
        ylabel="acceleration along the path, mm/s²",
        title="Phase plane: every stop ends at 0, 0",
    )
    phase.axhline(0.0, color=SOFT, linewidth=0.8)
    times.legend(loc="upper right")
    times.set_ylim(-5, 125)
    return figure


# --- State machine ---

STATES = {
    "boot": (-0.4, 2.0),
    "off": (1.6, 2.0),
    "homing": (1.6, 0.6),
    "enabling": (3.2, 2.0),
    "ready": (4.8, 2.0),
    "running": (6.6, 2.0),
    "holding": (8.4, 2.8),
    "held": (8.4, 1.5),
    "stopping": (6.6, 0.6),
    "quick stop": (4.0, -0.8),
    "fault": (0.9, -0.8),
}
TRANSITIONS = (
    ("boot", "off", "found", 0.0),
    ("off", "enabling", "enable", 0.0),
    ("enabling", "ready", "on", 0.0),
    ("ready", "running", "start", -0.25),
    ("running", "ready", "end", -0.25),
    ("running", "holding", "hold", 0.0),
    ("holding", "held", "standstill", 0.0),
    ("held", "running", "resume", 0.0),
    ("running", "stopping", "stop", 0.0),
    ("held", "stopping", "stop", 0.0),
    ("stopping", "ready", "standstill", 0.0),
    ("off", "homing", "home", -0.3),
    ("homing", "off", "done", -0.3),
    ("fault", "boot", "reset", 0.0),
)


def draw_box(axes: Axes, name: str) -> None:
    """A state."""
    x, y = STATES[name]
    box = FancyBboxPatch(
        (x - 0.55, y - 0.24), 1.1, 0.48, boxstyle="round,pad=0.02,rounding_size=0.1"
    )
    box.set(facecolor="#eef3f8", edgecolor=RED if name in ("fault", "quick stop") else BLUE)
    axes.add_patch(box)
    axes.text(x, y, name, ha="center", va="center", color=INK)


def draw_arrow(axes: Axes, start: str, end: str, label: str, bend: float) -> None:
    """A transition, its label beside the middle."""
    a, b = np.array(STATES[start]), np.array(STATES[end])
    style = {"arrowstyle": "-|>", "color": SOFT, "shrinkA": 24, "shrinkB": 24}
    if abs(b[1] - a[1]) > 0.1:
        style["shrinkA"] = style["shrinkB"] = 18
    style["connectionstyle"] = f"arc3,rad={bend}"
    axes.annotate("", xy=tuple(b), xytext=tuple(a), arrowprops=style)
    along = b - a
    normal = np.array([along[1], -along[0]])
    middle = 0.5 * (a + b) + 0.5 * bend * normal
    axes.text(
        float(middle[0]),
        float(middle[1]) + 0.1,
        label,
        ha="center",
        va="bottom",
        fontsize=8,
        color=INK,
    )


def state_figure() -> Figure:
    """States of the controller (object 0x2002) and the commands between them."""
    figure, axes = pyplot.subplots(figsize=(9.6, 4.6))
    for start, end, label, bend in TRANSITIONS:
        draw_arrow(axes, start, end, label, bend)
    for name in STATES:
        draw_box(axes, name)
    axes.text(
        4.0,
        -1.3,
        "from every state with drives on,\nby command quick-stop; then off",
        ha="center",
        va="top",
    )
    axes.text(0.9, -1.3, "from every state\nfrom off on", ha="center", va="top")
    axes.set(xlim=(-1.0, 9.2), ylim=(-2.1, 3.3))
    axes.axis("off")
    return figure


# --- Bus timing ---

READY_US = 55.0
"""Time from a tick until its setpoints are ready to be sent."""
REACTION_US = 200.0
"""Time from SYNC until a drive sends its position."""
DRIVES = (2, 3)
"""Node numbers of the drives."""


def frames(at_us: float) -> list[tuple[float, float, str, str]]:
    """Frames of one period with two drives: begin and length in us, label and sender."""
    out = []
    sync_us = worst_bits(0x080, 1) * BIT_US
    out.append((at_us, sync_us, "SYNC", "controller"))
    free_us = at_us + max(sync_us, READY_US)
    for node in DRIVES:
        length = worst_bits(0x200 + node, 6) * BIT_US
        out.append((free_us, length, f"RPDO1 {node}", "controller"))
        free_us += length
    free_us = max(free_us, at_us + sync_us + REACTION_US)
    for node in DRIVES:
        length = worst_bits(0x180 + node, 6) * BIT_US
        out.append((free_us, length, f"TPDO1 {node}", "drive"))
        free_us += length
    return out


def draw_frames(axes: Axes, k: int, period_us: float) -> None:
    """One period of the bus."""
    for begin, length, label, sender in frames(k * period_us):
        row, color = (1, BLUE) if sender == "controller" else (0, ORANGE)
        axes.barh(row, length, left=begin, height=0.75, color=color, edgecolor="white")
        axes.text(
            begin + 0.5 * length,
            row,
            label,
            rotation=90,
            ha="center",
            va="center",
            fontsize=6.5,
            color="white",
        )
    axes.axvline(k * period_us, color=GREY, linewidth=0.8)


def bus_figure() -> Figure:
    """Three periods: setpoint k is sent after SYNC k, latched at SYNC k+1, reached at SYNC k+2."""
    period_us = 1000.0
    figure, axes = pyplot.subplots(figsize=(9.6, 3.4))
    for k in range(3):
        draw_frames(axes, k, period_us)
        axes.text(k * period_us + 8, 1.42, ("SYNC k", "SYNC k+1", "SYNC k+2")[k], fontsize=8.5)
    axes.plot([period_us, 2 * period_us], [-0.95, -0.55], color=GREEN, linewidth=2.2)
    axes.text(15, -1.05, "setpoint k is sent", color=GREEN, va="top")
    axes.text(
        period_us + 15, -1.05, "setpoint k is latched,\nthe axis moves to it", color=GREEN, va="top"
    )
    axes.text(
        2 * period_us + 15,
        -1.05,
        "setpoint k is reached,\nTPDO1 reports the position",
        color=GREEN,
        va="top",
    )
    axes.set(
        xlim=(-20, 2.75 * period_us),
        ylim=(-1.75, 1.75),
        xlabel="time, µs (1 Mbit/s, longest frames)",
    )
    axes.set_yticks([0, 1], ["drives", "controller"])
    axes.grid(visible=False)
    return figure


# --- Toolpaths ---

TOOLPATHS = ("pocket", "engraving", "dispensing", "surface")


def toolpath_figure() -> Figure:
    """The example toolpaths as their files program them: isometric, rapid moves dashed."""
    figure, grid = pyplot.subplots(2, 2, figsize=(9.6, 6.8))
    for axes, name in zip(grid.flat, TOOLPATHS, strict=True):
        _toolpath(axes, name)
    return figure


def _toolpath(axes: Axes, name: str) -> None:
    file = ROOT / "examples" / "toolpaths" / f"{name}.ngc"
    path = divided(read_toolpath(file, ReadOptions()), 0.01, file.name)
    for section in path.sections:
        x, y, z = section.reference.point.T
        across, up = (x + y) * np.sqrt(0.5), (y - x) * np.sqrt(1 / 6) + z * np.sqrt(2 / 3)
        rapid = np.isinf(section.reference.feed_mm_s)
        edges = np.flatnonzero(np.append(True, rapid[1:] != rapid[:-1]))
        for first, last in zip(edges, [*edges[1:], rapid.size], strict=True):
            part = slice(first, last + 1)
            style: dict[str, Any] = (
                {"color": SOFT, "linewidth": 0.8, "linestyle": (0, (4, 3))}
                if rapid[first]
                else {"color": BLUE, "linewidth": 0.9 if rapid.size > 1000 else 1.6}
            )
            axes.plot(across[part], up[part], **style)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(f"{name}.ngc")


FIGURES: dict[str, Any] = {
    "path": path_figure,
    "outputs": output_figure,
    "stops": stop_figure,
    "states": state_figure,
    "bus": bus_figure,
    "toolpaths": toolpath_figure,
}


def tutorial_figures() -> Iterator[tuple[str, Figure]]:
    """The figures that the blocks of the tutorial draw."""
    for result in tutorial.run(tutorial.PAGE.read_text(encoding="utf-8")):
        if result.cell.image is not None:
            yield result.cell.image, result.figure


def main() -> int:
    """Draws or compares all figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    parser.add_argument(
        "--output", type=Path, default=IMAGES, help="folder of the figures (default: docs/images)"
    )
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    other = []
    with styled(), mpl.rc_context({"svg.hashsalt": "hodograph", "svg.fonttype": "none"}):
        drawn = ((name, draw()) for name, draw in FIGURES.items())
        for name, figure in chain(drawn, tutorial_figures()):
            file, text = options.output / f"{name}.svg", svg(figure)
            if not options.check:
                file.write_text(text, encoding="utf-8")
            elif not file.exists() or file.read_text(encoding="utf-8") != text:
                other.append(file.name)
    if other:
        print(
            f"figures that are not current: {', '.join(other)}: run make figures", file=sys.stderr
        )
    return 1 if other else 0


if __name__ == "__main__":
    sys.exit(main())
