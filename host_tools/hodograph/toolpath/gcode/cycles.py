# SPDX-License-Identifier: MIT
"""Canned cycles: G81 (drill), G82 (drill and dwell) and G83 (drill in pecks), as moves. Used by gcode/interpreter. No
I/O.

    G81 X Y Z R L    G82 X Y Z R P L    G83 X Y Z R Q L

For each hole the tool moves over the hole, rapidly down to R, by feed down to Z, and rapidly up again: to R after G99;
after G98 to where the series of cycles began, if that is above R. G82 dwells for P seconds at the bottom. G83 goes down
by Q at a time, up to R, and rapidly down again to 0.254 mm above the last depth. R, Z, P and Q hold until the motion
code changes. After G91 X and Y are steps, R counts from the level where the series began and Z from R; L repeats all.

A cycle that begins below R rises to R first.

In planes ZX and YZ the normal axis of the plane takes the place of Z. Drilling needs exact corners: moves of a cycle
have path mode EXACT_PATH.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..moves import (
    Blending,
    Command,
    Dwell,
    Feed,
    FeedMode,
    PathMode,
    Position,
    StraightMove,
)
from .block import Block
from .codes import g_name
from .coordinates import Coordinates, position_of
from .modes import CycleWords, Modes
from .polar import polar_target

PECK_CLEARANCE_MM = 0.254
_SAME_MM = 1e-6
"""A peck that ends this close to the bottom ends there: depths in inches are not exact in mm."""
MOST_STEPS = 100_000
"""Most holes times pecks of one block."""

_AXIS_LETTERS = "xyz"


class _Drill:
    """Collects the commands of one block, in program coordinates."""

    def __init__(self, block: Block, modes: Modes, where: Coordinates, feed: Feed) -> None:
        self.commands: list[Command] = []
        self.here = list(where.to_program(modes.position))
        self.end: Position = modes.position
        self._line = block.line.number
        self._where = where
        self._feed = feed

    def move(self, targets: dict[int, float], rapid: bool) -> None:
        """Move some axes; nothing if they are there already."""
        if all(self.here[axis] == number for axis, number in targets.items()):
            return
        for axis, number in targets.items():
            self.here[axis] = number
        self.end = self._where.to_path(position_of(self.here))
        self.commands.append(StraightMove(self._line, self.end, None if rapid else self._feed))

    def dwell(self, duration_s: float) -> None:
        self.commands.append(Dwell(self._line, duration_s))


def cycle(
    block: Block, modes: Modes, where: Coordinates, motion: int, feed: Feed
) -> tuple[list[Command], Position]:
    """The commands of a block with a canned cycle, and the path position at its end.

    Raises ToolpathError: inverse time, a word is missing or out of range, or R is below the bottom.
    """
    if modes.feed_mode is FeedMode.INVERSE_TIME:
        raise block.motion_error("a canned cycle cannot have inverse time: write G94 before it")
    first, second, normal = modes.plane.value
    drill = _Drill(block, modes, where, feed)
    words = _words(block, modes, motion, _AXIS_LETTERS[normal])
    level = drill.here[normal] if words.level is None else words.level
    words.level = level
    r = words.r if modes.absolute else words.r + level
    bottom = words.z if modes.absolute else r + words.z
    if r < bottom:
        raise block.motion_error(f"R is below {_AXIS_LETTERS[normal].upper()}: raise R")
    if drill.here[normal] < r:
        drill.move({normal: r}, rapid=True)
    level = max(level, r)
    begin = len(drill.commands)
    depths = _depths(block, motion, words, r, bottom)
    clear = r if modes.retract_to_r else level
    for hole in _holes(block, modes, drill.here, first, second, len(depths)):
        drill.move(dict(zip((first, second), hole, strict=True)), rapid=True)
        drill.move({normal: r}, rapid=True)
        _drill_hole(drill, normal, r, depths, words.p if motion == 820 else None)
        drill.move({normal: clear}, rapid=True)
    modes.cycle = words
    exact = _with_exact_path(block, modes, drill.commands[begin:])
    return drill.commands[:begin] + exact, drill.end


def _words(block: Block, modes: Modes, motion: int, bottom_letter: str) -> CycleWords:
    """The words in force: those of the block, else those that hold."""
    old = modes.cycle
    repeated = modes.motion == motion
    for letter in ("r", bottom_letter):
        if letter not in block.values and not repeated:
            raise block.motion_error(f"{g_name(motion)} needs {letter.upper()}")
    values, unit = block.values, modes.unit_mm
    words = CycleWords(
        r=values["r"] * unit if "r" in values else old.r,
        z=values[bottom_letter] * unit if bottom_letter in values else old.z,
        p=values.get("p", old.p),
        q=values["q"] * unit if "q" in values else old.q,
        level=old.level,
    )
    if motion == 820 and (words.p is None or not (repeated or "p" in values)):
        raise block.motion_error("G82 needs P, the time at the bottom in s")
    if motion == 820 and (words.p or 0.0) < 0.0:
        raise block.error("p", "P must be 0 or more")
    if motion == 830 and (words.q is None or not (repeated or "q" in values)):
        raise block.motion_error("G83 needs Q, the depth of a peck")
    if motion == 830 and (words.q or 0.0) <= 0.0:
        raise block.error("q", "Q must be more than 0")
    return words


def _depths(block: Block, motion: int, words: CycleWords, r: float, bottom: float) -> list[float]:
    """The depths at which the pecks end."""
    depths: list[float] = []
    if motion == 830 and words.q is not None:
        if (r - bottom) / words.q > MOST_STEPS:
            raise block.error("q", f"more than {MOST_STEPS} pecks: increase Q")
        pecks = math.ceil((r - bottom) / words.q)
        depths = [r - peck * words.q for peck in range(1, pecks)]
    return [*(depth for depth in depths if depth > bottom + _SAME_MM), bottom]


def _holes(
    block: Block, modes: Modes, here: list[float], first: int, second: int, pecks: int
) -> Iterator[tuple[float, float]]:
    """The places of the holes in the plane."""
    count = 1
    if "l" in block.values:
        count = block.integer("l", "L of a canned cycle", 1, MOST_STEPS // pecks or 1)
    letters = (_AXIS_LETTERS[first], _AXIS_LETTERS[second])
    given = [
        block.values[each] * modes.unit_mm if each in block.values else None for each in letters
    ]
    place = (here[first], here[second])
    for _ in range(count):
        target = polar_target(block, modes, place)
        if target is not None:
            new = list(target)
        elif modes.absolute:
            new = [
                old if number is None else number for old, number in zip(place, given, strict=True)
            ]
        else:
            new = [old + (number or 0.0) for old, number in zip(place, given, strict=True)]
        place = (new[0], new[1])
        yield place


def _drill_hole(
    drill: _Drill, normal: int, r: float, depths: list[float], dwell_s: float | None
) -> None:
    for number, depth in enumerate(depths):
        if number > 0:
            drill.move({normal: r}, rapid=True)
            drill.move({normal: depths[number - 1] + PECK_CLEARANCE_MM}, rapid=True)
        drill.move({normal: depth}, rapid=False)
    if dwell_s is not None:
        drill.dwell(dwell_s)


def _with_exact_path(block: Block, modes: Modes, commands: list[Command]) -> list[Command]:
    before = modes.path_mode or PathMode(block.line.number, Blending.CONTINUOUS)
    if before.blending is Blending.EXACT_PATH:
        return commands
    line = block.line.number
    after = PathMode(line, before.blending, before.tolerance_mm, before.fit_tolerance_mm)
    return [PathMode(line, Blending.EXACT_PATH), *commands, after]
