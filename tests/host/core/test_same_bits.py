# SPDX-License-Identifier: MIT
"""The kernels give the same bits from every compiler and optimisation; firmware/core.

Fixed must by its nature; float and double because they use IEEE + - * / only, without contraction. Run by pytest;
starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from core_sources import FIRMWARE, point_sources
from marks import long

ROOT = Path(__file__).resolve().parents[3]
PROGRAMS = ROOT / "tests" / "data" / "programs"
NAMES = (
    "alpha_exponential",
    "heart_exponential",
    "star_minimax",
    "line_slow",
    "line_tiny",
    "space3",
    "space6",
)
COMPILERS = [c for c in ("gcc", "clang", "clang-14") if shutil.which(c)]
BUILDS = [(c, o) for c in COMPILERS for o in ("-O0", "-O2", "-O3")]


def build(compiler: str, level: str, target: Path) -> Path:
    """The printing program, compiled."""
    subprocess.run(
        [
            compiler,
            "-std=c99",
            level,
            "-ffp-contract=off",
            f"-I{FIRMWARE}",
            str(Path(__file__).with_name("print_bits.c")),
            *point_sources(),
            "-o",
            str(target),
        ],
        check=True,
    )
    return target


def bits(program: Path, kernel: int) -> list[str]:
    """CRC of all points of each golden program."""
    return [
        subprocess.run(
            [str(program), str(PROGRAMS / f"{name}.hdgp"), str(kernel)],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.strip()
        for name in NAMES
    ]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> list[list[str]]:
    """CRCs of the first compiler without optimisation, by kernel."""
    program = build(*BUILDS[0], tmp_path_factory.mktemp("bits") / "reference")
    return [bits(program, kernel) for kernel in range(3)]


@pytest.mark.parametrize(
    ("compiler", "level"), [build if build[1] == "-O2" else long(*build) for build in BUILDS[1:]]
)
def test_same_bits(compiler: str, level: str, reference: list[list[str]], tmp_path: Path) -> None:
    program = build(compiler, level, tmp_path / "program")
    assert [bits(program, kernel) for kernel in range(3)] == reference


def test_programs_and_kernels_differ(reference: list[list[str]]) -> None:
    """The CRCs are of something: no two programs, and no two kernels on a curve, agree."""
    for row in reference:
        assert len(set(row)) == len(NAMES)
    assert len({row[0] for row in reference}) == 3
