# SPDX-License-Identifier: MIT
"""Options of the G-code reader: the machine's tables, and the bounds of loops and subroutines. Used by toolpath/files
and toolpath/gcode. No I/O.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..moves import ORIGIN, Position
from .block import Block
from .coordinates import G28_POINT, G30_POINT, SYSTEMS, origin_parameter
from .parameters import Parameters

MOST_JUMPS = 1_000_000


@dataclass(frozen=True)
class Options:
    """Settings of the machine at the start of a program; lengths in mm, angles in degrees.

    work            machine position of path position 0: the work offset of the machine file
    start           path position at which the program starts
    origins         origins of coordinate systems 1 (G54) to 9 (G59.3), as path positions; those not given are 0
    g28, g30        reference points, as machine positions
    tools           offset of each tool by its number. None: every tool has offset 0, so that programmed positions are
                    those of the tool's tip. With a table, a tool that is not in it is refused.
    feed_mm_s       feed of moves while no F is in force; in degrees per second where rotary axes move alone. None:
                    moves without an F in force are refused. job.py replaces the feeds that F gives, if requested.
    block_delete    whether lines that begin with "/" are left out
    optional_stops  whether M1 stops; False: it is left out
    most_jumps      most subroutine calls and backward jumps of loops; a program with more is refused, since its loops
                    may be endless
    fast_path       whether plain straight moves are read without the general interpreter. The moves are the same.
    """

    work: Position = ORIGIN
    start: Position = ORIGIN
    origins: Mapping[int, Position] = field(default_factory=dict)
    g28: Position = ORIGIN
    g30: Position = ORIGIN
    tools: Mapping[int, Position] | None = None
    feed_mm_s: float | None = None
    block_delete: bool = False
    optional_stops: bool = True
    most_jumps: int = MOST_JUMPS
    fast_path: bool = True

    def __post_init__(self) -> None:
        """Check the numbers of the coordinate systems."""
        if any(not 1 <= system <= SYSTEMS for system in self.origins):
            raise ValueError(f"coordinate systems have numbers 1 to {SYSTEMS}")

    def store_tables(self, parameters: Parameters) -> None:
        """Write origins and reference points where a program reads them."""
        places = {origin_parameter(system): point for system, point in self.origins.items()}
        places |= {G28_POINT: self.g28, G30_POINT: self.g30}
        for first, point in places.items():
            for axis, number in enumerate(point):
                parameters.set(first + axis, number)

    def tool_offset(self, block: Block, word: str, tool: int) -> Position:
        """The offset of a tool. Raises ToolpathError, at `word` of `block`, if the table does not have it."""
        if self.tools is None or tool == 0:
            return ORIGIN
        if tool not in self.tools:
            raise block.error(word, f"tool {tool} is not in the tool table: add it")
        return self.tools[tool]
