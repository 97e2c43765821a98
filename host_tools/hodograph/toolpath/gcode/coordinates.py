# SPDX-License-Identifier: MIT
"""Coordinate systems: from the numbers of a program to path positions and back. Used by toolpath/gcode. No I/O; changes
its own object and the parameters that it was given.

    path position    = R (program position + G92 offset) + origin of the coordinate system + tool offset
    machine position = path position + work offset of the machine file

Only G53, G28, G30 and their parameters have machine positions; `reference` and `store_reference` convert them. R turns
x and y about z by the rotation of the coordinate system (G10 L2 R). Everything here is in mm and degrees; the
interpreter converts units. The tables are in parameters with the numbers of RS274/NGC, so that a program can read them:

    5161 to 5166                    reference point of G28, a machine position
    5181 to 5186                    reference point of G30, a machine position
    5210                            whether the G92 offset is active
    5211 to 5216                    G92 offset
    5220                            number n of the active coordinate system, 1 to 9
    5201 + 20 n to 5206 + 20 n      origin of system n
    5210 + 20 n                     rotation of system n

A value that a program writes there takes effect when the system is next selected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from ..moves import AXES, ORIGIN, Position
from .parameters import Parameters

SYSTEMS = 9
"""Coordinate systems G54 to G59.3, numbered from 1."""

G28_POINT = 5161
G30_POINT = 5181
G92_ACTIVE = 5210
G92_OFFSET = 5211
SYSTEM_NUMBER = 5220


def position_of(numbers: Iterable[float]) -> Position:
    """Six numbers as a position."""
    x, y, z, a, b, c = numbers
    return (x, y, z, a, b, c)


def plus(left: Position, right: Position) -> Position:
    """The sum, axis by axis."""
    return position_of(p + q for p, q in zip(left, right, strict=True))


def minus(left: Position, right: Position) -> Position:
    """The difference, axis by axis."""
    return position_of(p - q for p, q in zip(left, right, strict=True))


class Coordinates:
    """The active coordinate system, the G92 offset and the tool offset.

    `shift` is the sum of all offsets of the program; without a rotation a path position is a program position plus
    `shift`. `work` is the work offset of the machine file.
    """

    def __init__(self, parameters: Parameters, work: Position = ORIGIN) -> None:
        """System 1 (G54), as the parameters have it; no tool offset."""
        self._parameters = parameters
        self.work = work
        self.system = 1
        self.origin = ORIGIN
        self.rotation_deg = 0.0
        self.g92 = ORIGIN
        self.tool = ORIGIN
        self.shift = ORIGIN
        if parameters.number(G92_ACTIVE):
            self.g92 = self.stored(G92_OFFSET)
        self.select(1)

    def stored(self, first: int) -> Position:
        """Six parameters from number `first` on."""
        return position_of(self._parameters.number(first + axis) for axis in range(len(AXES)))

    def store(self, first: int, position: Position) -> None:
        """Set six parameters from number `first` on."""
        for axis, number in enumerate(position):
            self._parameters.set(first + axis, number)

    def reference(self, first: int) -> Position:
        """The path position of a reference point, whose parameters begin at number `first`."""
        return minus(self.stored(first), self.work)

    def store_reference(self, first: int, path: Position) -> None:
        """Make a path position a reference point."""
        self.store(first, plus(path, self.work))

    def select(self, system: int) -> None:
        """Make a coordinate system the active one, with its origin and rotation."""
        self.system = system
        self.origin = self.stored(origin_parameter(system))
        self.rotation_deg = self._parameters.number(rotation_parameter(system))
        self._parameters.set(SYSTEM_NUMBER, float(system))
        self._add_up()

    def _add_up(self) -> None:
        self.shift = plus(plus(self.g92, self.origin), self.tool)

    def set_tool(self, offset: Position) -> None:
        """Use a tool offset."""
        self.tool = offset
        self._add_up()

    def set_g92(self, offset: Position) -> None:
        """Use and store a G92 offset."""
        self.store(G92_OFFSET, offset)
        self._parameters.set(G92_ACTIVE, 1.0)
        self.g92 = offset
        self._add_up()

    def clear_g92(self, forget: bool) -> None:
        """Use no G92 offset; `forget` clears the stored one too."""
        self._parameters.set(G92_ACTIVE, 0.0)
        if forget:
            self.store(G92_OFFSET, ORIGIN)
        self.g92 = ORIGIN
        self._add_up()

    def restore_g92(self) -> None:
        """Use the stored G92 offset."""
        self.set_g92(self.stored(G92_OFFSET))

    def to_path(self, program: Position) -> Position:
        """The path position of a program position."""
        if self.rotation_deg == 0.0:
            return plus(program, self.shift)
        turned = _turned(plus(program, self.g92), self.rotation_deg)
        return plus(plus(turned, self.origin), self.tool)

    def to_program(self, path: Position) -> Position:
        """The program position of a path position."""
        if self.rotation_deg == 0.0:
            return minus(path, self.shift)
        from_origin = minus(minus(path, self.tool), self.origin)
        return minus(_turned(from_origin, -self.rotation_deg), self.g92)

    def set_origin(self, system: int, change: Callable[[int, float], float]) -> None:
        """Store an origin (G10 L2): `change` gives each number of it from its axis and the old one."""
        first = origin_parameter(system)
        numbers = [change(axis, old) for axis, old in enumerate(self.stored(first))]
        self.store(first, position_of(numbers))
        self._reselect(system)

    def set_rotation(self, system: int, angle_deg: float) -> None:
        """Store a rotation (G10 L2 R)."""
        self._parameters.set(rotation_parameter(system), angle_deg)
        self._reselect(system)

    def set_origin_here(self, system: int, path: Position, want: dict[int, float]) -> None:
        """Store the origin with which `path` has these program coordinates, by axis (G10 L20)."""
        first = origin_parameter(system)
        angle = self._parameters.number(rotation_parameter(system))
        from_tool = minus(path, self.tool)
        turned = _turned(minus(from_tool, self.stored(first)), -angle)
        program = list(minus(turned, self.g92))
        for axis, number in want.items():
            program[axis] = number
        self.store(first, minus(from_tool, _turned(plus(position_of(program), self.g92), angle)))
        self._reselect(system)

    def _reselect(self, system: int) -> None:
        if system == self.system:
            self.select(system)


def origin_parameter(system: int) -> int:
    """Number of the parameter with the x of a system's origin; five more follow."""
    return 5201 + 20 * system


def rotation_parameter(system: int) -> int:
    """Number of the parameter with the rotation of a system, in degrees."""
    return 5210 + 20 * system


def _turned(position: Position, angle_deg: float) -> Position:
    if angle_deg == 0.0:
        return position
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    x, y, z, a, b, c = position
    return (x * cosine - y * sine, x * sine + y * cosine, z, a, b, c)
