# SPDX-License-Identifier: MIT
"""The toolpaths of examples/toolpaths: what their script writes, and read from end to end. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from drawings import moves_in
from hodograph.toolpath.gcode import read_gcode
from hodograph.toolpath.moves import (
    AnalogOutput,
    ArcMove,
    Command,
    DigitalOutput,
    ProgramEnd,
    SplineMove,
    StraightMove,
    ToolChange,
)

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "toolpaths"
KINDS: dict[str, tuple[type[Command], ...]] = {
    "pocket": (ArcMove, StraightMove, ToolChange),
    "engraving": (ArcMove, StraightMove, SplineMove),
    "dispensing": (ArcMove, DigitalOutput, AnalogOutput),
    "surface": (StraightMove,),
    "five_axes": (StraightMove,),
}


@pytest.mark.parametrize("name", KINDS)
def test_an_example_is_what_its_script_writes(name: str) -> None:
    write = runpy.run_path(str(FOLDER / "generate.py"))[name]
    assert (FOLDER / f"{name}.ngc").read_text(encoding="utf-8").splitlines() == "\n".join(
        write()
    ).splitlines()


@pytest.mark.parametrize("name", KINDS)
def test_an_example_is_read(name: str) -> None:
    with (FOLDER / f"{name}.ngc").open(encoding="utf-8") as lines:
        found = list(read_gcode(lines, name))
    assert isinstance(found[-1], ProgramEnd)
    assert {type(command) for command in found} >= set(KINDS[name])
    assert moves_in(found)[-1].end[2] >= 5.0
