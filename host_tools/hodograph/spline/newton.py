# SPDX-License-Identifier: MIT
"""Newton-Raphson on an interpolation system, in the plane or in space, and continuation where it does not converge.

docs/theory/numerics.md sections 2.3 (the iteration, when it stops) and 3.4 (continuation).

Used by spline/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import PlanError
from .banded import SingularSystem
from .bernstein import Real

_ROUNDING = 16.0 * 2.0**-52
"""Residual, relative to its terms, that counts as 0: 16 units in the last place."""
_STAGNATION = 1e-11
"""Residual that also counts as 0 once a step reduces it by less than half."""
_MOST_STEPS = 20
"""Greatest number of steps."""
_SMALLEST_STRIDE = 2.0**-12
"""Continuation fails if a step has to be a smaller part of it than this."""
_BULGES = (0.0, 0.25j, -0.25j)
"""Detours of the continuation, tried in this order; those off the real axis only for planar splines."""

Unknowns = NDArray[Any]
"""Unknowns of M spans: (M,) complex in the plane, (M, 3) real in space; residuals and chords likewise."""


class InterpolationSystem(Protocol):
    """The equations of a spline: one residual for each span."""

    @property
    def chords(self) -> Unknowns:
        """From point to point, mm."""
        ...

    def with_chords(self, chords: Unknowns) -> Self:
        """This system for other chords."""
        ...

    def residual(self, z: Unknowns) -> Unknowns:
        """The residual of the equations; 0 for the solution."""
        ...

    def residual_mm(self, z: Unknowns) -> Unknowns:
        """The error of each span's chord, mm."""
        ...

    def sizes(self, residual: Unknowns) -> Real:
        """Magnitude (M,) of the residual of each span."""
        ...

    def largest_term(self, z: Unknowns) -> float:
        """Magnitude of the largest term that is summed in the residual."""
        ...

    def newton_step(self, z: Unknowns, residual: Unknowns) -> Unknowns:
        """-J(z)^-1 residual. Raises SingularSystem."""
        ...


@dataclass(frozen=True, eq=False)
class Outcome:
    """Where the iteration ended: `worst` is the span of the largest residual."""

    z: Unknowns
    iterations: int
    converged: bool
    worst: int


def solved(system: InterpolationSystem, z: Unknowns) -> Outcome:
    """The solution near `z`, by Newton, else by continuation. Raises PlanError naming the span."""
    outcome = newton(system, z)
    if not outcome.converged:
        spent = outcome.iterations
        outcome = continued(system, z)
        outcome = replace(outcome, iterations=spent + outcome.iterations)
    if not (outcome.converged and np.isfinite(outcome.z).all()):
        raise PlanError(
            f"no spline found: span {outcome.worst} cannot be fitted; "
            "move or add points around it so that the path turns less sharply"
        )
    return outcome


def newton(system: InterpolationSystem, z: Unknowns, most_steps: int = _MOST_STEPS) -> Outcome:
    """Full Newton steps from `z` until the residual is at rounding level.

    Rounding level: 16 units in the last place of the largest term, or less than 1e-11 of it and no
    longer falling.
    """
    previous = np.inf
    residual = system.residual(z)
    for iterations in range(most_steps + 1):
        size = system.sizes(residual)
        worst = int(size.argmax())
        term = system.largest_term(z)
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


def continued(system: InterpolationSystem, z: Unknowns) -> Outcome:
    """Follow the solution from chords that `z` solves exactly to the chords of `system`.

    The stride halves where Newton needs more than five steps and doubles again after. Paths in the
    plane that run into a singular point are tried again along a detour through complex multiples of
    the change.
    """
    spent = 0
    outcome = Outcome(z, 0, False, 0)
    begin = system.chords + system.residual_mm(z)
    for bulge in _BULGES if np.iscomplexobj(begin) else _BULGES[:1]:
        outcome = _follow(system, z, begin, bulge)
        spent += outcome.iterations
        if outcome.converged:
            break
    return replace(outcome, iterations=spent)


def _follow(system: InterpolationSystem, z: Unknowns, begin: Unknowns, bulge: complex) -> Outcome:
    change = system.chords - begin
    done, stride, spent, worst = 0.0, 0.25, 0, 0
    while done < 1.0:
        target = min(1.0, done + stride)
        share = target + bulge * target * (1.0 - target)
        last = target == 1.0
        chords = system.chords if last else begin + share * change
        step = newton(system.with_chords(chords), z, _MOST_STEPS if last else 5)
        spent += step.iterations
        if step.converged:
            z, done, stride = step.z, target, 2.0 * stride
            continue
        worst, stride = step.worst, stride / 2.0
        if stride < _SMALLEST_STRIDE:
            return Outcome(z, spent, False, worst)
    return Outcome(z, spent, True, worst)
