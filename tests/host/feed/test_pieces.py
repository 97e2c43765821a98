# SPDX-License-Identifier: MIT
"""Feed pieces against the exact profile in 50 digits, and against the rules of docs/reference/protocol.md 1.3. Run by
pytest; starts and writes nothing.
"""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hodograph.errors import PlanError
from hodograph.feed import ControllerLimits, FeedPlan, FeedRequest, Limits, plan_feed
from hodograph.feed.pieces import FeedPieces, derivative_bounds, derivative_extremes, exponents
from hodograph.feed.ramp import minimax_nodes, minimax_peak

CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)
LENGTH_MM = 1e-9
JERK_MM_S3 = 5.0


HUMP = [0, 1, 0, -6, 8, -3]
MIRROR = [0, 0, 0, 4, -7, 3]
"""tau (1 - tau)^4 + 4 tau^2 (1 - tau)^3 in powers of tau, and the same of 1 - tau."""


def value(p, x):
    """Of a polynomial, lowest power first."""
    return mpmath.polyval(list(p), x, asc=True)


def derivative(p, order):
    """The polynomial differentiated; lowest power first."""
    for _ in range(order):
        p = [k * v for k, v in enumerate(p)][1:] or [0]
    return p


class Reference:
    """F and F''' of a plan from the definitions of its profile, in mpmath; nothing shared with the package
    but the numbers feed, ramp time, n_c and length.
    """

    def __init__(self, plan: FeedPlan) -> None:
        self.feed = mpmath.mpf(plan.feed_mm_s)
        self.time = mpmath.mpf(plan.ramp_time_s)
        self.length = mpmath.mpf(plan.curve.length_mm.numerator) / plan.curve.length_mm.denominator
        self.end = self.time + self.length / self.feed
        if plan.profile == "minimax":
            self._polynomial = self._minimax(plan.request.degree)
        else:
            self._polynomial = [mpmath.mpf(c) for c in (0, 0, 0, 10, -15, 6)]
        self._n = mpmath.mpf(plan.n_c) if plan.n_c else None

    @staticmethod
    def _minimax(degree: int) -> list[mpmath.mpf]:
        """Powers of tau. The nodes to 16 digits do: the solution is flat there."""
        x = [mpmath.mpf(float(v)) for v in minimax_nodes(degree)[0]]
        m = (degree - 1) // 2
        inner = [v for v in x if v < 1]
        rows = [[v ** (2 * k + 1) for k in range(m)] for v in x]
        rows += [[(2 * k + 1) * v ** (2 * k) for k in range(m)] for v in inner]
        right = [mpmath.mpf(-1)] * len(x) + [mpmath.mpf(0)] * len(inner)
        c = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix(right))
        feed = [mpmath.mpf(0)] * (2 * m)
        for k in range(m):
            feed[2 * k + 1] = c[k]
        for _ in range(2):
            feed = [mpmath.mpf(0)] + [v / (k + 1) / 2 for k, v in enumerate(feed)]
            feed[0] = -value(feed, mpmath.mpf(-1))  # it vanishes at x = -1
        total = value(feed, mpmath.mpf(1))
        # To powers of tau, x = 2 tau - 1.
        out = [mpmath.mpf(0)] * len(feed)
        for k, v in enumerate(feed):
            for j in range(k + 1):
                out[j] += v / total * mpmath.binomial(k, j) * mpmath.mpf(2) ** j * (-1) ** (k - j)
        return out

    def _distance(self, t):
        """Of the ramp."""
        tau = t / self.time
        integral = [mpmath.mpf(0)] + [v / (k + 1) for k, v in enumerate(self._polynomial)]
        distance = self.feed * self.time * value(integral, tau)
        if self._n is not None:
            distance += self.time**2 * (
                self._added_integral(tau) - self._added_integral(mpmath.mpf(0))
            )
        return distance

    def _jerk(self, t):
        """Of the ramp."""
        tau = t / self.time
        jerk = self.feed / self.time**2 * value(derivative(self._polynomial, 2), tau)
        if self._n is not None:
            jerk += self._added_second(tau) / self.time
        return jerk

    def _added_integral(self, u):
        """Antiderivative of (18)'s part, by parts: A - B - e^(n u) A + e^(n (1 - u)) B."""
        n, plain = self._n, [a - b for a, b in zip(HUMP, MIRROR, strict=True)]
        out = sum(v * u ** (k + 1) / (k + 1) for k, v in enumerate(plain))
        for k in range(6):
            out -= mpmath.exp(n * u) * (-1) ** k * value(derivative(HUMP, k), u) / n ** (k + 1)
            out -= mpmath.exp(n * (1 - u)) * value(derivative(MIRROR, k), u) / n ** (k + 1)
        return out

    def _added_second(self, u):
        n = self._n
        a, b = ([value(derivative(p, k), u) for k in range(3)] for p in (HUMP, MIRROR))
        rise = mpmath.exp(n * u) * (n**2 * a[0] + 2 * n * a[1] + a[2])
        fall = mpmath.exp(n * (1 - u)) * (n**2 * b[0] - 2 * n * b[1] + b[2])
        return a[2] - b[2] - rise + fall

    def at(self, t):
        """F and its third derivative at a time; beyond a ramp by a rounding, its continuation."""
        if t <= self.time:
            return self._distance(t), self._jerk(t)
        if self.end - t <= self.time:
            return self.length - self._distance(self.end - t), self._jerk(self.end - t)
        return self.feed * (t - self.time / 2), mpmath.mpf(0)


def evaluate(pieces: FeedPieces, i: int, share: float) -> tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]:
    """Time, F and F''' of a piece in mpmath, at a share of its duration."""
    piece = pieces[i]
    local = int(share * piece.duration_q32_s)
    before = int(pieces.duration_q32_s[:i].sum())
    scale = mpmath.mpf(2) ** piece.exponent
    tau = mpmath.ldexp(local, -32) / scale
    c = [mpmath.ldexp(v, -40) for v in (piece.start_q40, *piece.c_q40)]
    jerk = value(derivative(c, 3), tau) / scale**3
    return mpmath.ldexp(before + local, -32), value(c, tau), jerk


def worst_errors(plan: FeedPlan, shares: tuple[float, ...]) -> tuple[float, float]:
    """Greatest error of F and of F''' of the pieces, in 50 digits."""
    with mpmath.workdps(50):
        reference, pieces = Reference(plan), plan.pieces
        length = jerk = mpmath.mpf(0)
        for i in range(len(pieces)):
            for share in shares:
                t, own, own_jerk = evaluate(pieces, i, share)
                exact, exact_jerk = reference.at(t)
                length = max(length, abs(own - exact))
                jerk = max(jerk, abs(own_jerk - exact_jerk))
        return float(length), float(jerk)


CASES = [
    ("quintic", 5, 100.0, 0.1, 100.0, 1000),
    ("exponential", 5, 100.0, 0.1, 100.0, 1000),
    ("exponential", 5, 100.0, 0.1, 100.0, 4000),
    ("exponential", 5, 250.0, 0.25, 6.0, 1000),
    ("exponential", 5, 3.0, 0.5, 40.0, 2000),
    ("exponential", 5, 20.0, 0.2, 40.0, 2000),
    ("minimax", 5, 100.0, 0.1, 100.0, 8000),
    ("minimax", 7, 100.0, 0.1, 100.0, 1000),
    ("minimax", 9, 100.0, 0.1, 33.0, 1000),
    ("minimax", 12, 300.0, 0.5, 1000.0, 1000),
]


@pytest.mark.parametrize(("profile", "degree", "feed", "time", "length", "period_us"), CASES)
def test_pieces_are_the_profile_in_50_digits(
    profile, degree, feed, time, length, period_us
) -> None:
    request = FeedRequest(profile, feed, time, degree=degree)
    plan = plan_feed(length, request, Limits(policy="report"), CONTROLLER, period_us=period_us)
    # The ends of pieces may be beyond a jump of the jerk by a rounding of time: not exactly there.
    length_error, jerk_error = worst_errors(plan, (1e-6, 0.13, 0.5, 0.77, 1.0 - 1e-6))
    assert length_error < LENGTH_MM
    assert jerk_error < JERK_MM_S3


@st.composite
def plans(draw: st.DrawFn) -> FeedPlan:
    profile = draw(st.sampled_from(("quintic", "exponential", "minimax")))
    feed = 10 ** draw(st.floats(-1.0, 3.5))
    time = 10 ** draw(st.floats(-2.5, 1.0))
    length = 10 ** draw(st.floats(-2.0, 4.0))
    degree = draw(st.integers(3, 12))
    policy = draw(st.sampled_from(("respect", "report")))
    limits = Limits(
        draw(st.none() | st.floats(1.0, 2000.0)),
        draw(st.none() | st.floats(50.0, 1e5)),
        draw(st.none() | st.floats(1e3, 1e7)),
        policy,
    )
    controller = draw(st.none() | st.just(CONTROLLER))
    period_us = draw(st.sampled_from((1000, 2000, 4000, 8000)))
    request = FeedRequest(
        profile, feed, time, n_c=draw(st.sampled_from(("optimise", 0.0))), degree=degree
    )
    try:
        return plan_feed(length, request, limits, controller, period_us=period_us)
    except PlanError as error:  # so slow that no program can last so long
        assume("would take longer" not in str(error))
        raise


@pytest.mark.long_examples(120)
@settings(max_examples=25, deadline=None)
@given(plans())
def test_pieces_join_and_end_exactly_and_keep_the_rules_of_the_format(plan: FeedPlan) -> None:
    join_and_end_exactly(plan)
    keep_the_rules_of_the_format(plan)


def join_and_end_exactly(plan: FeedPlan) -> None:
    """F, its feed and its acceleration go on from piece to piece."""
    pieces = plan.pieces
    ends = []
    for piece in pieces:
        scale = 32 + piece.exponent
        d = piece.duration_q32_s
        assert 2 ** (scale - 1) < d <= 2**scale
        total = sum(c * d**k << scale * (7 - k) for k, c in enumerate(piece.c_q40, start=1))
        ends.append(piece.start_q40 + Fraction(total, 2 ** (scale * 7)))
    assert pieces.start_q40[0] == 0
    for end, start in zip(
        ends, [*pieces.start_q40[1:], round(plan.length_mm * 2**40)], strict=True
    ):
        assert abs(end - int(start)) <= Fraction(1, 2), "F meets the next start to the last bit"
    feed, acceleration, _ = derivative_bounds(pieces.duration_q32_s, pieces.c_q40)
    assert np.abs(feed[:-1, -1] - feed[1:, 0]).max(initial=0.0) < 2.0**-18
    assert np.abs(acceleration[:-1, -1] - acceleration[1:, 0]).max(initial=0.0) < 2.0**-8
    for value in (feed[0, 0], feed[-1, -1]):
        assert abs(value) < 2.0**-18
    for value in (acceleration[0, 0], acceleration[-1, -1]):
        assert abs(value) < 2.0**-8
    assert pieces.total_q32_s == round(plan.curve.time_s * 2**32)


def keep_the_rules_of_the_format(plan: FeedPlan) -> None:
    """Ranges, lengths and durations of pieces, and no feed backwards."""
    pieces = plan.pieces
    assert np.abs(pieces.c_q40).max() <= 2**54
    joints = np.append(pieces.start_q40, round(plan.length_mm * 2**40))
    assert np.diff(joints).min() > 0
    assert np.diff(joints).max() <= 32 << 40
    pairs = pieces.duration_q32_s[1:-2] + pieces.duration_q32_s[2:-1]
    assert np.all(pairs * 1e6 > 2 * plan.period_us * 2.0**32)
    lows, _ = derivative_extremes(pieces.duration_q32_s, pieces.c_q40)
    assert lows[0].min() > -(2.0**-10)


def test_a_ramp_of_few_periods_is_said_to_be_inexact() -> None:
    request = FeedRequest("exponential", 20.0, 0.01)
    plan = plan_feed(10.0, request, None, CONTROLLER, period_us=4000)
    assert not plan.raw.faithful
    assert any("too few periods" in note for note in plan.notes)
    longer = plan_feed(10.0, FeedRequest("exponential", 20.0, 0.1), None, CONTROLLER)
    assert longer.raw.faithful
    assert not any("too few periods" in note for note in longer.notes)


def test_exponent_is_the_least_power_of_two() -> None:
    durations = [1, 2, 3, 4, 5, 2**31, 2**32, 2**32 + 1, 2**53, 2**53 + 1, 2**54 - 1, 2**54]
    expected = [(d - 1).bit_length() - 32 for d in durations]
    assert exponents(np.array(durations, dtype=np.int64)).tolist() == expected


def test_bang_bang_bounds_the_peak() -> None:
    assert all(4.0 < minimax_peak(d) <= 6.0 for d in range(3, 13))
