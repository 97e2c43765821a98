# SPDX-License-Identifier: MIT
"""Profile `optimal` on random paths, limits, plants and controllers: planned, compiled, and nothing above a limit. Run
by pytest; starts and writes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Drive, load_drive
from hodograph.feed import AxisLimits, ControllerLimits, FeedRequest, FeedZone, Limits, Plant
from hodograph.feed.optimal import plan_optimal, replan_optimal, window
from hodograph.feed.optimal.track import Track
from hodograph.program import compile_path
from hodograph.spline import PHSpline, from_control_polygon
from hodograph.verify import verify_program
from quick_stops import QUICK_STOPS

DRIVE = Path(__file__).parents[3] / "examples/drives/alpha_x.toml"
OPTIMAL = FeedRequest("optimal")


@dataclass
class Case:
    spline: PHSpline
    limits: Limits
    controller: ControllerLimits | None
    plants: tuple[Plant, Plant] | None
    period_us: int


def random_case(seed: int) -> Case:
    """Sizes over four decades, limits over three; each limit present or not."""
    rng = np.random.default_rng([seed, 29])
    spline = random_path(rng)
    feed = float(10.0 ** rng.uniform(0.5, 2.8))
    acceleration = feed / float(10.0 ** rng.uniform(-2.0, -0.3))
    jerk = acceleration / float(10.0 ** rng.uniform(-2.5, -0.7))

    def near(value: float) -> float:
        return value * float(10.0 ** rng.uniform(-0.3, 0.3))

    def maybe(value: float, chance: float = 0.6) -> float | None:
        return near(value) if rng.uniform() < chance else None

    def pair(value: float, chance: float = 0.6) -> tuple[float, float] | None:
        return (near(value), near(value)) if rng.uniform() < chance else None

    zones: tuple[FeedZone, ...] = ()
    if rng.uniform() < 0.3:
        low, high = np.sort(rng.uniform(0.0, spline.length_mm, 2)).tolist()
        zones = (FeedZone(low, high, feed * float(rng.uniform(0.05, 0.6))),)
    plants = None
    if rng.uniform() < 0.5:
        lag = 0.2 * float(10.0 ** rng.uniform(-0.5, 0.5))
        plants = (Plant(feed / 3.0, lag, 5.0, 0.2), Plant(feed / 4.0, 0.15, 5.0))
    limits = Limits(
        feed_mm_s=near(feed),
        acceleration_mm_s2=maybe(acceleration),
        jerk_mm_s3=maybe(jerk),
        centripetal_mm_s2=maybe(acceleration, 0.3),
        axis=AxisLimits(pair(feed, 0.3), pair(acceleration), pair(jerk)),
        zones=zones,
        volts=5.0 if plants else None,
    )
    roomy = ControllerLimits(3.0 * feed, 5.0 * acceleration, 8.0 * jerk, 0.1)
    controller = roomy if rng.uniform() < 0.5 else None
    return Case(spline, limits, controller, plants, int(rng.choice([1000, 2000, 4000])))


def random_path(rng: np.random.Generator) -> PHSpline:
    """A walk, or a closed path."""
    count, scale = int(rng.integers(4, 25)), 10.0 ** rng.uniform(-2.0, 2.0)
    if rng.uniform() < 0.3:
        angle = np.arange(count) / count * 2.0 * np.pi
        radius = scale * count / 6.0 * (1.0 + 0.4 * rng.uniform(-1.0, 1.0, count))
        return from_control_polygon(radius * np.exp(1j * angle), True).spline
    turn = np.cumsum(rng.normal(0.0, rng.uniform(0.1, 0.9), count))
    return from_control_polygon(
        np.cumsum(scale * rng.uniform(0.5, 1.5, count) * np.exp(1j * turn)), False
    ).spline


def drive(plant: Plant) -> Drive:
    """One with these volts, as the verifier takes it."""
    known = load_drive(DRIVE)
    return replace(
        known,
        gain_rad_s_v=plant.gain_mm_s_v / known.screw_mm_rad,
        time_constant_s=plant.time_constant_s,
        volts_limit=plant.volts,
        equipment=replace(known.equipment, friction_volts=plant.friction_volts),
    )


@pytest.mark.parametrize("seed", range(24))
def test_nothing_is_above_a_limit(seed: int) -> None:
    case = random_case(seed)
    plan = plan_optimal(
        case.spline, OPTIMAL, case.limits, case.controller, case.plants, period_us=case.period_us
    )
    program = compile_path(case.spline, plan, QUICK_STOPS, replan_optimal).program
    found = verify_program(program, case.limits, [drive(one) for one in case.plants or ()])
    assert found.kept, found.exceeded
    assert isinstance(plan.curve, Track)
    assert plan.curve.stretch < 1.01


# Minutes long at limits of milliseconds; and one whose programs end short of the solver's tolerance.
SLOW = Limits(jerk_mm_s3=30000.0, volts=5.0, axis=AxisLimits(None, None, (42500.0, 29200.0)))
WEAK = (Plant(1.66, 0.46, 5.0, 0.2), Plant(1.25, 0.15, 5.0))


def bow(length_mm: float) -> PHSpline:
    points = np.array([0.0, 1.0, 2.0 + 0.3j, 2.9 + 0.8j, 3.9 + 0.9j, 4.9 + 0.4j])
    return from_control_polygon(points * length_mm / 5.0, False).spline


def test_effort_does_not_grow_with_the_time_that_a_path_takes() -> None:
    """Intervals are close where the acceleration changes at once, and nowhere else."""
    pieces = [
        len(plan_optimal(bow(length_mm), OPTIMAL, SLOW, None, WEAK, period_us=4000).pieces)
        for length_mm in (100.0, 1600.0)
    ]
    assert pieces[1] < 2 * pieces[0] < 1000


def test_a_program_that_is_not_solved_to_the_last_digit_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All end at the bound of iterations here, near their solution, and the plan keeps its limits all the same."""
    limits = Limits(acceleration_mm_s2=54.0, jerk_mm_s3=3600.0, feed_mm_s=5.0)
    whole = plan_optimal(bow(4.0), OPTIMAL, limits)
    solve = partial(window.solve, tolerance=1e-30)
    monkeypatch.setattr(window, "solve", lambda problem, penalty, _: solve(problem, penalty))
    plan = plan_optimal(bow(4.0), OPTIMAL, limits)
    assert plan.duration_s == pytest.approx(whole.duration_s, rel=2e-3)
    assert verify_program(
        compile_path(bow(4.0), plan, QUICK_STOPS, replan_optimal).program, limits
    ).kept
