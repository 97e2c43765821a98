# SPDX-License-Identifier: MIT
"""Rotary axes that move with a toolpath: smooth, within the tolerance, and run on a machine. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError, PlanError
from hodograph.job import load_job
from hodograph.job_simulation import simulate_job, write_job_trace
from hodograph.spline.spatial import SpatialPHSpline
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.fit.fitting import FittedPath, Tolerance, fit
from hodograph.toolpath.fit.reference import Reference
from hodograph.toolpath.fit.sections import divided
from hodograph.toolpath.fit.speeds import MotionLimits
from hodograph.toolpath.fit.turning import Angles, turning_bound_deg, with_turning
from hodograph.toolpath.gcode import read_gcode

ROOT = Path(__file__).resolve().parent.parent.parent.parent
MACHINES = ROOT / "examples" / "machines"
TOLERANCE = 0.01


@pytest.fixture(scope="module")
def five() -> Machine:
    return load_machine(MACHINES / "mill_five_axes.toml")


def program(folder: Path, text: str) -> Path:
    file = folder / "part.ngc"
    file.write_text(text)
    return file


def turned(points: np.ndarray, angles: np.ndarray) -> tuple[FittedPath, Angles]:
    count = len(points) - 1
    feed = np.full(count, np.inf)
    reference = Reference(points, np.arange(1, count + 1), feed, np.zeros(count), angles)
    found = fit(reference, Tolerance(TOLERANCE, MotionLimits(200.0, 2000.0, 50000.0)))
    assert isinstance(found, FittedPath)
    target = Angles.of(found.arc_length_at(reference.place_mm), angles)
    return with_turning(found, (0, 1, 2), TOLERANCE), target


def smooth_program() -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 1.0, 120)
    points = np.stack((40.0 * np.cos(3 * t), 40.0 * np.sin(3 * t), 5.0 * t), axis=1)
    return points, np.stack((20.0 * np.sin(2 * t), 0.0 * t, 170.0 * t**2), axis=1)


def hard_program() -> tuple[np.ndarray, np.ndarray]:
    """Legs from 1 um to 100 mm, rates that jump, angles with noise."""
    rng = np.random.default_rng(3)
    legs = 10.0 ** rng.uniform(-3.0, 2.0, size=40)
    way = np.cumsum(np.column_stack((legs, legs * rng.uniform(-0.5, 0.5, 40), 0 * legs)), axis=0)
    angles = np.cumsum(rng.choice([0.0, 0.001, 1.0, 30.0], size=(40, 3)), axis=0)
    zero = np.zeros((1, 3))
    return np.vstack((zero, way)), np.vstack((zero, angles))


@pytest.mark.parametrize("make", [smooth_program, hard_program])
def test_angles_are_smooth_and_within_the_tolerance(make: object) -> None:
    points, angles = smooth_program() if make is smooth_program else hard_program()
    path, target = turned(points, angles)
    curve = path.curve
    bound = turning_bound_deg(curve, target).max()
    assert path.turning_deg == bound
    s = np.linspace(0.0, curve.length_mm, 20001)
    off = np.linalg.norm(curve.extra_point(s) - target(s), axis=1).max()
    assert off <= bound <= TOLERANCE
    assert off >= 0.1 * TOLERANCE
    assert np.array_equal(curve.axes_nodes[[0, -1], 3:], angles[[0, -1]])
    before = np.arange(curve.segment_count - 1)
    ends, starts = (
        curve.frames_at(segment, np.full(before.size, xi))
        for segment, xi in ((before, 1.0), (before + 1, 0.0))
    )
    for one, other in ((ends.r1, starts.r1), (ends.r2, starts.r2)):
        assert np.allclose(one, other, rtol=1e-6, atol=1e-6 * np.abs(one).max())


def test_joints_for_angles_leave_the_curve_as_it_is() -> None:
    points, angles = hard_program()
    path, _ = turned(points, angles)
    plain, _ = turned(points, np.zeros_like(angles))
    assert path.curve.segment_count > plain.curve.segment_count
    s = np.linspace(0.0, plain.curve.length_mm, 2001)
    assert path.curve.length_mm == pytest.approx(plain.curve.length_mm, rel=1e-12)
    assert np.abs(path.curve.point(s) - plain.curve.point(s)).max() < 1e-9
    assert path.deviation_mm == plain.deviation_mm


def test_angles_that_stay_are_constant() -> None:
    points, _ = smooth_program()
    path, _ = turned(points, np.tile([5.0, 0.0, -3.0], (len(points), 1)))
    assert np.array_equal(np.unique(path.curve.extra, axis=0)[0, :, 0], [5.0, 0.0, -3.0])
    assert np.ptp(path.curve.extra, axis=(0, 2)).max() == 0.0


def test_arcs_turn_in_proportion_and_later_moves_keep_the_angle() -> None:
    text = "G21 F600\nG1 X10\nG3 X10 Y20 J10 A90 C-30\nG1 X0\nM2"
    (section,) = divided(read_gcode(text.splitlines()), TOLERANCE, "part.ngc").sections
    angles = section.reference.turn_deg
    assert angles is not None
    arc = section.reference.line == 3
    first, last = np.flatnonzero(arc)[[0, -1]]
    assert np.allclose(angles[first : last + 2, 0], np.linspace(0.0, 90.0, last - first + 2))
    assert angles[-1].tolist() == [90.0, 0.0, -30.0]
    assert not angles[: first + 1].any()


def test_a_program_of_five_axes_runs_to_its_end(tmp_path: Path, five: Machine) -> None:
    lines = [f"X{k:g} Y{0.02 * k * k:g} A{0.5 * k:g} C{-2 * k:g}" for k in range(1, 13)]
    text = "\n".join(["G21 G1 F1500", *lines, "G93 X20 Y8 C0 F60", "M2"])
    job = load_job(program(tmp_path, text), five)
    run = simulate_job(job)
    (motion,) = run.motions
    said = run.summary()["deviation_bound_deg"]
    assert said == job.sections[0].turning_summary["deviation_bound_deg"] == job.deviation_deg
    assert isinstance(said, float)
    assert 0.001 < said <= 0.01
    assert np.allclose(motion.cmd_mm[-1], [20.0, 8.0, 0.0, 6.0, 0.0], atol=1e-9)
    line = job.sections[0].line_at(motion.arc_length_mm)
    timed_s = np.count_nonzero(line == 14) * run.period_s
    assert 1.0 <= timed_s < 1.3, "G93 F60 asks for a second, a stop comes at the end"
    at = np.flatnonzero(np.diff(line))[5]
    x, angle = motion.cmd_mm[at, 0], motion.cmd_mm[at, 3]
    assert angle == pytest.approx(0.5 * x, abs=0.06)


def test_what_cannot_turn_is_refused_with_its_line(tmp_path: Path, five: Machine) -> None:
    mill = load_machine(MACHINES / "mill.toml")
    cases = (
        (five, "F600\nG1 X5\nG0 B9\n", ":3: the move turns B, but no axis b of"),
        (mill, "F600\nG1 X5\nG0 A90\n", ":3: the move turns A, but no axis a of mill.toml"),
        (five, "F600\nG1 X5\nG1 X6 B9\n", ":3: the move turns B, but no axis b of"),
        (mill, "F600\nG1 X5 A1\n", ":2: the move turns A, but no axis a of mill.toml"),
    )
    for machine, text, words in cases:
        with pytest.raises(InputError, match=words):
            load_job(program(tmp_path, text), machine)
    with pytest.raises(PlanError, match=r":3: a goes to .* … 125 deg with the work offset"):
        load_job(program(tmp_path, "F600\nG1 X5\nG1 X90 A125\nX99\n"), five)
    file = program(tmp_path, "F600\nG1 X5 A1\nX9\n")
    with pytest.raises(InputError, match=r":2: the move turns A, but no axis a of mill.toml"):
        list(StreamReader(file, mill, TOLERANCE, ReadOptions()).sections())


def test_axes_that_the_program_does_not_turn_stand(tmp_path: Path, five: Machine) -> None:
    job = load_job(program(tmp_path, "F600\nG1 X5 C3\nX9\n"), five)
    curve = job.sections[0].fitted.curve
    assert curve.axes == 5
    assert not curve.axes_nodes[:, 3].any()
    assert curve.axes_nodes[-1, 4] == 3.0
    plain = load_job(program(tmp_path, "F600\nG1 X5\nX9\n"), five).sections[0].pipeline.curve
    assert isinstance(plain, SpatialPHSpline)
    assert plain.axes == 5
    assert not plain.extra.any()


ALONE = """G21 G94 G64
G1 X30 Y5 Z-2 F1200
A90 F360
X33 A80 F1200
C90 A0 F3600
C180 A30
G93 A10 F30
G94 X40 F1200
M2
"""


def test_moves_that_only_turn_are_programs_with_the_feed_of_the_file(
    tmp_path: Path, five: Machine
) -> None:
    job = load_job(program(tmp_path, ALONE), five)
    alone = [section.stands_at for section in job.sections]
    assert alone == [None, (30.0, 5.0, -2.0), None, (33.0, 5.0, -2.0), None]
    assert job.length_mm == pytest.approx(np.sqrt(30.0**2 + 5**2 + 2**2) + 10.0, abs=0.01)
    run = simulate_job(job)
    first, last = run.motions[1], run.motions[3]
    assert first.feed_mm_s.max() == pytest.approx(6.0, rel=1e-3)
    assert 15.0 < first.ticks * run.period_s < 15.3, "90 degrees at 360 degrees a minute"
    line = job.sections[3].line_at(last.arc_length_mm[: last.ticks])
    timed_s = np.count_nonzero(line == 7) * run.period_s
    assert 2.0 <= timed_s < 2.3, "G93 F30 asks for two seconds, a stop comes at the end"
    ends = [job.sections[k].places(run.motions[k].cmd_mm)[-1] for k in range(5)]
    assert np.allclose(ends[1], [30.0, 5.0, -2.0, 90.0, 0.0], atol=1e-9)
    assert np.allclose(ends[3], [33.0, 5.0, -2.0, 10.0, 180.0], atol=1e-9)
    for end, motion, section in zip(ends, run.motions[1:], job.sections[1:], strict=False):
        assert np.allclose(section.places(motion.cmd_mm)[0], end, atol=1e-9)


def test_the_trace_of_a_move_that_only_turns_has_all_axes(tmp_path: Path, five: Machine) -> None:
    offset = replace(five, offset_mm=(100.0, 0.0, 20.0, 5.0, 0.0))
    file = tmp_path / "trace.csv"
    write_job_trace(simulate_job(load_job(program(tmp_path, "G1 X3 F600\nG0 A40\n"), offset)), file)
    table = np.genfromtxt(file, delimiter=",", names=True)
    turns = table["line"] == 2
    assert np.ptp(table["arc_length_mm"][turns]) == 0.0
    assert set(table["x_cmd_mm"][turns]) == set(table["x_act_mm"][turns]) == {3.0}
    assert set(table["z_cmd_mm"]) == {0.0}
    assert table["a_cmd_deg"][-1] == pytest.approx(40.0, abs=1e-9)
    assert table["a_act_deg"][-1] == pytest.approx(40.0, abs=1e-3)


def test_one_turning_axis_is_enough(tmp_path: Path, five: Machine) -> None:
    four = replace(five, path_count=4, offset_mm=five.offset_mm[:4])
    job = load_job(program(tmp_path, "G1 Z4 X1 F600\nG1 A40 F3600\nX3\n"), four)
    (_, turning, _) = simulate_job(job).motions
    moved = job.sections[1].pipeline.machine
    assert moved.path_names == ("z", "a")
    assert np.allclose(turning.cmd_mm[[0, -1]], [[4.0, 0.0], [4.0, 40.0]], atol=1e-9)
    assert np.ptp(turning.cmd_mm[:, 0]) == 0.0


def test_three_turning_axes_draw_a_path_in_space(tmp_path: Path, five: Machine) -> None:
    b = replace(five.axes[4], name="b", node=7)
    six = replace(five, axes=(*five.axes, b), path_count=6, offset_mm=(0.0,) * 6)
    job = load_job(program(tmp_path, "G1 X1 F600\nA10 B20 C30 F3600\nA0 C40\n"), six)
    turning = simulate_job(job).motions[1]
    assert job.sections[1].fitted.deviation_mm <= TOLERANCE
    assert np.allclose(turning.cmd_mm[-1], [0.0, 40.0, 20.0], atol=1e-9), "a, c, b"


def test_turning_alone_is_one_program_that_only_run_takes(tmp_path: Path, five: Machine) -> None:
    job = load_job(program(tmp_path, "G0 C-90\n"), five)
    with pytest.raises(PlanError, match=r"moves rotary axes alone.*not compile"):
        job.only_section("compile")
    with pytest.raises(PlanError, match=r":1: c goes to -4000 … 0 deg"):
        load_job(program(tmp_path, "G0 C-4000\n"), five)


def test_less_way_than_a_path_needs_is_made_good_later(tmp_path: Path, five: Machine) -> None:
    text = "G1 X5 F600\nX5.001 A10 F3600\nX5.0015 A20\nX5.01 F600\nX9\n"
    job = load_job(program(tmp_path, text), five)
    assert [section.stands_at for section in job.sections] == [None, (5.0, 0.0, 0.0), None]
    points = job.sections[2].fitted.reference.point
    assert points[[0, -1], 0].tolist() == [5.0, 9.0]


def test_a_feed_that_is_given_replaces_that_of_moves_that_turn(
    tmp_path: Path, five: Machine
) -> None:
    """In degrees per second; F is not needed then."""
    file = tmp_path / "part.ngc"
    ticks = []
    for text in ("G1 A9 F360\n", "G1 A9\n", "G1 A9 F60\n"):
        file.write_text(text)
        (section,) = load_job(file, five, reading=ReadOptions(feed_mm_s=30.0)).sections
        ticks.append(section.pipeline.program.ticks)
    assert len(set(ticks)) == 1
    (slow,) = load_job(file, five).sections
    assert slow.pipeline.program.ticks > 10 * ticks[0]
