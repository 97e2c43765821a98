# SPDX-License-Identifier: MIT
"""The ramps against their definitions, evaluated anew in 50 digits. Run by pytest; starts and writes nothing."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from hodograph.feed.ramp import (
    ACCELERATION,
    DISPLACEMENT,
    FEED,
    JERK,
    Ramp,
    exponential_ramp,
    minimax_nodes,
    minimax_peak,
    minimax_ramp,
    quintic_ramp,
)

FEEDS = st.floats(0.5, 4000.0)
TIMES = st.floats(0.01, 20.0)
DEGREES = st.integers(3, 12)


def paper_feed(tau, feed, time, n_c):
    """(14) with (17) and (18), term by term as printed."""
    rise = (1 - mpmath.exp(n_c * tau)) if n_c is not None else mpmath.mpf(0)
    fall = (1 - mpmath.exp(n_c * (1 - tau))) if n_c is not None else mpmath.mpf(0)
    v = [
        mpmath.mpf(0),
        time / 5 * rise,
        2 * time / 5 * rise,
        feed - 2 * time / 5 * fall,
        feed - time / 5 * fall,
        feed,
    ]
    return sum(mpmath.binomial(5, k) * v[k] * tau**k * (1 - tau) ** (5 - k) for k in range(6))


@pytest.mark.parametrize("n_c", [None, 0.5, 2.0, 8.12, 12.0])
def test_ramp_is_the_papers(n_c: float | None) -> None:
    ramp = quintic_ramp(100.0, 0.1) if n_c is None else exponential_ramp(100.0, 0.1, n_c)
    with mpmath.workdps(50):
        feed, time = mpmath.mpf(100), mpmath.mpf(0.1)

        def curve(t):
            return paper_feed(t / time, feed, time, n_c)

        for tau in (0.0, 0.01, 0.2, 0.37, 0.5, 0.63, 0.99, 1.0):
            t = tau * 0.1
            exact = curve(mpmath.mpf(t))
            assert abs(ramp.value(FEED, t) - exact) < 1e-12
            distance = mpmath.quad(curve, [0, mpmath.mpf(t) / 2, mpmath.mpf(t)])
            assert abs(ramp.value(DISPLACEMENT, t) - distance) < 1e-14
            for order, bound in ((ACCELERATION, 1e-9), (JERK, 1e-6)):
                exact = mpmath.diff(curve, mpmath.mpf(t), order)
                assert abs(ramp.value(order, t) - exact) < bound


def ramps(feed: float, time: float, degree: int) -> list[Ramp]:
    return [
        quintic_ramp(feed, time),
        minimax_ramp(feed, time, degree),
        exponential_ramp(feed, time, 5.0),
    ]


@settings(max_examples=60, deadline=None)
@given(FEEDS, TIMES, DEGREES)
def test_every_ramp_is_antisymmetric_and_starts_and_ends_at_rest(feed, time, degree) -> None:
    t = np.linspace(0.0, time, 201)
    for ramp in ramps(feed, time, degree):
        v = ramp.value(FEED, t)
        np.testing.assert_allclose(v + v[::-1], feed, rtol=0, atol=1e-11 * feed)
        assert abs(ramp.value(FEED, 0.0)) < 1e-12 * feed
        assert abs(ramp.value(ACCELERATION, 0.0)) < 1e-10 * feed / time
        assert abs(ramp.value(ACCELERATION, time)) < 1e-10 * feed / time
        distance = ramp.value(DISPLACEMENT, time)
        np.testing.assert_allclose(distance, feed * time / 2, rtol=1e-13)


@settings(max_examples=60, deadline=None)
@given(FEEDS, TIMES, DEGREES)
def test_polynomial_ramps_never_go_back_nor_over(feed, time, degree) -> None:
    t = np.linspace(0.0, time, 4001)
    for ramp in (quintic_ramp(feed, time), minimax_ramp(feed, time, degree)):
        assert ramp.value(ACCELERATION, t).min() > -1e-9 * feed / time
        v = ramp.value(FEED, t)
        assert v.min() > -1e-12 * feed
        assert v.max() < feed * (1.0 + 1e-12)
        assert ramp.lowest_feed() > -1e-12 * feed


@settings(max_examples=40, deadline=None)
@given(FEEDS, TIMES, st.floats(0.0, 12.0))
def test_peak_is_the_true_extremum(feed, time, n_c) -> None:
    t = np.linspace(0.0, time, 20001)
    for ramp in (quintic_ramp(feed, time), exponential_ramp(feed, time, n_c)):
        for order in (ACCELERATION, JERK):
            sampled = np.abs(ramp.value(order, t)).max()
            assert sampled <= ramp.peak(order) * (1.0 + 1e-10)
            assert sampled >= ramp.peak(order) * (1.0 - 1e-5)


def test_plain_quintic_has_the_known_peaks() -> None:
    ramp = quintic_ramp(100.0, 0.1)
    assert ramp.peak(JERK) == pytest.approx(10.0 / np.sqrt(3.0) * 1e4, rel=1e-13)
    assert ramp.peak(ACCELERATION) == pytest.approx(1875.0, rel=1e-13)


def test_exponential_dips_below_zero_by_the_little_that_is_known() -> None:
    assert -2e-8 < exponential_ramp(100.0, 0.1, 8.12).lowest_feed() < -1e-8


# Minimax: the closed form against the linear program itself


def least_peak_by_linear_program(degree: int) -> tuple[float, float]:
    """Least peak of V'' over polynomials V of `degree`, V(0) = V'(0) = V'(1) = 0, V(1) = 1, in powers of
    x = 2 tau - 1 as Chebyshev series: (what the linear program on a grid says, true peak of its answer).
    """
    cheb = np.polynomial.chebyshev
    n = degree + 1
    unit = np.eye(n)
    x = np.cos(np.linspace(0.0, np.pi, 601))
    jerk = np.stack([cheb.chebval(x, cheb.chebder(u, 2, scl=2.0)) for u in unit], axis=1)
    ends = []
    for place in (-1.0, 1.0):
        ends.append([cheb.chebval(place, u) for u in unit])
        ends.append([cheb.chebval(place, cheb.chebder(u, 1, scl=2.0)) for u in unit])
    ones = np.ones((x.size, 1))
    answer = linprog(
        np.append(np.zeros(n), 1.0),
        A_ub=np.vstack((np.hstack((jerk, -ones)), np.hstack((-jerk, -ones)))),
        b_ub=np.zeros(2 * x.size),
        A_eq=np.hstack((np.array(ends), np.zeros((4, 1)))),
        b_eq=[0.0, 0.0, 1.0, 0.0],
        bounds=[(None, None)] * (n + 1),
        method="highs",
    )
    assert answer.status == 0
    fine = np.cos(np.linspace(0.0, np.pi, 20001))
    curve = cheb.chebval(fine, cheb.chebder(answer.x[:-1], 2, scl=2.0))
    return float(answer.fun), float(np.abs(curve).max())


@pytest.mark.parametrize("degree", range(3, 13))
def test_minimax_is_the_answer_of_the_linear_program(degree: int) -> None:
    grid, true = least_peak_by_linear_program(degree)
    assert grid <= minimax_peak(degree) * (1.0 + 1e-6), "a grid bounds the true optimum from below"
    assert minimax_peak(degree) <= true * (1.0 + 1e-9), "no polynomial has less"
    assert minimax_peak(degree) == pytest.approx(grid, rel=1e-4)
    assert minimax_ramp(100.0, 0.1, degree).peak(JERK) == pytest.approx(
        minimax_peak(degree) * 1e4, rel=1e-11
    )


def test_minimax_goes_down_to_the_bang_bang_limit() -> None:
    peaks = [minimax_peak(d) for d in (3, 5, 7, 9, 11)]
    assert peaks == sorted(peaks, reverse=True)
    assert peaks[0] == pytest.approx(6.0, rel=1e-14)
    assert peaks[1] == pytest.approx(6.0 * np.sqrt(3.0 / 5.0), rel=1e-14)
    assert peaks[-1] > 4.0
    for odd in (3, 5, 7, 9, 11):
        assert minimax_peak(odd + 1) == minimax_peak(odd)


@pytest.mark.parametrize("degree", range(3, 13))
def test_nodes_are_a_quadrature_for_the_first_moment(degree: int) -> None:
    """The dual certificate: positive weights that integrate x g(x) exactly for all odd g allowed."""
    x, w = minimax_nodes(degree)
    assert np.all(w > 0)
    for power in range(1, degree - 1, 2):
        assert 2.0 * np.sum(w * x * x**power) == pytest.approx(2.0 / (power + 2), rel=1e-12)
