# SPDX-License-Identifier: MIT
"""Arcs and helices: G2 and G3 with their centre (I, J, K) or radius (R). Used by gcode/interpreter. No I/O.

I, J and K give the centre. The radii from it to start and end may differ by 0.1 % or by 0.0283 mm (0.00283 inch in
G20), whichever is more, and by 100 times that length at most. These are LinuxCNC's bounds: programs are rounded to few
digits. R is the radius of an arc of at most 180°; if negative, of at least 180°. P counts turns.
"""

from __future__ import annotations

import math

from ..moves import ArcMove, Feed, Plane, Position
from .block import Block
from .codes import POLAR_LETTERS
from .coordinates import Coordinates, position_of
from .modes import MM_PER_INCH, Modes

COUNTERCLOCKWISE = 30
"""Code of G3 in tenths."""
_SPIRAL_ABSOLUTE_MM = 2 * 0.01 * math.sqrt(2.0)
_SPIRAL_ABSOLUTE_INCH = 2 * 0.001 * math.sqrt(2.0)
"""Difference of the radii at start and end of an arc that is always accepted: mm, inch."""
_SPIRAL_RELATIVE = 1e-3
"""A greater difference, up to 100 times, is accepted up to this share of the radius."""
_LEAST_RADIUS_INCH = 5e-5
_SEMICIRCLE = 1e-12
"""An R arc this near to a semicircle, relative, is one."""
MOST_TURNS = 1_000_000
"""Greatest P word of an arc."""
_CENTRE_LETTERS = "ijk"
_AXIS_LETTERS = "xyz"

Point = tuple[float, float]


def arc(
    block: Block, modes: Modes, where: Coordinates, motion: int, end: Position, feed: Feed
) -> ArcMove:
    """The move of a block with G2 (motion 20) or G3 (30) to path position `end`.

    Raises ToolpathError: the words for the centre are missing or contradict each other, or no such arc exists.
    """
    first, second, _ = modes.plane.value
    start = where.to_program(modes.position)
    there_all = where.to_program(end)
    here, there = (start[first], start[second]), (there_all[first], there_all[second])
    if where.rotation_deg != 0.0 and modes.plane is not Plane.XY:
        raise block.motion_error(
            "arcs outside of plane XY need a coordinate system without rotation"
        )
    if "r" in block.values:
        centre = _centre_by_radius(block, modes, motion, here, there)
    else:
        centre = _centre_by_offsets(block, modes, here)
        _check_radii(block, modes, centre, here, there)
    turns = block.integer("p", "P of an arc", 1, MOST_TURNS) if "p" in block.values else 1
    at_centre = list(there_all)
    at_centre[first], at_centre[second] = centre
    centre_path = where.to_path(position_of(at_centre))
    return ArcMove(
        block.line.number,
        end,
        modes.plane,
        (centre_path[first], centre_path[second]),
        turns if motion == COUNTERCLOCKWISE else -turns,
        feed,
    )


def _centre_by_offsets(block: Block, modes: Modes, start: Point) -> Point:
    first, second, normal = modes.plane.value
    letters = [_CENTRE_LETTERS[first], _CENTRE_LETTERS[second]]
    given = [letter for letter in letters if letter in block.values]
    names = " and ".join(letter.upper() for letter in sorted(letters))
    if _CENTRE_LETTERS[normal] in block.values:
        text = f"the centre of an arc in plane {modes.plane.name} is {names}: remove this word"
        raise block.error(_CENTRE_LETTERS[normal], text)
    if not given:
        raise block.motion_error(f"an arc needs {names}, or R")
    if modes.absolute_centre:
        if len(given) < 2:
            raise block.motion_error(f"an arc after G90.1 needs both {names}")
        return (block.values[letters[0]] * modes.unit_mm, block.values[letters[1]] * modes.unit_mm)
    offsets = [block.values.get(letter, 0.0) * modes.unit_mm for letter in letters]
    return (start[0] + offsets[0], start[1] + offsets[1])


def _check_radii(block: Block, modes: Modes, centre: Point, start: Point, end: Point) -> None:
    radius, radius_end = math.dist(centre, start), math.dist(centre, end)
    if min(radius, radius_end) < _LEAST_RADIUS_INCH * MM_PER_INCH:
        raise block.motion_error("the arc has no radius: its centre is at its start or end")
    absolute = _SPIRAL_ABSOLUTE_MM
    if modes.unit_mm != 1.0:
        absolute = _SPIRAL_ABSOLUTE_INCH * MM_PER_INCH
    difference = abs(radius - radius_end)
    relative = difference / max(radius, radius_end)
    if difference > 100.0 * absolute or (difference > absolute and relative > _SPIRAL_RELATIVE):
        raise block.motion_error(
            f"the centre is {radius:.6g} mm from the start of the arc, but {radius_end:.6g} mm from its end: "
            "correct the end or the centre"
        )


def _centre_by_radius(block: Block, modes: Modes, motion: int, start: Point, end: Point) -> Point:
    first, second, _ = modes.plane.value
    letters = _AXIS_LETTERS[first] + _AXIS_LETTERS[second]
    if block.has_any(_CENTRE_LETTERS):
        raise block.error("r", "an arc has R or a centre, not both: remove one")
    if not block.has_any(letters + POLAR_LETTERS):
        names = " or ".join(letter.upper() for letter in sorted(letters))
        raise block.error("r", f"an arc with R needs an end: give {names}")
    if start == end:
        raise block.error("r", "an arc with R cannot end where it starts: give its centre")
    radius = block.values["r"] * modes.unit_mm
    half = math.dist(start, end) / 2.0
    size = abs(radius)
    if half - size > _LEAST_RADIUS_INCH * MM_PER_INCH or size == 0.0:
        raise block.error("r", f"R is too small: half the chord is {half:.6g} mm")
    if half > size * (1.0 - _SEMICIRCLE):
        half = size
    direction = math.atan2(end[1] - start[1], end[0] - start[0])
    is_right = (motion == COUNTERCLOCKWISE) == (radius < 0.0)
    direction += -math.pi / 2.0 if is_right else math.pi / 2.0
    offset = size * math.cos(math.asin(half / size))
    middle = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0)
    return (middle[0] + offset * math.cos(direction), middle[1] + offset * math.sin(direction))
