# SPDX-License-Identifier: MIT
"""The example of the core's manual (firmware/core/hodograph.h): it compiles as it stands, and gives the setpoints. Run
by pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from hodograph.native import NativeProgram

ROOT = Path(__file__).resolve().parents[3]
CORE = ROOT / "firmware" / "core"
IMAGE = ROOT / "tests" / "data" / "programs" / "heart_minimax.hdgp"
WARNINGS = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Werror",
    "-ffp-contract=off",
)
FRAME = """
#include <stdio.h>

int main(int argc, char **argv)
{
    static uint8_t image[1 << 20];
    const struct program_limits limits = {.min_q40_mm = {-((int64_t)1 << 52), -((int64_t)1 << 52)},
                                          .max_q40_mm = {(int64_t)1 << 52, (int64_t)1 << 52}};
    FILE *file = fopen(argv[argc - 1], "rb");
    if (file == NULL) {
        return 2;
    }
    const uint32_t size = (uint32_t)fread(image, 1, sizeof image, file);
    fclose(file);
    int result = load(image, size, &limits);
    while (result == 0) {
        int32_t counts[2];
        result = tick(counts);
        printf("%ld %ld\\n", (long)counts[0], (long)counts[1]);
    }
    return result == 1 ? 0 : 3;
}
"""


def example() -> str:
    """The indented text of the manual, from its #include to the end of the comment."""
    manual = (CORE / "hodograph.h").read_text(encoding="utf-8").partition("*/\n#ifndef")[0]
    lines = manual[manual.index(" *     #include") :].splitlines()
    return "".join(line.removeprefix(" *").removeprefix("     ") + "\n" for line in lines)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example with a main() of this test, linked with the core."""
    folder = tmp_path_factory.mktemp("manual")
    source = folder / "example.c"
    source.write_text(example() + FRAME, encoding="utf-8")
    target = folder / "example"
    sources = sorted(str(path) for path in CORE.glob("*.c"))
    command = ["gcc", *WARNINGS, f"-I{CORE.parent}", str(source), *sources, "-o", str(target)]
    subprocess.run(command, check=True)
    return target


def test_gives_the_setpoints_of_the_program(program: Path) -> None:
    run = subprocess.run([program, IMAGE], check=True, capture_output=True, text=True)
    got = np.array([line.split() for line in run.stdout.splitlines()], dtype=np.int32)
    _, wanted = NativeProgram(IMAGE.read_bytes()).setpoints("fixed", 1_000_000)
    np.testing.assert_array_equal(got, wanted)


def test_an_image_that_is_damaged_is_refused(program: Path, tmp_path: Path) -> None:
    damaged = bytearray(IMAGE.read_bytes())
    damaged[200] ^= 1
    file = tmp_path / "damaged.hdgp"
    file.write_bytes(bytes(damaged))
    assert subprocess.run([program, file], check=False).returncode == 3


def test_is_about_thirty_lines() -> None:
    code = [line for line in example().splitlines() if line.strip()]
    assert 25 <= len(code) <= 42
