# SPDX-License-Identifier: MIT
"""Toolpath files that are broken anywhere: moves, or one clear message with its place.

Mutated programs of G-code that are read are compared with LinuxCNC in test_gcode_linuxcnc.py. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drawings import Move
from hodograph.errors import InputError, ToolpathError
from hodograph.toolpath.drawing import ORDERS, DrawingOptions
from hodograph.toolpath.dxf import read_dxf
from hodograph.toolpath.gcode import Options, read_gcode
from hodograph.toolpath.moves import ORIGIN, ArcMove, Command, Message, ProgramEnd, SplineMove
from hodograph.toolpath.points import PointOptions, read_points
from hodograph.toolpath.svg import read_svg
from marks import long
from mutated_files import mutated

ROOT = Path(__file__).resolve().parent.parent.parent
SOUND = ROOT / "data" / "toolpaths"
"""A sound file of each format, with something of everything."""

PART = 100
"""Files in a test."""

CASES = [
    (kind, part) if part < usual else long(kind, part)
    for kind, usual, most in (("svg", 3, 100), ("dxf", 3, 100), ("csv", 3, 100), ("ngc", 10, 1000))
    for part in range(most)
]


def drawing_options(seed: int) -> DrawingOptions:
    unit = None if seed % 2 else 1.0
    return DrawingOptions(
        10.0,
        unit_mm=unit,
        order=ORDERS[seed % 3],
        gap_mm=(0.0, 0.01, 1.0)[seed % 3],
        lift_mm=(0.0, 2.0)[seed % 2],
    )


def points_of(path: Path, seed: int) -> Iterator[Command]:
    with path.open(encoding="utf-8", errors="surrogateescape", newline="\n") as lines:
        yield from read_points(
            lines, path.name, PointOptions(10.0, closed=seed % 2 == 0, noise_mm=0.1 * (seed % 3))
        )


def program_of(path: Path, seed: int) -> Iterator[Command]:
    with path.open(encoding="utf-8", errors="surrogateescape", newline="\n") as lines:
        yield from read_gcode(lines, path.name, Options(most_jumps=1000))


READERS: dict[str, Callable[[Path, int], Iterator[Command]]] = {
    "svg": lambda path, seed: read_svg(path, drawing_options(seed)),
    "dxf": lambda path, seed: read_dxf(path, drawing_options(seed)),
    "csv": points_of,
    "ngc": program_of,
}


def check(found: list[Command], *, is_gcode: bool) -> None:
    """What every toolpath keeps."""
    assert isinstance(found[-1], ProgramEnd)
    here = ORIGIN
    for command in found:
        if isinstance(command, Message):
            assert command.text.isprintable()
        if not isinstance(command, Move):
            continue
        assert all(map(math.isfinite, command.end))
        if is_gcode:  # arcs in three planes and with several turns; moves of no length
            continue
        if isinstance(command, ArcMove):
            x, y = command.centre
            radii = [math.hypot(end[0] - x, end[1] - y) for end in (here, command.end)]
            assert radii[0] > 0
            assert radii[1] == pytest.approx(radii[0], rel=1e-6, abs=1e-6)
            assert command.turns in (-1, 1)
        elif isinstance(command, SplineMove):
            check_spline(command)
            assert command.points[0] == here
        else:
            assert command.end != here
        here = command.end


def check_spline(move: SplineMove) -> None:
    degree, knots = move.degree, move.knots
    assert len(knots) == len(move.points) + degree + 1
    assert len(move.weights) == len(move.points) > degree
    assert all(weight > 0 for weight in move.weights)
    assert knots[: degree + 1] == (0.0,) * (degree + 1)
    assert knots[-degree - 1 :] == (1.0,) * (degree + 1)
    assert list(knots) == sorted(knots)


@pytest.mark.parametrize("kind", READERS)
def test_the_sound_files_are_read(kind: str) -> None:
    found = list(READERS[kind](SOUND / f"sound.{kind}", 1))
    check(found, is_gcode=kind == "ngc")
    assert len(found) > 5


def outcome(kind: str, path: Path, seed: int) -> tuple[list[Command], InputError | None]:
    """The commands, or the refusal."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return list(READERS[kind](path, seed)), None
    except InputError as error:
        return [], error


@pytest.mark.parametrize(("kind", "part"), CASES)
def test_a_broken_file_gives_moves_or_one_message(tmp_path: Path, kind: str, part: int) -> None:
    sound = (SOUND / f"sound.{kind}").read_bytes()
    path = tmp_path / f"broken.{kind}"
    read = 0
    for seed in range(part * PART, part * PART + PART):
        data = mutated(sound, seed)
        path.write_bytes(data)
        found, error = outcome(kind, path, seed)
        if error is None:
            check(found, is_gcode=kind == "ngc")
            read += 1
            continue
        assert str(error).isprintable(), seed
        assert path.name in str(error), seed
        if isinstance(error, ToolpathError):
            assert 1 <= error.line <= data.count(b"\n") + data.count(b"\r") + 2, seed
            assert error.column >= 1, seed
    assert read > PART / 20


def test_a_chain_that_closing_leaves_without_a_step_is_no_contour(tmp_path: Path) -> None:
    """A line shorter than the gap is closed by moving its end onto its start."""
    path = tmp_path / "tiny.svg"
    tiny = '<path d="M 5 5 L 5.00000000001 5"/>'
    for around in ("", '<path d="M 0 0 L 9 0 L 9 9 Z"/>'):
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{around}{tiny}</svg>')
        options = DrawingOptions(10.0, unit_mm=1.0, order="inside-first", gap_mm=0.01)
        if not around:
            with pytest.raises(ToolpathError, match="no line or curve"):
                list(read_svg(path, options))
        else:
            found = [one for one in read_svg(path, options) if isinstance(one, Move)]
            assert [one.end[:2] for one in found if max(one.end[:2]) < 8.0] == [(0.0, 0.0)]
