# SPDX-License-Identifier: MIT
"""The chain rule of the verifier against the program's own curve differentiated in 60 digits. Run by pytest; starts and
writes nothing.
"""

import mpmath
import numpy as np
import pytest
from programs import random_program

from hodograph.feed import Limits
from hodograph.program import Program
from hodograph.verify.bounds import bends
from hodograph.verify.cells import cut
from hodograph.verify.instants import motion_at
from hodograph.verify.quantities import quantities

mp = mpmath.mp.clone()
mp.dps = 60


def exact_point(
    program: Program, piece: int, segment: int, t: mpmath.mpf
) -> tuple[mpmath.mpf, ...]:
    """x, y at t after the start of a piece: the formulas of docs/reference/protocol.md 1.2 and 1.3, nothing else."""
    one = program.pieces[piece]
    tau = t / mp.mpf(2) ** one.exponent
    arc = one.start_q40 + sum(c * tau ** (k + 1) for k, c in enumerate(one.c_q40))
    arc = (arc - int(program.start_q40[segment])) / mp.mpf(2) ** 40
    u, v = ([mp.mpf(int(c)) / 2**44 for c in w[segment]] for w in program.a_q44)
    w = [mp.mpc(a, b) for a, b in zip(u, v, strict=True)]
    power = [w[0], 2 * (w[1] - w[0]), w[0] - 2 * w[1] + w[2]]

    def product(a: list, b: list) -> list:
        out = [mp.mpc(0)] * 5
        for i, left in enumerate(a):
            for j, right in enumerate(b):
                out[i + j] += left * right
        return out

    direction = product(power, power)
    speed = [c.real for c in product(power, [mp.conj(c) for c in power])]
    xi = arc / sum(c / (k + 1) for k, c in enumerate(speed))
    for _ in range(9):
        value = sum(c * xi ** (k + 1) / (k + 1) for k, c in enumerate(speed)) - arc
        xi -= value / sum(c * xi**k for k, c in enumerate(speed))
    r = sum(c * xi ** (k + 1) / (k + 1) for k, c in enumerate(direction))
    return r.real, r.imag


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_the_point(seed: int) -> None:
    program = random_program(seed)
    cells = cut(program)
    rng = np.random.default_rng(seed)
    ends = np.cumsum(program.pieces.duration_q32_s)
    begins = ends - program.pieces.duration_q32_s
    cell = rng.integers(0, len(cells), 6)
    u = rng.uniform(0.1, 0.9, 6)
    found = motion_at(cells, cell, u)
    for i, one in enumerate(cell):
        middle = cells.start_s[one] + 0.5 * cells.duration_s[one]
        piece = int(np.searchsorted(ends * 2.0**-32, middle, side="right"))
        t = mp.mpf(float(cells.time_s(cell, u)[i])) - mp.mpf(int(begins[piece])) / 2**32
        segment = int(cells.segment[one])
        for axis in range(2):

            def along(time: mpmath.mpf, axis: int = axis, p: int = piece, s: int = segment):
                return exact_point(program, p, s, time)[axis]

            h = mp.mpf(10) ** -9
            points = [along(t + k * h) for k in (-2, -1, 0, 1, 2)]
            velocity = (points[3] - points[1]) / (2 * h)
            acceleration = (points[3] - 2 * points[2] + points[1]) / h**2
            jerk = (points[4] - 2 * points[3] + 2 * points[1] - points[0]) / (2 * h**3)
            assert found.axis_velocity[axis][i] == pytest.approx(float(velocity), abs=1e-7)
            assert found.axis_acceleration[axis][i] == pytest.approx(float(acceleration), abs=1e-4)
            assert found.axis_jerk[axis][i] == pytest.approx(float(jerk), abs=1e-1)


@pytest.mark.parametrize("parts", [1, 3])
def test_cells_know_the_parameters_at_their_ends(parts: int) -> None:
    cells = cut(random_program(1))
    cells = cells.divided(np.full(len(cells), parts)) if parts > 1 else cells
    assert len(cells) > 40
    every = np.arange(len(cells))
    for side in (0, 1):
        arc = np.polynomial.polynomial.polyval(
            cells.xi[:, side], cells.curve.arc[cells.segment].T, tensor=False
        )
        own = cells.arc_length_mm(every, np.full(every.size, float(side)))
        np.testing.assert_allclose(cells.curve.start_mm[cells.segment] + arc, own, atol=1e-9)
    assert np.all(cells.xi[:, 1] > cells.xi[:, 0])


@pytest.mark.parametrize("seed", range(6))
def test_second_derivatives_stay_within_their_bounds(seed: int) -> None:
    """And the bounds are of use: within a factor of fifty in the middle of all."""
    cells = cut(random_program(seed))
    bound = bends(cells)
    every = np.arange(len(cells))
    step = 1e-3
    slack = []
    for u in np.linspace(step, 1.0 - step, 41):
        three = [motion_at(cells, every, np.full(every.size, u + k * step)) for k in (-1, 0, 1)]
        for row in quantities(cells, Limits(), ()):
            a, b, c = (row.of(motion) for motion in three)
            second = np.abs(a - 2.0 * b + c) / (step * cells.duration_s) ** 2
            rounding = 1e-13 * np.maximum(np.abs(b), 1.0) / (step * cells.duration_s) ** 2
            allowed = row.of(bound) * (1.0 + 1e-6) + 100.0 * rounding
            assert np.all(second <= allowed), row.limit.quantity
            slack.append(np.median(allowed / np.maximum(second, rounding)))
    assert np.median(slack) < 50.0
