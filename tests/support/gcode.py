# SPDX-License-Identifier: MIT
"""Short programs of G-code and what the reader makes of them. Used by the tests of the G-code reader. No I/O."""

from __future__ import annotations

from typing import Any

import pytest

from hodograph.errors import ToolpathError
from hodograph.toolpath.gcode import Options, read_gcode
from hodograph.toolpath.moves import (
    ArcMove,
    Command,
    Position,
    ProgramEnd,
    SplineMove,
    StraightMove,
)

FILE = "part.ngc"


def commands_of(text: str, **options: Any) -> list[Command]:
    """All commands but the end of the program."""
    found = list(read_gcode(text.splitlines(keepends=True), FILE, Options(**options)))
    assert isinstance(found[-1], ProgramEnd)
    return found[:-1]


def moves_of(text: str, **options: Any) -> list[StraightMove | ArcMove | SplineMove]:
    """All moves."""
    kinds = StraightMove | ArcMove | SplineMove
    return [each for each in commands_of(text, **options) if isinstance(each, kinds)]


def ends_of(text: str, **options: Any) -> list[Position]:
    """Where the moves end."""
    return [move.end for move in moves_of(text, **options)]


def last(text: str, **options: Any) -> Position:
    """Where the last move ends."""
    return ends_of(text, **options)[-1]


def xyz_of(text: str, **options: Any) -> list[tuple[float, ...]]:
    """x, y and z of the ends of the moves."""
    return [end[:3] for end in ends_of(text, **options)]


def error_of(text: str, **options: Any) -> ToolpathError:
    """The refusal of a program."""
    with pytest.raises(ToolpathError) as refusal:
        commands_of(text, **options)
    error = refusal.value
    assert str(error).startswith(f"{FILE}:{error.line}:{error.column}: ")
    assert "\n" not in str(error)
    return error


def place_of(text: str, **options: Any) -> tuple[int, int]:
    """Line and column of the refusal of a program."""
    error = error_of(text, **options)
    return (error.line, error.column)
