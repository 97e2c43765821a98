# SPDX-License-Identifier: MIT
"""Newton-Raphson on the interpolation system, and continuation where it does not converge.

docs/theory/numerics.md sections 2.3 (the iteration, when it stops) and 3.4 (continuation).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .banded import SingularSystem
from .bernstein import Complex
from .system import System

_ROUNDING = 16.0 * 2.0**-52
_STAGNATION = 1e-11
_MOST_STEPS = 20
_SMALLEST_STRIDE = 2.0**-12
_BULGES = (0.0, 0.25j, -0.25j)


@dataclass(frozen=True)
class Outcome:
    """Where the iteration ended: `worst` is the span of the largest residual."""

    z: Complex
    iterations: int
    converged: bool
    worst: int


def newton(system: System, z: Complex, most_steps: int = _MOST_STEPS) -> Outcome:
    """Full Newton steps from `z` until the residual is at rounding level.

    Rounding level: 16 units in the last place of the largest term of (13), or less than 1e-11 of
    it and no longer falling.
    """
    previous = np.inf
    residual = system.residual(z)
    for iterations in range(most_steps + 1):
        size = np.abs(residual)
        worst = int(size.argmax())
        term = 60.0 * float(np.abs(z).max()) ** 2
        greatest = float(size[worst])
        if not np.isfinite(greatest + term):
            return Outcome(z, iterations, False, worst)
        settled = greatest <= _STAGNATION * term and greatest >= previous / 2.0
        if greatest <= _ROUNDING * term or settled:
            return Outcome(z, iterations, True, worst)
        if iterations == most_steps:
            break
        previous = greatest
        try:
            with np.errstate(all="ignore"):
                z = z + system.newton_step(z, residual)
                residual = system.residual(z)
        except SingularSystem:
            return Outcome(z, iterations, False, worst)
    return Outcome(z, most_steps, False, worst)


def continued(system: System, z: Complex) -> Outcome:
    """Follow the solution from chords that `z` solves exactly to the chords of `system`.

    The stride halves where Newton needs more than five steps and doubles again after. Paths that
    run into a singular point are tried again along a detour through complex multiples of the
    change.
    """
    spent = 0
    outcome = Outcome(z, 0, False, 0)
    begin = system.chords + system.residual_mm(z)
    for bulge in _BULGES:
        outcome = _follow(system, z, begin, bulge)
        spent += outcome.iterations
        if outcome.converged:
            break
    return replace(outcome, iterations=spent)


def _follow(system: System, z: Complex, begin: Complex, bulge: complex) -> Outcome:
    change = system.chords - begin
    done, stride, spent, worst = 0.0, 0.25, 0, 0
    while done < 1.0:
        target = min(1.0, done + stride)
        share = target + bulge * target * (1.0 - target)
        last = target == 1.0
        chords = system.chords if last else begin + share * change
        step = newton(replace(system, chords=chords), z, _MOST_STEPS if last else 5)
        spent += step.iterations
        if step.converged:
            z, done, stride = step.z, target, 2.0 * stride
            continue
        worst, stride = step.worst, stride / 2.0
        if stride < _SMALLEST_STRIDE:
            return Outcome(z, spent, False, worst)
    return Outcome(z, spent, True, worst)
