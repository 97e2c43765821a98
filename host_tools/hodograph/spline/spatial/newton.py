# SPDX-License-Identifier: MIT
"""Newton-Raphson on the system in space, and continuation beside it; docs/theory/spatial-splines.md 4."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import PlanError
from ..banded import SingularSystem
from ..bernstein import Real
from .system import SpaceSystem

_ROUNDING = 16.0 * 2.0**-52
_STAGNATION = 1e-11
_MOST_STEPS = 20
_SMALLEST_STRIDE = 2.0**-12


@dataclass(frozen=True, eq=False)
class SpaceOutcome:
    """Where the iteration ended: `worst` is the span of the largest residual."""

    unknown: Real
    iterations: int
    converged: bool
    worst: int


def solved(system: SpaceSystem) -> SpaceOutcome:
    """The solution near the frame, by Newton, else by continuation. Raises PlanError naming the span."""
    outcome = newton(system, system.first_guess)
    if not outcome.converged:
        spent = outcome.iterations
        outcome = continued(system, system.first_guess)
        outcome = replace(outcome, iterations=spent + outcome.iterations)
    if not outcome.converged:
        raise PlanError(
            f"no spline found: span {outcome.worst} cannot be fitted; "
            "move or add points around it so that the path turns less sharply"
        )
    return outcome


def newton(system: SpaceSystem, unknown: Real, most_steps: int = _MOST_STEPS) -> SpaceOutcome:
    """Full Newton steps from `unknown` (M, 3) until the residual is at rounding level.

    Rounding level: 16 units in the last place of the largest term, or less than 1e-11 of it and no longer falling.
    """
    previous = np.inf
    residual = system.residual(unknown)
    for iterations in range(most_steps + 1):
        size = np.abs(residual).max(axis=1)
        worst = int(size.argmax())
        term = 60.0 * float(np.sum(system.values(unknown) ** 2, axis=1).max())
        greatest = float(size[worst])
        if not np.isfinite(greatest + term):
            return SpaceOutcome(unknown, iterations, False, worst)
        settled = greatest <= _STAGNATION * term and greatest >= previous / 2.0
        if greatest <= _ROUNDING * term or settled:
            return SpaceOutcome(unknown, iterations, True, worst)
        if iterations == most_steps:
            break
        previous = greatest
        try:
            with np.errstate(all="ignore"):
                unknown = unknown + system.newton_step(unknown, residual)
                residual = system.residual(unknown)
        except SingularSystem:
            return SpaceOutcome(unknown, iterations, False, worst)
    return SpaceOutcome(unknown, most_steps, False, worst)


def continued(system: SpaceSystem, unknown: Real) -> SpaceOutcome:
    """Follow the solution from chords that `unknown` solves exactly to the chords of `system`.

    The stride halves where Newton needs more than five steps and doubles again after.
    """
    begin = system.chords + system.residual_mm(unknown)
    done, stride, spent, worst = 0.0, 0.25, 0, 0
    while done < 1.0:
        target = min(1.0, done + stride)
        last = target == 1.0
        chords = system.chords if last else begin + target * (system.chords - begin)
        step = newton(replace(system, chords=chords), unknown, _MOST_STEPS if last else 5)
        spent += step.iterations
        if step.converged:
            unknown, done, stride = step.unknown, target, 2.0 * stride
            continue
        worst, stride = step.worst, stride / 2.0
        if stride < _SMALLEST_STRIDE:
            return SpaceOutcome(unknown, spent, False, worst)
    return SpaceOutcome(unknown, spent, True, worst)
