# SPDX-License-Identifier: MIT
"""Contours of a drawing: lines, arcs and splines that follow each other, kept in little memory. Used by toolpath/. No
I/O.

A reader of drawings calls `move_to` and then the methods that draw, in the coordinates of the drawing; the affine map
`Contours.affine` takes them to mm. Contours may then be read in any order and direction (`steps`).

A contour takes 60 bytes, a step of it 30 to 80, so that a drawing of any size takes a few times the memory of its file.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Point = tuple[float, float, float]
"""x, y, z."""

MOST_MM = 1e9
"""Greatest coordinate of a drawing."""

FLAT_MM = 1e-9
"""An arc that is nowhere farther from its chord is a line."""

_ROUND = 1e-9
"""Share of the radius by which the radii of an ellipse may differ if a circle replaces it."""


class ShapeError(ValueError):
    """A shape has no meaning; the message has the reason. Readers add the place."""


@dataclass(frozen=True, slots=True)
class Affine:
    """The map of (x, y, z) to (x, y, z) whose matrix has the three rows `x`, `y`, `z` and the column `shift`."""

    x: Point = (1.0, 0.0, 0.0)
    y: Point = (0.0, 1.0, 0.0)
    z: Point = (0.0, 0.0, 1.0)
    shift: Point = (0.0, 0.0, 0.0)

    @staticmethod
    def plane(a: float, b: float, c: float, d: float, e: float, f: float) -> Affine:
        """The map of the plane that SVG writes as matrix(a, b, c, d, e, f)."""
        return Affine((a, c, 0.0), (b, d, 0.0), shift=(e, f, 0.0))

    @staticmethod
    def scaling(x: float, y: float, z: float) -> Affine:
        """Scale each coordinate."""
        return Affine((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))

    @staticmethod
    def rotation(angle_deg: float) -> Affine:
        """Turn the plane x, y counterclockwise. Quarters of a turn are exact."""
        quarters, rest = divmod(angle_deg, 90.0)
        c, s = math.cos(math.radians(rest)), math.sin(math.radians(rest))
        for _ in range(int(quarters) % 4 if math.isfinite(quarters) else 0):
            c, s = -s, c
        return Affine.plane(c, s, -s, c, 0.0, 0.0)

    @staticmethod
    def translation(x: float, y: float, z: float = 0.0) -> Affine:
        """Shift."""
        return Affine(shift=(x, y, z))

    def direction(self, vector: Point) -> Point:
        """The image of a vector, which is not shifted."""
        x, y, z = vector
        rows = (self.x, self.y, self.z)
        first, second, third = (row[0] * x + row[1] * y + row[2] * z for row in rows)
        return first, second, third

    def point(self, point: Point) -> Point:
        """The image of a point."""
        x, y, z = self.direction(point)
        return x + self.shift[0], y + self.shift[1], z + self.shift[2]

    def after(self, first: Affine) -> Affine:
        """The map that applies `first`, and then this one."""
        columns = [self.direction((first.x[k], first.y[k], first.z[k])) for k in range(3)]
        x, y, z = zip(*columns, strict=True)
        return Affine(x, y, z, self.point(first.shift))


@dataclass(frozen=True, eq=False, slots=True)
class Spline:
    """A NURBS, as moves.SplineMove has it: `points` of shape (n, 3), `weights` (n,), `knots` (n + degree + 1,)."""

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    knots: NDArray[np.float64]
    degree: int

    def reversed(self) -> Spline:
        """This curve from its end to its start."""
        return Spline(self.points[::-1], self.weights[::-1], 1.0 - self.knots[::-1], self.degree)


LINE, QUADRATIC, CUBIC, ARC, SPLINE, _MOVE = range(6)
"""Kinds of steps. QUADRATIC and CUBIC are Bézier curves."""

_TRIPLES = (1, 2, 3, 2, 1, 1)
"""How many points each kind has, the start not counted."""


class Step(NamedTuple):
    """A part of a contour, in mm.

    `controls` are the control points of a Bézier curve. Those of an ARC are one triple: x and y of its centre, and 1.0
    if it is counterclockwise, else -1.0; it lies in a plane z = const, and its start is its end for a whole circle.
    """

    kind: int
    line: int
    start: Point
    controls: tuple[Point, ...]
    end: Point
    spline: Spline | None

    def reversed(self) -> Step:
        """This step from its end to its start."""
        controls = self.controls[::-1]
        if self.kind == ARC:
            x, y, turns = controls[0]
            controls = ((x, y, -turns),)
        spline = self.spline.reversed() if self.spline is not None else None
        return Step(self.kind, self.line, self.end, controls, self.start, spline)

    @property
    def is_circle(self) -> bool:
        """Whether it is a whole circle."""
        return self.kind == ARC and self.start == self.end


class Contours:
    """Contours in the order in which they were drawn.

    `affine` maps everything drawn from now on; `group` is the number of contours begun from now on.
    """

    def __init__(self) -> None:
        self.affine = Affine()
        self.group = 0
        self.pen: Point = (0.0, 0.0, 0.0)  # in mm, like all stored values
        self._begin: tuple[Point, int] | None = None
        self._kinds = bytearray()
        self._lines = array("q")
        self._triples = array("d")
        self._splines: list[Spline] = []
        self._first_step = array("q")
        self._first_triple = array("q")
        self._first_spline = array("q")
        self._groups = array("q")
        self._ends: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self._first_step)

    @property
    def step_count(self) -> int:
        """Number of steps of all contours."""
        return len(self._kinds) - len(self)

    # ---- drawing: points in the coordinates of the drawing

    def move_to(self, point: Point, line: int) -> None:
        """Begin a contour. A contour without steps is not kept."""
        self.pen = self._mapped(point)
        self._begin = (self.pen, line)

    def line_to(self, end: Point, line: int) -> bool:
        """Draw a straight line; False, and no line, if it has no length."""
        return self._line_to(self._mapped(end), line)

    def bezier_to(self, controls: Sequence[Point], end: Point, line: int) -> bool:
        """Draw a Bézier curve with one or two inner control points; False, and no curve, if it has no length."""
        points = [self._mapped(point) for point in (*controls, end)]
        if all(point == self.pen for point in points):
            return False
        self._add(QUADRATIC if len(controls) == 1 else CUBIC, points, line)
        return True

    def ellipse_to(
        self,
        centre: Point,
        axes: tuple[Point, Point],
        start: float,
        sweep: float,
        end: Point | None,
        line: int,
    ) -> bool:
        """Draw the arc centre + axes[0] cos t + axes[1] sin t, from t = start over `sweep` (rad, up to a whole turn).

        The pen is at its start. `end` is its end, if known better than by the angles; None closes a whole turn.
        False, and no arc, if it has no length.
        """
        middle = self._mapped(centre)
        u, v = (self.affine.direction(axis) for axis in axes)
        stop = self.pen if end is None else self._mapped(end)
        size = max(math.hypot(*u), math.hypot(*v))
        if 2.0 * size * math.sin(min(abs(sweep), math.tau) / 4) ** 2 < FLAT_MM or (
            stop == self.pen and end is not None and abs(sweep) < math.pi
        ):
            return self._line_to(stop, line)
        if not size < MOST_MM:
            raise ShapeError(f"a radius beyond {MOST_MM:g} mm: check units and scale")
        flat = max(abs(u[2]), abs(v[2])) <= _ROUND * size
        dot = sum(p * q for p, q in zip(u, v, strict=True))
        is_round = (
            abs(math.hypot(*u) - math.hypot(*v)) <= _ROUND * size and abs(dot) <= _ROUND * size**2
        )
        if flat and is_round:
            turn = math.copysign(1.0, sweep * (u[0] * v[1] - u[1] * v[0]))
            self._add(ARC, [(middle[0], middle[1], turn), (stop[0], stop[1], self.pen[2])], line)
        else:
            self._spline_to(_ellipse(np.array([middle, u, v]), start, sweep, self.pen, stop), line)
        return True

    def spline_to(self, spline: Spline, line: int) -> bool:
        """Draw a NURBS from the pen, which is at its first point; False, and no curve, if it has no length."""
        points = np.array([self._mapped((x, y, z)) for x, y, z in spline.points.tolist()])
        if (points == points[0]).all():
            return False
        self._spline_to(Spline(points, spline.weights, spline.knots, spline.degree), line)
        return True

    def close(self, line: int) -> None:
        """Draw a line to the start of the contour, unless the pen is there. Steps after it belong to another
        contour.
        """
        if self._begin is None and len(self):
            self._line_to(self._point(self._first_triple[-1]), line)
        self._begin = (self.pen, line)

    def draw(self, step: Step) -> bool:
        """Draw a step of other contours; the pen is at its start. False if it has no length."""
        if step.kind == LINE:
            return self.line_to(step.end, step.line)
        if step.kind in (QUADRATIC, CUBIC):
            return self.bezier_to(step.controls, step.end, step.line)
        if step.spline is not None:
            return self.spline_to(step.spline, step.line)
        (x, y, _), z = step.controls[0], step.start[2]
        u = (step.start[0] - x, step.start[1] - y, 0.0)
        sweep = sweep_of(step)
        end = None if step.is_circle else step.end
        return self.ellipse_to((x, y, z), (u, (-u[1], u[0], 0.0)), 0.0, sweep, end, step.line)

    def _mapped(self, point: Point) -> Point:
        x, y, z = self.affine.point(point)
        if not (abs(x) < MOST_MM and abs(y) < MOST_MM and abs(z) < MOST_MM):
            raise ShapeError(f"a coordinate beyond ±{MOST_MM:g} mm: check units and scale")
        return x, y, z

    def _line_to(self, end: Point, line: int) -> bool:
        if end == self.pen:
            return False
        self._add(LINE, [end], line)
        return True

    def _spline_to(self, spline: Spline, line: int) -> None:
        x, y, z = spline.points[-1].tolist()
        self._add(SPLINE, [(x, y, z)], line)
        self._splines.append(spline)

    def _add(self, kind: int, points: Sequence[Point], line: int) -> None:
        if self._begin is not None:
            start, first_line = self._begin
            self._begin = None
            self._first_step.append(len(self._kinds))
            self._first_triple.append(len(self._triples) // 3)
            self._first_spline.append(len(self._splines))
            self._groups.append(self.group)
            self._append(_MOVE, [start], first_line)
        self._append(kind, points, line)
        self.pen = points[-1]

    def _append(self, kind: int, points: Sequence[Point], line: int) -> None:
        self._kinds.append(kind)
        self._lines.append(line)
        for point in points:
            self._triples.extend(point)

    # ---- reading

    def group_of(self, index: int) -> int:
        """The group of a contour."""
        return self._groups[index]

    def line_of(self, index: int) -> int:
        """The source line of the first step of a contour."""
        return self._lines[self._first_step[index] + 1]

    def length_of(self, index: int) -> int:
        """Number of steps of a contour."""
        after = self._first_step[index + 1] if index + 1 < len(self) else len(self._kinds)
        return after - self._first_step[index] - 1

    def ends(self) -> NDArray[np.float64]:
        """The start and the end of each contour, shape (contours, 2, 3), when all are drawn."""
        if self._ends is None or len(self._ends) != len(self):
            triples = np.frombuffer(self._triples, dtype=np.float64).reshape(-1, 3)
            first = np.frombuffer(self._first_triple, dtype=np.int64)
            last = np.append(first[1:], len(triples)) - 1
            self._ends = np.stack([triples[first], triples[last]], axis=1)
        return self._ends

    def highest(self) -> float:
        """The greatest z of all points and control points; curves are nowhere higher."""
        triples = np.frombuffer(self._triples, dtype=np.float64).reshape(-1, 3)
        kinds = np.frombuffer(self._kinds, dtype=np.uint8)
        is_point = np.full(len(triples), True)
        ends = np.cumsum(np.array(_TRIPLES)[kinds]) - 1
        is_point[ends[kinds == ARC] - 1] = False  # centres
        heights = [float(spline.points[:, 2].max()) for spline in self._splines]
        return max([float(triples[is_point, 2].max()), *heights])

    def corners(self, index: int) -> NDArray[np.float64]:
        """The starts of the steps of a contour, shape (steps, 3)."""
        places = self._triple_places(index)
        triples = np.frombuffer(self._triples, dtype=np.float64).reshape(-1, 3)
        return triples[places[:-1]]

    def steps(self, index: int, first: int = 0, *, backwards: bool = False) -> Iterator[Step]:
        """The steps of a contour. A closed one may begin with step `first`, and ends with the one before it."""
        places = self._triple_places(index)
        count = len(places) - 1
        spline_at = self._spline_places(index)
        order = [(first + k) % count for k in range(count)]
        for at in reversed(order) if backwards else order:
            step = self._step(self._first_step[index] + 1 + at, places[at], spline_at.get(at))
            yield step.reversed() if backwards else step

    def _triple_places(self, index: int) -> NDArray[np.int64]:
        """Index of the first number of each step, and of the end of the last one."""
        begin = self._first_step[index]
        kinds = np.frombuffer(self._kinds, dtype=np.uint8)[
            begin : begin + 1 + self.length_of(index)
        ]
        widths = np.array(_TRIPLES)[kinds]
        widths[0] = 0
        return self._first_triple[index] + np.cumsum(widths)

    def _spline_places(self, index: int) -> dict[int, int]:
        begin = self._first_step[index] + 1
        kinds = np.frombuffer(self._kinds, dtype=np.uint8)[begin : begin + self.length_of(index)]
        return {
            int(at): self._first_spline[index] + k
            for k, at in enumerate(np.flatnonzero(kinds == SPLINE))
        }

    def _step(self, step: int, place: int, spline: int | None) -> Step:
        kind = self._kinds[step]
        points = [self._point(int(place) + k) for k in range(_TRIPLES[kind] + 1)]
        found = self._splines[spline] if spline is not None else None
        return Step(kind, self._lines[step], points[0], tuple(points[1:-1]), points[-1], found)

    def _point(self, at: int) -> Point:
        x, y, z = self._triples[3 * at : 3 * at + 3]
        return x, y, z


def sweep_of(arc: Step) -> float:
    """The angle of an arc, in rad, positive if counterclockwise."""
    x, y, turns = arc.controls[0]
    if arc.is_circle:
        return turns * math.tau
    first = math.atan2(arc.start[1] - y, arc.start[0] - x)
    last = math.atan2(arc.end[1] - y, arc.end[0] - x)
    sweep = (turns * (last - first)) % math.tau
    return turns * (sweep or math.tau)


def _ellipse(
    frame: NDArray[np.float64], start: float, sweep: float, first: Point, last: Point
) -> Spline:
    """The arc of an ellipse as a NURBS of degree 2, one piece for each started quarter of a turn."""
    count = max(1, math.ceil(abs(sweep) / (math.pi / 2) - 1e-12))
    half = sweep / (2 * count)
    angles = start + half * np.arange(2 * count + 1)
    weights = np.where(np.arange(2 * count + 1) % 2, math.cos(half), 1.0)
    centre, u, v = frame
    points = centre + (np.outer(np.cos(angles), u) + np.outer(np.sin(angles), v)) / weights[:, None]
    points[0], points[-1] = first, last
    inner = np.repeat(np.arange(count + 1) / count, 2)
    return Spline(points, weights, np.concatenate([[0.0], inner, [1.0]]), 2)


def as_spline(step: Step) -> Spline:
    """A spline or Bézier curve as a NURBS."""
    if step.spline is not None:
        return step.spline
    points = np.array([step.start, *step.controls, step.end])
    n = len(points)
    return Spline(points, np.ones(n), np.repeat([0.0, 1.0], n), n - 1)


def points_within(step: Step, count: int) -> NDArray[np.float64]:
    """`count` points inside a step, evenly spread in its parameter, shape (count, 3)."""
    t = np.arange(1, count + 1) / (count + 1)
    if step.kind == LINE:
        return np.outer(1.0 - t, step.start) + np.outer(t, step.end)
    if step.kind == ARC:
        x, y, _ = step.controls[0]
        dx, dy = step.start[0] - x, step.start[1] - y
        angle = math.atan2(dy, dx) + sweep_of(step) * t
        radius = math.hypot(dx, dy)
        columns = [
            x + radius * np.cos(angle),
            y + radius * np.sin(angle),
            np.full(count, step.start[2]),
        ]
        return np.column_stack(columns)
    spline = as_spline(step)
    homogeneous = np.column_stack([spline.points * spline.weights[:, None], spline.weights])
    values = BSpline(spline.knots, homogeneous, spline.degree)(t)
    found: NDArray[np.float64] = values[:, :3] / values[:, 3:]
    return found
