# SPDX-License-Identifier: MIT
"""Path files with several paths: what they may say, and the job that they become. Run by pytest; starts threads, and
writes to temporary folders.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from hodograph import pipeline
from hodograph.cli.main import main
from hodograph.cli.stream_command import has_paths
from hodograph.config import Machine, load_machine, load_path_file, load_paths
from hodograph.errors import InputError, PlanError
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeFault, NativeLimits
from hodograph.program.inspection import end_point_q40
from hodograph.stream import paths
from hodograph.stream.chunk import Chunk, Rest
from hodograph.stream.chunks import CHUNK_BYTES
from hodograph.stream.journal import Entry
from hodograph.stream.paths import PathsJob
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.resuming import nearest_place
from hodograph.stream.simulation import simulate_chunks
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.moves import Dwell, ProgramStop

ROOT = Path(__file__).resolve().parents[3]
PATHS = ROOT / "examples" / "paths.toml"
FACETS = ROOT / "examples" / "facets.toml"
MACHINE = ROOT / "examples" / "machines" / "paper_alpha.toml"


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Two axes."""
    return load_machine(MACHINE)


def _planned(
    machine: Machine, begin: Place, file: Path = PATHS
) -> list[tuple[int, Chunk, tuple[object, ...]]]:
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    with JobPlan(job, CHUNK_BYTES, 7, begin) as plan:
        found = []
        with suppress(IndexError):
            while (item := plan.item(len(found), 100.0)) is not None:
                section, chunk, _ = item
                found.append((section.number, chunk, section.before))
        assert plan.section_count == len(found)
        return found


def test_paths_are_one_job(machine: Machine) -> None:
    found = _planned(machine, Place())
    headers = [chunk.header for _, chunk, _ in found]
    assert [one.rest for one in headers] == [None, Rest(500), Rest(stop=True)]
    assert [one.joined for one in headers] == [True, True, False]
    assert [one.line for one in headers] == [1, 2, 3]
    assert {one.job for one in headers} == {7}
    assert [before for _, _, before in found] == [(), (Dwell(2, 0.5),), (ProgramStop(3, False),)]
    limits = NativeLimits(**asdict(program_limits(machine)), chunk=1)
    chunks = [chunk for _, chunk, _ in found]
    run = simulate_chunks(chunks, limits, "fixed", machine.counts_per_mm)
    own = sum(-(-chunk.program.duration_q32_s * 1000 // 2**32) + 1 for chunk in chunks)
    assert (run.ticks, run.sections) == (own + 500 + 8, 3)


def test_a_long_list_of_paths_goes_on_as_another_job(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paths, "ENOUGH_Q40", _planned(machine, Place())[1][1].header.job_start_q40)
    found = _planned(machine, Place())
    headers = [chunk.header for _, chunk, _ in found]
    assert [(one.job, one.first, one.last) for one in headers] == [
        (7, True, True),
        (8, True, True),
        (9, True, True),
    ]
    assert [before for _, _, before in found] == [(), (Dwell(2, 0.5),), (ProgramStop(3, False),)]
    limits = NativeLimits(**asdict(program_limits(machine)), chunk=1)
    for _, chunk, _ in found:
        simulate_chunks([chunk], limits, "fixed", machine.counts_per_mm)


def test_a_job_of_paths_goes_on_inside_a_path(machine: Machine) -> None:
    whole = _planned(machine, Place())[1][1]
    at_q40 = whole.program.length_q40 // 3
    found = _planned(machine, Place(1, at_q40))
    assert [number for number, _, _ in found] == [1, 2]
    first = found[0][1]
    assert found[0][2] == ()
    assert (first.header.first, first.header.job, first.header.job_start_q40) == (True, 8, at_q40)
    rest = whole.program.length_q40 - at_q40
    assert abs(first.program.length_q40 - rest) < 2**14
    near = np.abs(end_point_q40(first.program) - end_point_q40(whole.program))
    assert near.max() < 2**14
    assert found[1][1].header.job_start_q40 == at_q40 + first.program.length_q40


def test_ends_of_programs(machine: Machine) -> None:
    for _, chunk, _ in _planned(machine, Place(2)):
        program = chunk.program
        assert np.allclose(program.point_q40[:, 0] * 2.0**-40, [40, 40], atol=1e-9)
        assert np.allclose(end_point_q40(program) * 2.0**-40, [0, 0], atol=1e-9)


@pytest.fixture(scope="module")
def five() -> Machine:
    """Five axes."""
    return load_machine(ROOT / "examples" / "machines" / "mill_five_axes.toml")


@pytest.fixture(scope="module")
def facets(five: Machine) -> list[tuple[int, Chunk, tuple[object, ...]]]:
    """The example whose axes turn alone, from its start on."""
    return _planned(five, Place(), FACETS)


def test_axes_turn_alone_between_paths(
    five: Machine, facets: list[tuple[int, Chunk, tuple[object, ...]]]
) -> None:
    found = facets
    headers = [chunk.header for _, chunk, _ in found]
    assert [chunk.program.first_axis for _, chunk, _ in found] == [0, 3, 0]
    assert [(one.first, one.last, one.joined, one.rest) for one in headers] == [
        (True, True, False, None)
    ] * 3
    assert [one.job for one in headers] == [7, 8, 9]
    assert [before for _, _, before in found] == [(), (Dwell(2, 0.2),), ()]
    ends = []
    for _, chunk, _ in found:
        moved = five.turning if chunk.program.first_axis else five
        limits = NativeLimits(**asdict(program_limits(moved)), chunk=1)
        last: list[np.ndarray] = []
        simulate_chunks([chunk], limits, "fixed", moved.path_counts, last.append)
        ends.append((last[-1][-1] / np.array(moved.path_counts)).tolist())
    assert ends == [[22.0, 32.0, 10.0, 0.0, 0.0], [12.0, 120.0], [-20.0, 30.0, 2.0, 12.0, 120.0]]


def test_a_job_goes_on_where_axes_turn_alone(
    five: Machine, facets: list[tuple[int, Chunk, tuple[object, ...]]]
) -> None:
    whole = facets[1][1].program
    at_q40 = whole.length_q40 // 3
    found = _planned(five, Place(1, at_q40), FACETS)
    assert [(number, before) for number, _, before in found] == [(1, ()), (2, ())]
    first = found[0][1]
    assert (first.header.job, first.header.job_start_q40) == (8, at_q40)
    assert np.abs(end_point_q40(first.program) - end_point_q40(whole)).max() < 2**14
    job = JobFiles(
        (FACETS,), replace(five, offset_mm=(1.0, 2.0, 3.0, 4.0, 5.0)), 0.01, ReadOptions()
    )
    entry = Entry((), "", {}, 7, 0, 0, 500 << 40, starts=tuple((k, 0) for k in range(3)))
    near = nearest_place(job, entry, (23.0, 34.0, 13.0, 12.0, 55.0))
    assert (near.place.section, near.line) == (1, 2)
    assert near.distance_mm < 1e-3


def test_paths_with_outputs_about_a_turn(tmp_path: Path, five: Machine) -> None:
    """What is on stays on while rotary axes move alone, in jobs of their own in the controller."""
    outputs = (
        (ROOT / "examples" / "machines" / "dispenser.toml")
        .read_text()
        .partition("[outputs]")[2]
        .partition("[[axis]]")[0]
    )
    text = (ROOT / "examples" / "machines" / "mill_five_axes.toml").read_text()
    machine_file = tmp_path / "five.toml"
    text = text.replace("../drives", f"{ROOT}/examples/drives")
    machine_file.write_text(text.replace("[[axis]]", f"[outputs]{outputs}[[axis]]", 1))
    switched = '[[path.output]]\nname = "valve"\nat_fraction = {}\non = {}\n'
    file = tmp_path / "facets.toml"
    text = FACETS.read_text().replace('"machines/mill_five_axes.toml"', f'"{machine_file}"')
    first, turn, last = text.split("[[path]]")[1:]
    last, found, rest = last.partition("[feed]")
    file.write_text(
        f"[[path]]{first}{switched.format(0.5, 'true')}[[path]]{turn}{switched.format(0.25, 'false')}"
        f"{switched.format(0.75, 'true')}[[path]]{last}{switched.format(1.0, 'false')}{found}{rest}"
    )
    valve = load_machine(machine_file)
    events = [chunk.program.events for _, chunk, _ in _planned(valve, Place(), file)]
    assert [one["place"][0] for one in events][1:] == [0, 0]
    assert [len(one) for one in events] == [1, 3, 2]
    begun = _planned(valve, Place(2, 1 << 40), file)[0][1].program.events
    assert [len(begun), begun["place"][0]] == [2, 0]


def test_all_axes_meet(tmp_path: Path, five: Machine) -> None:
    for begin, old, new, words in (
        (
            0,
            "[[22, 32, 10, 0, 0]",
            "[[22, 32, 10, 0, 1]",
            r"path 2 begins 1 deg of c from the end of path 1",
        ),
        (1, "[[22, 32, 10, 12, 120]", "[[22, 32, 11, 12, 120]", r"path 3 begins 1 mm of z"),
    ):
        file = tmp_path / "facets.toml"
        file.write_text(FACETS.read_text().replace(old, new, 1))
        made = PathsJob(file, five, 1, CHUNK_BYTES, True).chunks(begin, 0)
        with pytest.raises(InputError, match=words):
            list(made)


def test_a_list_of_one_path(tmp_path: Path) -> None:
    text = PATHS.read_text().replace('"machines/', f'"{MACHINE.parent}/')
    file = tmp_path / "one.toml"
    file.write_text("[[path]]" + text.split("[[path]]")[1] + text[text.index("[feed]") :])
    assert has_paths(file), "run streams it"
    assert not has_paths(ROOT / "examples" / "helix.toml")


def _changed(folder: Path, old: str, new: str) -> Path:
    text = PATHS.read_text().replace('"machines/', f'"{MACHINE.parent}/')
    assert old in text
    file = folder / "paths.toml"
    file.write_text(text.replace(old, new, 1))
    return file


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("dwell_ms = 500", "dwell_ms = -1", r"\[path 2\] dwell_ms"),
        ('stop = "program"', 'stop = "maybe"', r"\[path 3\] stop"),
        ("dwell_ms = 500", "pause_ms = 500", r"\[path 2\] pause_ms"),
        ("closed = false", "dwell_ms = 5\nclosed = false", "first path has none"),
        ("[feed]", '[[output]]\nname = "valve"\non = true\nat_mm = 5\n[feed]', "files with one"),
        ("[[40, 0], [52, 20], [40, 40]]", "[[40, 0, 1], [5, 2, 0], [4, 4, 4]]", "one kind"),
    ],
)
def test_files_with_errors(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_paths(_changed(tmp_path, old, new))


def test_a_path_begins_where_the_one_before_ends(tmp_path: Path, machine: Machine) -> None:
    file = _changed(tmp_path, "[[40, 0], [52", "[[40, 0.5], [52")
    with pytest.raises(InputError, match=r"path 2 begins 0\.5 mm of y from the end of path 1"):
        list(PathsJob(file, machine, 1, CHUNK_BYTES, True).chunks(0, 0))


def test_a_path_that_is_too_long(machine: Machine) -> None:
    with pytest.raises(PlanError, match=r"path 1 takes .* divide the path"):
        list(PathsJob(PATHS, machine, 1, 4000, True).chunks(0, 0))


def test_a_path_that_the_controller_would_refuse_is_not_sent(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = NativeFault(-61, 0, "an axis limit is not proved to be kept")
    judge = pipeline._judge
    monkeypatch.setattr(pipeline, "_judge", lambda *given: replace(judge(*given), fault=fault))
    with pytest.raises(PlanError, match=r"paths.toml.*the controller would refuse the program: an"):
        next(PathsJob(PATHS, machine, 1, CHUNK_BYTES, True).chunks(0, 0))


def test_other_commands_name_the_way(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match="only stream takes it, and run as its one file"):
        load_path_file(PATHS)
    assert main(["stream", str(PATHS), "--simulate", "--tolerance", "0.1"]) == 2
    assert "--tolerance is for toolpaths" in capsys.readouterr().err
    assert main(["stream", "job.pdf", "--simulate"]) == 2
    assert "no toolpath" in capsys.readouterr().err
