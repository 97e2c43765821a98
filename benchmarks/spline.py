# SPDX-License-Identifier: MIT
"""Spline figures: convergence over random polygons, time per point, accuracy of the inverse.

    python benchmarks/spline.py [--json OUT] [--polygons N]

Run by `make bench`. Starts processes.

The polygons are N (10^4) smooth and N uniformly random ones, seeds 0 … N - 1 of tests/host/spline/polygons.py. Prints
the figures and writes them as one JSON object.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures
from numpy.typing import NDArray

Row = tuple[int, int, int, float, float]

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests/host/spline"), str(ROOT / "host_tools")]

from polygons import ALPHA, HEART, Polygon, smooth, uniform  # noqa: E402

from hodograph.errors import PlanError  # noqa: E402
from hodograph.spline import PHSpline, from_control_polygon  # noqa: E402
from hodograph.spline.verdict import EXTRA_TURNING_RAD  # noqa: E402


def part(polygon: Callable[[int], Polygon], seeds: range) -> tuple[list[Row], list[str]]:
    """Figures of the accepted splines, messages of the refused ones."""
    rows: list[Row] = []
    refused: list[str] = []
    for seed in seeds:
        try:
            found = from_control_polygon(*polygon(seed))
        except PlanError as error:
            refused.append(f"seed {seed}: {error}")
            continue
        rows.append(
            (
                found.newton_iterations,
                found.trial_iterations,
                found.changed_sides,
                found.extra_turning_rad,
                found.bending_ratio,
            )
        )
    return rows, refused


def seeds_figures(polygon: Callable[[int], Polygon], count: int) -> dict[str, Any]:
    """Convergence and quality over seeds 0 … count - 1, on two processes."""
    seeds = [range(first, min(first + 250, count)) for first in range(0, count, 250)]
    with ProcessPoolExecutor(2) as pool:
        parts = list(pool.map(part, [polygon] * len(seeds), seeds))
    refused = [text for _, texts in parts for text in texts]
    table = np.array([row for rows, _ in parts for row in rows])
    iterations, trials, changed, extra, bending = table.T
    return {
        "polygons": count,
        "seeds": f"0 to {count - 1}",
        "accepted": len(table),
        "rate_percent": 100 * len(table) / count,
        "refused": refused[:10],
        "iterations_median": float(np.median(iterations)),
        "iterations_worst": int(iterations.max()),
        "with_trials_percent": float(100 * np.mean(trials > 0)),
        "trial_iterations_worst": int(trials.max()),
        "changed_sides": int(changed.sum()),
        "extra_turning_worst_rad": float(extra.max()),
        "extra_loops": int((extra > EXTRA_TURNING_RAD).sum()),
        "bending_ratio_median": float(np.median(bending)),
        "bending_ratio_worst": float(bending.max()),
    }


def wavy(count: int) -> NDArray[np.complex128]:
    """A long smooth polygon with legs of about 6 mm."""
    t = np.arange(count) / count
    points: NDArray[np.complex128] = (
        count * (1 + 0.3 * np.cos(14 * np.pi * t)) * np.exp(2j * np.pi * t)
    )
    return points


def seconds(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Least wall time and least processor time of `repeats` runs, after one to warm up."""
    work()
    wall, cpu = [], []
    for _ in range(repeats):
        begin = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - begin[0])
        cpu.append(time.process_time() - begin[1])
    return min(wall), min(cpu)


def speed() -> dict[str, Any]:
    """Wall times, and processor time per point, for 10^3 … 10^5 points."""
    out: dict[str, Any] = {
        "alpha_ms": 1e3 * seconds(lambda: from_control_polygon(ALPHA, False), 50)[0],
        "heart_ms": 1e3 * seconds(lambda: from_control_polygon(HEART, True), 50)[0],
    }
    for count in (1000, 10_000, 100_000):
        p = wavy(count)
        for closed in (False, True):
            name = "closed" if closed else "open"
            wall, cpu = seconds(partial(from_control_polygon, p, closed), 5)
            out[f"{name}_{count}_s"] = wall
            out[f"{name}_{count}_cpu_us_per_point"] = 1e6 * cpu / count
    p, _ = uniform_long(100_000)
    begin = time.perf_counter()
    try:
        out["uniform_100000_newton_iterations"] = from_control_polygon(p, False).newton_iterations
    except PlanError as error:
        out["uniform_100000_refused"] = str(error)
    out["uniform_100000_s"] = time.perf_counter() - begin
    return out


def uniform_long(count: int) -> Polygon:
    """Uniformly random points, far beyond the 200 of `uniform`."""
    rng = np.random.default_rng([count, 3])
    return rng.uniform(0, 100, count) + 1j * rng.uniform(0, 100, count), False


def evaluation() -> dict[str, Any]:
    """Inverse of arc length and splitting on a spline of 10^4 spans."""
    spline: PHSpline = from_control_polygon(wavy(10_000), True).spline
    s = np.random.default_rng(7).uniform(0, spline.length_mm, 1_000_000)
    spline.locate(s[:10])
    begin = time.perf_counter()
    segment, xi = spline.locate(s)
    took = time.perf_counter() - begin
    error = spline.arc_length(segment, xi) - (s - spline.segment_starts_mm[segment])
    heart = from_control_polygon(HEART, True).spline
    return {
        "locate_us_per_point": 1e6 * took / s.size,
        "locate_error_relative_to_segment": float(
            np.abs(error / spline.segment_lengths_mm[segment]).max()
        ),
        "split_10000_ms": 1e3 * seconds(lambda: spline.split(32.0), 3)[0],
        "max_curvature_10000_ms": 1e3 * seconds(spline.max_curvature_per_mm, 3)[0],
        "heart_split_segments": heart.split(32.0).segment_count,
    }


def main() -> None:
    """Entry point."""
    parser = figures_parser(__doc__)
    parser.add_argument("--polygons", type=int, default=10_000)
    options = parser.parse_args()
    figures = {
        "speed": speed(),
        "evaluation": evaluation(),
        "smooth": seeds_figures(smooth, options.polygons),
        "uniform": seeds_figures(uniform, options.polygons),
    }
    for group, values in figures.items():
        for name, value in values.items():
            shown = f"{value:.6g}" if isinstance(value, float) else value
            print(f"spline.{group}.{name}: {shown}")
    write_figures(options.json, {"spline": figures})


if __name__ == "__main__":
    main()
