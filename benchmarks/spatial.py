# SPDX-License-Identifier: MIT
"""Measures splines in space: convergence and bending on random walks, order of approximation, criteria, time.

    python benchmarks/spatial.py [--json OUT] [--paths N]

Run by `make bench`. Prints the figures and writes them to OUT as one JSON object.

Random walks are those of tests/host/spline/polygons.py with seeds 0 … N - 1 (N = 200). Splines through their points are
made with each kind of knots, and splines with them as control polygon. The criteria are compared on N / 10 walks.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures
from scipy.optimize import minimize
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests/host/spline"), str(ROOT / "host_tools")]

from polygons import helix, torus_knot, walk  # noqa: E402

from hodograph.errors import PlanError  # noqa: E402
from hodograph.spline import KNOT_NAMES  # noqa: E402
from hodograph.spline.knots import knot_spans  # noqa: E402
from hodograph.spline.newton import newton  # noqa: E402
from hodograph.spline.spatial import (  # noqa: E402
    SpatialPHSpline,
    SpatialSplineResult,
    spatial_from_control_polygon,
    spatial_through_points,
)
from hodograph.spline.spatial.frame import guide_frame  # noqa: E402
from hodograph.spline.spatial.guide import SpaceEnd, points_guide  # noqa: E402
from hodograph.spline.spatial.quality import spline_shape  # noqa: E402
from hodograph.spline.spatial.quaternion import phase_between, polar, root, turned  # noqa: E402
from hodograph.spline.spatial.system import SpaceSystem, cubic_end  # noqa: E402

Real = np.ndarray[Any, np.dtype[np.float64]]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Quadrature of a span for `energies`, on -1 … 1."""


def seeds_figures(attempt: Callable[[int], SpatialSplineResult], count: int) -> dict[str, Any]:
    """Convergence and bending of the splines that `attempt` makes of seeds 0 … count - 1."""
    found, refused = [], 0
    for seed in range(count):
        try:
            found.append(attempt(seed))
        except PlanError:
            refused += 1
    iterations = [result.newton_iterations for result in found]
    bending = [result.bending_ratio for result in found]
    return {
        "paths": count,
        "solved_percent": 100 * len(found) / count,
        "iterations_median": float(np.median(iterations)),
        "iterations_worst": max(iterations),
        "bending_ratio_median": float(np.median(bending)),
        "bending_ratio_worst": max(bending),
    }


def walk_figures(count: int) -> dict[str, Any]:
    """`seeds_figures` of walks that turn by up to 90, 120 and 180 degrees at each point.

    The legs of a walk have uniformly distributed lengths of 3 to 15 mm ("even"), or log-normal ones ("sigma_…"). Those
    of control polygons are "even".
    """
    out: dict[str, Any] = {}
    for degrees in (90, 120, 180):
        for sigma in (None, 1.0, 2.0, 3.0):
            for knots in KNOT_NAMES:
                legs = "even" if sigma is None else f"sigma_{sigma:g}"

                def attempt(
                    seed: int, turn: float = np.radians(degrees), s: Any = sigma, name: str = knots
                ) -> SpatialSplineResult:
                    return spatial_through_points(walk(seed, turn, s), False, knots=name)

                out[f"turns_{degrees}_{legs}_{knots}"] = seeds_figures(attempt, count)
        for closed in (False, True):

            def polygon(
                seed: int, turn: float = np.radians(degrees), around: bool = closed
            ) -> SpatialSplineResult:
                return spatial_from_control_polygon(walk(seed, turn), around)

            name = f"turns_{degrees}_control_polygon_{'closed' if closed else 'open'}"
            out[name] = seeds_figures(polygon, count)
    return out


def helix_errors() -> dict[str, Any]:
    """Greatest errors of splines through points of a helix of two turns, in the middle half of their length."""
    out = {}
    for per_turn in (16, 32, 64, 128):
        spline = spatial_through_points(helix(per_turn), False).spline
        s = np.linspace(0.25, 0.75, 4001) * spline.length_mm
        p = spline.point(s)
        out[f"points_{per_turn}"] = {
            "radius_mm": float(np.abs(np.hypot(p[:, 0], p[:, 1]) - 20).max()),
            "curvature_per_mm": float(np.abs(spline.curvature(s) - 20 / 404).max()),
            "torsion_per_mm": float(np.abs(spline.torsion(s) - 2 / 404).max()),
        }
    return out


def distance_from(spline: SpatialPHSpline, exact: Real) -> float:
    """Greatest distance (mm) of the spline from a curve that is given by many points (`exact`).

    It is measured at 8001 places of the spline, as the distance from the tangent of the curve at its nearest point.
    """
    along = np.gradient(exact, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    p = spline.point(np.linspace(0, spline.length_mm, 8001))
    at = cKDTree(exact).query(p)[1]
    return float(np.linalg.norm(np.cross(p - exact[at], along[at]), axis=1).max())


def trefoil_errors() -> dict[str, float]:
    """Distance (mm) from the trefoil of splines through 24 to 384 of its points."""
    exact = torus_knot(400_000)
    exact = np.vstack((exact[-9:], exact, exact[:9]))
    return {
        f"points_{count}": distance_from(
            spatial_through_points(torus_knot(count), True).spline, exact
        )
        for count in (24, 48, 96, 192, 384)
    }


def published() -> SpatialPHSpline:
    """A PH quintic with the end points and directions of Farouki (2019), example 1, and arc length 1.25.

    Farouki, Giannelli, Manni and Sestini (2008), equations (47) to (55), give the quintics with these ends. They have
    two free angles. Here each angle makes a root the nearest one of its fibre to other roots (`phase_between`), so this
    is not the curve of a printed figure. The parametric speed at both ends is found by bisection on the arc length.
    """
    angles = ((0.65 * np.pi, -0.25 * np.pi), (0.25 * np.pi, 0.25 * np.pi))
    tangents = np.array(
        [[np.cos(a), np.sin(a) * np.cos(b), np.sin(a) * np.sin(b)] for a, b in angles]
    )

    def quintic(speed: float) -> SpatialPHSpline:
        first, last = root(speed * tangents)
        last = turned(last, phase_between(last, first))
        chord = np.array([120.0, 0.0, 0.0])
        inner = root(chord - 15 * speed * tangents.sum(axis=0) + 10 * polar(first, last))
        inner = turned(inner, phase_between(inner, first + last))
        middle = inner / 4 - 0.75 * (first + last)
        preimage = np.stack((first, middle, last), axis=-1)[None]
        return SpatialPHSpline(np.zeros((1, 3)), preimage, False)

    low, high = 0.5, 8.0
    for _ in range(60):
        speed = (low + high) / 2
        low, high = (speed, high) if quintic(speed).length_mm < 1.25 else (low, speed)
    return quintic(low)


def published_errors() -> dict[str, float]:
    """Figures of the curve `published`, and of splines through its points with its end tangents.

    Of the splines: distance from the curve, and bending energy.
    """
    curve = published()
    exact = curve.position(np.zeros(400_001, dtype=int), np.linspace(0, 1, 400_001))
    out: dict[str, float] = {
        "arc_length": curve.length_mm,
        "end_point_error": float(np.abs(exact[-1] - [1, 0, 0]).max()),
        "bending_energy": float(spline_shape(curve.preimage).bending.sum()),
    }
    ends = curve.tangent([0.0, curve.length_mm])
    for spans in (1, 2, 4, 8, 16, 32):
        p = curve.position(np.zeros(spans + 1, dtype=int), np.linspace(0, 1, spans + 1))
        found = spatial_through_points(p, False, "cubic", ends[0], ends[1]).spline
        out[f"spans_{spans}_distance"] = distance_from(found, exact)
        out[f"spans_{spans}_bending_energy"] = float(spline_shape(found.preimage).bending.sum())
    return out


def system_through(p: Real) -> SpaceSystem:
    """The equations of the spline through the points of an open path, with cubic ends and chord-length knots."""
    knots = knot_spans(np.linalg.norm(np.diff(p, axis=0), axis=1), "chord", False)
    free = SpaceEnd("cubic", None)
    guide = points_guide(p, False, free, free, knots)
    chords, length = np.diff(p, axis=0), knots.length[:, None]
    frame = guide_frame(guide.hodograph / length[:, :, None], chords / length)
    ends = cubic_end(float(knots.after[0])), cubic_end(float(knots.before[-1]))
    return SpaceSystem(chords, knots, frame.middle, *ends)


def energies(preimage: Real) -> tuple[float, float]:
    """Integrals of curvature^2 and of torsion^2 over arc length (1/mm)."""
    spline = SpatialPHSpline(np.zeros((preimage.shape[0], 3)), preimage, False)
    segment, xi = np.meshgrid(np.arange(preimage.shape[0]), (NODES + 1) / 2, indexing="ij")
    speed = spline.speed(segment, xi) * WEIGHTS / 2
    bending = np.sum(spline.curvature_at(segment, xi) ** 2 * speed)
    return float(bending), float(np.sum(spline.torsion_at(segment, xi) ** 2 * speed))


def compare(p: Real) -> dict[str, tuple[float, float]]:
    """Energies of splines through the same points by four criteria.

    Interpolation leaves one unknown for each span, the phase of its frame. Each criterion chooses all phases.
    """
    system = system_through(p)

    def solution(phases: Real) -> tuple[SpaceSystem, Any]:
        moved = replace(system, frame=turned(system.frame, np.append(0.0, phases)))
        return moved, newton(moved, moved.first_guess)

    def energy(phases: Real, torsion: float) -> float:
        moved, found = solution(phases)
        if not found.converged:
            return 1e3
        bending, twisting = energies(moved.coefficients(found.z))
        return bending + torsion * twisting

    def twist(phases: Real) -> float:
        moved, found = solution(phases)
        if not found.converged:
            return 1e3
        z = moved.values(found.z)
        return float(np.sum(phase_between(z[1:], z[:-1]) ** 2))

    start = np.zeros(system.frame.shape[0] - 1)
    aims: dict[str, Callable[[Real], float]] = {
        "no_twist_between_neighbours": twist,
        "least_bending": lambda phases: energy(phases, 0.0),
        "least_bending_and_torsion": lambda phases: energy(phases, 1.0),
    }
    phases = {"frame_of_the_guide": start}
    for name, aim in aims.items():
        phases[name] = minimize(aim, start, method="BFGS", options={"maxiter": 60}).x
    out = {}
    for name, at in phases.items():
        moved, found = solution(at)
        out[name] = energies(moved.coefficients(found.z))
    return out


def criteria(count: int) -> dict[str, Any]:
    """Medians of the energies of each criterion, divided by those of the guide's frame.

    They are taken over the first 9 points of walks that turn by up to 60 and 120 degrees.
    """
    out: dict[str, Any] = {}
    for degrees in (60, 120):
        rows = [compare(walk(seed, np.radians(degrees))[:9]) for seed in range(count)]
        for name in rows[0]:
            ratios = np.array([np.divide(row[name], row["frame_of_the_guide"]) for row in rows])
            total = np.array(
                [np.sum(row[name]) / np.sum(row["frame_of_the_guide"]) for row in rows]
            )
            out[f"turns_{degrees}_{name}"] = {
                "bending_median": float(np.median(ratios[:, 0])),
                "torsion_median": float(np.median(ratios[:, 1])),
                "sum_median": float(np.median(total)),
            }
    return out


def speed() -> dict[str, float]:
    """Wall times (s), each the least of three runs; of the random walk, the time and iterations of one run."""
    out = {}
    for count in (1000, 10_000, 100_000):
        long = count / 24 * torus_knot(count, 2, 9)
        works: dict[str, Callable[[], object]] = {
            "open": partial(spatial_through_points, long, False),
            "closed": partial(spatial_through_points, long, True),
            "control_polygon": partial(spatial_from_control_polygon, long, False),
        }
        for name, work in works.items():
            walls = []
            for _ in range(3):
                begin = time.perf_counter()
                work()
                walls.append(time.perf_counter() - begin)
            out[f"{name}_{count}_s"] = min(walls)
    rough = np.cumsum(np.random.default_rng(5).normal(size=(100_000, 3)), axis=0)
    begin = time.perf_counter()
    out["random_walk_100000_iterations"] = spatial_through_points(rough, False).newton_iterations
    out["random_walk_100000_s"] = time.perf_counter() - begin
    return out


def main() -> None:
    """Measures, prints and writes."""
    parser = figures_parser(__doc__)
    parser.add_argument("--paths", type=int, default=200)
    options = parser.parse_args()
    figures = {
        "speed": speed(),
        "helix": helix_errors(),
        "trefoil_mm": trefoil_errors(),
        "published": published_errors(),
        "walks": walk_figures(options.paths),
        "criteria": criteria(max(options.paths // 10, 1)),
    }
    for group, values in figures.items():
        for name, value in values.items():
            print(f"spatial.{group}.{name}: {value}", flush=True)
    write_figures(options.json, {"spatial": figures})


if __name__ == "__main__":
    main()
