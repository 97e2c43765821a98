# SPDX-License-Identifier: MIT
"""Splines of plane XY: G5 (cubic Bézier), G5.1 (quadratic Bézier), G5.2 with G5.3 (NURBS). Used by gcode/interpreter.
No I/O.

    G5 X Y I J P Q   control points: start, start + (I, J), end + (P, Q), end; without I and J a G5 continues the G5
                     before it without a corner
    G5.1 X Y I J     control points: start, start + (I, J), end
    G5.2 X Y P L     a control point with weight P; L is the order (degree + 1) of the whole curve, 3 if not given;
                     the start is the first control point, with weight 1, or P of a first G5.2 without X and Y
    G5.3             the end of the curve; its knots are uniform between clamped ends

Z, A, B and C cannot move with a spline.
"""

from __future__ import annotations

from ..moves import Feed, FeedMode, Plane, Position, SplineMove
from .block import Block
from .codes import g_name
from .coordinates import Coordinates
from .modes import Modes, SplineBuilder

NURBS = 52
MOST_ORDER = 16


def knots_of(count: int, order: int) -> tuple[float, ...]:
    """Clamped uniform knots from 0 to 1 of `count` control points."""
    inner = count - order + 1
    middle = tuple(step / inner for step in range(1, inner))
    return (0.0,) * order + middle + (1.0,) * order


def bezier(
    block: Block, modes: Modes, where: Coordinates, motion: int, end: Position, feed: Feed
) -> SplineMove:
    """The move of a block with G5 (motion 50) or G5.1 (51) to path position `end`.

    Raises ToolpathError: another plane, or words are missing.
    """
    _check_plane(block, modes)
    start = where.to_program(modes.position)
    if motion == 50:
        handle = _first_handle(block, modes)
        for letter in "pq":
            if letter not in block.values:
                raise block.motion_error(f"G5 needs {letter.upper()}")
        p, q = block.values["p"] * modes.unit_mm, block.values["q"] * modes.unit_mm
        modes.spline_handle = (-p, -q)
        inner = [_moved(start, *handle), _moved(where.to_program(end), p, q)]
    else:
        for letter in "ij":
            if letter not in block.values:
                raise block.motion_error(f"G5.1 needs {letter.upper()}")
        i, j = block.values["i"] * modes.unit_mm, block.values["j"] * modes.unit_mm
        inner = [_moved(start, i, j)]
    points = (modes.position, *map(where.to_path, inner), end)
    count = len(points)
    return SplineMove(
        block.line.number, points, (1.0,) * count, knots_of(count, count), count - 1, feed
    )


def _check_plane(block: Block, modes: Modes) -> None:
    if modes.plane is not Plane.XY:
        raise block.motion_error("splines need plane XY: write G17 before them")


def _first_handle(block: Block, modes: Modes) -> tuple[float, float]:
    given = [letter for letter in "ij" if letter in block.values]
    if len(given) == 2:
        return (block.values["i"] * modes.unit_mm, block.values["j"] * modes.unit_mm)
    if given:
        raise block.error(given[0], "G5 needs I and J, or neither")
    if modes.spline_handle is None:
        raise block.motion_error("the first G5 needs I and J")
    return modes.spline_handle


def _moved(point: Position, x: float, y: float) -> Position:
    return (point[0] + x, point[1] + y, *point[2:])


def add_control_point(block: Block, modes: Modes, end: Position) -> None:
    """Execute a block with G5.2, whose control point is path position `end`.

    Raises ToolpathError: another plane, inverse time, steps (G91), or words are missing or out of range.
    """
    _check_plane(block, modes)
    if not modes.absolute:
        raise block.motion_error("G5.2 needs absolute coordinates: write G90 before it")
    if modes.feed_mode is FeedMode.INVERSE_TIME:
        raise block.motion_error("G5.2 cannot have inverse time: write G94 before it")
    has_point = block.has_any("xy")
    if has_point and not ("x" in block.values and "y" in block.values):
        raise block.motion_error("G5.2 needs both X and Y")
    if modes.spline is None:
        weight = 1.0 if has_point else _weight(block)
        modes.spline = SplineBuilder(block.line.number, 3, [modes.position], [weight])
    elif not has_point:
        raise block.motion_error("only the first G5.2 can be without X and Y")
    if "l" in block.values:
        modes.spline.order = block.integer("l", "L of G5.2", 3, MOST_ORDER)
    if has_point:
        modes.spline.points.append(end)
        modes.spline.weights.append(_weight(block))


def _weight(block: Block) -> float:
    weight = block.values.get("p", 0.0)
    if weight <= 0.0:
        raise block.error("p", "G5.2 needs a weight P above 0")
    return weight


def finish_nurbs(block: Block, modes: Modes, feed: Feed) -> SplineMove:
    """Execute a block with G5.3: the move that the blocks with G5.2 before it describe.

    Raises ToolpathError: no G5.2 before it, or too few control points.
    """
    spline = modes.spline
    if spline is None:
        raise block.error("g53", "G5.3 without G5.2 before it")
    count = len(spline.points)
    if count < spline.order:
        text = f"a curve of order {spline.order} needs as many control points, but has {count}"
        raise block.error("g53", f"{text}: add points or lower L")
    modes.spline = None
    return SplineMove(
        spline.line,
        tuple(spline.points),
        tuple(spline.weights),
        knots_of(count, spline.order),
        spline.order - 1,
        feed,
    )


def check_inside_nurbs(block: Block) -> None:
    """Between G5.2 and G5.3 a block may only have control points: other words would be lost or change the points.
    Raises ToolpathError: it has other words.
    """
    allowed = {NURBS, 53}
    for code in block.g.values():
        if code not in allowed:
            raise block.error(
                f"g{code}",
                f"{g_name(code)} between G5.2 and G5.3: move it before or after the curve",
            )
    for code in block.m.values():
        raise block.error(
            f"m{code}", f"M{code} between G5.2 and G5.3: move it before or after the curve"
        )
    for letter in "fst":
        if letter in block.values:
            text = f"{letter.upper()} between G5.2 and G5.3: move it before or after the curve"
            raise block.error(letter, text)
