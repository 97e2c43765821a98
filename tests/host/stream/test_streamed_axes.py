# SPDX-License-Identifier: MIT
"""Streamed toolpaths with rotary axes that move with x, y and z: in windows, as chunks, continued in the middle. Run by
pytest; starts threads, and writes to temporary folders.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from test_chunks import MOST, ROOT, _limits, _sections, _verify

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError
from hodograph.events import SwitchedOutputs
from hodograph.job import load_job
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits
from hodograph.native.stream import OfflineStream
from hodograph.program.check import check_image
from hodograph.spline.spatial import SpatialPHSpline
from hodograph.stream import reading
from hodograph.stream.chunk import Chunk, shared_fault
from hodograph.stream.chunks import FEWEST_SHARED_PIECES, SectionChunks
from hodograph.stream.geometry import Block, blocks_from, curve_after, short_segments, with_joints
from hodograph.stream.journal import Entry
from hodograph.stream.output_check import require_outputs
from hodograph.stream.plan import JobFiles, JobPlan, Place, PlannedSection
from hodograph.stream.reading import StreamReader
from hodograph.stream.resuming import nearest_place
from hodograph.stream.simulation import concatenated, simulate_chunks
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.fit.turning import Angles
from hodograph.toolpath.moves import Dwell

MACHINES = ROOT / "examples" / "machines"
TOLERANCE = 0.01


@pytest.fixture(scope="module")
def machine() -> Machine:
    """x, y, z, a and c."""
    return load_machine(MACHINES / "mill_five_axes.toml")


def _walk(seed: int, count: int, step_mm: float, swing_deg: float) -> str:
    """G-code of a random walk in space, over which A and C swing."""
    draw = np.random.default_rng(seed)
    heading = np.cumsum(draw.normal(0.0, 0.03, count))
    step = step_mm * draw.uniform(0.4, 2.0, count)
    way = np.cumsum(step)
    x, y = np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading))
    z = np.cumsum(draw.normal(0.0, 0.02 * step_mm, count))
    a = swing_deg * np.sin(way / draw.uniform(20.0, 60.0))
    c = draw.uniform(-0.5, 0.5) * way + swing_deg * (1.0 - np.cos(way / draw.uniform(20.0, 60.0)))
    lines = (
        f"G1 X{x[k]:.4f} Y{y[k]:.4f} Z{z[k]:.4f} A{a[k]:.4f} C{c[k]:.4f}" for k in range(count)
    )
    return "\n".join(["G21 G90 G64 P0.01", "F3000", *lines, "M2", ""])


def _written(folder: Path, text: str) -> Path:
    file = folder / "turned.ngc"
    file.write_text(text)
    return file


def _short_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, chords in (
        ("FIRST_CHORDS", 30),
        ("WINDOW_CHORDS", 40),
        ("_SEARCHED", 10),
        ("_LONGEST", 1),
    ):
        monkeypatch.setattr(reading, name, chords)


def _blocks(file: Path, machine: Machine) -> list[Block]:
    (section,) = StreamReader(file, machine, TOLERANCE, ReadOptions()).sections()
    return list(section.blocks)


def _ends(curve: object) -> np.ndarray:
    """Value, rate and second derivative by arc length of the extra axes at both ends: (2, 3, E)."""
    assert isinstance(curve, SpatialPHSpline)
    ends = []
    for segment, xi in ((0, 0.0), (curve.segment_count - 1, 1.0)):
        frames = curve.frames_at(np.array([segment]), np.array([xi]))
        value = curve.extra_position(np.array([segment]), np.array([xi]))[0]
        ends.append([value, frames.r1[3:, 0], frames.r2[3:, 0]])
    return np.array(ends)


def test_windows_join_c2_within_the_tolerance(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = _written(tmp_path, _walk(5, 140, 0.6, 25.0))
    (whole,) = load_job(file, machine, TOLERANCE).sections
    _short_windows(monkeypatch)
    blocks = _blocks(file, machine)
    assert len(blocks) >= 3
    for one, other in pairwise(blocks):
        assert np.abs(_ends(one.curve)[1] - _ends(other.curve)[0]).max() < 1e-8
    reference = whole.fitted.reference
    assert reference.turn_deg is not None
    at, programmed = 0.0, reference.turn_deg[:, [0, 2]]
    for block in blocks:
        curve = block.curve
        assert isinstance(curve, SpatialPHSpline)
        s = np.linspace(0.0, curve.length_mm, 500)
        # By arc length the curve is not quite at the place of the reference: A and C change by less than 1 deg a mm.
        place = (at + s) * reference.place_mm[-1] / sum(b.curve.length_mm for b in blocks)
        off = curve.extra_point(s) - Angles.of(reference.place_mm, programmed)(place)
        assert np.abs(off).max() < 5.0 * TOLERANCE
        at += curve.length_mm


@pytest.mark.parametrize("seed", [2])
def test_setpoints_are_those_of_one_program(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    _short_windows(monkeypatch)
    file = _written(tmp_path, _walk(seed, 45, 0.8, 10.0))
    (chunks,) = _sections(file, machine)
    assert len(chunks) > 2
    assert {chunk.program.axis_count for chunk in chunks} == {5}
    _verify(chunks, machine, shared=FEWEST_SHARED_PIECES)  # one has no room for more
    assert any(chunk.header.shared_pieces > FEWEST_SHARED_PIECES for chunk in chunks[1:])


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10, 16))
def test_more_random_paths(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    _short_windows(monkeypatch)
    draw = np.random.default_rng(seed)
    file = _written(tmp_path, _walk(seed, 300, draw.uniform(0.3, 2.0), draw.uniform(1.0, 60.0)))
    (chunks,) = _sections(file, machine)
    _verify(chunks, machine, shared=1, rests=True)


@pytest.mark.long
def test_example_takes_the_time_of_the_whole_plan(machine: Machine) -> None:
    file = ROOT / "examples" / "toolpaths" / "five_axes.ngc"
    (chunks,) = _sections(file, machine)
    # The controller would refuse the first ones with more.
    run = _verify(chunks, machine, shared=FEWEST_SHARED_PIECES)
    assert run.takeovers == (len(chunks) - 1, 0)
    (section,) = load_job(file, machine).sections
    assert concatenated(chunks).duration_s < 1.005 * section.pipeline.plan.duration_s


def test_axes_that_stand_are_in_the_chunks(tmp_path: Path, machine: Machine) -> None:
    """At the last angle, and where none was programmed at 0."""
    lines = ["G21 G90 G64 P0.01 F1200", "G1 X5 C10", "G4 P0.1", "G1 X9", "G1 X9 Y4", "M2", ""]
    turned, still = _sections(_written(tmp_path, "\n".join(lines)), machine)
    for chunk in still:
        program = chunk.program
        assert np.abs(program.point_q40[3:] - np.array([[0], [10 << 40]])).max() <= 1
        assert not program.extra_q40.any()
    _verify(turned, machine, shared=0)


def _fed(chunks: list[Chunk], machine: Machine) -> np.ndarray:
    stream = OfflineStream("fixed", _limits(machine))
    for chunk in chunks:
        assert stream.give(chunk.encode()) is None
        points = stream.run(60_000, until_rest=True)
    return np.asarray(points["position_q40"][-1][:5] * 2.0**-40)


def test_a_job_goes_on_inside_a_section(tmp_path: Path, machine: Machine) -> None:
    file = _written(tmp_path, _walk(2, 16, 1.0, 10.0))
    blocks = _blocks(file, machine)
    begin_mm = 0.41 * sum(block.curve.length_mm for block in blocks)
    after = blocks_from(iter(blocks), begin_mm, SwitchedOutputs())
    made = SectionChunks(machine, "walk", after, 1, MOST, round(begin_mm * 2**40))
    chunks = [one.chunk for one in made.chunks()]
    first, curve = chunks[0].program, blocks[0].curve
    assert isinstance(curve, SpatialPHSpline)
    assert np.allclose(first.point_q40[:, 0] * 2.0**-40, curve.axes_point(begin_mm), atol=1e-9)
    end = blocks[-1].curve
    assert isinstance(end, SpatialPHSpline)
    assert np.allclose(_fed(chunks, machine), end.axes_nodes[-1], atol=1e-8)


@pytest.mark.parametrize("beside_mm", [0.0, -1e-12, -3e-11, -5e-10, 1e-12, 1e-9])
def test_a_job_that_goes_on_at_an_end_of_a_segment_has_no_piece_of_the_one_before(
    tmp_path: Path, machine: Machine, beside_mm: float
) -> None:
    """Tails end there. The rounded numbers of some 1e-12 mm of a segment are above the jerk limit of an axis."""
    (block,) = _blocks(_written(tmp_path, _walk(2, 16, 1.0, 10.0)), machine)
    ends = block.curve.segment_starts_mm
    for k, end_mm in enumerate(ends[1:-1].tolist(), 1):
        (after,) = blocks_from(iter([block]), end_mm + beside_mm, SwitchedOutputs())
        assert after.curve.segment_starts_mm[1] > 0.9 * (ends[k + 1] - end_mm)
        assert after.line.tolist() == block.line[k:].tolist()
        assert short_segments(after).line.size == short_segments(after).curve.segment_count
    begin_mm = float(ends[-4]) + beside_mm
    parts = blocks_from(iter([block]), begin_mm, SwitchedOutputs())
    made = SectionChunks(machine, "walk", parts, 1, MOST, round(begin_mm * 2**40))
    for one in made.chunks():
        assert check_image(one.chunk.image, program_limits(machine), chunk=True) is None


def test_a_job_that_goes_on_where_two_parts_meet_begins_with_the_second(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    _short_windows(monkeypatch)
    blocks = _blocks(_written(tmp_path, _walk(5, 140, 0.6, 25.0)), machine)
    length_mm = blocks[0].curve.length_mm
    for beside_mm in (-3e-7, -1e-12, 0.0, 1e-12, 3e-7):
        after = list(blocks_from(iter(blocks), length_mm + beside_mm, SwitchedOutputs()))
        assert [one.line.size for one in after] == [one.line.size for one in blocks[1:]]


def test_parts_of_a_curve_have_its_extra_axes(tmp_path: Path, machine: Machine) -> None:
    (block,) = _blocks(_written(tmp_path, _walk(4, 25, 1.0, 20.0)), machine)
    curve = block.curve
    assert isinstance(curve, SpatialPHSpline)
    s = np.linspace(0.0, curve.length_mm, 300)
    cut = with_joints(curve, np.array([0.1, 0.2, 3.3, 0.7 * curve.length_mm]))
    assert isinstance(cut, SpatialPHSpline)
    assert cut.segment_count == curve.segment_count + 4
    assert np.abs(cut.axes_point(s) - curve.axes_point(s)).max() < 1e-10
    begin_mm = 0.37 * curve.length_mm
    _, rest = curve_after(curve, begin_mm)
    assert isinstance(rest, SpatialPHSpline)
    own = s[s > begin_mm]
    assert np.abs(rest.axes_point(own - begin_mm) - curve.axes_point(own)).max() < 1e-10


TURNED_ALONE = """G21 G90 G61 F3600
G0 A6 C20
G1 X6 C23
G4 P0.1
G1 A3
G1 C30
M2
"""
"""A job of the controller for the first line, one for the second, one for the other two with their exact stop."""


def _planned(file: Path, machine: Machine, begin: Place) -> list[tuple[PlannedSection, Chunk]]:
    job = JobFiles((file,), machine, TOLERANCE, ReadOptions())
    found = list[tuple[PlannedSection, Chunk]]()
    with JobPlan(job, MOST, 5, begin, processes=1) as plan, suppress(IndexError):
        while (item := plan.item(len(found), 100.0)) is not None:
            found.append(item[:2])
    return found


def test_axes_that_turn_alone_have_jobs_of_their_own(tmp_path: Path, machine: Machine) -> None:
    found = _planned(_written(tmp_path, TURNED_ALONE), machine, Place())
    assert [one.number for one, _ in found] == sorted(one.number for one, _ in found)
    begun = [(one, chunk) for one, chunk in found if chunk.header.first]
    axes = [(chunk.program.first_axis, chunk.program.axis_count) for _, chunk in begun]
    assert axes == [(3, 2), (0, 5), (3, 2)]
    assert [one.standing_mm for one, _ in begun] == [(0.0, 0.0, 0.0), (), (6.0, 0.0, 0.0)]
    assert [one.before for one, _ in begun] == [(), (), (Dwell(4, 0.1),)]
    assert [chunk.header.job for _, chunk in begun] == [5, 6, 7]
    ends = []
    for _, first in begun:
        own = [chunk for _, chunk in found if chunk.header.job == first.header.job]
        moved = machine.turning if first.program.first_axis else machine
        limits = NativeLimits(**asdict(program_limits(moved)), chunk=1)
        last: list[np.ndarray] = []
        for before, chunk in zip([None, *own], own, strict=False):
            assert check_image(chunk.image, program_limits(moved), chunk=True) is None
            assert shared_fault(chunk, before) is None
        simulate_chunks(own, limits, "fixed", moved.path_counts, last.append)
        ends.append((last[-1][-1] / np.array(moved.path_counts)).tolist())
    assert ends == [[6.0, 20.0], [6.0, 0.0, 0.0, 6.0, 23.0], [3.0, 30.0]]


def test_a_job_goes_on_where_axes_turn_alone(tmp_path: Path, machine: Machine) -> None:
    file = _written(tmp_path, TURNED_ALONE)
    number = _planned(file, machine, Place())[-1][0].number
    first = _planned(file, machine, Place(number, 3 << 40))[0]
    assert (first[0].number, first[0].before) == (number, ())
    assert first[1].header.job_start_q40 == 3 << 40
    start = first[1].program.point_q40[:, 0] * 2.0**-40
    assert np.allclose(start, [3.0, 26.0], atol=1e-6)
    entry = Entry((), "", {}, 1, 0, 0, 100 << 40, starts=tuple((k, 0) for k in range(number + 1)))
    job = JobFiles((file,), machine, TOLERANCE, ReadOptions())
    found = nearest_place(job, entry, (6.0, 0.0, 0.0, 3.0, 26.5))
    assert (found.place.section, found.line) == (number, 6)
    assert abs(found.place.arc_q40 * 2.0**-40 - 3.5) < 1e-3
    assert found.distance_mm < 1e-3


@pytest.mark.parametrize("line", ["G1 X3 A90", "G0 b-1 X4", "N7 g1 x3 c [45]", "G1 X3 A#1"])
def test_an_axis_that_the_machine_lacks_is_refused_before_anything_moves(
    tmp_path: Path, line: str
) -> None:
    mill = load_machine(MACHINES / "mill.toml")
    file = _written(tmp_path, f"G21 G90 F600\n#1=9\nG1 X1 A0 (A90)\n{line}\nG1 X2\nM2\n")
    with pytest.raises(InputError, match=r"turned.ngc:4: the move turns [ABC], but no axis [abc]"):
        require_outputs(file, mill, ReadOptions())
