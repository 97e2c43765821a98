# SPDX-License-Identifier: MIT
"""Compares profile `optimal` with the best known optimum (collocation), a lower bound (TOPP-RA) and the best program of
the paper's kind, all under the same limits, on the paper's curves, in space, with five axes, and on random ones.

    python benchmarks/optimal.py [--json OUT] [--only NAME…] [--intervals N]

Run by `make bench`. Prints to stdout; writes OUT and temporary path files.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "benchmarks/support"), str(ROOT / "host_tools")]

from collocation import Optimum, Task, solve  # noqa: E402
from toppra_bound import bound  # noqa: E402

from hodograph.errors import HodographError  # noqa: E402
from hodograph.feed import Limits  # noqa: E402
from hodograph.machine_limits import controller_limits, plants  # noqa: E402
from hodograph.native.program import NativeProgram  # noqa: E402
from hodograph.pipeline import Pipeline, load_pipeline  # noqa: E402
from hodograph.verify import sampled, verify_program  # noqa: E402

PAPER = """feed_mm_s = 100
acceleration_mm_s2 = 2000
jerk_mm_s3 = 50000
[limits.axis]
acceleration_mm_s2 = 2000
jerk_mm_s3 = 50000
"""
ALL = """feed_mm_s = 200
acceleration_mm_s2 = 3000
jerk_mm_s3 = 80000
centripetal_mm_s2 = 1500
volts = 4.5
[limits.axis]
velocity_mm_s = [180, 160]
acceleration_mm_s2 = [2500, 1800]
jerk_mm_s3 = [70000, 50000]
"""
SPACE = """feed_mm_s = 150
acceleration_mm_s2 = 1500
jerk_mm_s3 = 40000
[limits.axis]
velocity_mm_s = [120, 130, 60]
acceleration_mm_s2 = [1400, 1500, 800]
jerk_mm_s3 = [35000, 40000, 20000]
"""
FIVE = """feed_mm_s = 150
acceleration_mm_s2 = 1500
jerk_mm_s3 = 40000
[limits.axis]
velocity_mm_s = [120, 130, 60, 90, 140]
acceleration_mm_s2 = [1400, 1500, 800, 900, 1800]
jerk_mm_s3 = [35000, 40000, 20000, 30000, 60000]
"""
SPACE_SEEDS = range(201, 204)
SEEDS = range(101, 106)
"""Seeds of paths that were never used for tuning."""

RAMPS_S = (0.02, 0.03, 0.045, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.6)
"""Ramp times that are compared."""
COARSE = 8
"""Intervals of a span in the first solution of the reference."""
LEAST_RESERVE = 0.002
"""Reserve of the limits in the compared plans."""


@dataclass(frozen=True)
class Case:
    """A name, the section [path], [limits], and the machine file."""

    name: str
    path: str
    limits: str
    machine: Path


def cases() -> Iterator[Case]:
    """The paper's two curves under two sets of limits, and the random ones."""
    machines = ROOT / "examples/machines"
    for curve in ("alpha", "heart"):
        text = (ROOT / f"examples/{curve}.toml").read_text(encoding="utf-8")
        path = text[text.index("[path]") : text.index("[feed]")]
        for label, limits in (("paper", PAPER), ("all", ALL)):
            yield Case(f"{curve}, {label}", path, limits, machines / f"paper_{curve}.toml")
    for seed in SEEDS:
        yield Case(f"random {seed}", random_path(seed), ALL, machines / "paper_alpha.toml")
    yield from space_cases(machines)


def space_cases(machines: Path) -> Iterator[Case]:
    """Helix, trefoil knot and random walks in space, and the example with five axes."""
    for name, limits, machine in (("helix", SPACE, "mill"), ("five_axes", FIVE, "mill_five_axes")):
        text = (ROOT / f"examples/{name}.toml").read_text(encoding="utf-8")
        path = text[text.index("[path]") : text.index("[feed]")]
        yield Case(name.replace("_", " "), path, limits, machines / f"{machine}.toml")
    t = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = 30.0 + 10.0 * np.cos(3.0 * t)
    knot = np.stack(
        (ring * np.cos(2.0 * t), ring * np.sin(2.0 * t), 10.0 * np.sin(3.0 * t)), axis=1
    )
    yield Case("trefoil", _through(knot, closed=True), SPACE, machines / "mill.toml")
    for seed in SPACE_SEEDS:
        rng = np.random.default_rng([seed, 6])
        legs = rng.uniform(8.0, 20.0, (int(rng.integers(5, 9)), 1))
        distance = np.cumsum(rng.uniform(-0.7, 0.7, (len(legs), 3)), axis=0) + np.array(
            [1.0, 0.0, 0.0]
        )
        walk = np.cumsum(legs * distance / np.linalg.norm(distance, axis=1)[:, None], axis=0)
        yield Case(f"space {seed}", _through(walk, closed=False), SPACE, machines / "mill.toml")


def _through(points: np.ndarray, *, closed: bool) -> str:
    listed = np.round(points, 6).tolist()
    return f"[path]\nclosed = {str(closed).lower()}\nthrough = {listed}\n"


def random_path(seed: int) -> str:
    """Five to nine control points, open or closed, some 60 to 200 mm long."""
    rng = np.random.default_rng([seed, 5])
    count, closed = int(rng.integers(5, 10)), bool(rng.integers(2))
    if closed:
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        points = rng.uniform(15.0, 40.0, count) * np.exp(1j * angle)
    else:
        turn = np.cumsum(rng.uniform(-1.2, 1.2, count))
        points = np.cumsum(rng.uniform(10.0, 30.0, count) * np.exp(1j * turn))
    listed = [[round(float(p.real), 6), round(float(p.imag), 6)] for p in points]
    return f"[path]\nclosed = {str(closed).lower()}\ncontrol_points = {listed}\n"


def chain_of(case: Case, feed: str, reserve: float, folder: Path) -> Pipeline:
    """A path file of the case with this section [feed]."""
    text = f"{case.path}[feed]\n{feed}[limits]\nreserve = {reserve}\n{case.limits}"
    file = folder / "case.toml"
    file.write_text(text + f'[machine]\nfile = "{case.machine}"\n', encoding="utf-8")
    return load_pipeline(file, allow_space=True)


def task_of(pipeline: Pipeline) -> Task:
    """The limits of the planner without its reserve: path file and controller."""
    limits, own = pipeline.file.limits, controller_limits(pipeline.machine)
    kept = 1.0 - own.kept_free

    def least(given: float | None, most: float) -> float:
        return min(given or np.inf, kept * most)

    bound_by = replace(
        limits,
        feed_mm_s=least(limits.feed_mm_s, own.feed_mm_s),
        acceleration_mm_s2=least(limits.acceleration_mm_s2, own.acceleration_mm_s2),
        jerk_mm_s3=least(limits.jerk_mm_s3, own.jerk_mm_s3),
    )
    return Task(pipeline.curve, bound_by, plants(pipeline.machine, limits))


def optimum(task: Task, intervals: int) -> dict[str, Any]:
    """Several starts on a coarse grid, then the best of them on grids twice and four times as fine."""
    top = task.limits.feed_mm_s or 100.0
    starts = [solve(task, COARSE, None, share * top) for share in (0.1, 0.3, 0.6)]
    good = [one for one in starts if one is not None]
    if not good:
        return {"collocation_s": None}
    best: Optimum = min(good, key=lambda one: one.duration_s)
    spread = max(one.duration_s for one in good) / best.duration_s - 1.0
    trail = [best.duration_s]
    fine = max(2 * COARSE, round(intervals / task.spline.segment_count))
    for per_span in (max(COARSE, fine // 2), fine):
        finer = solve(task, per_span, (best.arc_mm, best.feed_mm_s), 0.3 * top)
        if finer is not None:
            best = finer
            trail.append(finer.duration_s)
    return {
        "collocation_s": best.duration_s,
        "collocation_last_change_percent": 100.0 * abs(trail[-1] / trail[-2] - 1.0)
        if len(trail) > 1
        else None,
        "collocation_beyond_percent": 100.0 * best.beyond,
        "collocation_starts": len(good),
        "collocation_spread_percent": 100.0 * spread,
        "collocation_intervals": best.intervals,
    }


def planned(case: Case, folder: Path) -> dict[str, Any] | None:
    """The planner's own time, peaks and wall time; None where it cannot."""
    pipeline = chain_of(case, 'profile = "optimal"\n', Limits.reserve, folder)
    spline = pipeline.curve  # not to be timed
    begin = time.perf_counter()
    try:
        duration_s = pipeline.plan.duration_s
    except HodographError as error:
        print(f"  {case.name}: {error}", file=sys.stderr)
        return None
    planning_s = time.perf_counter() - begin
    machine = pipeline.machine
    found = verify_program(
        pipeline.program, pipeline.file.limits, machine.models(machine.path_axes)
    )
    jerks = next(
        one for one in sampled(NativeProgram(pipeline.image)) if one.kernel == "fixed"
    ).jerk_mm_s3
    return {
        "duration_s": duration_s,
        "segments": spline.segment_count,
        "planning_s": planning_s,
        "kept": found.kept,
        "worst_ratio": max(peak.usage for peak in found.peaks),
        "axis_jerk_mm_s3": max(jerks),
    }


def of_the_papers_kind(case: Case, folder: Path) -> dict[str, Any] | None:
    """The least time of ramp, constant feed, ramp under the same limits, over ramp times and profiles."""
    tried: dict[tuple[str, float], float] = {}

    def duration(profile: str, ramp_s: float) -> float:
        feed = f'profile = "{profile}"\nnominal_mm_s = 450\nramp_time_s = {ramp_s}\n'
        try:
            plan = chain_of(case, feed, LEAST_RESERVE, folder).plan
        except HodographError:
            return np.inf
        return plan.duration_s

    for ramp_s in RAMPS_S:
        tried["minimax", ramp_s] = duration("minimax", ramp_s)
    coarse = min(tried, key=tried.__getitem__)[1]
    for share in (0.8, 0.9, 1.0, 1.1, 1.25):
        for profile in ("minimax", "exponential"):
            tried[profile, share * coarse] = duration(profile, share * coarse)
    best = min(tried, key=tried.__getitem__)
    if not np.isfinite(tried[best]):
        return None
    return {"duration_s": tried[best], "profile": best[0], "ramp_time_s": best[1]}


def measure(case: Case, intervals: int, folder: Path) -> dict[str, Any]:
    """All figures of one case."""
    pipeline = chain_of(case, 'profile = "optimal"\n', LEAST_RESERVE, folder)
    task = task_of(pipeline)
    out = optimum(task, intervals)
    lower = bound(task.spline, task.limits)
    out |= {"toppra_s": lower.duration_s, "toppra_axis_jerk_mm_s3": lower.axis_jerk_mm_s3}
    out["papers_kind"] = of_the_papers_kind(case, folder)
    out["optimal"] = found = planned(case, folder)
    if found is not None and out["collocation_s"] is not None:
        found["of_best"] = found["duration_s"] / out["collocation_s"]
    return out


HEADER = (
    f"{'case':<16} {'best known':>10} {'change %':>8} {'optimal':>9} {'/ best':>8} "
    f"{'TOPP-RA':>8} {'/ best':>7} {'its jerk':>9} {'our jerk':>9} {'paper kind':>10} {'saved %':>8}"
)


def row(name: str, found: dict[str, Any]) -> str:
    """One line of the table."""

    def over(value: float | None) -> str:
        best = found["collocation_s"]
        return "-" if value is None or best is None else f"{value / best:.4f}"

    def seconds(value: float | None) -> str:
        return "-" if value is None else f"{value:.4f}"

    own, paper = found["optimal"], found["papers_kind"]
    own_s = own and own["duration_s"]
    paper_s = paper and paper["duration_s"]
    saved = "-" if own_s is None or paper_s is None else f"{100 * (1 - own_s / paper_s):.1f}"
    change = found.get("collocation_last_change_percent")
    jerk = "-" if own is None else f"{own['axis_jerk_mm_s3']:.3g}"
    return (
        f"{name:<16} {seconds(found['collocation_s']):>10} {'-' if change is None else f'{change:.3f}':>8} "
        f"{seconds(own_s):>9} {over(own_s):>8} "
        f"{seconds(found['toppra_s']):>8} {over(found['toppra_s']):>7} "
        f"{found['toppra_axis_jerk_mm_s3']:>9.3g} {jerk:>9} {seconds(paper_s):>10} {saved:>8}"
    )


def main() -> int:
    """Exit status."""
    parser = figures_parser(__doc__)
    parser.add_argument("--only", nargs="*", help="cases whose names begin so")
    parser.add_argument("--intervals", type=int, default=128, help="of the finest grid, in all")
    options = parser.parse_args()
    every = list(cases())
    chosen = [one for one in every if not options.only or one.name.startswith(tuple(options.only))]
    if not chosen:
        names = "; ".join(one.name for one in every)
        parser.error(f"--only {' '.join(options.only)}: no such case; the cases are {names}")
    results = {}
    print(HEADER)
    with tempfile.TemporaryDirectory() as folder:
        for case in chosen:
            results[case.name] = measure(case, options.intervals, Path(folder))
            print(row(case.name, results[case.name]), flush=True)
    write_figures(options.json, results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
