# SPDX-License-Identifier: MIT
"""From points or a control polygon to a PHSpline; docs/theory/numerics.md sections 1 to 3. Used by many modules of
host_tools: the pipelines of paths and sections, moves to a start, streamed paths. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ..errors import InputError
from .bernstein import Complex
from .curve import PHSpline
from .ends import EndCondition, end_shares, end_spans, through_guide
from .knots import KnotSpans, checked_knots, knot_spans
from .nodal import Guide, checked_points, control_polygon_guide
from .solve import solve
from .start import followed_branch, root_on_branch, starting_values, without_rests
from .system import EndRule, System, clamped_end

Spline = TypeVar("Spline")


@dataclass(frozen=True)
class FoundSpline(Generic[Spline]):
    """A spline in the plane or in space, how it was found and how good it is; docs/theory/numerics.md 3.5.

    newton_iterations  linear systems of the whole spline that were solved, including continuation and polishing
    trial_iterations   linear systems that were solved in trials of the other side of near-cusps, on windows of at most
                       17 spans; 0 for smooth input
    changed_sides      near-cusps that the spline passes on the other side than its guide, for less bending
    extra_turning_rad  greatest total turning beyond the guide's within three spans that also bend
                       more
    bending_ratio      bending energy over that of the guide (cubic B-spline or cubic spline)
    notes              one line each, for stderr
    """

    spline: Spline
    newton_iterations: int
    trial_iterations: int = 0
    changed_sides: int = 0
    extra_turning_rad: float = 0.0
    bending_ratio: float = 1.0
    notes: tuple[str, ...] = ()


SplineResult = FoundSpline[PHSpline]


def from_control_polygon(points: object, closed: bool) -> SplineResult:
    """C2 PH quintic spline of a cubic B-spline control polygon (paper sections 1 and 2).

    `points`: complex (n,) or real (n, 2), mm; open from 4 points on, closed from 3 on (each point
    once; a repeated tail of three is dropped with a note). Raises InputError for bad points and
    PlanError, naming the span, where there is no acceptable spline.
    """
    p, notes = checked_points(points, closed, 3 if closed else 4, "control point")
    guide = control_polygon_guide(p, closed)
    first, last = complex(guide.hodograph[0, 0]), complex(guide.hodograph[-1, 2])
    return _solved(guide, first, last, notes)


def through_points(
    points: object,
    closed: bool,
    ends: str = "cubic",
    start_tangent: complex | None = None,
    end_tangent: complex | None = None,
    knots: str = "chord",
) -> SplineResult:
    """C2 PH quintic spline through given points, one span from each point to the next.

    `points`: complex (n,) or real (n, 2), mm; open from 2 points on, closed from 3 on (each point
    once; a repeated last point is dropped with a note). Ends of an open path:

        ends = "cubic"      the end spans are PH cubics (w linear), the default
        ends = "natural"    no curvature at the ends
        start_tangent, end_tangent   direction there (any length), instead of `ends` at that end

    A closed path is periodic and takes no tangents. `knots`, a name of KNOT_NAMES, sets the parameter length of spans:
    chord-length knots suit points at any distances. Raises InputError and PlanError as above.
    """
    p, notes = checked_points(points, closed, 3 if closed else 2, "through point")
    start = EndCondition.chosen(ends, start_tangent, "start_tangent", closed)
    end = EndCondition.chosen(ends, end_tangent, "end_tangent", closed)
    chords = np.diff(np.append(p, p[0]) if closed else p)
    spans = None
    if checked_knots(knots) != "uniform":
        spans = knot_spans(np.abs(chords), knots, closed)
    guide = through_guide(p, closed, start, end, spans)
    first_length, last_length = end_spans(spans)
    first_share, last_share = end_shares(spans)
    first = complex(guide.hodograph[0, 0]) / first_length
    last = complex(guide.hodograph[-1, 2]) / last_length
    return _solved(
        guide,
        first if start.tangent else start.rule(p.size - 1, first_share),
        last if end.tangent else end.rule(p.size - 1, last_share),
        notes,
        spans,
    )


def line(start: complex, end: complex) -> PHSpline:
    """The straight segment from `start` to `end`, mm. Raises InputError when they coincide."""
    if not (np.isfinite(start) and np.isfinite(end)) or start == end:
        raise InputError("a line needs two different finite points")
    w = np.full((1, 3), np.sqrt(complex(end - start)))
    return PHSpline(np.array([start], dtype=np.complex128), w, False)


def _solved(
    guide: Guide,
    first: complex | EndRule,
    last: complex | EndRule,
    notes: tuple[str, ...],
    knots: KnotSpans | None = None,
) -> SplineResult:
    """`first`, `last`: derivative by the parameter there, or the rule in place of it (open paths)."""
    length = np.ones((1, 1)) if knots is None else knots.length[:, None]
    hodograph = without_rests(guide.hodograph / length, guide.closed)
    branch = followed_branch(hodograph)
    chords: Complex = np.diff(guide.nodal_points)
    if guide.closed:
        turns = round(float(branch.node_angle[-1] - branch.node_angle[0]) / (2.0 * np.pi))
        system = System(chords, cyclic_sign=-1 if turns % 2 else 1, knots=knots)
    else:
        start = _end_rule(first, branch.node_angle[:1])
        system = System(chords, start, _end_rule(last, branch.node_angle[-1:]), knots=knots)
    solution = solve(system, starting_values(hodograph, branch), hodograph * length)
    spline = PHSpline(guide.nodal_points[:-1].copy(), solution.w, guide.closed)
    return SplineResult(
        spline,
        solution.newton_iterations,
        solution.trial_iterations,
        solution.changed_sides,
        solution.verdict.extra_turning_rad,
        solution.verdict.bending_ratio,
        notes,
    )


def _end_rule(end: complex | EndRule, angle: np.ndarray) -> EndRule:
    if isinstance(end, EndRule):
        return end
    return clamped_end(complex(root_on_branch(np.array([end]), angle)[0]))
