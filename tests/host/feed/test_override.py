# SPDX-License-Identifier: MIT
"""The override bounds: docs/theory/feed.md section 7, its inequality at random instants. Run by pytest; starts and
writes nothing.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.feed.override_levels import (
    FULL,
    LEVEL_OVERRIDES,
    LEVELS,
    rate_codes,
    rates_per_s,
    second_codes,
    seconds_per_s2,
)


@pytest.mark.long_examples(200)
@settings(max_examples=20, deadline=None)
@given(
    st.sampled_from(("quintic", "exponential", "minimax")),
    st.floats(1.0, 450.0),
    st.floats(0.03, 1.0),
    st.floats(0.0, 0.3),
    st.integers(0, 2**32 - 1),
)
def test_no_motion_of_the_override_breaks_a_limit(profile, feed, time, reserve, seed) -> None:
    controller = ControllerLimits(500.0, 5000.0, 200000.0, reserve)
    limits = Limits(450.0, 4500.0, 150000.0)
    plan = plan_feed(300.0, FeedRequest(profile, feed, time), limits, controller)
    pieces = plan.pieces
    rng = np.random.default_rng(seed)
    ends = np.cumsum(pieces.duration_q32_s) * 2.0**-32
    t = np.sort(rng.uniform(0.0, plan.duration_s, 2000))
    i = np.minimum(np.searchsorted(ends, t), len(pieces) - 1)
    level = seed % LEVELS
    factor = pieces.override_factor[i]
    most = factor if level == FULL else np.full_like(factor, LEVEL_OVERRIDES[level])
    rate = pieces.override_rate_per_s(level)[i]
    second = pieces.override_second_per_s2(level)[i]
    v, a, j = plan.feed(t), plan.acceleration(t), plan.jerk(t)
    # The extremes of the bounded set, and points within.
    for corner in range(16):
        pull = rng.uniform(-1.0, 1.0, (3, t.size)) if corner >= 8 else np.ones((3, t.size))
        signs = [1.0 if corner >> bit & 1 else -1.0 for bit in range(3)]
        lam, d1, d2 = (s * p * b for s, p, b in zip(signs, pull, (most, rate, second), strict=True))
        slack = 1.0 + 1e-6
        assert np.all(np.abs(lam * v) <= 500.0 * slack)
        assert np.all(np.abs(d1 * v + lam**2 * a) <= 5000.0 * slack)
        # The piece's jerk may be off the profile's by the 5 mm/s^3 of the format.
        assert np.all(np.abs(d2 * v + 3.0 * lam * d1 * a + lam**3 * j) <= 200000.0 * slack + 10.0)
        # At a constant override the program's own limits hold too.
        assert np.all(factor * v <= 450.0 * slack)
        assert np.all(factor**2 * np.abs(a) <= 4500.0 * slack)
        assert np.all(factor**3 * np.abs(j) <= 150000.0 * slack + 10.0)
    assert factor.min() >= 1.0
    assert factor.max() <= 2.0
    assert rate.min() > 0.0
    assert second.min() > 0.0


def test_constant_feed_has_generous_bounds() -> None:
    controller = ControllerLimits(500.0, 5000.0, 200000.0, 0.1)
    plan = plan_feed(300.0, FeedRequest("minimax", 100.0, 0.1), None, controller)
    pieces, middle = plan.pieces, len(plan.pieces) // 2
    assert pieces.override_factor[middle] == 2.0
    for level in range(LEVELS):
        # 50 /s and 2000 /s^2, as codes: up to 9 % less
        assert 45.8 <= pieces.override_rate_per_s(level)[middle] <= 50.0
        assert 1834 <= pieces.override_second_per_s2(level)[middle] <= 2000.0


def test_lower_levels_leave_a_changing_rate_more() -> None:
    """A plan at its limits: at rate 1 almost nothing, at a half most of acceleration and jerk."""
    controller = ControllerLimits(500.0, 2000.0, 50000.0, 0.0)
    plan = plan_feed(300.0, FeedRequest("minimax", 400.0, 0.1), None, controller)
    pieces = plan.pieces
    busy = np.flatnonzero(pieces.override_rate_per_s() < 0.1)
    assert busy.size > 0
    for codes in (pieces.override_rate_codes, pieces.override_second_codes):
        assert (codes.min(axis=0)[:-1] >= codes.min(axis=0)[1:]).all()
    assert pieces.override_rate_per_s(0)[busy].min() > 1.0


def test_codes_round_down() -> None:
    values = np.exp(np.linspace(np.log(1e-5), np.log(1e5), 10001))
    for codes_of, numbers_of in ((rate_codes, rates_per_s), (second_codes, seconds_per_s2)):
        codes = codes_of(values)
        some = codes > 0
        assert (numbers_of(codes) <= values).all()
        assert (
            numbers_of(codes)[some & (codes < 255)] >= 0.917 * values[some & (codes < 255)]
        ).all()
        assert (codes_of(numbers_of(np.arange(1, 256))) == np.arange(1, 256)).all()
    assert rates_per_s([1, 255]).tolist() == [71468 * 2.0**-32, 120193 * 2.0**-1]


def test_under_report_an_exceeded_limit_leaves_no_factor() -> None:
    controller = ControllerLimits(500.0, 5000.0, 200000.0, 0.1)
    limits = Limits(None, None, 40000.0, "report")
    plan = plan_feed(300.0, FeedRequest("quintic", 100.0, 0.1), limits, controller)
    assert plan.pieces.override_factor.min() == 1.0
