# SPDX-License-Identifier: MIT
"""Moves and machine commands of a toolpath, in the order in which they happen. Used by many modules of host_tools: all
toolpath readers, jobs, streaming. No I/O.

A toolpath is a sequence of the classes below (`Command`). All are frozen. Each carries `line`, the number of the source
line that it comes from (1-based; 0 if the source has no lines).

Positions are path positions of the controlled point: tuples of six numbers (x, y, z in mm; a, b, c in degrees). They
contain all offsets of the program: a point of a program is the same number here only while every offset is 0. They do
not contain the work offset of the machine file (`WorkFrame`). An axis that a program does not name keeps its number of
the start position. A move starts where the one before it ends; the first one starts at the start position given to its
reader.

Speeds are in mm/s, times in s, rotational speeds in rev/min.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from ..events import OutputValues

AXES = "xyzabc"
"""Names of the axes, in the order of a `Position`."""

Position = tuple[float, float, float, float, float, float]
"""x, y, z in mm; a, b, c in degrees."""

ORIGIN: Position = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class WorkFrame:
    """Where a toolpath lies in the machine.

    offset  machine position of path position 0: `[work] offset_mm` of the machine file
    start   path position at which the toolpath starts: `[work] start_mm`
    """

    offset: Position = ORIGIN
    start: Position = ORIGIN


class Plane(enum.Enum):
    """The plane of an arc; the value holds the indices of its first, second and normal axis.

    The three axes are a right-handed system, so counterclockwise is seen from the positive end of the normal axis.
    """

    XY = (0, 1, 2)
    ZX = (2, 0, 1)
    YZ = (1, 2, 0)


class FeedMode(enum.Enum):
    """The mode in which the feed of a move was programmed."""

    PER_MINUTE = "length per minute"
    INVERSE_TIME = "duration of the move"
    PER_REVOLUTION = "length per revolution of the spindle"


@dataclass(frozen=True, slots=True)
class Feed:
    """The feed of a move.

    In mode INVERSE_TIME `duration_s` is the time of the whole move and both speeds are 0. In the other modes
    `duration_s` is 0 and `feed_mm_s` is the speed along the path; `feed_deg_s` takes its place in a move of a, b and c
    alone. Mode PER_REVOLUTION holds the speeds at `spindle_rev_min`, which is 0 in the other modes.
    """

    mode: FeedMode
    feed_mm_s: float = 0.0
    feed_deg_s: float = 0.0
    duration_s: float = 0.0
    spindle_rev_min: float = 0.0


@dataclass(frozen=True, slots=True)
class StraightMove:
    """A straight move to `end`; `feed` is None for a rapid move."""

    line: int
    end: Position
    feed: Feed | None


@dataclass(frozen=True, slots=True)
class ArcMove:
    """A circular arc in `plane`, or a helix if the normal axis moves too; a, b and c follow in proportion.

    `centre` holds the first and second coordinate of the plane, in mm. `turns` is positive if counterclockwise; its
    magnitude counts full turns, a started one included: 1 is an arc of at most 360°. Start and end are the same point
    of the plane only for whole turns. The radii at start and end may differ slightly (by what the format of the source
    allows); then the radius changes in proportion to the angle.
    """

    line: int
    end: Position
    plane: Plane
    centre: tuple[float, float]
    turns: int
    feed: Feed


@dataclass(frozen=True, slots=True)
class SplineMove:
    """A non-uniform rational B-spline (NURBS) of x, y and z.

    `points` are the control points, of which the first is the start and the last the end; `weights` are positive, one
    for each point. `knots` rises from 0 to 1 and has len(points) + degree + 1 numbers; the first and last degree + 1
    are equal, so that the curve meets its end points. A Bézier curve is the case of degree + 1 points.
    """

    line: int
    points: tuple[Position, ...]
    weights: tuple[float, ...]
    knots: tuple[float, ...]
    degree: int
    feed: Feed

    @property
    def end(self) -> Position:
        """The end of the move."""
        return self.points[-1]


class Blending(enum.Enum):
    """How the path may differ from the programmed moves at their joints."""

    EXACT_STOP = "stop at the end of every move"
    EXACT_PATH = "follow the moves exactly; stop only where their direction changes"
    CONTINUOUS = "round corners within a tolerance"


@dataclass(frozen=True, slots=True)
class PathMode:
    """Path blending of the moves that follow.

    Only CONTINUOUS has tolerances. `tolerance_mm` bounds the deviation of the path; None leaves it to the machine.
    `fit_tolerance_mm` bounds the deviation of a curve that replaces several moves; None is the same as `tolerance_mm`.
    """

    line: int
    blending: Blending
    tolerance_mm: float | None = None
    fit_tolerance_mm: float | None = None


@dataclass(frozen=True, slots=True)
class Dwell:
    """Standstill for `duration_s`."""

    line: int
    duration_s: float


class Rotation(enum.Enum):
    """Rotation of the spindle; clockwise as seen from the spindle towards the part."""

    STOPPED = 0
    CLOCKWISE = 1
    COUNTERCLOCKWISE = -1


@dataclass(frozen=True, slots=True)
class Spindle:
    """State of the spindle from here on. The speed is a setting, which also holds while STOPPED."""

    line: int
    rotation: Rotation
    speed_rev_min: float


@dataclass(frozen=True, slots=True)
class Coolant:
    """State of both coolants from here on."""

    line: int
    mist: bool
    flood: bool


@dataclass(frozen=True, slots=True)
class ToolSelect:
    """The changer prepares tool `tool`; 0 is none."""

    line: int
    tool: int


@dataclass(frozen=True, slots=True)
class ToolChange:
    """Tool `tool` comes into the spindle; 0 is none."""

    line: int
    tool: int


@dataclass(frozen=True, slots=True)
class ToolOffset:
    """The offset of tool `tool` is added from here on, but there is no table that has it: 0 is added."""

    line: int
    tool: int


@dataclass(frozen=True, slots=True)
class DigitalOutput:
    """Output number `output` goes on or off: with the start of the next move if `synchronised`, else at once."""

    line: int
    output: int
    on: bool
    synchronised: bool


@dataclass(frozen=True, slots=True)
class AnalogOutput:
    """Output number `output` goes to `value`: with the start of the next move if `synchronised`, else at once."""

    line: int
    output: int
    value: float
    synchronised: bool


@dataclass(frozen=True, slots=True)
class OverrideSwitch:
    """Whether the operator's overrides of feed and spindle speed are in effect from here on."""

    line: int
    enabled: bool


@dataclass(frozen=True, slots=True)
class Message:
    """A text for the operator."""

    line: int
    text: str


@dataclass(frozen=True, slots=True)
class ProgramStop:
    """The program pauses until the operator resumes it; if `optional`, only while optional stops are on."""

    line: int
    optional: bool


@dataclass(frozen=True, slots=True)
class ProgramEnd:
    """The program ends. It is the last command of a toolpath."""

    line: int


Move = StraightMove | ArcMove | SplineMove
"""A command that moves the axes; each has `line`, `end` and `feed`."""


@dataclass(frozen=True, slots=True)
class SwitchedAtRest:
    """The outputs of the machine from here on, at a rest where no section's program switches them. No reader makes it:
    job_outputs does, after the commands that switch outputs.
    """

    line: int
    values: OutputValues


Command = (
    Move
    | PathMode
    | Dwell
    | Spindle
    | Coolant
    | ToolSelect
    | ToolChange
    | ToolOffset
    | DigitalOutput
    | AnalogOutput
    | OverrideSwitch
    | Message
    | ProgramStop
    | ProgramEnd
    | SwitchedAtRest
)
"""One element of a toolpath."""
