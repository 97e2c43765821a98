# SPDX-License-Identifier: MIT
"""Extra axes of a path in space: C2 quintics in the parameter of its segments; docs/theory/spatial-splines.md 8. Used
by spatial/build, pipeline and fit/turning. No I/O.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...fixed_point import MM_PER_Q40, Q40_PER_MM
from ..bernstein import Real
from ..nodal import control_polygon_guide
from .curve import SpatialPHSpline

_MOST_SLOPE, _MOST_BEND = 1.5, 4.0
"""Greatest slope at a node times the longer span next to it, and greatest second derivative times the square of that
span, over the greater step.
"""

_REPEATED = 1e-9

_SHORT_MM = 1e-4
"""Spans shorter than this have rounded coefficients, as in a program."""


def with_extra_axes(curve: SpatialPHSpline, values: Real) -> SpatialPHSpline:
    """The curve with axes that have `values` (nodes, E) at its joints; mm, or degrees of a rotary axis.

    curve  not yet split: one segment for each span
    values of an open path at its N + 1 joints, of a closed one at the N joints without the repeated first

    Slopes and second derivatives by arc length at the nodes are those of a C2 cubic spline over arc length. They are
    limited where the axis would overshoot, in a short span next to a long one. A quintic for each span meets both. An
    axis that is linear in arc length stays exactly linear.
    """
    value = np.vstack((values, values[:1])) if curve.closed else np.asarray(values)
    slope, bend = _by_arc_length(curve.segment_starts_mm, value, curve.closed)
    return replace(curve, extra=quintics_by_arc_length(curve, value, slope, bend))


def quintics_by_arc_length(curve: SpatialPHSpline, value: Real, slope: Real, bend: Real) -> Real:
    """Bezier coefficients (N, E, 6) of axes with values, slopes and second derivatives (N + 1, E) by arc length at the
    joints of a curve.

    In spans below _SHORT_MM they are rounded as in a program: in a span of 10 nm the rounding alone makes a third
    derivative of 10^5 deg/mm^3, which a feed plan has to include.
    """
    c = curve.speed_coefficients
    begin = _by_parameter(slope[:-1], bend[:-1], c[:, 0], 4.0 * (c[:, 1] - c[:, 0]))
    end = _by_parameter(slope[1:], bend[1:], c[:, 4], 4.0 * (c[:, 4] - c[:, 3]))
    extra = _hermite(value[:-1], value[1:], begin, end)
    short = np.diff(curve.segment_starts_mm) < _SHORT_MM
    extra[short] = np.rint(extra[short] * Q40_PER_MM) * MM_PER_Q40
    return extra


def with_standing_axes(curve: SpatialPHSpline, count: int) -> SpatialPHSpline:
    """The curve with `count` more extra axes, which stand at 0."""
    if count == 0:
        return curve
    still = np.zeros((curve.segment_count, count, 6))
    return replace(
        curve, extra=np.concatenate((curve.extra, still), axis=1) if curve.extra_axes else still
    )


def nodal_values(values: Real, closed: bool) -> Real:
    """Values (nodes, E) at the joints of a curve from those (n, E) at the points of its control polygon."""
    columns = (np.asarray(one, dtype=np.complex128) for one in values.T)
    nodes = [control_polygon_guide(one, closed).nodal_points.real for one in columns]
    return np.stack(nodes, axis=1)[:-1] if closed else np.stack(nodes, axis=1)


def require_moving(points: Real, values: Real, what: str) -> None:
    """Raises InputError: extra axes (n, E) differ between two consecutive points (n, 3) that are the same."""
    same = ~np.diff(points, axis=0).any(axis=1) & np.diff(values, axis=0).any(axis=1)
    if same.any():
        k = int(np.argmax(same))
        raise InputError(
            f"{what} {k + 1} has the x, y and z of {what} {k}, while other axes move: end the path there; axes that "
            "turn alone have a path of their own"
        )


def without_tail(values: Real, count: int, what: str) -> Real:
    """The first `count` rows of extra axes: those of the points that a closed path keeps.

    The points after them repeat the first ones in x, y and z. Raises InputError: an extra axis does not repeat its
    values there.
    """
    tail = len(values) - count
    apart = np.abs(values[count:] - values[:tail])
    if apart.size and apart.max() > _REPEATED:
        point, axis = (int(k) for k in np.unravel_index(int(apart.argmax()), apart.shape))
        raise InputError(
            f"{what} {count + point} repeats {what} {point} in x, y and z, but number {axis + 4} is "
            f"{values[count + point, axis]:g}, not {values[point, axis]:g}: on a closed path every axis comes back; "
            "set closed = false to end there"
        )
    return values[:count]


def _by_arc_length(s_mm: Real, value: Real, closed: bool) -> tuple[Real, Real]:
    """First and second derivatives (nodes, E) by arc length."""
    # Here, since the import of scipy takes longer than making most splines.
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(s_mm, value, bc_type="periodic" if closed else "not-a-knot")
    span, step = np.diff(s_mm)[:, None], np.abs(np.diff(value, axis=0))
    longer, greater = (_beside(one, closed) for one in (span, step))
    most_slope, most_bend = _MOST_SLOPE * greater / longer, _MOST_BEND * greater / longer**2
    return (
        np.clip(spline(s_mm, 1), -most_slope, most_slope),
        np.clip(spline(s_mm, 2), -most_bend, most_bend),
    )


def _beside(spans: Real, closed: bool) -> Real:
    """The greater of the two values (N, …) on both sides of each node (N + 1, …)."""
    before = np.concatenate((spans[-1:] if closed else spans[:1], spans))
    after = np.concatenate((spans, spans[:1] if closed else spans[-1:]))
    return np.asarray(np.maximum(before, after))


def _by_parameter(slope: Real, bend: Real, speed: Real, growth: Real) -> tuple[Real, Real]:
    """First and second derivatives by xi from those by arc length, sigma and its derivative."""
    speed, growth = speed[:, None], growth[:, None]
    return slope * speed, bend * speed**2 + slope * growth


def _hermite(first: Real, last: Real, begin: tuple[Real, Real], end: tuple[Real, Real]) -> Real:
    """Bezier coefficients (N, E, 6) of quintics with values and two derivatives (N, E) at both ends."""
    before, after = first + begin[0] / 5.0, last - end[0] / 5.0
    inner = begin[1] / 20.0 + 2.0 * before - first, end[1] / 20.0 + 2.0 * after - last
    return np.stack((first, before, *inner, after, last), axis=-1)
