# SPDX-License-Identifier: MIT
"""Jobs: sections of a toolpath, what happens between them, their run, and messages. Run by pytest; writes to temporary
folders.
"""

from __future__ import annotations

import csv
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.config import Machine, load_machine
from hodograph.errors import InputError, PlanError
from hodograph.job import load_job
from hodograph.program.stops import FAULT
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.fit.reference import distance_to_chord
from hodograph.toolpath.fit.sections import divided
from hodograph.toolpath.gcode import read_gcode
from hodograph.toolpath.moves import Dwell, Spindle

ROOT = Path(__file__).resolve().parent.parent.parent.parent
MILL = ROOT / "examples" / "machines" / "mill.toml"


@pytest.fixture(scope="module")
def mill() -> Machine:
    return load_machine(MILL)


def sections(text: str, tolerance_mm: float = 0.01) -> list[tuple[int, int]]:
    path = divided(read_gcode(text.splitlines()), tolerance_mm, "part.ngc")
    return [(int(s.reference.line[0]), int(s.reference.line[-1])) for s in path.sections]


def program(folder: Path, text: str) -> Path:
    file = folder / "part.ngc"
    file.write_text(text)
    return file


def test_moves_are_one_section_until_something_stops_them() -> None:
    text = "F600\nG1 X1\nG1 Y1\nG4 P1\nG1 X2\nM3 S100\nG0 Y2\nG1 X3\nM6 T1\nG1 X4\nM64 P1\nG1 X5\nM62 P1\nG1 X6\nM2"
    assert sections(text) == [(2, 3), (5, 5), (7, 8), (10, 10), (12, 14)]


def test_exact_stops() -> None:
    moves = "F600\n{}G1 X1\nG1 Y1\nG1 X2\nM2"
    each = [(3, 3), (4, 4), (5, 5)]
    assert sections(moves.format("G61\n")) == each
    assert sections(moves.format("G61.1\n")) == each
    assert sections(moves.format("G64\n")) == [(3, 5)]
    assert sections(moves.format("G64\n"), 0.0) == each


def test_exact_path_does_not_stop_where_it_goes_straight_on() -> None:
    moves = "F600\n{}\nG1 X1 Y1\nG1 X3 Y3\nG1 X4 Y3\nG1 X5\nG2 X6 Y2 J-1\nG1 Y1\nM2"
    assert sections(moves.format("G61")) == [(3, 4), (5, 6), (7, 7), (8, 8)]
    assert sections(moves.format("G61.1")) == [(k, k) for k in range(3, 9)]


def test_a_path_mode_said_again_changes_nothing() -> None:
    again = "F600\nG64 P0.01\nG1 X1\nG64 P0.01\nG1 Y1\nM2"
    path = divided(read_gcode(again.splitlines()), 0.01, "-")
    assert [s.reference.point.tolist() for s in path.sections] == [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    ]


def stairs(leg_mm: float, legs: int) -> list[str]:
    """Right angles."""
    return [f"G1 X{leg_mm * ((k + 1) // 2):g} Y{leg_mm * (k // 2):g}" for k in range(1, legs + 1)]


@pytest.mark.parametrize(
    "moves", ["flood", "stairs", pytest.param("winding", marks=pytest.mark.long)]
)
def test_where_a_stop_would_come_too_late_the_plan_leaves_more_free(
    tmp_path: Path, mill: Machine, moves: str
) -> None:
    """And loses little time: the reserve lies around some places only."""
    wave = [
        f"G1 X{0.3 * k:g} Z{2 * math.sin(0.12 * k) + 0.4 * math.sin(0.8 * k):.4f}"
        for k in range(150)
    ]
    of_kind = {"flood": stairs(0.5, 26), "stairs": stairs(3.0, 12), "winding": wave}
    text = "\n".join(["F12000" if moves == "stairs" else "F6000", *of_kind[moves]])
    pipeline = load_job(program(tmp_path, text), mill).only_section("test").pipeline
    accepted = pipeline.compilation
    assert accepted.program.stops.worst(FAULT).time_s <= 0.5
    assert pipeline.plan.duration_s < accepted.plan.duration_s < 1.03 * pipeline.plan.duration_s
    assert pipeline.accepted.image


HOOKS = """
-9274 -285 -9825, -9074 -123 -10000, -9058 -114 -9992, -9075 -113 -9976, -8814 -240 -9500,
-8818 -86 -9403, -9387 3714 -8457, -10012 3898 -8901, -10062 3845 -8785, -10073 3903 -8668,
-9876 3879 -8634, -9735 1703 -8357, -9744 1703 -8359, -9271 5204 -5027, -9839 5233 -4340,
-9834 5246 -4342, -9856 5240 -4711, -10774 6287 -5458, -10771 6294 -5433"""
"""Points in 0.1 um, between which a curve turns back within a micrometre."""


def test_a_bend_of_less_than_a_micrometre_is_passed_slowly(tmp_path: Path, mill: Machine) -> None:
    """It is over between two places where a plan checks its limits, and so leaves no room for an override."""
    points = [[int(value) / 1e4 for value in point.split()] for point in HOOKS.split(",")]
    moves = [f"X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points]
    text = ["F9000", f"G0 {moves[0]}", "G4 P0.1", *(f"G1 {move}" for move in moves[1:])]
    job = load_job(program(tmp_path, "\n".join(text)), mill)
    for section in job.sections:
        assert section.pipeline.compilation.program.pieces.override_rate_codes.min() > 0
    assert not job.notes


def test_a_reversal_is_a_stop() -> None:
    assert sections("F600\nG1 X5\nG1 X1\nG1 X2 Y0.01\nM2") == [(2, 2), (3, 3), (4, 4)]


def test_the_tolerance_of_the_file_counts_where_it_is_less() -> None:
    path = divided(
        read_gcode("F600\nG64 P0.002\nG1 X1\nG1 Y1\nG64 P0.5\nG1 X2\nM2".splitlines()), 0.01, "-"
    )
    assert [s.tolerance_mm for s in path.sections] == [0.002, 0.01]


def test_commands_are_kept_at_their_sections() -> None:
    path = divided(
        read_gcode("F600\nM3 S100\nG1 X1\nG4 P2\nG1 Y1\nM62 P1\nG1 X2\nM2".splitlines()), 0.01, "-"
    )
    first, second = path.sections
    assert [type(c) for c in first.before] == [Spindle]
    assert [c.duration_s for c in second.before if isinstance(c, Dwell)] == [2.0]
    (event,) = second.events
    assert event.place_mm == pytest.approx(1.0)


def test_a_job_keeps_feeds_and_lines(tmp_path: Path, mill: Machine) -> None:
    job = load_job(
        program(tmp_path, "G21\nF6000\nG1 X20\nF1200\nG1 X40 Y3\nG0 X0 Y0 Z5\nM2\n"), mill
    )
    one, two = job.sections
    assert job.lines == 3
    assert one.pipeline.feed.nominal_mm_s == pytest.approx(100.0)
    (zone,) = one.pipeline.limits.zones
    assert zone.feed_mm_s == pytest.approx(20.0)
    assert zone.from_mm == pytest.approx(20.0, abs=0.05)
    assert one.line_at(np.array([1.0, 25.0])).tolist() == [3, 5]
    assert (two.first_line, two.last_line) == (6, 6)
    assert job.deviation_um < 10.0
    assert (
        load_job(job.file, mill, reading=ReadOptions(feed_mm_s=50.0))
        .sections[0]
        .pipeline.limits.zones
        == ()
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("M2\n", "moves nothing"),
        ("F60\nG1 A5\nM2\n", ":2: the move turns A"),
        ("F60\nG1 X1\nG1 X3000\nM2\n", ":3: x goes to"),
        ("F60\nG1 X1 Q\nM2\n", ":2:"),
    ],
)
def test_messages_name_the_line(tmp_path: Path, mill: Machine, text: str, words: str) -> None:
    with pytest.raises((InputError, PlanError), match=words):
        load_job(program(tmp_path, text), mill)


def test_tool_offsets_without_a_table_have_one_note(tmp_path: Path, mill: Machine) -> None:
    job = load_job(program(tmp_path, "F600\nG43 H1 G0 Z5\nG1 X5\nG43 H2\nG1 X9\nM2\n"), mill)
    (note,) = job.notes
    assert note.endswith(
        ":2: tool offset (G43) and 1 more: there is no tool table, 0 is added: "
        "give the offset with G43.1, or in [work] offset_mm"
    )
    assert len(job.sections) == 1


def test_simulate_joins_the_sections(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = program(tmp_path, "G21\nF12000\nG1 X4\nG1 Y3\nG4 P0.25\nG0 X0 Y0\nM2\n")
    trace = tmp_path / "out.csv"
    command = ["simulate", str(file), "--machine", str(MILL), "--trace", str(trace), "--json"]
    assert main([*command, "--tolerance", "0.01"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["lines"] == 3
    assert found["sections"] == 2
    assert found["dwell_s"] == 0.25
    assert 5.0 < found["deviation_bound_um"] <= 10.0
    with trace.open() as rows:
        table = list(csv.DictReader(rows))
    assert len(table) == found["ticks"]
    assert float(table[-1]["t_s"]) == pytest.approx(found["duration_s"])
    assert [int(row["tick"]) for row in table] == list(range(len(table)))
    path = np.array([[float(row[f"{axis}_cmd_mm"]) for axis in "xyz"] for row in table])
    legs = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0], [0.0, 0.0, 0.0]])
    off = distance_to_chord(path[:, None], legs[None, :-1], legs[None, 1:]).min(axis=1)
    assert 1000.0 * off.max() <= found["deviation_bound_um"]
    assert np.abs(path[-1]).max() < 1e-9
    assert np.abs(np.diff(path, axis=0)).max() <= 0.2 * (1.0 + 1e-6)
    jerk = np.abs(np.diff(path, 3, axis=0)).max() * 1e9
    assert jerk <= 50000.0 * 1.001
    assert {int(row["line"]) for row in table} == {3, 4, 6}


def test_import_shows_what_became_of_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = program(tmp_path, "G21\nF3000\nM3 S500\nG1 X9\nG3 X9 Y4 J2\nM5\nG0 X0 Y0\nM2\n")
    output = tmp_path / "part.toml"
    command = ["import", str(file), "--machine", str(MILL), "--json", "-o", str(output)]
    assert main(command) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert [s["last_line"] for s in found["section"]] == [5, 7]
    assert "part.ngc:3: spindle (M3, M4, M5) and 1 more" in captured.err
    written = tomllib.loads(output.read_text())
    assert written["section"] == found["section"]
    assert main(["simulate", str(file)]) == 2
    assert "names no machine" in capsys.readouterr().err


@pytest.mark.parametrize(
    "moves",
    [
        "G1 X10.004\nG1 X10",
        "G1 X10.001 Y0.001\nG1 X10.002 Y0\nG1 X10.001 Y-0.001\nG1 X10 Y0",
        "G1 X10.002 Y0.001\nG1 X10.0003 Y0",
        "G1 Z-0.002\nG1 Z0",
        "\n".join(["G1 X10.005\nG1 X10"] * 10),
    ],
    ids=["back", "loop", "nearly closed", "plunge", "back and forth"],
)
@pytest.mark.filterwarnings("error")
def test_a_section_that_returns_to_its_start_within_the_tolerance(
    tmp_path: Path, mill: Machine, moves: str
) -> None:
    job = load_job(program(tmp_path, f"F600\nG1 X10\nM3 S100\n{moves}\nM5\nG1 X20"), mill)
    for section in job.sections:
        assert section.pipeline.compilation.program.duration_q32_s > 0
    assert job.sections[-1].fitted.reference.point[-1].tolist() == [20.0, 0.0, 0.0]
    assert job.deviation_um <= 10.0


def test_hooks_shorter_than_a_section_stay_in_one(tmp_path: Path, mill: Machine) -> None:
    """Points that go back and forth by two micrometres: a part between two of them would have no length."""
    xs = [0.3, 0.28, 0.295, 0.2928, 0.295, 0.2932, 0.2956, 0.2875, 0.35]
    text = "\n".join(["F9000", *(f"G1 X{x:g}" for x in xs)])
    job = load_job(program(tmp_path, text), mill)
    for section in job.sections:
        assert section.fitted.curve.length_mm >= 2.0**-10
        assert section.pipeline.compilation.program.duration_q32_s > 0
    assert job.sections[-1].fitted.reference.point[-1].tolist() == [0.35, 0.0, 0.0]
    assert job.deviation_um <= 10.0
