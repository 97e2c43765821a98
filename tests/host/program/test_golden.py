# SPDX-License-Identifier: MIT
"""Tests of hodograph/program: check, encoding and inspection of the golden images. tests/data/manifest.txt names the
expected refusals, for the C tests too. Run by `make pytest`. Reads tests/data.
"""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.program import ProgramLimits, decode, encode, inspect_dict, inspect_text
from hodograph.program.check import check_image
from hodograph.program.codes import ProgramError
from hodograph.program.image import HEADER_SIZE, open_fault

ROOT = Path(__file__).parents[3]
DATA = ROOT / "tests" / "data"
LINES = [line for line in (DATA / "manifest.txt").read_text().splitlines() if line[0] != "#"]
ROWS = [line.split() for line in LINES if not line.startswith("limits")]
SPATIAL = {"space3.hdgp", "space6.hdgp"}
"""Of three and six path axes: for the bits (tests/host/core/test_same_bits.py), not for these limits of two."""
LAST_BITS = 4096
"""Of 2^-40 mm and 2^-44 mm^(1/2)."""
GOOD = [row[0] for row in ROWS if row[1] == "OK"]


def limits() -> ProgramLimits:
    numbers = [int(v) for v in re.findall(r"(?<= )-?\d+\b", LINES[0])]
    return ProgramLimits(
        *numbers[:4], (numbers[4], numbers[5]), (numbers[6], numbers[7]), numbers[8]
    )


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_check_says_what_the_table_says(row: list[str]) -> None:
    name, code, number, index = row
    fault = check_image((DATA / "programs" / name).read_bytes(), limits())
    if code == "OK":
        assert fault is None
    else:
        assert fault is not None
        assert (fault.code.name, int(fault.code), fault.index) == (code, int(number), int(index))


def alike(image: bytes, other: bytes) -> bool:
    """Whether two images hold the same program, but for last bits of coefficients: those are planned in floating point,
    which another processor may round otherwise.
    """
    if len(image) != len(other) or image[:HEADER_SIZE][4:12] != other[:HEADER_SIZE][4:12]:
        return False
    if open_fault(image) is not None or open_fault(other) is not None:
        return open_fault(image) is open_fault(other)
    a, b = decode(image), decode(other)
    numbers = [(a.point_q40, b.point_q40), (a.a_q44, b.a_q44), (a.pieces.c_q40, b.pieces.c_q40)]
    return (
        np.array_equal(a.stops.codes, b.stops.codes)
        and np.array_equal(a.pieces.duration_q32_s, b.pieces.duration_q32_s)
        and all(np.allclose(one, two, rtol=1e-9, atol=LAST_BITS) for one, two in numbers)
    )


def test_the_files_are_what_the_script_makes() -> None:
    """If not: run tests/data/make_golden.py, and check what has changed."""
    script = DATA / "make_golden.py"
    spec = spec_from_file_location("make_golden", script)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    images, table = module.golden()
    files = {file.name: file.read_bytes() for file in (DATA / "programs").glob("*.hdgp")}
    assert files.keys() == images.keys()
    assert [name for name, image in images.items() if not alike(files[name], image)] == []
    assert (DATA / "manifest.txt").read_text() == table


def test_every_file_is_in_the_table_and_every_code_in_a_file() -> None:
    files = {p.name for p in (DATA / "programs").glob("*.hdgp")}
    assert {row[0] for row in ROWS} == files - SPATIAL
    of_machines = {"STORE", "ROOM", "KERNEL"}
    of_machines |= {
        "AXIS_VELOCITY",
        "AXIS_ACCELERATION",
        "AXIS_JERK",
        "AXIS_STEP",
    }  # verify/test_limit_check.py
    of_chunks = {
        code.name for code in ProgramError if -100 < code <= ProgramError.CHUNK_EVENT
    }  # test_chunk.c
    of_programs = {code.name for code in ProgramError} - of_machines - of_chunks
    assert {row[1] for row in ROWS} - {"OK"} == of_programs


def test_codes_are_those_of_the_controller() -> None:
    header = (ROOT / "firmware" / "core" / "program_rules.h").read_text()
    pairs = re.findall(r"PROGRAM_ERR_(\w+) =\s*(-\d+)", header)
    assert {name: int(number) for name, number in pairs} == {c.name: int(c) for c in ProgramError}


def test_table_limits_are_read() -> None:
    assert limits() == ProgramLimits(
        1000, 500_000, 5_000_000, 200_000, (-200 << 40,) * 2, (200 << 40,) * 2, 250
    )


@pytest.mark.parametrize("name", GOOD)
def test_decode_and_encode_are_inverse(name: str) -> None:
    image = (DATA / "programs" / name).read_bytes()
    assert encode(decode(image)) == image


@pytest.mark.parametrize("name", GOOD)
def test_inspection(name: str) -> None:
    program = decode((DATA / "programs" / name).read_bytes())
    text, data = inspect_text(program, full=True), inspect_dict(program)
    assert data["segments"] + data["pieces"] < len(text.splitlines())
    assert f"{data['ticks']} ticks" in text
    assert data["length_mm"] == program.length_mm
    assert data["peak_feed_mm_s"] <= 500.0


@pytest.mark.parametrize("row", [row for row in ROWS if -5 <= int(row[2]) < 0], ids=lambda r: r[0])
def test_images_that_do_not_open_are_input_errors(row: list[str]) -> None:
    with pytest.raises(InputError, match=row[1]):
        decode((DATA / "programs" / row[0]).read_bytes())
