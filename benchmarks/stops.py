# SPDX-License-Identifier: MIT
"""Compares stops with the least time to rest on the same path under the same limits: feed hold and fault stop, at
instants spread over each program.

    python benchmarks/stops.py [--json OUT] [--only NAME…] [--instants N]

Run by `make bench`. Uses no bus; prints to stdout, writes OUT.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "benchmarks/support"), str(ROOT / "host_tools")]

from least_stop import LeastStop, State  # noqa: E402

from hodograph.machine_limits import stop_terms  # noqa: E402
from hodograph.native import NativeProgram  # noqa: E402
from hodograph.native.stop_search import StopSearch  # noqa: E402
from hodograph.pipeline import Pipeline, load_pipeline  # noqa: E402
from hodograph.program.stop_planning import fault_limits, hold_limits  # noqa: E402
from hodograph.simulate import simulate_stop  # noqa: E402

CASES = ("alpha_optimal", "heart_optimal", "alpha", "heart")
LIMITS = {"hold": hold_limits, "fault": fault_limits}
END_TICKS = 30
STARTS = (1.0, 0.7)
"""Durations of the starts, as shares of the stop's own."""


@dataclass(frozen=True)
class Compared:
    """A stop: when it was commanded, its time to standstill, and the least time (None: not found)."""

    at_s: float
    rest_after_s: float
    least_s: float | None

    @property
    def of_least(self) -> float | None:
        """Time of the stop over the least time."""
        return None if self.least_s is None else self.rest_after_s / self.least_s


def stops_of(pipeline: Pipeline, kind: str, instants: int) -> list[Compared]:
    """One stop at each instant, with the least time to rest from the state that the plan has there."""
    image, plan, machine = NativeProgram(pipeline.image), pipeline.plan, pipeline.machine
    own = LIMITS[kind](plan, stop_terms(machine, pipeline.file.limits))
    least = LeastStop(pipeline.spline_result.spline, own.raised(StopSearch(image).used(own)))
    period_s = machine.period_us * 1e-6
    out = []
    for share in np.arange(1, instants + 1) / (instants + 1):
        tick = int(np.ceil(share * plan.duration_s / period_s))
        run = simulate_stop(image, machine.models(machine.path_axes), kind, tick * period_s)
        before_s = (tick - 1) * period_s
        motion = (plan.arc_length, plan.feed, plan.acceleration)
        state = State(*(float(quantity(before_s)) for quantity in motion))
        starts_s = tuple(start * run.rest_after_s for start in STARTS)
        least_s = least.time_s(state, starts_s)
        if least_s is not None:  # the program itself ends in a rest
            least_s = min(least_s, plan.duration_s - before_s)
        out.append(Compared(tick * period_s, run.rest_after_s, least_s))
    return out


@dataclass(frozen=True)
class NearEnd:
    """The fault stop near the end of a program that is farthest from the least time to rest: how many ticks before the
    last setpoint it is commanded, the feed then, its time to standstill, and that of a brake with the machine's limits
    along the path.
    """

    ticks: int
    feed_mm_s: float
    rest_after_s: float
    least_s: float

    @property
    def lost_s(self) -> float:
        """How much later than possible the axes rest."""
        return self.rest_after_s - self.least_s


def near_end(pipeline: Pipeline) -> NearEnd:
    """The worst of the last END_TICKS instants."""
    image, plan, machine = NativeProgram(pipeline.image), pipeline.plan, pipeline.machine
    period_s = machine.period_us * 1e-6
    last = int(np.ceil(plan.duration_s / period_s))
    found = []
    for ticks in range(2, END_TICKS + 1):
        run = simulate_stop(
            image, machine.models(machine.path_axes), "fault", (last - ticks) * period_s
        )
        before_s = (last - ticks - 1) * period_s
        feed, acceleration = float(plan.feed(before_s)), float(plan.acceleration(before_s))
        least_s = least_brake_s(feed, acceleration, machine.acceleration_mm_s2, machine.jerk_mm_s3)
        least_s = min(least_s, plan.duration_s - before_s)
        found.append(NearEnd(ticks, feed, run.rest_after_s, least_s))
    return max(found, key=lambda one: one.lost_s)


def least_brake_s(speed: float, acceleration: float, most: float, jerk: float) -> float:
    """Time of the S-curve to rest in continuous time, with these limits along the path: mm, s."""
    depth = min(float(np.sqrt(speed * jerk + acceleration**2 / 2.0)), most)
    sign = 1.0 if acceleration + depth > 0.0 else -1.0
    peak = speed + sign * (acceleration**2 - depth**2) / (2.0 * jerk)
    even_s = max(peak / depth - depth / (2.0 * jerk), 0.0)
    return abs(acceleration + depth) / jerk + even_s + depth / jerk


def measure(name: str, instants: int, listed: bool) -> dict[str, Any]:
    """Figures of one program."""
    pipeline = load_pipeline(ROOT / f"examples/{name}.toml")
    out: dict[str, Any] = {}
    for kind in LIMITS:
        stops = stops_of(pipeline, kind, instants)
        ratios = np.array([one.of_least for one in stops if one.of_least is not None])
        out[kind] = {
            "stops": len(stops),
            "compared": len(ratios),
            "median_of_least": float(np.median(ratios)),
            "worst_of_least": float(ratios.max()),
            "within_1_3_percent": 100.0 * float(np.mean(ratios <= 1.3)),
            "worst_s": max(one.rest_after_s for one in stops),
        }
        if listed:
            for one in stops:
                print(
                    f"  {kind:<6} {one.at_s:7.3f} {one.rest_after_s:7.4f} {one.least_s} {one.of_least}"
                )
    end = near_end(pipeline)
    out["near_end"] = asdict(end) | {"lost_s": end.lost_s}
    return out


def main() -> int:
    """Exit status."""
    parser = figures_parser(__doc__)
    parser.add_argument("--only", nargs="*", help="programs by name")
    parser.add_argument("--instants", type=int, default=40)
    parser.add_argument("--list", action="store_true", help="one line for each stop")
    options = parser.parse_args()
    results = {}
    print(
        f"{'program':<16} {'stop':<6} {'compared':>8} {'median':>7} {'worst':>7} {'<= 1.3, %':>9} {'longest s':>9}"
    )
    for name in options.only or CASES:
        results[name] = measure(name, options.instants, options.list)
        for kind, found in results[name].items():
            if kind not in LIMITS:
                continue
            print(
                f"{name:<16} {kind:<6} {found['compared']:>8} {found['median_of_least']:>7.2f} "
                f"{found['worst_of_least']:>7.2f} {found['within_1_3_percent']:>9.0f} {found['worst_s']:>9.3f}",
                flush=True,
            )
        end = results[name]["near_end"]
        print(
            f"{name:<16} fault stop at the end: at most {1e3 * end['lost_s']:.1f} ms later than possible "
            f"({1e3 * end['rest_after_s']:.0f} ms for {1e3 * end['least_s']:.1f}, "
            f"{end['ticks']} ticks before the last setpoint, at {end['feed_mm_s']:.1f} mm/s)"
        )
    write_figures(options.json, results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
