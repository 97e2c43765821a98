# SPDX-License-Identifier: MIT
"""The place at which a job goes on that the controller has lost: on its path, nearest to the axes. Places of lines and
arc lengths. Run by pytest; writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError
from hodograph.stream.journal import Entry
from hodograph.stream.plan import JobFiles, Place
from hodograph.stream.resuming import nearest_place, place_of_arc, place_of_line
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[3]
PART = "G61\nF600\nG1 X10\nG1 Y10\nG1 X0\nG1 Y0\nG1 X10\n"
"""Sections of 10 mm, the last one as the first."""
Q40 = 1 << 40


@pytest.fixture(scope="module")
def machine() -> Machine:
    """The mill of the examples."""
    return load_machine(ROOT / "examples" / "machines" / "mill.toml")


@pytest.fixture
def job(tmp_path: Path, machine: Machine) -> JobFiles:
    file = tmp_path / "part.ngc"
    file.write_text(PART)
    return JobFiles((file,), machine, 0.01, ReadOptions())


def _entry(section: int, from_mm: float, to_mm: float) -> Entry:
    """A job of the controller that began with section 0."""
    starts = tuple((k, 10 * k * Q40) for k in range(section, 5))
    return Entry((), "", {}, 1, section, round(from_mm * Q40), round(to_mm * Q40), starts=starts)


@pytest.mark.parametrize(
    ("entry", "at", "section", "way", "distance"),
    [
        (_entry(0, 2.0, 15.0), (7.0, 0.001, 0.0), 0, 7.0, 0.001),
        (_entry(0, 2.0, 15.0), (10.0, 3.5, 0.0), 1, 3.5, 0.0),
        (_entry(0, 2.0, 50.0), (7.0, 0.0, 0.0), 0, 7.0, 0.0),
        (_entry(2, 2.0, 50.0), (7.0, 0.0, 0.0), 4, 7.0, 0.0),
        (_entry(0, 2.0, 15.0), (1.0, 0.0, 0.0), 0, 1.99, 0.99),
        (_entry(0, 2.0, 12.0), (10.0, 8.0, 0.0), 1, 2.01, 5.99),
        (_entry(0, 2.0, 15.0), (10.0, 0.0, 0.0), 0, 10.0, 0.0),
    ],
)
def test_nearest_places(
    job: JobFiles,
    entry: Entry,
    at: tuple[float, float, float],
    section: int,
    way: float,
    distance: float,
) -> None:
    """Only between the last place of the journal and the end of what was sent; of equal places the first."""
    found = nearest_place(job, entry, at)
    assert found.place.section == section
    assert abs(found.place.arc_q40 / Q40 - way) < 1e-5
    assert abs(found.distance_mm - distance) < 1e-5
    assert found.line == 3 + section
    off = np.linalg.norm(np.subtract(found.point_mm, at))
    assert abs(off - found.distance_mm) < 1e-9


def test_the_way_back_leaves_nothing_out(job: JobFiles) -> None:
    """Axes that coasted beyond a corner are nearest to a place that the motion has not come to."""
    found = nearest_place(job, _entry(0, 9.0, 25.0), (10.5, 1.0, 0.0))
    assert (found.place.section, found.passed is not None) == (1, True)
    assert found.passed is not None
    assert found.passed.place.section == 0
    np.testing.assert_allclose(found.passed.point_mm, (8.99, 0.0, 0.0), atol=1e-6)
    assert found.passed.line == 3


def test_a_place_at_the_start_of_a_section_is_its_start(job: JobFiles) -> None:
    """Otherwise its program stop or tool change would be passed over."""
    starts = ((2, 0),)
    entry = Entry((), "", {}, 1, 2, 0, 5 * Q40, first=2, starts=starts)
    found = nearest_place(job, entry, (10.0 - 1e-6, 10.0, 0.0))
    assert (found.place.section, found.place.arc_q40) == (2, 0)
    assert entry.place_at(1 << 20) == (2, 0)
    assert entry.place_at(1 << 30) == (2, 1 << 30)


def test_work_offset(job: JobFiles, machine: Machine) -> None:
    moved = replace(job, machine=replace(machine, offset_mm=(5.0, -3.0, 1.0)))
    found = nearest_place(moved, _entry(0, 1.0, 10.0), (9.0, -3.0, 1.0))
    assert abs(found.place.arc_q40 / Q40 - 4.0) < 1e-5
    assert found.distance_mm < 2e-6


def test_axes_that_turn_count(tmp_path: Path) -> None:
    """There and back on one line, while A goes on: the place is where A is too."""
    five = load_machine(ROOT / "examples" / "machines" / "mill_five_axes.toml")
    file = tmp_path / "part.ngc"
    file.write_text("G61\nF600\nG1 X10 A10\nG1 X0 A20\n")
    job = JobFiles((file,), five, 0.01, ReadOptions())
    found = nearest_place(job, _entry(0, 0.0, 20.0), (4.0, 0.0, 0.0, 16.5, 0.0))
    assert (found.place.section, found.line) == (1, 4)
    assert abs(found.distance_mm - 0.5**0.5 / 2.0) < 1e-4


def test_a_path_file(machine: Machine) -> None:
    two = load_machine(ROOT / "examples" / "machines" / "paper_alpha.toml")
    job = JobFiles((ROOT / "examples" / "paths.toml",), two, 0.01, ReadOptions())
    entry = Entry((), "", {}, 1, 0, 0, 100 * Q40, starts=((0, 0), (1, 50 * Q40)))
    found = nearest_place(job, entry, (52.0, 20.0))
    assert (found.place.section, found.line) == (1, 2)
    assert found.distance_mm < 1e-6


def test_a_journal_of_another_job(job: JobFiles) -> None:
    with pytest.raises(InputError, match="does not have"):
        nearest_place(job, _entry(0, 80.0, 90.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("line", "section", "at"),
    [
        (1, 0, (0.0, 0.0, 0.0)),
        (3, 0, (0.0, 0.0, 0.0)),
        (4, 1, (10.0, 0.0, 0.0)),
        (7, 4, (0.0, 0.0, 0.0)),
    ],
)
def test_a_line_begins_where_its_motion_does(
    job: JobFiles, line: int, section: int, at: tuple[float, ...]
) -> None:
    found = place_of_line(job, line)
    assert (found.place.section, found.place.arc_q40, found.line) == (section, 0, max(line, 3))
    assert found.point_mm == pytest.approx(at, abs=1e-9)


def test_a_line_has_the_work_offset(job: JobFiles, machine: Machine) -> None:
    moved = replace(job, machine=replace(machine, offset_mm=(5.0, -3.0, 1.0)))
    assert place_of_line(moved, 4).point_mm == pytest.approx((15.0, -3.0, 1.0), abs=1e-9)


def test_a_line_within_a_fitted_curve_is_not_passed(tmp_path: Path, machine: Machine) -> None:
    """And no place is far before it."""
    file, angle = tmp_path / "part.ngc", np.linspace(0.0, 3.0, 301)
    points = [(20.0 * np.sin(a), 20.0 - 20.0 * np.cos(a)) for a in angle[1:]]
    file.write_text("F6000\n" + "".join(f"G1 X{x:.4f} Y{y:.4f}\n" for x, y in points))
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    for line in (3, 50, 51, 52, 200, 301):
        found = place_of_line(job, line)
        begins_mm = 20.0 * angle[line - 2]  # line 2 begins at the start
        assert begins_mm - 8.0 < found.place.arc_q40 / Q40 < begins_mm + 0.01
        assert found.line == line


def place_in(tmp_path: Path, machine: Machine, text: str, line: int) -> tuple[int, float]:
    file = tmp_path / "part.ngc"
    file.write_text(text)
    place = place_of_line(JobFiles((file,), machine, 0.01, ReadOptions()), line).place
    return place.section, place.arc_q40 / Q40


def test_lines_that_one_segment_passes(tmp_path: Path, machine: Machine) -> None:
    """Also at the end of a section: nothing of it is left out."""
    text = "F600\nG1 X2\nG1 X4\n(no motion)\nG1 X6\nG4 P1\nG1 X8\nG1 X9\nM2\n"
    for line, place in {2: (0, 0), 3: (0, 2), 4: (0, 4), 5: (0, 4), 6: (1, 0), 8: (1, 2)}.items():
        assert place_in(tmp_path, machine, text, line) == pytest.approx(place, abs=1e-6)


def test_a_rounded_corner_begins_near_its_point(tmp_path: Path, machine: Machine) -> None:
    section, arc_mm = place_in(tmp_path, machine, "F6000\nG1 X10\nG1 Y10\nG1 X0\nM2\n", 3)
    assert (section, arc_mm) == (0, pytest.approx(10.0, abs=0.02))


def test_a_line_of_a_subroutine_is_found_where_it_runs(tmp_path: Path, machine: Machine) -> None:
    """Lines after it run before."""
    text = "F600\nO1 sub\nG91\nG1 Y3\nG1 X3\nG90\nO1 endsub\nG1 X20\nO1 call\nG1 X0 Y0\nM2\n"
    assert place_in(tmp_path, machine, text, 5) == (0, pytest.approx(23.0, abs=0.02))


def test_no_motion_at_a_line_or_after_it(job: JobFiles) -> None:
    with pytest.raises(InputError, match=r"part\.ngc: there is no motion at line 8 or after it"):
        place_of_line(job, 8)


def test_arc_lengths_count_over_all_sections(job: JobFiles) -> None:
    found = place_of_arc(job, 25.0)
    assert found.place.section == 2
    assert found.place.arc_q40 / Q40 == pytest.approx(5.0, abs=1e-9)
    assert found.point_mm == pytest.approx((5.0, 10.0, 0.0), abs=1e-9)
    assert place_of_arc(job, 20.0).place == Place(2, 0)
    with pytest.raises(InputError, match=r"50 mm, so there is no place at 50\.5 mm"):
        place_of_arc(job, 50.5)
