# SPDX-License-Identifier: MIT
"""Curves of DXF entities: `CURVES` has the function that draws each kind. It draws in the coordinates of the contours.
Used by toolpath/dxf. No I/O; changes the contours that it is given.

Raises ShapeError: a value is missing or has no meaning.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from .contours import FLAT_MM, MOST_MM, Affine, Contours, Point, ShapeError, Spline
from .dxf_tags import Entity, ezdxf_module, number_of

_MOST_DEGREE = 15
"""Greatest degree of a spline."""

_ROUNDED_TURN = 1e-4
"""By how many rad a whole circle or ellipse may seem longer than a turn: programs write 2π as 6.28319 or 6.2832."""


def entity_system(entity: Entity) -> Affine:
    """The map from the coordinate system of an entity, which its extrusion direction gives, to the world's."""
    extrusion = entity.point(210, (0.0, 0.0, 1.0))
    if extrusion == (0.0, 0.0, 1.0):
        return Affine()
    size = math.hypot(*extrusion)
    if not 1e-12 < size < 1e12:
        raise ShapeError("extrusion direction without length")
    ocs = ezdxf_module("math").OCS(tuple(each / size for each in extrusion))
    x, y, z = zip(ocs.ux.xyz, ocs.uy.xyz, ocs.uz.xyz, strict=True)
    return Affine(x, y, z)


def _line(entity: Entity, contours: Contours) -> None:
    contours.move_to(entity.point(10), entity.line)
    contours.line_to(entity.point(11), entity.line)


def _circle(entity: Entity, contours: Contours) -> None:
    contours.affine = contours.affine.after(entity_system(entity))
    (x, y, z), radius = entity.point(10), entity.number(40)
    if radius < 0:
        raise ShapeError("a negative radius")
    start, sweep_deg = 0.0, 360.0
    if entity.kind == "ARC":
        start = entity.number(50)
        sweep_deg = entity.number(51) - start
        is_whole = 0.0 < sweep_deg - 360.0 < math.degrees(_ROUNDED_TURN)
        sweep_deg = 360.0 if is_whole else sweep_deg % 360.0 or 360.0
    first, last = (
        Affine.rotation(angle % 360.0).direction((radius, 0.0, 0.0))
        for angle in (start, start + sweep_deg)
    )
    contours.move_to((x + first[0], y + first[1], z), entity.line)
    end = None if sweep_deg == 360.0 else (x + last[0], y + last[1], z)
    axes = ((radius, 0.0, 0.0), (0.0, radius, 0.0))
    contours.ellipse_to(
        (x, y, z), axes, math.radians(start % 360.0), math.radians(sweep_deg), end, entity.line
    )


def _ellipse(entity: Entity, contours: Contours) -> None:
    centre, major, ratio = entity.point(10), entity.point(11), entity.number(40)
    normal = np.array(entity_system(entity).direction((0.0, 0.0, 1.0)))
    minor = np.cross(normal, major) * ratio
    start = entity.number(41, 0.0) % math.tau
    sweep = entity.number(42, math.tau) - entity.number(41, 0.0)
    is_whole = abs(abs(sweep) - math.tau) < 1e-9 or not sweep
    is_whole = is_whole or math.tau < sweep < math.tau + _ROUNDED_TURN
    sweep = math.tau if is_whole else sweep % math.tau
    axes = (major, (float(minor[0]), float(minor[1]), float(minor[2])))

    def at(t: float) -> Point:
        x, y, z = (
            c + math.cos(t) * u + math.sin(t) * v for c, u, v in zip(centre, *axes, strict=True)
        )
        return x, y, z

    contours.move_to(at(start), entity.line)
    contours.ellipse_to(
        centre, axes, start, sweep, None if is_whole else at(start + sweep), entity.line
    )


def _lwpolyline(entity: Entity, contours: Contours) -> None:
    contours.affine = contours.affine.after(entity_system(entity))
    height = entity.number(38, 0.0)
    vertices: list[list[float]] = []
    bulges: list[float] = []
    for tag in entity.tags:
        if tag.code == 10:
            vertices.append([number_of(tag)])
            bulges.append(0.0)
        elif tag.code in (20, 42):
            if not vertices or (tag.code == 20 and len(vertices[-1]) != 1):
                raise ShapeError(f"line {tag.line}: group {tag.code} before its x (group 10)")
            if tag.code == 20:
                vertices[-1].append(number_of(tag))
            else:
                bulges[-1] = number_of(tag)
    if any(len(vertex) != 2 for vertex in vertices):
        raise ShapeError("a vertex without y (group 20)")
    if len(vertices) != entity.integer(90, len(vertices)):
        raise ShapeError(f"{len(vertices)} vertices, where group 90 says {entity.integer(90, 0)}")
    points = [(x, y, height) for x, y in vertices]
    _polyline_through(
        contours, points, bulges, entity.line, is_closed=bool(entity.integer(70, 0) & 1)
    )


def _polyline(entity: Entity, contours: Contours) -> None:
    flags = entity.integer(70, 0)
    vertices = [
        part for part in entity.parts if part.kind == "VERTEX" and not part.integer(70, 0) & 16
    ]
    points = [part.point(10) for part in vertices]
    bulges = [part.number(42, 0.0) for part in vertices]
    if flags & 8:
        bulges = [0.0] * len(points)
    else:
        contours.affine = contours.affine.after(entity_system(entity))
        height = entity.number(30, 0.0)
        points = [(x, y, height) for x, y, _ in points]
    _polyline_through(contours, points, bulges, entity.line, is_closed=bool(flags & 1))


def _polyline_through(
    contours: Contours, points: list[Point], bulges: list[float], line: int, *, is_closed: bool
) -> None:
    """Lines, and arcs where the bulge (tangent of a quarter of the angle) is not 0."""
    if not points:
        return
    contours.move_to(points[0], line)
    ends = [*points[1:], points[0]] if is_closed else points[1:]
    for start, end, bulge in zip(points, ends, bulges, strict=False):
        if bulge == 0.0 or start == end:
            contours.line_to(end, line)
            continue
        if _is_slight(contours, start, end, bulge):
            _slight_arc(contours, start, end, bulge, line)
            continue
        dx, dy, away = end[0] - start[0], end[1] - start[1], (1.0 / bulge - bulge) / 4.0
        x = (start[0] + end[0]) / 2.0 - away * dy
        y = (start[1] + end[1]) / 2.0 + away * dx
        u = (start[0] - x, start[1] - y, 0.0)
        axes = (u, (-u[1], u[0], 0.0))
        contours.ellipse_to((x, y, start[2]), axes, 0.0, 4.0 * math.atan(bulge), end, line)


def _is_slight(contours: Contours, start: Point, end: Point, bulge: float) -> bool:
    """Whether an arc is so nearly straight that its centre may be too far away."""
    chord = contours.affine.direction((end[0] - start[0], end[1] - start[1], 0.0))
    return abs(bulge) < 1e-3 and math.hypot(*chord) > abs(bulge) * MOST_MM / 10.0


def _slight_arc(contours: Contours, start: Point, end: Point, bulge: float, line: int) -> None:
    """The arc as a rational spline, which needs no centre; a line if it is nowhere farther from it."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    if math.hypot(*contours.affine.direction((dx, dy, 0.0))) * abs(bulge) / 2.0 < FLAT_MM:
        contours.line_to(end, line)
        return
    height = bulge / (1.0 - bulge * bulge)  # of the tangents' intersection, as a share of the chord
    tip = ((start[0] + end[0]) / 2 + height * dy, (start[1] + end[1]) / 2 - height * dx, start[2])
    weights = np.array([1.0, math.cos(2.0 * math.atan(bulge)), 1.0])
    contours.spline_to(
        Spline(np.array([start, tip, end]), weights, np.repeat([0.0, 1.0], 3), 2), line
    )


def _spline(entity: Entity, contours: Contours) -> None:
    if entity.kind == "HELIX":
        entity = _without_subclass(entity, b"AcDbHelix")
    points = entity.points(10)
    spline = _through_fit_points(entity) if not points else _given_spline(entity, np.array(points))
    if spline is None:
        return
    x, y, z = spline.points[0].tolist()
    contours.move_to((x, y, z), entity.line)
    contours.spline_to(spline, entity.line)


def _without_subclass(entity: Entity, name: bytes) -> Entity:
    at = next(
        (k for k, tag in enumerate(entity.tags) if tag.code == 100 and tag.value == name), None
    )
    return Entity(entity.kind, entity.line, entity.tags[:at])


def _given_spline(entity: Entity, points: NDArray[np.float64]) -> Spline:
    degree = entity.integer(71, 3)
    knots = np.array([number_of(tag) for tag in entity.all(40)])
    weights = (
        np.array([number_of(tag) for tag in entity.all(41)])
        if entity.all(41)
        else np.ones(len(points))
    )
    for code, what, count in ((72, "knots", len(knots)), (73, "control points", len(points))):
        if entity.integer(code, count) != count:
            raise ShapeError(f"{count} {what}, where group {code} says {entity.integer(code, 0)}")
    if not 1 <= degree <= _MOST_DEGREE:
        raise ShapeError(f"degree {degree} is not 1 to {_MOST_DEGREE}")
    if (
        len(points) <= degree
        or len(knots) != len(points) + degree + 1
        or len(weights) != len(points)
    ):
        raise ShapeError(
            f"{len(points)} control points, {len(knots)} knots, {len(weights)} weights of degree {degree}"
        )
    if (np.diff(knots) < 0).any() or not (weights > 0).all():
        raise ShapeError("knots that fall, or weights that are not positive")
    begin, end = knots[degree], knots[len(points)]
    if not end - begin > 0 or not (weights < 1e12 * weights.min()).all():
        raise ShapeError("no range of knots, or weights too far apart")
    return clamped(Spline(points, weights, (knots - begin) / (end - begin), degree))


def clamped(spline: Spline) -> Spline:
    """The part of a NURBS from knot 0 to knot 1, with these knots repeated so that it meets its end points.

    Raises ShapeError: an inner knot is repeated more often than the degree allows, so that the curve may have a gap.
    """
    found = _clamped_at_start(_clamped_at_start(spline).reversed()).reversed()
    inner = found.knots[(found.knots > 0.0) & (found.knots < 1.0)]
    if len(inner) and np.unique(inner, return_counts=True)[1].max() > found.degree:
        raise ShapeError("a knot that is repeated too often: the curve has a gap")
    return found


def _clamped_at_start(spline: Spline) -> Spline:
    degree, knots = spline.degree, spline.knots
    values = np.column_stack([spline.points * spline.weights[:, None], spline.weights])
    for _ in range(degree - int((knots == 0.0).sum())):
        values, knots = _with_knot(values, knots, degree, 0.0)
    last = int(np.searchsorted(knots, 0.0, side="right")) - 1
    values = values[last - degree :]
    knots = np.concatenate([np.zeros(degree + 1), knots[last + 1 :]])
    return Spline(values[:, :3] / values[:, 3:], values[:, 3], knots, degree)


def _with_knot(
    values: NDArray[np.float64], knots: NDArray[np.float64], degree: int, knot: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The curve with another knot (Boehm's algorithm)."""
    span = int(np.searchsorted(knots, knot, side="right")) - 1
    old = np.arange(span - degree + 1, span + 1)
    share = (knot - knots[old]) / (knots[old + degree] - knots[old])
    between = (1.0 - share)[:, None] * values[old - 1] + share[:, None] * values[old]
    new = np.concatenate([values[: span - degree + 1], between, values[span:]])
    return new, np.insert(knots, span + 1, knot)


def _through_fit_points(entity: Entity) -> Spline | None:
    """The spline that CAD systems draw through fit points; None if they have no length.

    It is cubic, its knots are chord lengths, and its ends have the tangents given, else no curvature. A closed one
    returns to its first point, with the direction and the curvature that it has there.
    """
    points = np.array(entity.points(11)).reshape(-1, 3)
    is_closed = bool(entity.integer(70, 0) & 1) and len(points) > 1
    if is_closed:
        is_there = np.abs(points[-1] - points[0]).max() <= 1e-9 * np.ptp(points, axis=0).max()
        points = np.concatenate([points[:-1] if is_there else points, points[:1]])
    if len(points):
        points = points[np.append(True, (points[1:] != points[:-1]).any(axis=1))]
    if len(points) < 2:
        return None
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    whole = float(lengths[-1])
    if not (whole < 1e12 and (np.diff(lengths) > 1e-12 * whole).all()):
        raise ShapeError("fit points too near to each other, or too far apart")
    ends: Any = tuple(_end_condition(entity, code, whole) for code in (12, 13))
    if is_closed and not (entity.all(12) or entity.all(13)):
        ends = "periodic"
    found = make_interp_spline(lengths / whole, points, k=3, bc_type=ends)
    if is_closed:
        return clamped(Spline(found.c, np.ones(len(found.c)), found.t, 3))
    return Spline(found.c, np.ones(len(found.c)), found.t, 3)


def _end_condition(entity: Entity, code: int, length: float) -> list[tuple[int, list[float]]]:
    """The derivative (number and value) at an end of a spline through fit points, whose tangent has this code."""
    tangent = entity.point(code, (0.0, 0.0, 0.0))
    size = math.hypot(*tangent)
    if not 1e-12 < size < 1e12:
        return [(2, [0.0, 0.0, 0.0])]
    return [(1, [each / size * length for each in tangent])]


CURVES: dict[str, Callable[[Entity, Contours], None]] = {
    "LINE": _line,
    "CIRCLE": _circle,
    "ARC": _circle,
    "ELLIPSE": _ellipse,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
    "SPLINE": _spline,
    "HELIX": _spline,
}
