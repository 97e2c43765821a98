# SPDX-License-Identifier: MIT
"""Knots of planar paths through points: C2 whatever the knots, uneven points, the whole chain to a program. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from hodograph.config import load_machine
from hodograph.errors import InputError, PlanError
from hodograph.pipeline import load_pipeline
from hodograph.spline import KNOT_NAMES, through_points
from hodograph.spline.knots import KnotSpans, knot_spans
from hodograph.spline.system import NATURAL_END, EndRule, System, clamped_end, cubic_end

ROOT = Path(__file__).resolve().parents[3]
WHIP = [[0, 0], [10, 0], [10.000001, 0], [20, 5]]


def joint_jumps(spline, knots, closed):
    """Greatest jumps of r' and r'' by the spline's parameter, relative to their sizes."""
    w0, w1, w2 = (spline.w / np.sqrt(knots.length)[:, None]).T
    ends, starts = (
        slice(None) if closed else slice(None, -1),
        slice(None) if closed else slice(1, None),
    )
    shift = -1 if closed else 0
    first = np.roll(w0[starts] ** 2, shift) - w2[ends] ** 2
    bend_end, bend_start = 4 * w2 * (w2 - w1) / knots.length, 4 * w0 * (w1 - w0) / knots.length
    second = np.roll(bend_start[starts], shift) - bend_end[ends]
    return np.abs(first).max(), np.abs(second).max() / max(1.0, np.abs(bend_end).max())


def random_points(seed, sigma=1.0):
    rng = np.random.default_rng([seed, 11])
    count = int(rng.integers(4, 40))
    turns = np.cumsum(rng.uniform(-1.5, 1.5, count - 1))
    legs = 5 * np.exp(sigma * rng.normal(size=count - 1))
    return np.concatenate(([0], np.cumsum(legs * np.exp(1j * turns))))


@given(seed=st.integers(0, 10**6), name=st.sampled_from(KNOT_NAMES), closed=st.booleans())
def test_the_spline_is_c2_in_its_own_parameter(seed, name, closed):
    p = random_points(seed, 0.5)
    try:
        spline = through_points(p, closed, knots=name).spline
    except PlanError:
        return  # a closing leg may turn back on the path
    chords = np.abs(np.diff(np.append(p, p[0]) if closed else p))
    first, second = joint_jumps(spline, knot_spans(chords, name, closed), closed)
    assert first < 1e-9
    assert second < 1e-9
    np.testing.assert_allclose(spline.nodal_points[: p.size], p, atol=1e-10)


@pytest.mark.parametrize("closed", [False, True])
def test_general_formulas_with_even_spans_are_those_of_the_paper(closed):
    rng = np.random.default_rng(1)
    z, chords = (rng.normal(size=9) + 1j * rng.normal(size=9) for _ in range(2))
    ends = {"cyclic_sign": -1} if closed else {"start": clamped_end(2 + 1j), "end": cubic_end(0.5)}
    uniform = System(chords, **ends)
    general = replace(uniform, knots=KnotSpans.of(np.ones(9), closed))
    residual = uniform.residual(z)
    np.testing.assert_allclose(general.residual(z), residual, atol=1e-11)
    np.testing.assert_allclose(
        general.newton_step(z, residual), uniform.newton_step(z, residual), rtol=1e-9
    )
    np.testing.assert_allclose(general.coefficients(z), uniform.coefficients(z), atol=1e-14)


@pytest.mark.parametrize("closed", [False, True])
def test_newton_steps_solve_the_linear_part(closed):
    rng = np.random.default_rng(2)
    z, direction = (rng.normal(size=7) + 1j * rng.normal(size=7) for _ in range(2))
    knots = KnotSpans.of(rng.uniform(0.3, 3, 7), closed)
    ends = {"cyclic_sign": 1} if closed else {"start": NATURAL_END, "end": EndRule(1.6, -0.6, 1j)}
    system = System(rng.normal(size=7) + 0j, knots=knots, **ends)
    change = (system.residual(z + direction) - system.residual(z - direction)) / 2
    np.testing.assert_allclose(system.newton_step(z, -change), direction, rtol=1e-7, atol=1e-7)


def test_the_guide_of_chord_length_knots_is_scipys_cubic_spline():
    from hodograph.spline.ends import EndCondition, through_guide

    p = random_points(5)
    knots = knot_spans(np.abs(np.diff(p)), "chord", False)
    free = EndCondition("natural", 0j)
    guide = through_guide(p, False, free, free, knots)
    at = np.concatenate(([0], np.cumsum(knots.length)))
    slope = CubicSpline(at, p, bc_type="natural").derivative()
    for k, xi in ((0, 0.0), (1, 0.5), (2, 1.0)):
        values = slope(at[:-1] + xi * knots.length) * knots.length
        h0, h1, h2 = guide.hodograph.T
        own = h0 * (1 - xi) ** 2 + 2 * h1 * xi * (1 - xi) + h2 * xi**2
        np.testing.assert_allclose(own, values, atol=1e-10, err_msg=str(k))


def test_nearly_equal_points_make_no_whip():
    curvature = {name: through_points(WHIP, False, knots=name).spline for name in KNOT_NAMES}
    assert curvature["chord"].max_curvature_per_mm() < 0.1
    assert curvature["uniform"].max_curvature_per_mm() > 1


@pytest.mark.parametrize("sigma", [1, 2, 3])
def test_uneven_legs_are_all_solved(sigma):
    results = [through_points(random_points(seed, sigma), False) for seed in range(60)]
    assert max(result.newton_iterations for result in results) <= 20
    assert max(result.bending_ratio for result in results) < 1.2


def test_a_straight_line_of_uneven_points_has_one_speed():
    spline = through_points(np.array([0, 1, 1.5, 7, 7.25, 30]) * (3 + 4j), False).spline
    assert spline.max_curvature_per_mm() < 1e-14
    assert np.ptp(spline.speed(range(5), np.full(5, 0.3)) / spline.segment_lengths_mm) < 1e-13


def test_a_mirrored_path_gives_a_mirrored_curve():
    p = random_points(7)
    one, other = (through_points(q, False).spline for q in (p, np.conj(p)))
    back = through_points(p[::-1], False).spline
    s = np.linspace(0, one.length_mm, 200)
    np.testing.assert_allclose(other.point(s), np.conj(one.point(s)), atol=1e-10)
    np.testing.assert_allclose(back.point(back.length_mm - s), one.point(s), atol=1e-9)


def test_unknown_knots_are_refused():
    with pytest.raises(InputError, match='knots = "even" is unknown: use chord, centripetal'):
        through_points(WHIP, False, knots="even")


@pytest.mark.parametrize("name", ["chord", "centripetal"])
@pytest.mark.parametrize("feed", ["nominal_mm_s = 40\nramp_time_s = 0.1", 'profile = "optimal"'])
def test_programs_of_uneven_points_keep_their_limits(tmp_path, name, feed):
    """Segments whose parameters differ in scale: the C2 joints reach the program, and the controller accepts it."""
    file = tmp_path / "path.toml"
    points = [[0, 0], [10, 0], [12, 1], [30, 8], [31, 20], [8, 26], [6, 25], [-4, 12]]
    file.write_text(
        f'[path]\nclosed = false\nthrough = {points}\nknots = "{name}"\n[feed]\n{feed}\n'
    )
    machine = load_machine(ROOT / "examples/machines/paper_alpha.toml")
    chain = replace(load_pipeline(file), given_machine=machine)
    assert chain.accepted.image == chain.image
    assert chain.program.segment_count >= 7
