# SPDX-License-Identifier: MIT
"""The reader of streamed toolpaths: the place of an output on the path, how far it reads ahead before a section begins,
and one note for each kind of command that the machine does not execute. Run by pytest; writes to temporary folders.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from hodograph.config import Machine, load_machine
from hodograph.job import toolpath_commands
from hodograph.stream import reading
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.moves import Command, Move

MACHINES = Path(__file__).parents[3] / "examples" / "machines"


def reader(tmp_path: Path, machine: str, text: str) -> StreamReader:
    file = tmp_path / "job.ngc"
    file.write_text(f"G21 G17 G90 G94 G64 P0.02\nG1 F600\n{text}\nM30\n")
    return StreamReader(file, load_machine(MACHINES / machine), 0.01, ReadOptions())


def read(found: StreamReader) -> None:
    for section in found.sections():
        for _ in section.blocks:
            pass


@pytest.mark.parametrize(
    ("word", "places"),
    [
        ("M62 P0", [10.0]),
        ("M67 E0 Q5", [10.0, 20.0]),  # the channel of S: the end of the program switches it off
    ],
)
def test_an_output_has_its_place(tmp_path: Path, word: str, places: list[float]) -> None:
    found = reader(tmp_path, "dispenser.toml", f"G1 X10\n{word}\nG1 X20")
    events = [block.events for section in found.sections() for block in section.blocks]
    assert [round(event["place"] * 2.0**-40, 6) for event in events[0]] == places
    assert not found.notes


@pytest.mark.parametrize(("machine", "moves"), [("mill.toml", 1), ("dispenser.toml", 3)])
def test_before_a_section_begins_it_is_read_up_to_the_next_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, machine: str, moves: int
) -> None:
    """Only if the machine has outputs: these may stand between both. A move that is too short for a section of its own
    does not end this search.
    """
    found = reader(tmp_path, machine, "G1 X10\nM65 P0\nG4 P1\nG1 X10.0001\nM62 P0\nG1 X20")
    read_moves: list[Move] = []

    def counted(
        file: Path, machine: Machine, options: ReadOptions, notes: list[str]
    ) -> Iterator[Command]:
        for command in toolpath_commands(file, machine, options, notes):
            if isinstance(command, Move):
                read_moves.append(command)
            yield command

    monkeypatch.setattr(reading, "toolpath_commands", counted)
    next(next(found.sections()).blocks)
    assert len(read_moves) == moves


def test_what_the_machine_does_not_have_is_noted_once(tmp_path: Path) -> None:
    found = reader(tmp_path, "mill.toml", "M62 P0\nG1 X10\nM63 P0\nM3 S5\nG1 X20")
    read(found)
    assert [note.partition("job.ngc:")[2] for note in found.notes] == [
        "3: outputs (M62 to M65, M67, M68): the machine file has no output for it, the motion goes on without",
        "6: spindle (M3, M4, M5): the machine file has no output for it, the motion goes on without",
    ]
