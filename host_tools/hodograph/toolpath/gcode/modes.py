# SPDX-License-Identifier: MIT
"""Modal state of the interpreter: settings that stay in force from block to block, and the path position. Used by
toolpath/gcode. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..moves import ORIGIN, Feed, FeedMode, PathMode, Plane, Position, Rotation
from .codes import AXIS_LETTERS

MM_PER_INCH = 25.4


@dataclass(slots=True)
class CycleWords:
    """Words of a canned cycle that hold until they are given again, in mm and s. `level`: position of the normal axis
    at the start of the series.
    """

    r: float = 0.0
    z: float = 0.0
    p: float | None = None
    q: float | None = None
    level: float | None = None


@dataclass(slots=True)
class SplineBuilder:
    """A NURBS between its first G5.2 and G5.3: control points as path positions."""

    line: int
    order: int
    points: list[Position]
    weights: list[float]


@dataclass(slots=True)
class Modes:
    """The state after a block. It begins as in LinuxCNC: G17 G21 G40 G49 G54 G64 G80 G90 G91.1 G94 G97 G99.

    `position` is the path position; `unit_mm` is the length of a program unit. `motion`: ten times the number of the
    active G-code (800: G80). `feed_word` is the last F as it was programmed, and `feed_unit_mm` is `unit_mm` when that
    F was programmed. `spline_handle`: control point from which a G5 without I and J continues.
    """

    position: Position = ORIGIN
    motion: int | None = 800
    plane: Plane = Plane.XY
    absolute: bool = True
    absolute_centre: bool = False
    unit_mm: float = 1.0
    feed_mode: FeedMode = FeedMode.PER_MINUTE
    feed_word: float = 0.0
    feed_unit_mm: float = 1.0
    feed: Feed | None = None
    path_mode: PathMode | None = None
    retract_to_r: bool = True
    rotation: Rotation = Rotation.STOPPED
    speed_rev_min: float = 0.0
    mist: bool = False
    flood: bool = False
    overrides: bool = True
    selected_tool: int = 0
    tool: int = 0
    uses_tool_offset: bool = False
    returned: float | None = None
    line: int = 0
    cycle: CycleWords = field(default_factory=CycleWords)
    spline: SplineBuilder | None = None
    spline_handle: tuple[float, float] | None = None

    def unit(self, letter: str) -> float:
        """Length in mm, or angle in degrees, of one unit of an axis."""
        return self.unit_mm if letter in "xyz" else 1.0

    def in_program_units(self, axis: int, value: float) -> float:
        """A coordinate in mm or degrees as the program would write it."""
        return value / self.unit(AXIS_LETTERS[axis])

    def update_feed(self) -> None:
        """Make `feed` from the last F; None: there is none, or it is 0."""
        speed = self.feed_word
        if self.feed_mode is FeedMode.PER_REVOLUTION:
            speed *= self.speed_rev_min
        if self.feed_mode is FeedMode.INVERSE_TIME or speed == 0.0:
            self.feed = None
            return
        per_revolution = self.feed_mode is FeedMode.PER_REVOLUTION
        self.feed = Feed(
            self.feed_mode,
            feed_mm_s=speed * self.feed_unit_mm / 60.0,
            feed_deg_s=speed / 60.0,
            spindle_rev_min=self.speed_rev_min if per_revolution else 0.0,
        )
