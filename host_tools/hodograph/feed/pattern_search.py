# SPDX-License-Identifier: MIT
"""Pattern search for one variable within bounds; docs/theory/numerics.md 5.4.

The rules of generalized pattern search as MATLAB's `patternsearch` documents them for its defaults (poll
+1 then -1, take the first better point, mesh doubled after success and halved after failure, end
when the mesh is below its tolerance), since the paper used that function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

INITIAL_MESH = 1.0
MESH_TOLERANCE = 1e-6
MOST_ITERATIONS = 1000


@dataclass(frozen=True)
class SearchStep:
    """State after one iteration: evaluations so far, best point and value, mesh size for the next."""

    iteration: int
    evaluations: int
    best: float
    value: float
    mesh: float


def pattern_search(
    objective: Callable[[float], float], start: float, low: float, high: float
) -> tuple[SearchStep, ...]:
    """Minimises `objective` over low … high from `start`; the last step holds the result.

    Points outside the bounds are not polled. Step 0 is the start.
    """
    best, value, mesh = start, objective(start), INITIAL_MESH
    evaluations = 1
    steps = [SearchStep(0, evaluations, best, value, mesh)]
    while mesh > MESH_TOLERANCE and len(steps) <= MOST_ITERATIONS:
        better = False
        for candidate in (best + mesh, best - mesh):
            if not low <= candidate <= high:
                continue
            evaluations += 1
            found = objective(candidate)
            if found < value:
                best, value, better = candidate, found, True
                break
        mesh = mesh * 2.0 if better else mesh / 2.0
        steps.append(SearchStep(len(steps), evaluations, best, value, mesh))
    return tuple(steps)
