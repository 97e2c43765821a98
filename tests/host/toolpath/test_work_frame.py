# SPDX-License-Identifier: MIT
"""Where a toolpath lies in the machine: G53, G28 and G30 reach machine positions whatever [work] offset_mm is, and
[work] start_mm is where a toolpath of any kind starts. Run by pytest; writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.config import Machine, load_machine
from hodograph.errors import InputError, PlanError
from hodograph.job import DEFAULT_TOLERANCE_MM, Job, load_job, work_frame
from hodograph.job_simulation import simulate_job
from hodograph.stream.journal import machine_mark
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions, read_toolpath
from hodograph.toolpath.gcode import Options, read_gcode
from hodograph.toolpath.moves import StraightMove, WorkFrame

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
WORK = (100.0, -40.0, -30.0, 5.0, 0.0, 0.0)
START = (1.0, 2.0, 20.0, 0.0, 0.0, 0.0)
POINTS = "0,0\n10,0\n10,5\n"
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">
<path d="M4 30 L8 30 L8 24"/></svg>
"""


@pytest.fixture
def mill() -> Machine:
    machine = load_machine(EXAMPLES / "machines" / "mill.toml")
    return replace(machine, offset_mm=WORK[:3], start_mm=START[:3])


def job_of(folder: Path, machine: Machine, text: str) -> Job:
    file = folder / "part.ngc"
    file.write_text(text)
    return load_job(file, machine)


def ends(text: str) -> list[tuple[float, ...]]:
    """Ends of the moves of G-code with the work offset WORK, as machine positions."""
    moves = read_gcode(text.splitlines(keepends=True), "part.ngc", Options(work=WORK))
    return [
        tuple(mm + offset for mm, offset in zip(move.end, WORK, strict=True))
        for move in moves
        if isinstance(move, StraightMove)
    ]


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("G53 G0 Z0", (100.0, -40.0, 0.0, 5.0)),
        ("G53 G0 X1 A-3", (1.0, -40.0, -30.0, -3.0)),
        ("G20 G53 G0 X1", (25.4, -40.0, -30.0, 5.0)),
        ("G92 X7 Y7 Z7\nG10 L2 P1 R30\nG53 G0 X3 Y4 Z0", (3.0, 4.0, 0.0, 5.0)),
        ("G54 G0 X5 Y5\nG28", (0.0, 0.0, 0.0, 0.0)),
        ("G0 X5 Y5 Z5\nG28 Z10", (105.0, -35.0, 0.0, 5.0)),
        ("G0 X5 Y5 Z5\nG91 G28 Z0", (105.0, -35.0, 0.0, 5.0)),
        ("G91 G30 Z0", (100.0, -40.0, 0.0, 5.0)),
        ("G0 X5 Y6 Z7\nG28.1\nG0 X0 Y0 Z50\nG28", (105.0, -34.0, -23.0, 5.0)),
        ("#5163 = -1\nG28 Z9", (100.0, -40.0, -1.0, 5.0)),
        ("G10 L2 P1 R90\nG28 Z3", (100.0, -40.0, 0.0, 5.0)),
        ("G0 Z#<_abs_z>", (100.0, -40.0, -60.0, 5.0)),
        ("G0 X5\nG53 G0 X#<_abs_x> Y[#<_abs_y> + 1]", (105.0, -39.0, -30.0, 5.0)),
        ("G20 G0 Z1\nG53 G0 X#<_abs_y> Z[#<_abs_z> + 1] A#<_abs_a>", (-40.0, -40.0, 20.8, 5.0)),
        ("G20 G91 G0 X1\nG28 Z1", (125.4, -40.0, 0.0, 5.0)),
        ("#1=#<_abs_z>\nG0 Z50\nG90 G53 G0 Z#1", (100.0, -40.0, -30.0, 5.0)),
        ("G91\no1 while [#<_abs_z> lt 0]\nG0 Z10\no1 endwhile", (100.0, -40.0, 0.0, 5.0)),
        ("G10 L20 P1 X0 Z7\nG0 Z9\nG53 G0 X1", (1.0, -40.0, -28.0, 5.0)),
        ("G81 X1 Y1 Z-1 R2 F100\nG28 Z5\nX4", (104.0, -39.0, -28.0, 5.0)),
    ],
)
def test_machine_positions_of_a_program(text: str, end: tuple[float, ...]) -> None:
    assert ends(text)[-1][:4] == pytest.approx(end, abs=1e-9)


def test_the_retract_of_a_post_processor_goes_to_the_machine_zero(
    tmp_path: Path, mill: Machine
) -> None:
    """Through the whole chain: the axes end at machine position 0, above the work and not in it."""
    text = "G90 G21 G53 G0 Z0\nG0 X10 Y10\nZ2\nG1 Z-1 F600\nX20\nG53 G0 Z0\nM2\n"
    job = job_of(tmp_path, mill, text)
    motion = simulate_job(job).motions[-1]
    assert motion.cmd_mm[-1] == pytest.approx((120.0, -30.0, 0.0), abs=2e-6)


@pytest.mark.parametrize(
    ("name", "text"),
    [("part.ngc", "G0 X4 Y4\nG1 Z0 F600\nX9\n"), ("p.csv", POINTS), ("d.svg", SVG)],
)
def test_a_toolpath_starts_at_start_mm(tmp_path: Path, mill: Machine, name: str, text: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    reading = ReadOptions(feed_mm_s=None if name == "part.ngc" else 20.0)
    job = load_job(file, mill, DEFAULT_TOLERANCE_MM, reading)
    begins = np.array(START[:3]) + WORK[:3]
    assert simulate_job(job).motions[0].cmd_mm[0] == pytest.approx(begins, abs=2e-6)
    section = next(StreamReader(file, mill, DEFAULT_TOLERANCE_MM, reading).sections())
    streamed = next(section.blocks).curve.point(np.zeros(1))[0]
    assert streamed == pytest.approx(START[:3], abs=1e-9)
    assert job.sections[-1].fitted.reference.point[-1, 2] == 0.0, "the work is at z = 0"


def test_names_of_axes_give_the_places_of_their_numbers() -> None:
    five = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    numbers = (1.0, 2.0, 3.0, 4.0, 5.0)
    frame = work_frame(replace(five, offset_mm=numbers, start_mm=numbers[::-1]))
    letters = [axis.name for axis in five.path_axes]
    assert letters == ["x", "y", "z", "a", "c"]
    assert frame == WorkFrame((1.0, 2.0, 3.0, 4.0, 0.0, 5.0), (5.0, 4.0, 3.0, 2.0, 0.0, 1.0))
    plane = load_machine(EXAMPLES / "machines" / "paper_alpha.toml")
    assert work_frame(replace(plane, offset_mm=(1.0, 2.0))).offset == (1.0, 2.0, 0.0, 0.0, 0.0, 0.0)


def test_the_first_three_axes_are_x_y_z_whatever_their_names() -> None:
    """An axis after them with the name z does not move with Z."""
    four = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    x, y, z, a, c = four.axes
    axes = (x, y, replace(z, name="w"), replace(a, name="z"), c)
    named = replace(four, axes=axes, offset_mm=(1.0, 2.0, 3.0, 4.0, 5.0))
    assert work_frame(named).offset == (1.0, 2.0, 3.0, 0.0, 0.0, 5.0)


def test_an_axis_that_no_toolpath_moves_has_no_start(tmp_path: Path) -> None:
    text = (EXAMPLES / "machines" / "mill_five_axes.toml").read_text()
    text = text.replace("../drives/", f"{EXAMPLES}/drives/")
    text = text.replace('"a", "c"]', '"u", "c"]').replace('name = "a"', 'name = "u"')
    for start in ("0", "4"):
        own = text.replace("[work]\n", f"[work]\nstart_mm = [1, 2, 3, {start}, 5]\n")
        (tmp_path / f"{start}.toml").write_text(own)
    assert load_machine(tmp_path / "0.toml").start_mm == (1.0, 2.0, 3.0, 0.0, 5.0)
    with pytest.raises(InputError, match="start_mm is 4 for axis u"):
        load_machine(tmp_path / "4.toml")


@pytest.mark.parametrize("path", [("x", "y", "z", "a"), ("x", "y", "z", "c", "a")])
def test_a_rotary_move_first_leaves_x_y_z_at_the_start(
    tmp_path: Path, path: tuple[str, ...]
) -> None:
    """With one axis after z, its program moves z too; with two, it moves them alone, in the order of the path."""
    place = {"x": (1.0, 100.0), "y": (2.0, -40.0), "z": (20.0, -30.0), "a": (3.0, 5.0)}
    place["c"] = (4.0, -9.0)
    five = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    by_name = {axis.name: axis for axis in five.axes}
    machine = replace(
        five,
        axes=tuple(by_name[name] for name in path),
        path_count=len(path),
        start_mm=tuple(place[name][0] for name in path),
        offset_mm=tuple(place[name][1] for name in path),
    )
    text = "G0 A10\nG53 G0 A20\nG0 X5\nG53 G0 Z0\nG28 A14\nM2\n"
    job = job_of(tmp_path, machine, text)
    run = simulate_job(job)
    ends = [
        dict(zip(path, section.places(motion.cmd_mm[[0, -1]]).T, strict=True))
        for section, motion in zip(job.sections, run.motions, strict=True)
    ]
    starts = {name: number for name, (number, _) in place.items()}
    wanted = [{"a": 15.0}, {"x": 5.0, "z": 30.0}, {"a": -5.0}]
    for found, moved in zip(ends, wanted, strict=True):
        for name in path:
            assert found[name][0] == pytest.approx(starts[name], abs=1e-5)
        starts |= moved
        for name in path:
            assert found[name][1] == pytest.approx(starts[name], abs=1e-5)
    sections = list(StreamReader(tmp_path / "part.ngc", machine, 0.01, ReadOptions()).sections())
    assert sections[0].standing_mm == tuple(place[n][0] for n in path[: len(path) - 2])


def test_axes_that_stand_outside_their_travel_are_refused(tmp_path: Path) -> None:
    """Also where a toolpath moves rotary axes alone."""
    five = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    machine = replace(five, start_mm=(0.0, 0.0, 3000.0, 0.0, 0.0))
    with pytest.raises(PlanError, match=r"part.ngc:2: z stands at 3000 mm.*start_mm"):
        job_of(tmp_path, machine, "G90\nG0 A10\n")


def test_g53_outside_the_travel_names_its_line(tmp_path: Path, mill: Machine) -> None:
    with pytest.raises(PlanError, match=r"part.ngc:2: z goes to .* 2500 .*offset_mm, or"):
        job_of(tmp_path, mill, "G0 X5\nG53 G0 Z2500\n")


def test_without_a_machine_file_all_is_0(tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text("G53 G0 X3\n")
    first = next(read_toolpath(tmp_path / "part.ngc", ReadOptions()))
    assert isinstance(first, StraightMove)
    assert first.end == (3.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_journal_knows_the_start(mill: Machine) -> None:
    """A job is not continued with another start: its first section would be another curve."""
    assert machine_mark(mill) != machine_mark(replace(mill, start_mm=(1.0, 2.0, 21.0)))


@pytest.mark.parametrize("value", ["[0, 0]", "[0, 0, 5000]", '"up"'])
def test_what_start_mm_may_be(tmp_path: Path, value: str) -> None:
    text = (EXAMPLES / "machines" / "mill.toml").read_text()
    text = text.replace("../drives/", f"{EXAMPLES}/drives/")
    (tmp_path / "mill.toml").write_text(text.replace("[work]\n", f"[work]\nstart_mm = {value}\n"))
    with pytest.raises(InputError, match="start_mm"):
        load_machine(tmp_path / "mill.toml")


def test_a_start_outside_the_travel_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / "machines" / "mill.toml").read_text()
    text = text.replace("../drives/", f"{EXAMPLES}/drives/")
    (tmp_path / "mill.toml").write_text(
        text.replace("[work]\n", "[work]\nstart_mm = [0, 0, 3000]\n")
    )
    (tmp_path / "part.ngc").write_text("G0 X5\n")
    words = ["import", str(tmp_path / "part.ngc"), "--machine", str(tmp_path / "mill.toml")]
    assert main(words) == 3
    told = capsys.readouterr().err
    assert "part.ngc:1: z goes to 3000" in told
    assert "change [work] offset_mm or start_mm" in told
