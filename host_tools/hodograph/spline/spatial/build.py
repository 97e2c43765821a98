# SPDX-License-Identifier: MIT
"""From points or a control polygon in space to a SpatialPHSpline. Used by bus/goto, pipeline and toolpath/fit/fitting.
No I/O.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import PlanError
from ..bernstein import Real
from ..build import FoundSpline, SplineResult, from_control_polygon, through_points
from ..ends import end_shares
from ..knots import KnotSpans, checked_knots, knot_spans
from ..newton import solved
from ..nodal import checked_space_points
from .curve import SpatialPHSpline, embedded
from .extra import nodal_values, require_moving, with_extra_axes, without_tail
from .frame import guide_frame, without_rests
from .guide import SpaceEnd, SpaceGuide, points_guide, polygon_guide
from .quality import judge
from .system import NATURAL_END, SpaceEndRule, SpaceSystem, cubic_end, tangent_end

SpatialSplineResult = FoundSpline[SpatialPHSpline]


def spatial_from_control_polygon(
    points: object, closed: bool, extra: Real | None = None
) -> SpatialSplineResult:
    """C2 PH quintic spline in space of a cubic B-spline control polygon, on uniform knots as in the plane.

    `points`: real (n, 3), mm; otherwise as `from_control_polygon`. Points of one z give the planar spline, bit for bit.
    `extra`: (n, E), values of extra axes at the points of the polygon; mm, or degrees.
    Raises InputError for bad points and PlanError, naming the span, where there is no acceptable spline.
    """
    _check_extra(points, extra, "control point")
    return _with_extra(_of_polygon(points, closed), extra, closed, polygon=True)


def _of_polygon(points: object, closed: bool) -> SpatialSplineResult:
    p, notes = checked_space_points(points, closed, 3 if closed else 4, "control point")
    if _level(p):
        return _embedded(from_control_polygon(p[:, :2], closed), float(p[0, 2]), notes)
    guide = polygon_guide(p, closed)
    spans = guide.hodograph.shape[0]
    knots = knot_spans(np.ones(spans), "uniform", closed)
    return _solved(guide, None, None, knots, notes)


def spatial_through_points(
    points: object,
    closed: bool,
    ends: str = "cubic",
    start_tangent: object = None,
    end_tangent: object = None,
    knots: str = "chord",
    extra: Real | None = None,
) -> SpatialSplineResult:
    """C2 PH quintic spline through given points in space, one span from each point to the next.

    `points`: real (n, 3), mm; tangents are vectors (3,); otherwise as `through_points`. Points of one z, with tangents
    that keep it, give the planar spline, bit for bit. `extra`: (n, E), values of extra axes at the points; mm, or
    degrees. Raises InputError and PlanError as above.
    """
    _check_extra(points, extra, "through point")
    found = _through(points, closed, ends, start_tangent, end_tangent, knots)
    return _with_extra(found, extra, closed, polygon=False)


def _through(
    points: object,
    closed: bool,
    ends: str,
    start_tangent: object,
    end_tangent: object,
    knots: str,
) -> SpatialSplineResult:
    p, notes = checked_space_points(points, closed, 3 if closed else 2, "through point")
    start = SpaceEnd.chosen(ends, start_tangent, "start_tangent", closed)
    end = SpaceEnd.chosen(ends, end_tangent, "end_tangent", closed)
    if _level(p) and start.level and end.level:
        planar = through_points(p[:, :2], closed, ends, start.planar, end.planar, knots)
        return _embedded(planar, float(p[0, 2]), notes)
    loop = np.vstack((p, p[:1])) if closed else p
    chord_mm = np.linalg.norm(np.diff(loop, axis=0), axis=1)
    knots_of = knot_spans(chord_mm, checked_knots(knots), closed)
    guide = points_guide(p, closed, start, end, knots_of)
    spans = chord_mm.size
    first_share, last_share = end_shares(knots_of)
    first = _free_end(start, first_share, spans)
    last = _free_end(end, last_share, spans)
    return _solved(guide, first, last, knots_of, notes)


def _level(p: Real) -> bool:
    """Whether all points have one z."""
    return bool(np.all(p[:, 2] == p[0, 2]))


def _embedded(found: SplineResult, height_mm: float, notes: tuple[str, ...]) -> SpatialSplineResult:
    own = {"spline": embedded(found.spline, height_mm), "notes": notes}
    return SpatialSplineResult(**vars(found) | own)


def _free_end(condition: SpaceEnd, share: float, spans: int) -> SpaceEndRule | None:
    """The rule of an end; None where its direction is given. For a single span both names mean natural."""
    if condition.tangent is not None:
        return None
    return cubic_end(share) if condition.name == "cubic" and spans > 1 else NATURAL_END


def _solved(
    guide: SpaceGuide,
    start: SpaceEndRule | None,
    end: SpaceEndRule | None,
    knots: KnotSpans,
    notes: tuple[str, ...],
) -> SpatialSplineResult:
    """`start`, `end`: rules of free ends; without one, the derivative there is the guide's."""
    chords = np.diff(guide.nodal_points, axis=0)
    length = knots.length[:, None]
    hodograph = without_rests(guide.hodograph / length[:, :, None], guide.closed)
    frame = guide_frame(hodograph, chords / length)
    system = SpaceSystem(
        chords,
        knots,
        frame.middle,
        tangent_end(frame.start) if start is None else start,
        tangent_end(frame.end) if end is None else end,
        frame.phase if guide.closed else None,
    )
    outcome = solved(system, system.first_guess)
    preimage = system.coefficients(outcome.z)
    verdict = judge(preimage, hodograph * length[:, :, None], guide.closed)
    if verdict.problem:
        raise PlanError(
            f"no acceptable spline: {verdict.problem}; move or add points around it, "
            "or make neighbouring spans more alike in length"
        )
    return SpatialSplineResult(
        SpatialPHSpline(guide.nodal_points[:-1].copy(), preimage, guide.closed),
        outcome.iterations,
        extra_turning_rad=verdict.extra_turning_rad,
        bending_ratio=verdict.bending_ratio,
        notes=notes,
    )


def _check_extra(points: object, extra: Real | None, what: str) -> None:
    given = np.asarray(points)
    if extra is not None and extra.shape[1] and given.ndim == 2 and len(given) == len(extra):
        require_moving(given, extra, what)


def _with_extra(
    found: SpatialSplineResult, extra: Real | None, closed: bool, polygon: bool
) -> SpatialSplineResult:
    """The spline with extra axes that have the values `extra` (n, E) at the given points; None: without."""
    if extra is None or not extra.shape[1]:
        return found
    spans = found.spline.segment_count
    count = spans if closed else spans + 3 if polygon else spans + 1
    kept = without_tail(extra, count, "control point" if polygon else "through point")
    nodes = nodal_values(kept, closed) if polygon else kept
    return replace(found, spline=with_extra_axes(found.spline, nodes))
