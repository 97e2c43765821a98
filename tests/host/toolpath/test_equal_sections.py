# SPDX-License-Identifier: MIT
"""Equal sections of a job share curve, plan and program: nothing but the place of their points may depend on that. Run
by pytest; writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from hodograph import job as jobs
from hodograph.config import Machine, load_machine
from hodograph.equal_sections import EqualSections, SharedPrograms, moved_program
from hodograph.errors import PlanError
from hodograph.job import Job, load_job
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.program import Program, encode
from hodograph.program.check import BOX_ROUNDING_Q40, TRAVEL_SLACK_Q40, boxes_q40, leaves_range
from hodograph.toolpath.fit.fitting import FittedPath, Tolerance, fit
from hodograph.toolpath.fit.sections import Section, divided
from hodograph.toolpath.fit.speeds import MotionLimits
from hodograph.toolpath.gcode import read_gcode

MACHINES = Path(__file__).resolve().parents[3] / "examples" / "machines"


class NoneEqual(EqualSections):
    """Finds no equal section."""

    def find(self, section: Section) -> None:
        """None."""

    def add(self, section: Section, fitted: FittedPath) -> SharedPrograms:
        """Shared by none."""
        return SharedPrograms()


@pytest.fixture(scope="module")
def mill() -> Machine:
    return load_machine(MACHINES / "mill.toml")


@pytest.fixture(scope="module")
def five() -> Machine:
    return load_machine(MACHINES / "mill_five_axes.toml")


def both(folder: Path, text: str, machine: Machine) -> tuple[Job, Job]:
    """The job of a program, and the same where no section is equal to another one."""
    file = folder / "part.ngc"
    file.write_text(text)
    shared = load_job(file, machine)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "EqualSections", NoneEqual)
        return shared, load_job(file, machine)


def different(job: Job) -> int:
    """How many sections are equal to none before."""
    return len({id(section.pipeline.shared) for section in job.sections})


def require_same_programs(shared: Job, alone: Job) -> None:
    """All programs of two jobs are equal: the curve to 2^-40 mm, the feed to what rounding in the planner does to
    coefficients of high powers, 2^-26 mm.
    """
    for one, other in zip(shared.sections, alone.sections, strict=True):
        own, wanted = one.pipeline.program, other.pipeline.program
        assert np.abs(own.point_q40 - wanted.point_q40).max() <= 1
        assert np.abs(own.pieces.start_q40 - wanted.pieces.start_q40).max() <= 1
        assert np.abs(own.pieces.c_q40 - wanted.pieces.c_q40).max() < 1 << 14
        pieces = replace(own.pieces, start_q40=wanted.pieces.start_q40, c_q40=wanted.pieces.c_q40)
        same = replace(own, point_q40=wanted.point_q40, pieces=pieces)
        assert encode(same) == encode(wanted)
        assert (one.first_line, one.last_line) == (other.first_line, other.last_line)
        assert one.pipeline.accepted.image == encode(own)
        limits = NativeLimits(**asdict(program_limits(one.pipeline.machine)))
        assert NativeProgram(encode(own)).check(limits) is None


def test_holes_of_a_grid_are_planned_once(tmp_path: Path, mill: Machine) -> None:
    places = [(x, y) for x in (10, 20.5, 31) for y in (-4, 6.25)]
    holes = [f"G0 X{x} Y{y}\nG1 Z-3\nG0 Z5" for x, y in places]
    shared, alone = both(tmp_path, "\n".join(["G21 F600", "G0 Z5", *holes, "M2"]), mill)
    assert len(shared.sections) == different(alone) == 7
    assert different(shared) == 4, "to the first hole, along y, back to the next column, up"
    require_same_programs(shared, alone)


def test_places_that_are_rounded(tmp_path: Path, mill: Machine) -> None:
    """Coordinates in 1/10 mm are no doubles: their differences are equal to 2^-40 mm only."""
    holes = [f"G0 X{0.1 + 10.1 * k:.1f} Y{-0.3 * k:.1f}\nG1 Z-3.3\nG0 Z5" for k in range(6)]
    file = tmp_path / "part.ngc"
    file.write_text("\n".join(["G21 F600", "G0 Z5", *holes, "M2"]))
    job = load_job(file, mill)
    assert (len(job.sections), different(job)) == (7, 3)
    for section in job.sections:
        program, start_mm = section.pipeline.program, section.fitted.reference.point[0]
        assert np.abs(program.point_q40[:, 0] - np.rint(start_mm * 2.0**40)).max() <= 1
        assert section.pipeline.accepted.image == encode(program)


TWICE = "G21 F600\nG1 X3 Y1\nG1 X4 Y4\nG4 P0.1\n{}G1 X7 Y5\nG1 X8 Y8\nM2\n"


@pytest.mark.parametrize(
    ("between", "count"), [("", 1), ("F900\n", 2), ("G64 P0.004\n", 2), ("G61\n", 3)]
)
def test_other_terms_are_other_sections(
    tmp_path: Path, mill: Machine, between: str, count: int
) -> None:
    shared, alone = both(tmp_path, TWICE.format(between), mill)
    assert different(shared) == count
    require_same_programs(shared, alone)


@pytest.mark.parametrize(
    ("first", "second"),
    [("", ""), ("", "M62 P0\n"), ("M62 P0\n", "M62 P0\n"), ("M62 P0\n", "M63 P0\n")],
)
def test_outputs_on_the_way_are_in_the_program(tmp_path: Path, first: str, second: str) -> None:
    """Sections with other events share the plan, and have programs of their own."""
    dispenser = load_machine(MACHINES / "dispenser.toml")
    text = f"G21 F600\nG1 X3 Y1\n{first}G1 X4 Y4\nG4 P0.1\nG1 X7 Y5\n{second}G1 X8 Y8\nM2\n"
    shared, alone = both(tmp_path, text, dispenser)
    require_same_programs(shared, alone)
    assert different(shared) == 1
    with_events = [len(one.pipeline.program.events) > 0 for one in shared.sections]
    assert with_events == [bool(first), bool(second)]


def test_axes_that_turn_along_are_shared(tmp_path: Path, five: Machine) -> None:
    """The second of three has the angles of the first, the last one has others."""
    moves = [
        f"G0 X{x} Y0 Z0\nG4 P0.1\nG1 X{x + 4} A{a}\nG1 Y3 A0\nG4 P0.1"
        for x, a in ((0, 6), (0.3, 6), (0.6, 7))
    ]
    shared, alone = both(tmp_path, "\n".join(["G21 F600", *moves, "M2"]), five)
    turning = [one for one in shared.sections if one.fitted.turning_deg]
    assert len({id(one.pipeline.shared) for one in turning}) == 2
    assert turning[0].fitted.curve.extra is turning[1].fitted.curve.extra
    assert len(shared.sections) == len(alone.sections)
    for section in shared.sections:
        assert section.pipeline.accepted.image == encode(section.pipeline.program)
    ends = [one.fitted.curve.axes_nodes[-1].tolist() for one in turning]
    assert np.allclose(ends, [[4, 3, 0, 0, 0], [4.3, 3, 0, 0, 0], [4.6, 3, 0, 0, 0]], atol=1e-9)


def test_axes_that_turn_alone(tmp_path: Path, five: Machine) -> None:
    """From another angle, and with x, y and z at another place."""
    text = "G21 F600\nG0 C30\nG4 P0.1\nG0 C60\nG0 X1\nG4 P0.1\nG0 C90\nM2\n"
    shared, alone = both(tmp_path, text, five)
    alone_turning = [one for one in shared.sections if one.stands_at is not None]
    assert [one.standing_mm[0] for one in alone_turning] == [0, 0, 1]
    assert len({id(one.pipeline.shared) for one in alone_turning}) == 2
    require_same_programs(shared, alone)


def test_a_hole_outside_the_travel_is_refused_with_its_line(tmp_path: Path, mill: Machine) -> None:
    file = tmp_path / "part.ngc"
    file.write_text("G21 F600\nG0 X900\nG4 P1\nG0 X1800\nG4 P1\nG0 X2700\nM2\n")
    with pytest.raises(PlanError, match=r"part\.ngc:6: x goes to .*2700"):
        load_job(file, mill)


def sections_of(text: str) -> list[Section]:
    """As `load_job` divides them."""
    return divided(read_gcode(text.splitlines()), 0.01, "-").sections


def test_what_makes_sections_equal() -> None:
    first, second = sections_of(TWICE.format(""))
    fitted = fit(first.reference, Tolerance(0.01, MotionLimits(100.0, 2000.0, 50000.0)), first.tied)
    assert isinstance(fitted, FittedPath)
    known = EqualSections()
    shared = known.add(first, fitted)
    found = known.find(second)
    assert found is not None
    assert found.shared is shared
    assert np.allclose(found.fitted.curve.nodal_points[-1], [8, 8, 0], atol=1e-9)
    own = second.reference
    turn_deg = np.zeros_like(own.point)
    others = (
        replace(second, tolerance_mm=0.009),
        replace(second, tied=(True, False)),
        replace(second, stands_at=(0.0, 0.0, 0.0)),
        replace(second, reference=replace(own, feed_mm_s=own.feed_mm_s * 1.01)),
        replace(second, reference=replace(own, sag_mm=own.sag_mm + 1e-6)),
        replace(second, reference=replace(own, turn_deg=turn_deg)),
        replace(second, reference=replace(own, point=own.point * (1.0 + 1e-9))),
    )
    for other in others:
        assert known.find(other) is None


@pytest.mark.parametrize(("far_mm", "is_known"), [(8191.0, True), (8192.0, False), (9e8, False)])
def test_points_too_far_apart_are_not_compared(far_mm: float, is_known: bool) -> None:
    (section,) = sections_of(f"F600\nG1 X{far_mm:.1f}\nM2")
    fitted = fit(section.reference, Tolerance(0.01, MotionLimits(100.0, 2000.0, 50000.0)))
    assert isinstance(fitted, FittedPath)
    known = EqualSections()
    known.add(section, fitted)
    assert (known.find(section) is not None) == is_known


def shifted(program: Program, axis: int, by_q40: int) -> Program:
    """With one axis elsewhere."""
    point = program.point_q40.copy()
    point[axis] += by_q40
    return replace(program, point_q40=point)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("high", [True, False])
def test_what_is_moved_is_within_the_limits_of_the_controller(
    tmp_path: Path, mill: Machine, axis: int, high: bool
) -> None:
    """Around the limits of travel: what `leaves_range` lets pass, the controller accepts; it lets pass all but a few
    units of what the controller accepts.
    """
    file = tmp_path / "part.ngc"
    file.write_text("G21 F600\nG1 X3 Y4 Z-2\nG1 X5.123 Y4.7\nG1 X5.5 Y7 Z1\nM2\n")
    pipeline = load_job(file, mill).sections[0].pipeline
    judged, limits = pipeline._judged, program_limits(mill)
    low_q40, high_q40 = boxes_q40(pipeline.program)
    edge = (limits.max_q40_mm if high else limits.min_q40_mm)[axis]
    sign = 1 if high else -1
    box = int(high_q40[:, axis].max() if high else low_q40[:, axis].min())
    to_edge = edge + sign * int(TRAVEL_SLACK_Q40) - box
    native = NativeLimits(**asdict(limits))
    most = int(BOX_ROUNDING_Q40)
    passed = []
    for units in range(-2 * most, 2 * most + 1):
        moved = shifted(pipeline.program, axis, to_edge + sign * units)
        is_accepted = NativeProgram(encode(moved)).check(native) is None
        made = moved_program(judged, moved.point_q40[:, 0], limits)
        passed.append((made is not None, is_accepted))
        assert (made is None) == leaves_range(moved, limits)
        if made is not None:
            assert is_accepted
            assert made.native.image == encode(moved)
    assert passed[0] == (True, True)
    assert passed[-1] == (False, False)
    assert 0 < sum(is_accepted for _, is_accepted in passed) - sum(own for own, _ in passed) < 13


def test_points_beyond_the_format(tmp_path: Path, mill: Machine) -> None:
    """On a machine with all travel that a program can have."""
    file = tmp_path / "part.ngc"
    file.write_text("G21 F600\nG1 X3 Y4 Z-2\nM2\n")
    pipeline = load_job(file, mill).sections[0].pipeline
    limits = replace(
        program_limits(mill), min_q40_mm=(-(5000 << 40),) * 3, max_q40_mm=(5000 << 40,) * 3
    )
    program, native = pipeline.program, NativeLimits(**asdict(limits))
    last = (4096 << 40) - 1
    for sign in (-1, 1):
        greatest = int((sign * program.point_q40[0]).max())
        for units, is_beyond in ((-1, False), (0, False), (1, True), (2, True)):
            moved = shifted(program, 0, sign * (last - greatest + units))
            assert leaves_range(moved, limits) == is_beyond
            fault = NativeProgram(encode(moved)).check(native)
            assert (fault is not None) == is_beyond
