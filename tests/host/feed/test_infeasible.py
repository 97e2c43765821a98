# SPDX-License-Identifier: MIT
"""Infeasible limits of profile `optimal`: the message names limit and place, and the value that it proposes is
feasible. Run by pytest; starts and writes nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hodograph.errors import PlanError
from hodograph.feed import (
    AxisLimits,
    ControllerLimits,
    FeedPlan,
    FeedRequest,
    FeedZone,
    Limits,
    Plant,
)
from hodograph.feed.optimal import plan_optimal, replan_optimal
from hodograph.program import check, compile_path
from hodograph.spline import PHSpline, from_control_polygon
from quick_stops import QUICK_STOPS

OPTIMAL = FeedRequest("optimal")
FAST = Limits(feed_mm_s=100.0, acceleration_mm_s2=1000.0, jerk_mm_s3=20000.0)
ROOMY = ControllerLimits(500.0, 5000.0, 200000.0, 0.1)
PLANTS = (Plant(130.0, 0.2, 5.0, 0.3), Plant(80.0, 0.15, 5.0))


def bend(length_mm: float = 20.0) -> PHSpline:
    """A path that turns."""
    points = np.array([0.0, 1.0, 1.5 + 0.4j, 1.2 + 1.2j, 2.0 + 1.6j, 3.0 + 1.2j])
    return from_control_polygon(points * length_mm / 4.0, False).spline


def plan(
    limits: Limits,
    controller: ControllerLimits | None = None,
    plants: tuple[Plant, Plant] | None = None,
    length_mm: float = 20.0,
) -> FeedPlan:
    return plan_optimal(bend(length_mm), OPTIMAL, limits, controller, plants)


def refused(make: Callable[[float], FeedPlan], value: float) -> tuple[str, float]:
    """The message, and the least value that it gives."""
    with pytest.raises(PlanError) as caught:
        make(value)
    text = str(caught.value)
    found = re.search(r": ([0-9.e+-]+) would do", text)
    assert found, text
    return text, float(found[1])


def with_axis(**one: tuple[float, float]) -> Limits:
    return replace(FAST, axis=AxisLimits(**one))


KINDS: dict[str, tuple[Callable[[float], FeedPlan], float]] = {
    "limits: feed_mm_s": (lambda x: plan(replace(FAST, feed_mm_s=x)), 2e-4),
    "limits: acceleration_mm_s2": (lambda x: plan(replace(FAST, acceleration_mm_s2=x)), 1e-9),
    "limits: jerk_mm_s3": (lambda x: plan(replace(FAST, jerk_mm_s3=x)), 1e-13),
    "limits: centripetal_mm_s2": (lambda x: plan(replace(FAST, centripetal_mm_s2=x)), 1e-9),
    "limits: cap of 3 to 4 mm, feed_mm_s": (
        lambda x: plan(replace(FAST, zones=(FeedZone(3.0, 4.0, x),))),
        1e-5,
    ),
    "limits: axis.velocity_mm_s of x": (lambda x: plan(with_axis(velocity_mm_s=(x, 1.0))), 1e-6),
    "limits: axis.acceleration_mm_s2 of y": (
        lambda x: plan(with_axis(acceleration_mm_s2=(1.0, x))),
        1e-10,
    ),
    "limits: axis.jerk_mm_s3 of x": (lambda x: plan(with_axis(jerk_mm_s3=(x, 1.0))), 1e-14),
    "limits: volts of x": (
        lambda x: plan(replace(FAST, volts=x), None, (replace(PLANTS[0], volts=x), PLANTS[1])),
        0.3 + 1e-9,
    ),
    "limits: volts of y": (
        lambda x: plan(replace(FAST, volts=x), None, (PLANTS[0], replace(PLANTS[1], volts=x))),
        1e-9,
    ),
    "controller: feed_mm_s": (lambda x: plan(FAST, replace(ROOMY, feed_mm_s=x)), 1e-4),
    "controller: acceleration_mm_s2": (
        lambda x: plan(FAST, replace(ROOMY, acceleration_mm_s2=x)),
        1e-9,
    ),
    "controller: jerk_mm_s3": (lambda x: plan(FAST, replace(ROOMY, jerk_mm_s3=x)), 1e-13),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_message_names_the_limit_and_its_value_works(name: str) -> None:
    make, value = KINDS[name]
    text, least = refused(make, value)
    assert text.startswith(f"{name} = ")
    assert "at arc length" in text
    found = make(least)
    assert check(compile_path(bend(), found, QUICK_STOPS, replan_optimal).program) is None
    # It is the least: what is a tenth below it is refused too.
    friction = 0.3 if name.endswith("volts of x") else 0.0
    refused(make, friction + 0.9 * (least - friction))


def test_all_limits_that_are_too_low_are_named_at_once() -> None:
    with pytest.raises(PlanError) as caught:
        plan(replace(FAST, feed_mm_s=1e-4, jerk_mm_s3=1e-14))
    assert "limits: feed_mm_s = 0.0001" in str(caught.value)
    assert "limits: jerk_mm_s3 = 1e-14" in str(caught.value)


LONG_MM = 40_000.0


@pytest.mark.parametrize(
    ("name", "make", "value"),
    [
        ("feed_mm_s", lambda x: plan(replace(FAST, feed_mm_s=x), length_mm=LONG_MM), 2e-3),
        (
            "acceleration_mm_s2",
            lambda x: plan(replace(FAST, acceleration_mm_s2=x), length_mm=LONG_MM),
            1e-9,
        ),
        ("jerk_mm_s3", lambda x: plan(replace(FAST, jerk_mm_s3=x), length_mm=LONG_MM), 1e-15),
    ],
)
def test_a_path_that_would_take_too_long(
    name: str, make: Callable[[float], FeedPlan], value: float
) -> None:
    text, least = refused(make, value)
    assert f"limits: {name} = " in text
    assert "longer than" in text
    found = make(least)
    assert 3.5e6 < found.duration_s < 2.0**22 - 1.0


def test_limits_that_take_too_long_together_say_by_how_much_to_raise_them() -> None:
    """Each by itself is quick enough; together they are not."""
    low = Limits(feed_mm_s=0.0115, acceleration_mm_s2=1.2e-8)
    with pytest.raises(PlanError, match="with all limits") as caught:
        plan(low, length_mm=LONG_MM)
    by = [float(x) for x in re.findall(r"by ([0-9.]+)", str(caught.value))]
    raised = Limits(feed_mm_s=0.0115 * by[0], acceleration_mm_s2=1.2e-8 * by[1])
    assert plan(raised, length_mm=LONG_MM).duration_s < 2.0**22 - 1.0
