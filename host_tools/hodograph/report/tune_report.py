# SPDX-License-Identifier: MIT
"""The report of a tuning: frequency and step responses of the loops, contour error along the paths; one HTML file and
its figures as PNG files. Used by cli/tune_command. Simulates the paths, and writes these files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..pipeline import Pipeline
from ..simulate import simulate
from ..tune import Tuning
from ..tune.loop import loop_of, offset_volts
from ..tune.result import (
    SATURATED,
    AxisResult,
    PathResult,
    Side,
    axis_table,
    case_table,
    poles_text,
)
from .page import Figure, file_name, render, write_page
from .style import BLUE, GREY, ORANGE, SOFT, png, styled

_STEP_PERIODS = 12.0
"""Length of a step response, in time constants of the slowest pole of the tuned loop."""
_LEAST_SHOWN_HZ = 1.0


def _sides(axis: AxisResult) -> tuple[tuple[str, str, Side], ...]:
    return ("as given", GREY, axis.given), ("tuned", BLUE, axis.tuned)


def frequency_figure(axis: AxisResult) -> bytes:
    """Loop opened at the volts, closed loop from the command, compliance."""
    figure, panels = pyplot.subplots(2, 2, figsize=(9.6, 6.6), sharex=True)
    (gain, closed), (phase, compliance) = panels
    for name, color, side in _sides(axis):
        loop = loop_of(side.drive)
        rad_s = loop.grid()
        rad_s = rad_s[(rad_s >= 2 * math.pi * _LEAST_SHOWN_HZ) & (rad_s < 0.9 * rad_s[-1])]
        hz, opened = rad_s / (2 * math.pi), loop.open(rad_s)
        gain.loglog(hz, np.abs(opened), color=color, label=name)
        phase.semilogx(hz, _degrees(opened), color=color)
        volts = offset_volts(side.drive, side.feedforward)
        plain = loop.closed(rad_s, *volts)
        closed.loglog(hz, np.abs(plain), color=color)
        compliance.loglog(hz, loop.compliance(rad_s), color=color)
        _mark(gain, phase, side)
    gain.axhline(1, color=SOFT, linewidth=0.8)
    phase.axhline(-180, color=SOFT, linewidth=0.8)
    gain.set_title(f"axis {axis.name}: loop opened at the volts")
    gain.set_ylabel("gain")
    gain.legend()
    phase.set_ylabel("phase, degrees")
    closed.set_title("position over command, with feedforward")
    closed.set_ylim(0.1, 10)
    compliance.set_title("compliance")
    compliance.set_ylabel("µm per N of load")
    for axes in panels[1]:
        axes.set_xlabel("frequency, Hz")
    for axes in panels.flat:  # hundreds of ticks without labels take most of the time
        axes.minorticks_off()
    return png(figure)


def _degrees(response: NDArray[np.complex128]) -> NDArray[np.float64]:
    found = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(found + 360 * round((-180 - found[0]) / 360))


def _mark(gain: Axes, phase: Axes, side: Side) -> None:
    at = side.margins.crossover_hz
    gain.plot(at, 1, "o", color=ORANGE, markersize=5)
    phase.plot(at, side.margins.phase_deg - 180, "o", color=ORANGE, markersize=5)


def step_figure(axis: AxisResult) -> bytes:
    """Step of the command without feedforward, and step of load."""
    figure, (command, load) = pyplot.subplots(1, 2, figsize=(9.6, 3.4))
    slowest = min(-float(np.max(loop_of(side.drive).poles().real)) for _, _, side in _sides(axis))
    for name, color, side in _sides(axis):
        t_s, moved, pushed = loop_of(side.drive).steps(_STEP_PERIODS / slowest)
        command.plot(1e3 * t_s, moved, color=color, label=name)
        load.plot(1e3 * t_s, pushed, color=color)
    command.axhline(1, color=SOFT, linewidth=0.8)
    command.set_title(f"axis {axis.name}: step of the setpoint, no feedforward")
    command.set_ylabel("position over step")
    command.legend()
    load.set_title("step of load")
    load.set_ylabel("movement, µm per N")
    for axes in (command, load):
        axes.set_xlabel("time, ms")
        axes.margins(x=0)
    return png(figure)


def contour_figure(tuning: Tuning, path: PathResult, pipeline: Pipeline) -> bytes:
    """Contour error along a path, as given and tuned, of the plant as modelled."""
    machine = tuning.machine
    figure, axes = pyplot.subplots(figsize=(9.6, 3.4))
    given = machine.models(machine.require_plane("tune")), machine.plane_feedforward
    for name, color, (drives, forward) in (
        ("as given", GREY, given),
        ("tuned", BLUE, (tuning.drives, tuning.feedforward)),
    ):
        motion = simulate(
            path.image,
            drives,
            kernel=machine.kernel,
            counts_per_mm=machine.counts_per_mm,
            feedforward=forward,
        )
        label = f"{name}: {motion.max_contour_error_um:.3f} µm"
        axes.semilogy(motion.t_s, np.maximum(motion.contour_error_um, 1e-4), color, label=label)
    axes.set_ylim(bottom=1e-4)
    axes.minorticks_off()
    axes.set_title(f"{pipeline.file.name}: contour error along the run")
    axes.set_xlabel("time, s")
    axes.set_ylabel("contour error, µm")
    axes.margins(x=0)
    axes.legend(loc="upper right", ncols=2)
    return png(figure)


def write_tune_report(tuning: Tuning, pipelines: Sequence[Pipeline], directory: Path) -> Path:
    """Writes tune.html and PNG files into `directory`; returns the HTML file. Raises InputError."""
    with styled():
        figures = list(_figures(tuning, pipelines))
    text = render(
        "tune.html.j2",
        machine=str(tuning.machine.file),
        poles=poles_text(tuning),
        axes=axis_table(tuning),
        cases=case_table(tuning),
        saturated=SATURATED,
        figures=figures,
    )
    return write_page(directory / "tune.html", text, ((one.name, one) for one in figures))


def _figures(tuning: Tuning, pipelines: Sequence[Pipeline]) -> Iterator[Figure]:
    for axis in tuning.axes:
        name = file_name(axis.name, "unnamed")
        yield Figure(
            f"frequency_{name}",
            f"Axis {axis.name}: frequency responses; orange: where the gain is 1.",
            frequency_figure(axis),
        )
        yield Figure(f"step_{name}", f"Axis {axis.name}: step responses.", step_figure(axis))
    for path, pipeline in zip(tuning.paths, pipelines, strict=True):
        yield Figure(
            f"contour_{file_name(path.name, 'unnamed')}",
            f"{path.name}: contour error along the run, the plant as modelled.",
            contour_figure(tuning, path, pipeline),
        )
