# SPDX-License-Identifier: MIT
"""From starting values to an accepted solution, or PlanError; docs/theory/numerics.md section 3. Used by spline/build.
No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..errors import PlanError
from .bernstein import Complex
from .loops import Unlooped, without_loops, without_remaining_loops
from .newton import solved
from .quality import Shape
from .system import System
from .verdict import Verdict, judge

_ROUNDS = 3
"""Greatest number of rounds that remove remaining loops."""


@dataclass(frozen=True)
class Solution:
    """w (M, 3) of the spline and how it was found.

    newton_iterations  linear systems of the whole spline that were solved, including continuation and polishing
    trial_iterations   linear systems that were solved in trials on windows of at most 17 spans
    changed_sides      near-cusps that the spline passes on the other side to avoid a loop
    """

    w: Complex
    newton_iterations: int
    trial_iterations: int
    changed_sides: int
    verdict: Verdict


@dataclass(frozen=True)
class _State:
    system: System
    z: Complex
    spent: int = 0
    trials: int = 0
    changes: int = 0


def solve(system: System, z: Complex, guide_hodograph: Complex) -> Solution:
    """The accepted solution near the starting values `z` (M,), compared with the guide (M, 3).

    Raises PlanError naming the span: no solution was found, or each has a loop or cusp that the guide lacks.
    """
    guide = Shape(guide_hodograph, 1)
    state = _converged(_State(system, z))
    better = without_loops(state.system, state.z, guide.turning)
    state = _polished(state, better)
    verdict = _judged(state, guide)
    for _ in range(_ROUNDS):
        if not verdict.problem:
            break
        better = without_remaining_loops(state.system, state.z, verdict.loops + verdict.cusps)
        state = _polished(state, better)
        verdict = _judged(state, guide)
        if not better.changes:
            break
    if verdict.problem:
        raise PlanError(
            f"no acceptable spline: {verdict.problem}; move or add points around it, "
            "or make neighbouring spans more alike in length"
        )
    w = state.system.coefficients(state.z)
    return Solution(w, state.spent, state.trials, state.changes, verdict)


def _judged(state: _State, guide: Shape) -> Verdict:
    closed = state.system.cyclic_sign != 0
    return judge(state.system.coefficients(state.z), guide, closed)


def _polished(state: _State, better: Unlooped) -> _State:
    trials = state.trials + better.iterations
    if not better.changes:
        return replace(state, trials=trials)
    changes = state.changes + better.changes
    return _converged(_State(better.system, better.z, state.spent, trials, changes))


def _converged(state: _State) -> _State:
    outcome = solved(state.system, state.z)
    return replace(state, z=outcome.z, spent=state.spent + outcome.iterations)
