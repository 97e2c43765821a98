# SPDX-License-Identifier: MIT
"""Polar coordinates: `@` is a distance from the program's origin in mm or inches, `^` an angle in degrees from x. Used
by gcode/cycles and gcode/interpreter. No I/O.

After G90 both are absolute; a missing one keeps its value of the present position. After G91 they are steps of the
present distance and angle. They replace X and Y of a motion in plane XY.
"""

from __future__ import annotations

import math

from ..moves import Plane
from .block import Block
from .codes import POLAR_LETTERS, Group
from .modes import Modes

Point = tuple[float, float]


def polar_target(block: Block, modes: Modes, here: Point) -> Point | None:
    """The program coordinates x and y that the polar words of a block give; None: it has none.

    here    present x and y, as program coordinates in mm
    Raises ToolpathError: X or Y in the same block, another plane, G53, or no present angle to start from.
    """
    given = [letter for letter in POLAR_LETTERS if letter in block.values]
    if not given:
        return None
    if block.has_any("xy"):
        raise block.error(given[0], "polar coordinates and X or Y exclude each other")
    if modes.plane is not Plane.XY or block.g.get(Group.NON_MODAL) == 530:
        raise block.error(given[0], "polar coordinates need plane XY (G17), and no G53")
    radius, angle = math.hypot(*here), math.atan2(here[1], here[0])
    needs_angle = "^" not in given or not modes.absolute
    if needs_angle and radius == 0.0:
        text = "the position is the origin and has no angle: give @ and ^ after G90"
        raise block.error(given[0], text)
    if not modes.absolute:
        radius += block.values.get("@", 0.0) * modes.unit_mm
        angle += math.radians(block.values.get("^", 0.0))
    else:
        radius = block.values["@"] * modes.unit_mm if "@" in given else radius
        angle = math.radians(block.values["^"]) if "^" in given else angle
    return (radius * math.cos(angle), radius * math.sin(angle))
