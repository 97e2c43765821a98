# SPDX-License-Identifier: MIT
"""Profile `optimal`: inside all limits on any path, fast, equal in several windows and in one, with clear messages if
no feed exists. Run by pytest; starts and writes nothing.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from hodograph.errors import InputError, PlanError
from hodograph.feed import (
    AxisLimits,
    ControllerLimits,
    FeedPlan,
    FeedRequest,
    FeedZone,
    Limits,
    Plant,
)
from hodograph.feed.optimal import plan_optimal, plan_peaks, replan_optimal, solver
from hodograph.feed.optimal.plan_limits import gather
from hodograph.feed.optimal.sequence import plan_windows
from hodograph.feed.optimal.track import Track, joined
from hodograph.feed.optimal.window import _long_enough
from hodograph.native.quadratic_program import QuadraticProgram, QuadraticSolution
from hodograph.program import check, compile_path
from hodograph.spline import PHSpline, from_control_polygon
from hodograph.verify import verify_program
from quick_stops import QUICK_STOPS

OPTIMAL = FeedRequest("optimal")
AXES = Limits(axis=AxisLimits(None, (2000.0, 2000.0), (50000.0, 50000.0)))
CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.1)


def walk(points: int, seed: int, step_mm: float = 15.0) -> PHSpline:
    """A smooth random path of points - 2 segments."""
    random = np.random.default_rng(seed)
    turns = np.cumsum(random.normal(0.0, 0.7, points))
    steps = step_mm * random.uniform(0.5, 1.5, points) * np.exp(1j * turns)
    return from_control_polygon(np.cumsum(steps), False).spline


def ring(points: int, seed: int, radius_mm: float = 30.0) -> PHSpline:
    """A closed random path."""
    random = np.random.default_rng(seed)
    radii = radius_mm * (1.0 + 0.3 * random.uniform(-1.0, 1.0, points))
    angles = 2.0 * np.pi * np.arange(points) / points
    return from_control_polygon(radii * np.exp(1j * angles), True).spline


def straight(length_mm: float) -> PHSpline:
    """One segment."""
    return from_control_polygon(np.linspace(0.0, length_mm, 4) + 0j, False).spline


def track(plan: FeedPlan) -> Track:
    assert isinstance(plan.curve, Track)
    return plan.curve


def keeps(plan: FeedPlan) -> bool:
    """Every limit, to 0.1 %."""
    (path,) = plan.paths
    controller = None if plan.assumed else plan.controller
    peaks = plan_peaks(plan, path.spline, plan.limits, controller, path.plants)
    return max(peak.usage for peak in peaks.values()) < 1.001


@pytest.mark.parametrize("seed", range(8))
def test_random_paths_and_limits_are_kept_and_make_programs(seed: int) -> None:
    random = np.random.default_rng(seed)
    scale = 10.0 ** random.uniform(-1.0, 1.0)
    spline = ring(9, seed, 20.0 * scale) if seed % 3 == 0 else walk(6 + seed, seed, 8.0 * scale)
    feed = 10.0 ** random.uniform(1.3, 2.6)
    acceleration = feed / random.uniform(0.03, 0.3)
    jerk = acceleration / random.uniform(0.02, 0.1)
    pair = tuple((acceleration * random.uniform(0.5, 2.0, 2)).tolist())
    limits = Limits(
        feed_mm_s=feed if seed % 2 else None,
        jerk_mm_s3=jerk,
        centripetal_mm_s2=acceleration if seed % 4 == 1 else None,
        volts=5.0 if seed % 5 == 2 else None,
        axis=AxisLimits(None, (pair[0], pair[1]), (1.5 * jerk, jerk) if seed % 3 else None),
        zones=(FeedZone(0.3 * spline.length_mm, 0.4 * spline.length_mm, 0.3 * feed),),
    )
    plants = (Plant(feed / 3.0, 0.15, 5.0, 0.1), Plant(feed / 4.0, 0.2, 5.0))
    plan = plan_optimal(
        spline, OPTIMAL, limits, None, plants if limits.volts else None, period_us=1000
    )
    assert keeps(plan)
    assert track(plan).stretch < 1.01
    assert check(compile_path(spline, plan, QUICK_STOPS, replan_optimal).program) is None


@pytest.mark.parametrize("seed", range(16))
def test_the_verifier_finds_no_limit_passed(seed: int) -> None:
    """It looks between samples too, and shares nothing with the planner."""
    random = np.random.default_rng(seed)
    spline = walk(int(random.integers(5, 12)), seed, 10.0 ** random.uniform(-1.0, 1.3))
    feed = 10.0 ** random.uniform(1.0, 2.5)
    acceleration = feed / random.uniform(0.02, 0.3)
    limits = Limits(feed, acceleration, acceleration / random.uniform(0.01, 0.1))
    plan = plan_optimal(spline, OPTIMAL, limits, None, None, period_us=1000)
    found = verify_program(compile_path(spline, plan, QUICK_STOPS, replan_optimal).program, limits)
    assert found.kept, found.exceeded


@pytest.mark.parametrize("length_mm", [2e-3, 0.1, 7.0, 300.0])
def test_a_straight_line_takes_the_time_of_seven_phases(length_mm: float) -> None:
    feed, acceleration, jerk = 100.0, 2000.0, 50000.0
    plan = plan_optimal(straight(length_mm), OPTIMAL, Limits(feed, acceleration, jerk))
    assert keeps(plan)
    least = least_time(length_mm, feed, acceleration, jerk)
    assert least * 0.9995 < plan.duration_s < least * 1.02 + 2e-3


def least_time(length: float, feed: float, acceleration: float, jerk: float) -> float:
    """From rest to rest, in closed form: the highest feed reached is the one that fits the length."""

    def ramp_s(v: float) -> float:
        if v < acceleration**2 / jerk:
            return 2.0 * float(np.sqrt(v / jerk))
        return v / acceleration + acceleration / jerk

    low, high = 0.0, feed
    if ramp_s(feed) * feed <= length:
        return 2.0 * ramp_s(feed) + (length - ramp_s(feed) * feed) / feed
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ramp_s(middle) * middle < length else (low, middle)
    return 2.0 * ramp_s(low)


def test_more_room_is_never_slower() -> None:
    spline = walk(12, 4)
    times = []
    for scale in (0.5, 1.0, 2.0):
        limits = replace(
            AXES, axis=AxisLimits(None, (scale * 2000.0, 2000.0), (50000.0, scale * 50000.0))
        )
        times.append(plan_optimal(spline, OPTIMAL, limits, CONTROLLER).duration_s)
    assert all(later < earlier * 1.0005 for earlier, later in pairwise(times))


def test_uniformly_wider_limits_scale_time_exactly() -> None:
    """Feed by k, accelerations by k^2, jerks by k^3: the same motion, k times as fast."""
    spline, k = ring(10, 3), 1.3
    base = Limits(150.0, 1500.0, 40000.0, axis=AxisLimits(None, (1200.0, 1800.0), None))
    fast = Limits(
        150.0 * k, 1500.0 * k**2, 40000.0 * k**3,
        axis=AxisLimits(None, (1200.0 * k**2, 1800.0 * k**2), None),
    )  # fmt: skip
    slow_s, fast_s = (plan_optimal(spline, OPTIMAL, x).duration_s for x in (base, fast))
    assert slow_s / fast_s == pytest.approx(k, rel=5e-3)


def test_windows_agree_with_one_plan_and_join_smoothly() -> None:
    spline = walk(40, 5)
    bounds = gather(OPTIMAL, AXES, CONTROLLER, None, 1000)
    whole = joined(list(plan_windows(spline, bounds, 1e-3, 10**6)))
    parts = list(plan_windows(spline, bounds, 1e-3, 60))
    assert len(parts) > 2
    assert joined(parts).times.sum() == pytest.approx(whole.times.sum(), rel=1e-3)
    for one, following in pairwise(parts):
        assert one.s[-1] == following.s[0]
        assert one.feed[-1] == pytest.approx(following.feed[0], rel=1e-6)
        assert one.acceleration[-1] == pytest.approx(following.acceleration[0], abs=1e-3)


@pytest.mark.parametrize("intervals", [25, 60])
def test_windows_do_not_stop_where_volts_alone_bound_the_acceleration(intervals: int) -> None:
    """Long ramps: the first estimate of a window is far above what the feed at its start can brake from."""
    turns = np.cumsum(np.random.default_rng(5).normal(0.0, 0.3, 6))
    spline = from_control_polygon(np.cumsum(6.0 * np.exp(1j * turns)), False).spline
    limits = Limits(jerk_mm_s3=30000.0, volts=5.0, axis=AxisLimits(None, None, (42500.0, 29200.0)))
    plants = (Plant(1.66, 0.46, 5.0, 0.2), Plant(1.25, 0.15, 5.0))
    bounds = gather(OPTIMAL, limits, None, plants, 4000)
    whole = joined(list(plan_windows(spline, bounds, 4e-3, 10**6)))
    parts = list(plan_windows(spline, bounds, 4e-3, intervals))
    assert len(parts) > 2
    assert min(part.feed[-1] for part in parts[:-1]) > 1.0
    assert joined(parts).times.sum() == pytest.approx(whole.times.sum(), rel=2e-3)


def test_each_period_has_pieces_that_the_controller_takes() -> None:
    spline = walk(12, 6)
    for period_us in (1000, 8000):
        plan = plan_optimal(spline, OPTIMAL, AXES, CONTROLLER, period_us=period_us)
        seconds = track(plan).seconds[1:-1]
        assert (seconds[1:] + seconds[:-1]).min() > 2e-6 * period_us
        assert check(compile_path(spline, plan, QUICK_STOPS, replan_optimal).program) is None


def test_without_a_limit_of_jerk_one_is_taken_and_reported() -> None:
    plan = plan_optimal(walk(8, 7), OPTIMAL, Limits(feed_mm_s=80.0))
    assert any("jerk" in note for note in plan.notes)
    assert keeps(plan)


@pytest.mark.parametrize(
    ("limits", "name", "needed"),
    [
        (Limits(feed_mm_s=1e-4), "feed_mm_s", 1e-3),
        (Limits(jerk_mm_s3=1.0, centripetal_mm_s2=1e-12), "centripetal_mm_s2", None),
        (Limits(axis=AxisLimits(None, None, (1e-14, 1.0))), "axis.jerk_mm_s3 of x", None),
    ],
)
def test_hopeless_limits_say_which_where_and_what_would_do(
    limits: Limits, name: str, needed: float | None
) -> None:
    spline = walk(8, 8)
    with pytest.raises(PlanError) as caught:
        plan_optimal(spline, OPTIMAL, limits)
    text = str(caught.value)
    assert f"limits: {name} = " in text
    assert "arc length" in text
    value = float(text.split(": ")[-1].split()[0])
    if needed is not None:
        assert value == pytest.approx(needed, rel=0.02)


def test_no_limits_at_all_are_refused() -> None:
    with pytest.raises(InputError, match="no limit"):
        plan_optimal(straight(10.0), OPTIMAL, Limits())


def test_effort_grows_in_proportion_to_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows by iterations of the solver, and what it gives, counted, since time depends on the load."""
    work: list[int] = []
    solve = solver.solve_quadratic

    def counted(program: QuadraticProgram, guess: np.ndarray, **options: Any) -> QuadraticSolution:
        found = solve(program, guess, **options)
        work[-1] += program.interval.size * found.iterations
        return found

    monkeypatch.setattr(solver, "solve_quadratic", counted)
    pieces = []
    for n in (150, 600):
        work.append(0)
        pieces.append(track(plan_optimal(walk(n + 2, 1), OPTIMAL, AXES, CONTROLLER)).s.size)
    for counts in (work, pieces):
        assert 3.0 < counts[1] / counts[0] < 5.5


def test_an_interval_that_is_too_brief_with_its_neighbour_is_joined_to_it() -> None:
    times = np.array([3.0, 3.0, 0.5, 1.0, 3.0, 0.5])
    assert _long_enough(times, None, 2.01).tolist() == [True, True, True, False, True, True, True]
    # Where other pieces come before and after the window, its own ends count too.
    times = np.array([0.5, 3.0, 3.0, 3.0, 0.5, 0.5])
    kept = _long_enough(times, 1.0, 2.01)
    assert kept.tolist() == [True, False, True, True, True, False, True]
