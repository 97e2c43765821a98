# SPDX-License-Identifier: MIT
"""Speed of `simulate`, and the accuracy of the simulated drives.

Run by `make bench`. Uses no bus; writes the file of --json.

Speed: 10^6 ticks of 1 ms on one core, contour error included, for each kernel: the heart, 350 laps, each turned by one
degree. Accuracy: alpha and heart at servo sample rates up to 1.024 MHz, compared with the rate of the drive files.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

from hodograph.config import Drive, load_machine, load_path_file
from hodograph.feed import ControllerLimits, plan_feed
from hodograph.native import KERNELS
from hodograph.program import ProgramOptions, compile_program, encode
from hodograph.simulate import Motion, simulate
from hodograph.spline import from_control_polygon

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
LAPS = 350
RATES_HZ = (4000, 8000, 16000, 32000, 64000)
NEARLY_CONTINUOUS_HZ = 1_024_000
"""Sampling rate that stands for continuous time."""
FINE_ENCODER = 2**26
"""Counts per revolution of an encoder that stands for one without steps."""


def example(name: str, laps: int = 1) -> tuple[bytes, tuple[Drive, Drive]]:
    """Program image and drives of an example, its control polygon repeated if asked."""
    path = load_path_file(EXAMPLES / f"{name}.toml")
    assert path.machine_file is not None
    assert path.feed is not None
    machine = load_machine(path.machine_file)
    points = path.path.points
    if laps > 1:
        points = np.concatenate([points * np.exp(1j * np.pi / 180 * k) for k in range(laps)])
    spline = from_control_polygon(points, path.path.closed and laps == 1).spline
    controller = ControllerLimits(
        machine.feed_mm_s, machine.acceleration_mm_s2, machine.jerk_mm_s3, machine.reserve
    )
    plan = plan_feed(spline.length_mm, path.feed, path.limits, controller)
    image = encode(compile_program(spline, plan, ProgramOptions(name=name)))
    x, y = machine.models(machine.path_axes)
    return image, (x, y)


def speed() -> dict[str, Any]:
    """Ticks, seconds and multiples of real time for each kernel, processor time of one thread."""
    image, drives = example("heart", LAPS)
    figures: dict[str, Any] = {}
    for kernel in KERNELS:
        begun = time.thread_time()
        motion = simulate(image, drives, kernel=kernel)
        seconds = time.thread_time() - begun
        figures[kernel] = {
            "ticks": motion.ticks,
            "seconds": seconds,
            "times_real_time": motion.ticks * 1e-6 * motion.period_us / seconds,
            "max_contour_error_um": motion.max_contour_error_um,
        }
    return figures


def sampled(image: bytes, drives: tuple[Drive, Drive], rate_hz: int, encoder: int) -> Motion:
    """The run with another servo sample rate and encoder."""
    changed = [replace(d, loop_rate_hz=rate_hz, encoder_counts_per_rev=encoder) for d in drives]
    return simulate(image, changed)


def accuracy(name: str) -> dict[str, Any]:
    """Contour error by servo sample rate, and the distance from the nearly continuous loop."""
    image, drives = example(name)
    best = sampled(image, drives, NEARLY_CONTINUOUS_HZ, FINE_ENCODER)
    figures: dict[str, Any] = {"nearly_continuous_contour_um": best.max_contour_error_um}
    for rate in RATES_HZ:
        motion = sampled(image, drives, rate, drives[0].encoder_counts_per_rev)
        away = np.abs(motion.act_mm - best.act_mm).max() * 1000.0
        figures[f"{rate}_hz"] = {
            "max_contour_error_um": motion.max_contour_error_um,
            "away_from_continuous_um": float(away),
        }
    motion = simulate(image, drives)
    figures["max_following_error_um"] = motion.max_following_error_um
    figures["max_volts"] = motion.max_volts
    return figures


def main() -> None:
    """Measure and write."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    figures = {"speed": speed(), "alpha": accuracy("alpha"), "heart": accuracy("heart")}
    write_figures(out, figures)


if __name__ == "__main__":
    main()
