# SPDX-License-Identifier: MIT
"""What a streamed toolpath says of commands that nobody executes."""

from pathlib import Path

import pytest

from hodograph.config import load_machine
from hodograph.errors import InputError
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions

MACHINES = Path(__file__).parents[3] / "examples" / "machines"


def reader(tmp_path: Path, machine: str, text: str) -> StreamReader:
    file = tmp_path / "job.ngc"
    file.write_text(f"G21 G17 G90 G94 G64 P0.02\nG1 F600\n{text}\nM30\n")
    return StreamReader(file, load_machine(MACHINES / machine), 0.01, ReadOptions())


def read(found: StreamReader) -> None:
    for section in found.sections():
        for _ in section.blocks:
            pass


@pytest.mark.parametrize("word", ["M62 P0", "M65 P0", "M67 E0 Q5", "M3 S50", "M5"])
def test_an_output_is_refused_with_its_line(tmp_path: Path, word: str) -> None:
    with pytest.raises(
        InputError, match=r"job.ngc:4: stream does not switch outputs yet: hodograph run does"
    ):
        read(reader(tmp_path, "dispenser.toml", f"G1 X10\n{word}\nG1 X20"))


def test_what_the_machine_does_not_have_is_noted_once(tmp_path: Path) -> None:
    found = reader(tmp_path, "mill.toml", "M62 P0\nG1 X10\nM63 P0\nM3 S5\nG1 X20")
    read(found)
    assert [note.partition("job.ngc:")[2] for note in found.notes] == [
        "3: outputs (M62 to M65, M67, M68): the machine has none, it moves as if they were done",
        "6: spindle (M3, M4, M5): the machine has none, it moves as if they were done",
    ]
