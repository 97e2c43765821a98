# SPDX-License-Identifier: MIT
"""Sections with rests between them as one job: dwells in ticks, program stops, starts at the end of the one before. Run
by pytest; writes to temporary folders.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError, PlanError
from hodograph.machine_limits import program_limits
from hodograph.native.program import NativeLimits
from hodograph.native.stream import OfflineStream
from hodograph.program.codes import ProgramError
from hodograph.program.inspection import end_point_q40
from hodograph.stream import chunks as chunks_module
from hodograph.stream.chunk import (
    FARTHEST_Q40,
    REST_TICKS,
    Chunk,
    ChunkHeader,
    Rest,
    parse,
    shared_fault,
)
from hodograph.stream.journal import Entry
from hodograph.stream.plan import JobFiles, JobPlan, Place, dwell_s, rest_of
from hodograph.stream.simulation import simulate_chunks
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.moves import Dwell, ProgramStop, ToolChange

ROOT = Path(__file__).resolve().parents[3]
MOST = 16 * 1024
PART = """F6000
G61
G1 X12
G4 P0.2
G1 Y15
M0
G4 P0.0305
G1 X0 Y0 Z-3
M1
G1 X3
G64 P0.01
G1 X5 Y3
G1 X9 Y1
M2
"""
RESTS = (Rest(200), Rest(31, stop=True), Rest(optional_stop=True), Rest())


@pytest.fixture(scope="module")
def machine() -> Machine:
    """The mill of the examples."""
    return load_machine(ROOT / "examples" / "machines" / "mill.toml")


@pytest.fixture(scope="module")
def jobs(tmp_path_factory: pytest.TempPathFactory, machine: Machine) -> list[list[Chunk]]:
    """Two files, each of which is a job."""
    folder = tmp_path_factory.mktemp("jobs")
    files = (folder / "one.ngc", folder / "two.ngc")
    for file, text in zip(files, (PART, "F6000\nG1 X2\n"), strict=True):
        file.write_text(text)
    job = JobFiles(files, machine, 0.01, ReadOptions())
    with JobPlan(job, MOST, 7, Place()) as plan:
        made = [list(chunks) for chunks in plan.by_job()]
        ticks = sum(chunk.program.duration_q32_s for chunks in made for chunk in chunks) / 2**32
        assert abs(plan.planned_s - ticks) < 1e-9
        waits_s = sum(rest.ticks(machine.period_us) for rest in RESTS) * 1e-6 * machine.period_us
        after_s = plan.after_s(0)
        assert after_s is not None
        first_s = made[0][0].program.duration_q32_s / 2**32
        assert abs(after_s - (plan.planned_s - first_s + waits_s)) < 1e-9
        return made


def part_job(folder: Path, machine: Machine) -> JobFiles:
    """The job of one file with PART."""
    file = folder / "part.ngc"
    file.write_text(PART)
    return JobFiles((file,), machine, 0.01, ReadOptions())


def _limits(machine: Machine) -> NativeLimits:
    return NativeLimits(**asdict(program_limits(machine)), chunk=1)


def test_a_file_is_one_job(jobs: list[list[Chunk]]) -> None:
    assert len(jobs) == 2
    for chunks, number, rests in zip(jobs, (7, 12), (RESTS, ()), strict=True):
        headers = [chunk.header for chunk in chunks]
        assert {one.job for one in headers} == {number}
        assert [one.sequence for one in headers] == list(range(len(headers)))
        assert tuple(one.rest for one in headers if one.rest is not None) == rests
        assert [one.first for one in headers] == [True] + [False] * (len(headers) - 1)
        assert [one.last for one in headers] == [False] * (len(headers) - 1) + [True]
        for before, chunk in pairwise(chunks):
            assert shared_fault(chunk, before) is None
            assert before.header.joined == (chunk.header.rest is not None)
        assert all(parse(chunk.encode()).header == chunk.header for chunk in chunks)


def test_the_controller_takes_no_job_of_4_km(jobs: list[list[Chunk]], machine: Machine) -> None:
    stream = OfflineStream("fixed", _limits(machine))
    before_q40 = FARTHEST_Q40 - (20 << 40)
    faults = []
    for chunk in jobs[0][:3]:
        header = replace(chunk.header, job_start_q40=chunk.header.job_start_q40 + before_q40)
        faults.append(stream.give(replace(chunk, header=header).encode()))
    assert faults[:2] == [None, None]
    assert faults[2] is not None, "it begins at 27 mm, 7 mm beyond"


def test_a_long_job_goes_on_as_another_one(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the first rest after so much of it, from where it ends, with the commands of the rest before it."""
    monkeypatch.setattr(chunks_module, "ENOUGH_Q40", 20 << 40)
    job = part_job(tmp_path, machine)
    with JobPlan(job, MOST, 7, Place()) as plan:
        found = []
        with suppress(IndexError):
            while (item := plan.item(len(found), 100.0)) is not None:
                found.append(item)
    firsts = [(section, chunk) for section, chunk, _ in found if chunk.header.first]
    assert [chunk.header.job for _, chunk in firsts] == [7, 9, 11]
    assert [dwell_s(section.before) for section, _ in firsts] == [0.0, 0.0305, 0.0]
    assert [section.start_q40 for section, _ in firsts] == [0, 0, 0]
    assert [chunk.header.last for _, chunk, _ in found] == [False, True] * 2 + [True]
    limits = _limits(machine)
    for begin, end in ((0, 2), (2, 4), (4, 5)):
        own = [chunk for _, chunk, _ in found[begin:end]]
        simulate_chunks(own, limits, "fixed", machine.counts_per_mm)
    for (_, a, _), (_, b, _) in pairwise(found):
        off = np.subtract(end_point_q40(a.program), b.program.point_q40[:, 0])
        assert np.abs(off).max() < 1 << 20


def test_a_section_that_ends_too_far_in_its_job_names_the_remedy(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chunks_module, "FARTHEST_Q40", 20 << 40)
    job = part_job(tmp_path, machine)
    with (
        JobPlan(job, MOST, 7, Place()) as plan,
        pytest.raises(PlanError, match=r"/part\.ngc:8: the section .* divide it by a dwell"),
    ):
        plan.item(2, 100.0)


def test_time_is_that_of_the_ticks(jobs: list[list[Chunk]], machine: Machine) -> None:
    """Each section has the setpoints that it has alone; between two there are the ticks of the rest."""
    stream = OfflineStream("fixed", _limits(machine))
    for chunk in jobs[0]:
        assert stream.give(chunk.encode()) is None
    points = stream.run(1_000_000)
    assert stream.underruns == 0
    ends = [k for k, chunk in enumerate(jobs[0]) if chunk.header.joined or chunk.header.last]
    assert ends == list(range(len(ends))), "each section of this job is one chunk"
    at = 0
    for chunk in jobs[0]:
        if chunk.header.rest is not None:
            ticks = chunk.header.rest.ticks(machine.period_us)
            assert ticks == max(chunk.header.rest.dwell_ms, REST_TICKS)
            rest = points["position_q40"][at - 1 : at + ticks]
            assert not np.diff(rest, axis=0).any()
            at += ticks
        alone = replace(
            chunk.header,
            first=True,
            last=True,
            joined=False,
            rest=None,
            sequence=0,
            job_start_q40=0,
        )
        own = OfflineStream("fixed", _limits(machine))
        assert own.give(Chunk(alone, chunk.image).encode()) is None
        expected = own.run(1_000_000)
        found = points[at : at + len(expected)]
        assert np.array_equal(found["position_q40"], expected["position_q40"])
        assert np.array_equal(
            found["arc_length_q40_mm"], expected["arc_length_q40_mm"] + chunk.header.job_start_q40
        )
        at += len(expected)
    assert at == len(points)
    run = simulate_chunks(jobs[0], _limits(machine), "fixed", machine.counts_per_mm)
    assert (run.ticks, run.sections) == (at, 1 + len(RESTS))


def test_what_the_controller_refuses(jobs: list[list[Chunk]], machine: Machine) -> None:
    first, second = jobs[0][:2]

    def code(header: ChunkHeader) -> int:
        stream = OfflineStream("fixed", _limits(machine))
        assert stream.give(first.encode()) is None
        fault = stream.give(Chunk(header, second.image).encode())
        return 0 if fault is None else fault.code

    own = second.header
    assert code(own) == 0
    assert code(replace(own, rest=None)) == ProgramError.CHUNK_REST
    assert code(replace(own, job_start_q40=own.job_start_q40 + 1)) == ProgramError.CHUNK_REST
    assert code(replace(own, arc_shift_q40=1)) == ProgramError.CHUNK_REST
    assert code(replace(own, first=True)) == ProgramError.CHUNK_FIRST
    assert code(replace(own, sequence=2)) == ProgramError.CHUNK_SEQUENCE
    assert code(replace(own, last=True, joined=True)) == ProgramError.CHUNK_FORMAT
    with pytest.raises(InputError):
        parse(Chunk(replace(own, last=True, joined=True), second.image).encode())


def test_rests_of_commands() -> None:
    dwell = Dwell(1, 0.0101)
    assert rest_of([], stops=True) == Rest()
    assert rest_of([dwell, dwell], stops=True) == Rest(21)
    assert rest_of([ProgramStop(2, True), dwell], stops=True) == Rest(11, False, True)
    assert rest_of([ToolChange(2, 3), ProgramStop(2, True)], stops=True) == Rest(0, True, True)
    assert rest_of([ToolChange(2, 3)], stops=False) == Rest()
    assert dwell_s([dwell]) == 0.0101
    assert Rest(9).ticks(4000) == REST_TICKS
    assert Rest(33).ticks(4000) == 9


def test_a_place_in_the_job_is_one_in_a_section() -> None:
    entry = Entry((), "", {}, 100, section=4, first=3, starts=((4, 10 << 40), (5, 20 << 40)))
    assert entry.job == 103
    assert entry.place_at(12 << 40) == (4, 2 << 40)
    assert entry.place_at((20 << 40) - 1) == (5, 0)
    assert entry.place_at(25 << 40) == (5, 5 << 40)
