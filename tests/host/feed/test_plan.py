# SPDX-License-Identifier: MIT
"""Planning: what lowers the feed, what is reported, what is refused; and the pattern search. Run by pytest; starts and
writes nothing.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.errors import InputError, PlanError
from hodograph.feed import (
    AxisLimits,
    ControllerLimits,
    FeedRequest,
    FeedZone,
    Limits,
    plan_feed,
)
from hodograph.feed.ramp import JERK, exponential_ramp, pattern_search, quintic_ramp

PAPER = FeedRequest("exponential", 100.0, 0.1)


def test_the_papers_case() -> None:
    plan = plan_feed(100.0, PAPER, Limits(None, 2000.0, 50000.0))
    assert plan.feed_mm_s == 100.0
    assert plan.n_c == pytest.approx(8.3503, abs=2e-4)
    assert plan.peak_jerk_mm_s3 == pytest.approx(48146.1, abs=0.1)
    assert plan.evaluations == plan.history[-1].evaluations == 89
    assert plan.history[0].best == 5.0
    assert not plan.excesses
    assert not plan.notes


def test_found_n_c_is_the_least_of_a_fine_scan() -> None:
    plan = plan_feed(100.0, PAPER)
    scan = [exponential_ramp(100.0, 0.1, n).peak(JERK) for n in np.linspace(2.0, 12.0, 1001)]
    assert plan.peak_jerk_mm_s3 <= min(scan) * (1.0 + 1e-9)


def test_pattern_search_follows_the_rules() -> None:
    steps = pattern_search(lambda n: (n - 7.3) ** 2, 5.0, 2.0, 12.0)
    assert steps[-1].best == pytest.approx(7.3, abs=1e-5)
    assert steps[-1].mesh <= 1e-6
    for before, after in pairwise(steps):
        better = after.value < before.value
        assert after.mesh == before.mesh * (2.0 if better else 0.5)
        assert after.evaluations - before.evaluations <= 2
    at_bound = pattern_search(lambda n: -n, 5.0, 2.0, 12.0)
    assert at_bound[-1].best == 12.0


def test_report_lists_what_exceeds_and_leaves_the_feed() -> None:
    request = FeedRequest("quintic", 100.0, 0.1)
    plan = plan_feed(100.0, request, Limits(80.0, 1800.0, 50000.0, "report"))
    assert plan.feed_mm_s == 100.0
    assert [e.quantity for e in plan.excesses] == ["feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"]
    assert "above its limit" in plan.excesses[0].excess_text


@pytest.mark.long_examples(100)
@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from(("quintic", "exponential", "minimax")),
    st.floats(5.0, 1000.0),
    st.floats(0.02, 1.0),
    st.floats(100.0, 20000.0),
    st.floats(5e3, 1e6),
)
def test_respect_keeps_the_limits_and_wastes_little(
    profile, feed, time, acceleration, jerk
) -> None:
    limits = Limits(None, acceleration, jerk)
    plan = plan_feed(5000.0, FeedRequest(profile, feed, time), limits)
    assert plan.peak_acceleration_mm_s2 <= acceleration * (1.0 + 1e-9)
    assert plan.peak_jerk_mm_s3 <= jerk * (1.0 + 1e-9)
    if plan.feed_mm_s < feed and plan.raw.faithful:
        fullest = max(plan.peak_acceleration_mm_s2 / acceleration, plan.peak_jerk_mm_s3 / jerk)
        assert fullest > 1.0 - 1e-5
        assert "feed lowered" in plan.notes[0]
        assert "limits" in plan.notes[0]


@pytest.mark.long_examples(100)
@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from(("quintic", "exponential", "minimax")),
    st.floats(0.01, 200.0),
    st.sampled_from((1000, 2000, 4000, 8000)),
)
def test_short_paths_get_a_lower_feed(profile, length, period_us) -> None:
    plan = plan_feed(length, FeedRequest(profile, 100.0, 0.1), period_us=period_us)
    assert plan.ramp_time_s == 0.1
    assert plan.feed_mm_s <= length / 0.1 * (1.0 + 1e-12)
    assert plan.arc_length(plan.duration_s) == pytest.approx(length, rel=1e-12)
    if length < 10.0:
        assert plan.feed_mm_s == pytest.approx(length / 0.1, rel=0.1)
        assert "feed lowered" in plan.notes[0]


def test_controller_limits_bind_under_every_policy_with_their_reserve() -> None:
    controller = ControllerLimits(400.0, 1000.0, 1e6, 0.1)
    for policy in ("respect", "report"):
        plan = plan_feed(100.0, PAPER, Limits(policy=policy), controller)
        assert plan.peak_acceleration_mm_s2 == pytest.approx(900.0, rel=1e-5)
        assert plan.n_c != pytest.approx(8.3503, abs=0.05), "n_c is found again"
        assert "controller acceleration_mm_s2 = 1000 less its reserve" in plan.notes[0]


def test_without_a_reserve_the_note_still_names_the_limit() -> None:
    controller = ControllerLimits(400.0, 1000.0, 1e6, 0.0)
    plan = plan_feed(100.0, PAPER, None, controller)
    assert plan.peak_acceleration_mm_s2 == pytest.approx(998.0, rel=1e-5)
    assert len(plan.notes) == 1
    assert "controller acceleration_mm_s2 = 1000 less its reserve" in plan.notes[0]


def test_slow_feeds_fall_back_to_the_plain_ramp_and_say_so() -> None:
    plan = plan_feed(10.0, FeedRequest("exponential", 0.05, 0.1))
    assert plan.n_c == 0.0
    assert plan.peak_jerk_mm_s3 == pytest.approx(quintic_ramp(0.05, 0.1).peak(JERK))
    assert any("n_c = 0" in note for note in plan.notes)


def test_reverse_motion_is_refused() -> None:
    for n_c in (5.0, 8.12, 20.0):
        with pytest.raises(PlanError, match="reverse motion"):
            plan_feed(10.0, FeedRequest("exponential", 0.05, 0.1, n_c=n_c))


def test_a_dip_of_the_slow_exponential_ramp_leaves_starts_rising() -> None:
    for feed, ramp in ((10.0, 1.5), (5.0, 0.8), (1.0, 0.1), (30.0, 3.0)):
        plan = plan_feed(60.0, FeedRequest("exponential", feed, ramp))
        assert np.diff(plan.pieces.start_q40).min() > 0
        assert plan.feed(np.linspace(0.0, plan.duration_s, 100_001)).min() >= -(2.0**-14)


@pytest.mark.parametrize(
    "arguments",
    [
        {"profile": "cubic"},
        {"nominal_mm_s": 0.0},
        {"nominal_mm_s": float("nan")},
        {"nominal_mm_s": 1e9},
        {"ramp_time_s": 0.0},
        {"ramp_time_s": float("inf")},
        {"n_c": -1.0},
        {"n_c": "best"},
        {"degree": 2},
        {"degree": 40},
    ],
)
def test_absurd_requests_are_refused(arguments) -> None:
    good = {"profile": "quintic", "nominal_mm_s": 100.0, "ramp_time_s": 0.1}
    with pytest.raises(InputError):
        FeedRequest(**{**good, **arguments})


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_absurd_lengths_are_refused(length: float) -> None:
    with pytest.raises(InputError):
        plan_feed(length, PAPER)


def test_what_bounds_a_motion() -> None:
    assert not Limits().bind
    assert not Limits(zones=(FeedZone(0.0, 1.0, 5.0),)).bind
    assert Limits(volts=1.0).bind
    assert Limits(axis=AxisLimits(velocity_mm_s=(1.0, 2.0))).bind


def test_optimal_needs_no_feed_but_the_path() -> None:
    assert FeedRequest("optimal").optimal
    with pytest.raises(InputError):
        FeedRequest("optimal", 0.0)
    with pytest.raises(InputError):
        FeedRequest("quintic")
    with pytest.raises(PlanError, match="needs the path itself"):
        plan_feed(10.0, FeedRequest("optimal"), Limits(1.0))


def test_absurd_limits_are_refused() -> None:
    for kwargs in ({"feed_mm_s": 0.0}, {"jerk_mm_s3": float("nan")}, {"policy": "ignore"}):
        with pytest.raises(InputError):
            Limits(**kwargs)
    for kwargs in ({"volts": -1.0}, {"centripetal_mm_s2": float("inf")}):
        with pytest.raises(InputError, match="must be above 0 and finite"):
            Limits(**kwargs)
    with pytest.raises(InputError, match=r"limits.axis: jerk_mm_s3 0 must be above 0"):
        AxisLimits(jerk_mm_s3=(1.0, 0.0))
    for ends in ((1.0, 1.0), (-1.0, 1.0), (0.0, float("inf")), (float("nan"), 1.0)):
        with pytest.raises(InputError, match=r"limits.cap: from_mm"):
            FeedZone(*ends, 10.0)
    with pytest.raises(InputError):
        ControllerLimits(1.0, 1.0, 1.0, 1.5)
    with pytest.raises(InputError):
        plan_feed(10.0, PAPER, period_us=1500)


@pytest.mark.parametrize("profile", ["quintic", "exponential", "minimax"])
def test_derivatives_of_the_plan_belong_together(profile: str) -> None:
    plan = plan_feed(30.0, FeedRequest(profile, 100.0, 0.1))
    t = np.linspace(0.0005, plan.duration_s - 0.0005, 333)
    h = 1e-5
    for lower, upper, tolerance in (
        (plan.arc_length, plan.feed, 1e-3),
        (plan.feed, plan.acceleration, 1.0),
        (plan.acceleration, plan.jerk, 400.0),
    ):
        slope = (lower(t + h) - lower(t - h)) / (2.0 * h)
        # Where the jerk jumps (minimax), a difference across the jump is the mean of both sides.
        off = np.abs(slope - upper(t))
        assert np.quantile(off, 0.98) < tolerance


def test_time_grows_linearly_with_length() -> None:
    """Not by the clock: the number of pieces is that of the length, and one array pass makes them."""
    request = FeedRequest("minimax", 100.0, 0.1)
    counts = [len(plan_feed(length, request).pieces) for length in (1e3, 1e4, 1e5)]
    assert counts[2] - counts[1] == pytest.approx(10 * (counts[1] - counts[0]), rel=0.01)
