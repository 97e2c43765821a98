# SPDX-License-Identifier: MIT
"""Measures contour errors of simulated drives, with the servo loops of the paper and with tuned ones.

Also measures the errors of identified plants. Run by `make bench`. Uses no bus; writes the file of --json and temporary
path files.

Paths: alpha and heart, at the paper's feed and in the least time within all limits. There are three groups of figures:

contour      Contour errors at SYNCs and between them. To compute the errors between SYNCs, this script simulates the
             drives again, one servo sample after the other. It also counts the samples at the voltage limit.
sensitivity  Contour errors where the plant differs from its model. Time-optimal feeds are planned for motors
             with 4.5 V, as in the examples, and with 3.5 V.
identify     Errors of the plant that is identified from noisy positions and voltages.

Loops in the first group:

- the paper's
- tuned: examples/machines/tuned.toml
- the tuned poles, in drives that interpolate setpoints by straight lines
- poles that `hodograph tune` found for such drives
- the tuned poles, in drives whose speed is a difference of encoder positions and whose voltage acts one servo sample
  late

Loops in the second group: the paper's, and the tuned ones with and without feedforward.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures
from numpy.typing import NDArray

from hodograph.config import Drive, Machine, load_machine
from hodograph.config.axis_table import Feedforward
from hodograph.identify import Stretch, identify_axis
from hodograph.native import AxisInputs, Contour, NativeProgram
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import Motion, simulate
from hodograph.tune import Asked, tune
from hodograph.tune.cases import CASES, outcomes
from hodograph.tune.loop import loop_of, offset_volts

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
MACHINES = EXAMPLES / "machines"
PATHS = ("alpha", "heart", "alpha_optimal", "heart_optimal")
TUNED_HZ, TUNED_DAMPING = 214.5, 0.85
"""Bandwidth and damping that `hodograph tune` found for tuned.toml."""
LINES_HZ, LINES_DAMPING = 155.8, 0.6
"""The same for drives that interpolate setpoints by straight lines, found for all four paths."""
WEAKER_VOLTS = 3.5
"""Voltage limit of a plan. The drives have 5 V; the difference is a margin for plants with less gain than the model."""
SEEDS, NOISE_COUNTS, NOISE_MV = 10, 20.0, 10.0
"""Identification: number of noise seeds, and standard deviations of the noise of positions and of voltages."""

Float = NDArray[np.float64]
Drives = tuple[Drive, Drive]
Forward = tuple[Feedforward, Feedforward] | None


def forward_of(machine: Machine) -> Forward:
    """The feedforward of the axes x and y of a machine; None: it has none."""
    if machine.path_feedforward is None:
        return None
    x, y = machine.path_feedforward
    return x, y


def loops() -> dict[str, tuple[Drives, Forward]]:
    """Drives and feedforward of all loops but the paper's, by name. The paper's loop depends on the path."""
    machine, example = (load_machine(MACHINES / f"{n}.toml") for n in ("paper_alpha", "tuned"))
    x, y = example.models(example.path_axes)
    late = [replace(drive, speed="differences", delay_samples=1) for drive in (x, y)]
    axes = [replace(axis, drive=d) for axis, d in zip(machine.path_axes, late, strict=True)]
    asked = Asked(bandwidth_hz=TUNED_HZ, damping=TUNED_DAMPING)
    same = tune(machine, [], replace(asked, interpolation="linear"))
    lines = tune(machine, [], Asked(LINES_HZ, LINES_DAMPING, interpolation="linear"))
    sensed = tune(replace(machine, axes=tuple(axes)), [], asked)
    return {
        "tuned": ((x, y), forward_of(example)),
        "same_poles_linear": (same.drives, same.feedforward),
        "tuned_linear": (lines.drives, lines.feedforward),
        "tuned_late": (sensed.drives, sensed.feedforward),
    }


def between_um(
    pipeline: Pipeline, motion: Motion, drives: Drives, forward: Forward
) -> dict[str, float]:
    """Figures of a run from a second simulation, in which each servo sample is known.

    contour_um        greatest distance of the true position from the curve at any servo sample
    off_um            greatest difference of an axis from the position in `motion` at a SYNC
    at_limit_percent  share of the servo samples of both axes at the voltage limit
    """
    places, at_limit = zip(
        *(_axis(motion, axis, drives[axis], forward) for axis in range(2)), strict=True
    )
    per = places[0].shape[1]
    rows = motion.rows
    arc = rows["arc_length_q40_mm"].astype(np.float64)
    before = np.concatenate([arc[:1], arc[:-1]])
    parts = np.arange(1, per + 1) / per
    arcs = np.rint(before[:, None] + (arc - before)[:, None] * parts).astype(np.int64)
    contour = Contour(NativeProgram(pipeline.image))
    fine = 8_000_000  # counts per mm, so fine that rounding does not matter
    positions = np.stack([np.rint(p.ravel() * fine).astype(np.int32) for p in places], axis=1)
    errors = contour.errors_um(arcs.ravel(), positions, fine)
    at_sync = np.stack([p[:, -1] for p in places], axis=1) - motion.act_mm
    return {
        "contour_um": float(errors.max()),
        "off_um": 1e3 * float(np.abs(at_sync).max()),
        "at_limit_percent": 100.0 * sum(at_limit) / (2 * places[0].size),
    }


def _axis(motion: Motion, axis: int, drive: Drive, forward: Forward) -> tuple[Float, int]:
    """True positions (periods, samples) in mm, and the number of samples at the voltage limit.

    This is sim/plant in Python, for drives with exact speed and no delay.
    """
    loop, per = loop_of(drive), drive.loop_rate_hz * motion.period_us // 1_000_000
    step_s, period_s = loop.step_s, motion.period_us * 1e-6
    increment = 2 * np.pi * drive.screw_mm_rad / drive.encoder_counts_per_rev
    setpoints = motion.rows["set_counts"][:, axis].tolist()
    commanded = motion.cmd_mm[:, axis]
    by_speed, by_acceleration = offset_volts(drive, forward[axis]) if forward else (0.0, 0.0)
    distances = np.diff(np.concatenate([commanded[:1], commanded])) / period_s
    volts_ahead = (
        by_speed * distances + by_acceleration * np.diff(distances, prepend=0.0) / period_s
    )
    volts_ahead[motion.ticks :] = 0.0
    x, speed, integral, last, slope, distance = (
        setpoints[0] * 1e-6,
        0.0,
        0.0,
        setpoints[0],
        0.0,
        0.0,
    )
    places, limited = np.empty((len(setpoints), per)), 0
    for k, target in enumerate(setpoints):
        step = float(target - last)
        end = 1.5 * step - 0.5 * distance if drive.interpolation == "cubic" else step
        begin = slope if drive.interpolation == "cubic" else step
        for i in range(per):
            u = i / per
            r = begin * u + (3 * step - 2 * begin - end) * u**2 + (begin + end - 2 * step) * u**3
            v = begin + 2 * (3 * step - 2 * begin - end) * u
            v += 3 * (begin + end - 2 * step) * u**2
            away = (last + r) * 1e-6 - round(x / increment) * increment
            ref = loop.k_pp_rad_s_mm * away + loop.k_pf_rad_mm * v * 1e-6 / period_s
            volts = loop.volts_per_ref * ref + loop.volts_per_integral * integral
            volts += volts_ahead[k] - loop.volts_per_speed * speed
            if abs(volts) <= drive.volts_limit:
                integral += step_s * (ref - speed)
            else:
                limited += 1
            volts = max(-drive.volts_limit, min(drive.volts_limit, volts))
            x += loop.position_from_speed * speed + loop.position_from_volts * volts
            speed = loop.speed_from_speed * speed + loop.speed_from_volts * volts
            places[k, i] = x
        last, distance, slope = target, step, end
    return places, limited


def contours() -> dict[str, Any]:
    """Errors and voltage by path and loop. Late drives have no figures between SYNCs."""
    figures: dict[str, Any] = {}
    tuned = loops()
    for name in PATHS:
        pipeline = load_pipeline(EXAMPLES / f"{name}.toml")
        x, y = pipeline.machine.models(pipeline.machine.path_axes)
        paper: tuple[Drives, Forward] = ((x, y), None)
        figures[name] = {}
        for loop, (drives, forward) in {"paper": paper, **tuned}.items():
            motion = simulate(pipeline.image, drives, feedforward=forward)
            found: dict[str, Any] = {
                "contour_um": motion.max_contour_error_um,
                "following_um": motion.max_following_error_um,
                "volts": motion.max_volts,
            }
            if loop != "tuned_late":
                found["between_syncs"] = between_um(pipeline, motion, drives, forward)
            figures[name][loop] = found
    return figures


def weaker_volts(name: str, folder: Path) -> Path:
    """Writes the path file of an example with voltage limit WEAKER_VOLTS to the folder; returns the file."""
    text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    file = folder / f"{name}_{WEAKER_VOLTS:g}_v.toml"
    text = text.replace("volts = 4.5", f"volts = {WEAKER_VOLTS:g}")
    file.write_text(text.replace('"machines/', f'"{MACHINES}/'), encoding="utf-8")
    return file


def sensitivity() -> dict[str, Any]:
    """Contour errors (um) by path, loop and plant, and whether the voltage limit was reached."""
    figures: dict[str, Any] = {}
    example = load_machine(MACHINES / "tuned.toml")
    x, y = example.models(example.path_axes)
    with tempfile.TemporaryDirectory() as folder:
        files = [EXAMPLES / f"{name}.toml" for name in PATHS]
        files += [weaker_volts(name, Path(folder)) for name in PATHS if "optimal" in name]
        for file in files:
            pipeline = load_pipeline(file)
            own_x, own_y = pipeline.machine.models(pipeline.machine.path_axes)
            loops = {
                "paper": ((own_x, own_y), None),
                "no_offsets": ((x, y), None),
                "tuned": ((x, y), forward_of(example)),
            }
            found: dict[str, Any] = {"duration_s": pipeline.plan.duration_s}
            for loop, (drives, forward) in loops.items():
                runs = outcomes(pipeline.image, pipeline.machine.counts_per_mm, drives, forward)
                found[loop] = {
                    case.name: {"contour_um": run.contour_error_um, "at_limit": run.saturated}
                    for case, run in zip(CASES, runs, strict=True)
                }
            figures[file.stem] = found
    return figures


def plants() -> dict[str, Any]:
    """Errors (%) of the plants that are identified from noisy runs of the alpha and the heart, by path and friction."""
    figures: dict[str, Any] = {}
    for name in ("alpha", "heart"):
        pipeline = load_pipeline(EXAMPLES / f"{name}.toml")
        given = pipeline.machine.models(pipeline.machine.path_axes)
        for friction in (0.0, 0.2):
            truth = [
                replace(d, equipment=replace(d.equipment, friction_volts=friction)) for d in given
            ]
            motion = simulate(pipeline.image, truth)
            found = [
                _found(motion, axis, truth[axis], seed) for seed in range(SEEDS) for axis in (0, 1)
            ]
            errors = np.array([errors for errors, _ in found])
            widths = np.array([widths for _, widths in found])
            figures[f"{name}_friction_{friction:g}_v"] = {
                "worst_gain_percent": 100 * float(np.abs(errors[:, 0]).max()),
                "worst_time_percent": 100 * float(np.abs(errors[:, 1]).max()),
                "median_interval_percent": 100 * float(np.median(widths)),
                "inside_percent": 100 * float(np.mean(np.abs(errors) <= widths)),
            }
    return figures


def _found(motion: Motion, axis: int, truth: Drive, seed: int) -> tuple[list[float], list[float]]:
    """Relative errors of gain and time constant, and the half widths of their intervals, both over the true value."""
    noise = np.random.default_rng(1000 * axis + seed)
    rows = motion.program_rows
    still = np.zeros(len(rows), dtype=np.int32)
    targets = rows["set_counts"][:, axis]
    inputs = AxisInputs(int(targets[0]), targets, still, still.astype(np.int16))
    actual = rows["act_counts"][:, axis] + np.rint(noise.normal(0, NOISE_COUNTS, len(rows)))
    volts = rows["volts_mv"][:, axis] + np.rint(noise.normal(0, NOISE_MV, len(rows)))
    stretch = Stretch(inputs, actual.astype(np.int32), volts.astype(np.int16))
    guess = replace(truth, gain_rad_s_v=1.4 * truth.gain_rad_s_v, time_constant_s=0.12)
    found = identify_axis([stretch], guess, motion.counts_per_unit[axis], motion.period_us)
    pairs = (
        (found.gain_rad_s_v, truth.gain_rad_s_v),
        (found.time_constant_s, truth.time_constant_s),
    )
    return [e.value / real - 1 for e, real in pairs], [e.within / real for e, real in pairs]


def main() -> None:
    """Measures and writes."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    figures = {"contour": contours(), "sensitivity": sensitivity(), "identify": plants()}
    write_figures(out, figures)


if __name__ == "__main__":
    main()
