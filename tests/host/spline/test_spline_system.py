# SPDX-License-Identifier: MIT
"""The linear solvers, the system (13) with its Jacobian, Newton and continuation. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from polygons import ALPHA, HEART

from hodograph.errors import PlanError
from hodograph.spline.banded import SingularSystem, solve_cyclic, solve_tridiagonal
from hodograph.spline.bernstein import rotation, square
from hodograph.spline.loops import flipped, without_loops
from hodograph.spline.newton import continued, newton
from hodograph.spline.nodal import control_polygon_guide
from hodograph.spline.solve import solve
from hodograph.spline.start import followed_branch, starting_values, without_rests
from hodograph.spline.system import CUBIC_END, NATURAL_END, System, clamped_end


def complex_numbers(rng, *shape):
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def dense(lower, diagonal, upper, cyclic):
    n = diagonal.size
    a = np.diag(diagonal) + np.diag(lower[1:], -1) + np.diag(upper[:-1], 1)
    if cyclic:
        a[0, n - 1] += lower[0]
        a[n - 1, 0] += upper[-1]
    return a


@given(count=st.integers(1, 40), seed=st.integers(0, 10**6))
def test_tridiagonal_solver_against_dense(count, seed):
    rng = np.random.default_rng(seed)
    lower, upper, rhs = complex_numbers(rng, 3, count)
    diagonal = 4 + complex_numbers(rng, count)
    x = solve_tridiagonal(lower, diagonal, upper, rhs)
    a = dense(lower, diagonal, upper, False)
    np.testing.assert_allclose(a @ x, rhs, atol=1e-9 * np.linalg.norm(a) * np.abs(x).max())


@given(count=st.integers(3, 40), seed=st.integers(0, 10**6))
def test_cyclic_solver_against_dense(count, seed):
    rng = np.random.default_rng(seed)
    lower, upper, rhs = complex_numbers(rng, 3, count)
    diagonal = 4 + complex_numbers(rng, count)
    x = solve_cyclic(lower, diagonal, upper, rhs)
    a = dense(lower, diagonal, upper, True)
    np.testing.assert_allclose(a @ x, rhs, atol=1e-8 * np.linalg.norm(a) * np.abs(x).max())


def test_singular_matrices_are_reported():
    zero, one = np.zeros(4, complex), np.ones(4, complex)
    with pytest.raises(SingularSystem):
        solve_tridiagonal(zero, zero, zero, one)
    with pytest.raises(SingularSystem):
        solve_tridiagonal(zero[:1], zero[:1], zero[:1], one[:1])
    with pytest.raises(SingularSystem):
        solve_cyclic(zero, zero, zero, one)


SYSTEMS = {
    "natural": lambda c: System(c, NATURAL_END, NATURAL_END),
    "cubic": lambda c: System(c, CUBIC_END, CUBIC_END),
    "clamped": lambda c: System(c, clamped_end(2 + 1j), clamped_end(1 - 3j)),
    "mixed": lambda c: System(c, clamped_end(2 + 1j), CUBIC_END),
    "closed +": lambda c: System(c, cyclic_sign=1),
    "closed -": lambda c: System(c, cyclic_sign=-1),
}


@pytest.mark.parametrize("kind", SYSTEMS)
@given(count=st.integers(3, 12), seed=st.integers(0, 10**6))
def test_the_jacobian_is_the_derivative_of_the_residual(kind, count, seed):
    rng = np.random.default_rng(seed)
    system = SYSTEMS[kind](complex_numbers(rng, count))
    z, direction = 3 + complex_numbers(rng, count), complex_numbers(rng, count)
    # residual is quadratic: the central difference is the derivative exactly
    change = (system.residual(z + direction) - system.residual(z - direction)) / 2
    np.testing.assert_allclose(system.newton_step(z, -change), direction, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("kind", SYSTEMS)
def test_the_residual_is_60_times_the_gap(kind):
    rng = np.random.default_rng(5)
    system = SYSTEMS[kind](complex_numbers(rng, 7))
    z = complex_numbers(rng, 7)
    gap = square(system.coefficients(z)).mean(axis=1) - system.chords
    np.testing.assert_allclose(system.residual(z), 60 * gap, atol=1e-12)


def heart_system():
    guide = control_polygon_guide(HEART, True)
    branch = followed_branch(guide.hodograph)
    system = System(np.diff(guide.nodal_points), cyclic_sign=-1)
    return guide, system, starting_values(guide.hodograph, branch)


def test_the_wrong_cyclic_sign_gives_a_spurious_loop():
    _, system, z = heart_system()
    good = newton(system, z)
    assert good.converged
    turning = 2 * rotation(system.coefficients(good.z)).sum() / (2 * np.pi)
    assert abs(abs(turning) - 1) < 1e-12
    other = replace(system, cyclic_sign=1)
    wrong = newton(other, z)
    turning = 2 * rotation(other.coefficients(wrong.z)).sum() / (2 * np.pi)
    assert wrong.converged
    assert abs(turning - round(turning)) < 1e-12
    assert round(turning) % 2 == 0


def test_w_and_minus_w_are_the_same_curve():
    _, system, z = heart_system()
    one, other = newton(system, z), newton(system, -z)
    np.testing.assert_allclose(one.z, -other.z, atol=1e-13)


def test_newton_converges_quadratically_and_stops_at_rounding():
    _, system, z = heart_system()
    sizes = [np.abs(system.residual(newton(system, z, k).z)).max() for k in range(6)]
    assert sizes[2] < 1e-2 * sizes[1]
    assert sizes[3] < 1e-4 * sizes[2]
    assert sizes[4] < 1e-6 * sizes[3]
    outcome = newton(system, z)
    assert outcome.converged
    assert outcome.iterations <= 5


def test_newton_reports_when_it_does_not_converge():
    _, system, z = heart_system()
    outcome = newton(system, z, most_steps=1)
    assert not outcome.converged
    assert outcome.iterations == 1
    assert not newton(system, np.zeros(8, complex)).converged  # singular at once


@given(seed=st.integers(0, 10**6))
def test_continuation_reaches_a_solution_from_far_away(seed):
    rng = np.random.default_rng(seed)
    _, system, z = heart_system()
    far = z * np.exp(0.5 * complex_numbers(rng, z.size))
    outcome = continued(system, far)
    assert outcome.converged
    assert np.abs(system.residual(outcome.z)).max() < 1e-9
    assert outcome.iterations >= 1


def test_solve_falls_back_to_continuation_and_counts_it(monkeypatch):
    from hodograph.spline import newton as module

    guide, system, z = heart_system()
    plain = solve(system, z, guide.hodograph)
    calls = []

    def weak(system, z, most_steps=20):
        """Gives up at first; continuation takes the steps that it asks for."""
        calls.append(most_steps)
        return newton(system, z, 1 if len(calls) == 1 else most_steps)

    monkeypatch.setattr(module, "newton", weak)
    rescued = solve(system, z, guide.hodograph)
    assert calls
    assert rescued.newton_iterations > plain.newton_iterations
    np.testing.assert_allclose(np.abs(rescued.w), np.abs(plain.w), atol=1e-12)


def test_chords_that_cannot_be_met_raise_plan_error_naming_a_span():
    guide, system, z = heart_system()
    chords = system.chords.copy()
    chords[3] = np.nan
    with pytest.raises(PlanError, match="span"):
        solve(replace(system, chords=chords), z, guide.hodograph)


def test_a_loop_put_in_by_hand_is_taken_out_again():
    guide, system, z = heart_system()
    good = newton(system, z).z
    looped_system, start = flipped(system, good, 4)
    looped = newton(looped_system, start)
    assert looped.converged
    energy = [
        abs(rotation(s.coefficients(v))).sum()
        for s, v in ((system, good), (looped_system, looped.z))
    ]
    assert energy[1] > energy[0] + 1.5
    better = without_loops(looped_system, looped.z, rotation(guide.hodograph))
    assert better.changes == 1
    assert better.iterations > 0
    assert better.system.cyclic_sign == -1
    polished = newton(better.system, better.z).z
    np.testing.assert_allclose(np.abs(polished), np.abs(good), atol=1e-12)


def test_a_guide_that_stops_at_a_joint_is_moved_aside_on_both_spans():
    p = np.array([0, 10, 20, 10, 10 + 10j, 20 + 20j])  # legs 1 and 2 retrace each other
    hodograph = control_polygon_guide(p, True).hodograph
    assert (np.abs(hodograph[:, 0]) == 0).sum() == 1
    moved = without_rests(hodograph, True)
    assert np.abs(moved[:, 0]).min() > 0
    np.testing.assert_array_equal(moved[:, 0], np.roll(moved[:, 2], 1))
    np.testing.assert_array_equal(without_rests(moved, True), moved)


def test_alpha_takes_its_end_tangents_from_the_polygon():
    guide = control_polygon_guide(ALPHA, False)
    np.testing.assert_allclose(guide.hodograph[0, 0], 3 * (ALPHA[1] - ALPHA[0]))
    np.testing.assert_allclose(guide.hodograph[-1, 2], 3 * (ALPHA[-1] - ALPHA[-2]))
