# SPDX-License-Identifier: MIT
"""The solver of quadratic programs: solutions keep every bound and meet the conditions of an optimum, whose multipliers
another solver finds (least squares that are not negative). Run by pytest; starts processes, and writes to temporary
folders.
"""

from __future__ import annotations

import ctypes
import hashlib
import shutil
import subprocess
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from hodograph.native import quadratic_program
from hodograph.native.library import library
from hodograph.native.quadratic_program import (
    QuadraticProgram,
    QuadraticSolution,
    Status,
    solve_quadratic,
)

Real = NDArray[np.float64]

NUMERICS = Path(__file__).resolve().parents[3] / "host_tools" / "numerics"
BUILDS = [(c, level) for c in ("gcc", "clang") if shutil.which(c) for level in ("-O0", "-O3")]
BITS = {0.0: "7dfe88f560dc9c6c", 10.0: "be97fd992d25646f"}
"""Digests of the solutions of `exact_program` by penalty: arithmetic of doubles without contraction gives them."""

TOLERANCE, CURVATURE = 1e-8, 1e-8
_NEAR = 1e-5
"""What rounding leaves where shares of rows that contradict are known to many digits."""
_ACTIVE = 1e-3
"""A bound is at its limit when its slack is less, in lengths of its coefficients (1 at least)."""

_FIXED, _ONE_SIDED, _TWO_SIDED = 0.1, 0.5, 0.8


def random_program(rng: np.random.Generator, intervals: int, rows: int) -> QuadraticProgram:
    """A program that a known point keeps, some of its bounds exactly."""
    inside = rng.normal(0.0, 1.0, 2 * intervals + 2)
    factor = rng.normal(0.0, 1.0, (intervals, rng.integers(1, 5), 4))
    coefficients = rng.normal(0.0, 1.0, (rows, 4)) * 10.0 ** rng.uniform(-1.0, 2.5, (rows, 1))
    interval = rng.integers(0, intervals, rows)
    value = np.sum(coefficients * inside[2 * interval[:, None] + np.arange(4)], axis=1)
    free = rng.uniform(size=rows)
    least = np.where(free < _ONE_SIDED, -np.inf, value - rng.exponential(1.0, rows))
    most = np.where(free > _TWO_SIDED, np.inf, value + rng.exponential(1.0, rows))
    low, high = (
        inside - rng.exponential(2.0, inside.size),
        inside + rng.exponential(2.0, inside.size),
    )
    fixed = rng.uniform(size=inside.size) < _FIXED
    low[fixed] = high[fixed] = inside[fixed]
    return QuadraticProgram(
        rng.normal(0.0, 1.0, inside.size),
        np.einsum("nki,nkj->nij", factor, factor),
        low,
        high,
        coefficients,
        interval,
        least,
        most,
    )


def solved(program: QuadraticProgram, penalty: float = 0.0) -> QuadraticSolution:
    """From a guess that knows nothing."""
    guess = np.zeros(program.gradient.size)
    return solve_quadratic(
        program, guess, tolerance=TOLERANCE, curvature=CURVATURE, penalty=penalty
    )


def full_matrix(program: QuadraticProgram) -> Real:
    """The hessian of all unknowns."""
    out = CURVATURE * np.eye(program.gradient.size)
    for k, block in enumerate(program.hessian):
        out[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += block
    return out


def inequalities(program: QuadraticProgram, soft: bool) -> tuple[Real, Real]:
    """Matrix and right side of all bounds as matrix @ (x, shares) <= right."""
    size, count = program.gradient.size, program.hessian.shape[0]
    rows = np.zeros((program.interval.size, size + count))
    for k, at in enumerate(program.interval):
        rows[k, 2 * at : 2 * at + 4] = program.coefficients[k]
    share = np.zeros_like(rows)
    if soft:
        share[np.arange(rows.shape[0]), size + program.interval] = 1.0
    one = np.eye(size + count)
    parts = (
        (rows - share, program.most),
        (-rows - share, -program.least),
        (one[:size], program.high),
        (-one[:size], -program.low),
        (-one[size:], np.zeros(count)),
    )
    matrix, right = np.vstack([m for m, _ in parts]), np.concatenate([r for _, r in parts])
    return matrix[np.isfinite(right)], right[np.isfinite(right)]


def check(program: QuadraticProgram, x: Real, penalty: float = 0.0) -> None:
    """Bounds, and multipliers of those at their limits that balance the gradient."""
    count = program.hessian.shape[0]
    exceeded = np.zeros(count)
    y = np.sum(program.coefficients * x[2 * program.interval[:, None] + np.arange(4)], axis=1)
    if penalty > 0.0:
        np.maximum.at(exceeded, program.interval, np.maximum(y - program.most, program.least - y))
    matrix, right = inequalities(program, penalty > 0.0)
    slack = right - matrix @ np.concatenate((x, exceeded))
    assert slack.min() > -10.0 * TOLERANCE
    gradient = np.concatenate(
        (
            program.gradient + full_matrix(program) @ x,
            (penalty > 0.0) * (penalty + CURVATURE * exceeded),
        )
    )
    length = np.maximum(1.0, np.linalg.norm(matrix, axis=1))
    active = matrix[slack < _ACTIVE * length] / length[slack < _ACTIVE * length, None]
    _, rest = nnls(active.T, -gradient)
    assert rest < 1e-3 * max(1.0, np.abs(gradient).max())


@pytest.mark.parametrize("seed", range(120))
def test_random_programs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    intervals = int(rng.integers(1, 13))
    program = random_program(rng, intervals, int(rng.integers(0, 8 * intervals)))
    found = solved(program)
    assert found.status == Status.SOLVED
    check(program, found.unknowns)
    known = program.low == program.high
    assert np.array_equal(found.unknowns[known], program.low[known])


@pytest.mark.parametrize("seed", range(60))
def test_rows_that_contradict_are_noticed_and_exceeded_least_where_that_is_allowed(
    seed: int,
) -> None:
    rng = np.random.default_rng(1000 + seed)
    intervals = int(rng.integers(1, 13))
    program = random_program(rng, intervals, int(rng.integers(1, 8 * intervals)))
    k = int(rng.integers(program.interval.size))
    apart = 10.0 ** rng.uniform(-3.0, 2.0)
    contrary = replace(
        program,
        coefficients=np.vstack((program.coefficients, program.coefficients[k : k + 1])),
        interval=np.append(program.interval, program.interval[k]),
        least=np.append(program.least, apart),
        most=np.append(program.most, np.inf),
    )
    contrary.most[k], contrary.least[k] = -apart, -np.inf
    assert solved(contrary).status == Status.INFEASIBLE
    penalty = 10.0 ** rng.uniform(0.0, 3.0)
    found = solved(contrary, penalty)
    assert found.status in (Status.SOLVED, Status.NEAR)
    assert max(found.violated, found.gradient, found.gap) < _NEAR
    check(contrary, found.unknowns, penalty)


def test_a_bound_that_known_unknowns_break() -> None:
    program = random_program(np.random.default_rng(7), 3, 12)
    program.low[:4] = program.high[:4]
    row = program.coefficients[:1]
    value = float(np.sum(row * program.low[:4]))
    for most, status in ((value + 1e-12, Status.SOLVED), (value - 1e-3, Status.INFEASIBLE)):
        broken = replace(
            program,
            coefficients=np.vstack((program.coefficients, row)),
            interval=np.append(program.interval, 0),
            least=np.append(program.least, -np.inf),
            most=np.append(program.most, most),
        )
        broken.least[:-1], broken.most[:-1] = -np.inf, np.inf
        assert solved(broken).status == status


def test_a_program_without_rows_is_solved_at_its_bounds() -> None:
    size = 6
    program = QuadraticProgram(
        np.array([1.0, -1.0, 1.0, -1.0, 0.5, -2.0]),
        np.zeros((2, 4, 4)),
        np.full(size, -1.0),
        np.full(size, 3.0),
        np.zeros((0, 4)),
        np.zeros(0, dtype=np.int64),
        np.zeros(0),
        np.zeros(0),
    )
    found = solved(program)
    assert found.status == Status.SOLVED
    assert np.allclose(found.unknowns, [-1.0, 3.0, -1.0, 3.0, -1.0, 3.0], atol=1e-7)


def exact_program() -> QuadraticProgram:
    """A program whose numbers are the same on every computer: random ones without a function of the C library."""
    rng = np.random.default_rng(11)

    def some(*shape: int) -> Real:
        return rng.integers(-512, 513, shape) / 256.0

    intervals, rows = 12, 80
    inside, factor = some(2 * intervals + 2), some(intervals, 2, 4)
    coefficients, interval = some(rows, 4), rng.integers(0, intervals, rows)
    value = np.sum(coefficients * inside[2 * interval[:, None] + np.arange(4)], axis=1)
    return QuadraticProgram(
        some(inside.size),
        factor[:, 0, :, None] * factor[:, 0, None] + factor[:, 1, :, None] * factor[:, 1, None],
        inside - 2.0,
        inside + 2.0,
        coefficients,
        interval,
        value - np.abs(some(rows)) - 0.5,
        value + np.abs(some(rows)) + 0.5,
    )


def compiled(compiler: str, level: str, target: Path) -> Any:
    """The solver of another compiler, as a function of the package's module."""
    source = NUMERICS / "quadratic_program.c"
    command = [compiler, "-std=c99", level, "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run(
        [*command, f"-I{NUMERICS.parent}", str(source), "-lm", "-o", str(target)], check=True
    )
    address = ctypes.cast(ctypes.CDLL(str(target)).quadratic_solve, ctypes.c_void_p).value
    ffi, lib = library()
    return ffi.cast(ffi.typeof(lib.quadratic_solve), address)


@pytest.mark.parametrize(("compiler", "level"), BUILDS)
def test_every_compiler_gives_the_same_bits(
    compiler: str, level: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = [solved(exact_program(), penalty) for penalty in BITS]
    ffi, lib = library()
    other = SimpleNamespace(
        quadratic_work=lib.quadratic_work,
        quadratic_solve=compiled(compiler, level, tmp_path / "solver.so"),
    )
    monkeypatch.setattr(quadratic_program, "library", lambda: (ffi, other))
    for penalty, solution in zip(BITS, own, strict=True):
        found = solved(exact_program(), penalty)
        assert found.unknowns.tobytes() == solution.unknowns.tobytes()
        assert found.iterations == solution.iterations > 5


@pytest.mark.parametrize("penalty", BITS)
def test_the_bits_are_those_of_every_computer(penalty: float) -> None:
    found = solved(exact_program(), penalty)
    assert hashlib.sha256(found.unknowns.tobytes()).hexdigest()[:16] == BITS[penalty]


@pytest.mark.parametrize("penalty", BITS)
def test_memory_that_is_lent_does_not_change_the_bits(
    penalty: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = solved(exact_program(), penalty)
    for content in (0.0, np.nan, -1e300):
        lent = {**vars(np), "empty": partial(np.full, fill_value=content)}
        monkeypatch.setattr(quadratic_program, "np", SimpleNamespace(**lent))
        assert solved(exact_program(), penalty).unknowns.tobytes() == own.unknowns.tobytes()
