# SPDX-License-Identifier: MIT
"""Outputs of streamed jobs: a job in chunks switches the same outputs in the same ticks as the same job in one program,
and an output that the machine file does not define is refused. Run by pytest; starts threads and processes, and writes
to temporary folders.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, replace
from itertools import pairwise
from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine, load_paths
from hodograph.errors import InputError, PlanError
from hodograph.events import (
    ANALOGUE,
    DIGITAL,
    EVENT,
    PROPORTIONAL,
    Event,
    SwitchedOutputs,
    events_of,
)
from hodograph.job import load_job
from hodograph.machine_limits import program_limits
from hodograph.monitor.messages import job_message
from hodograph.monitor.output_marks import JobMarks
from hodograph.native.program import NativeLimits, NativeProgram
from hodograph.native.stream import OfflineStream
from hodograph.program.codes import ProgramError
from hodograph.program.image import decode, encode
from hodograph.stream import output_check
from hodograph.stream.chunk import Chunk, shared_fault
from hodograph.stream.output_check import require_outputs
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.simulation import concatenated, simulate_chunks
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[3]
SIZES = (6 * 1024, 9 * 1024, 16 * 1024)
HEAD = "G21 G17 G90 G94 G64 P0.02\nF6000\n"


@pytest.fixture(scope="module")
def machine() -> Machine:
    """Two axes; digital outputs 0 to 2, analogue output 0, M3 and S."""
    return load_machine(ROOT / "examples" / "machines" / "dispenser.toml")


def _wave(count: int) -> Iterator[str]:
    """Moves of about 2 mm, outputs at nearly every one, two at some."""
    for k in range(count):
        yield f"G1 X{2 * k:.4f} Y{8 * sin(0.11 * k) + 3 * cos(0.05 * k):.4f}"
        yield f"M{62 if k % 2 else 63} P0"
        if k % 3 == 0:
            yield f"M67 E0 Q{k % 100}"
        if k % 7 == 0:
            yield f"M{62 if k % 4 else 63} P1"


def _file(folder: Path, lines: Iterator[str]) -> Path:
    file = folder / "job.ngc"
    file.write_text(HEAD + "\n".join(lines) + "\nM2\n")
    return file


def _chunks(
    file: Path, machine: Machine, most: int = SIZES[1], begin: Place | None = None
) -> list[Chunk]:
    with JobPlan(
        JobFiles((file,), machine, 0.01, ReadOptions()), most, 7, begin or Place()
    ) as plan:
        found = [chunk for chunks in plan.by_job() for chunk in chunks]
    for before, chunk in pairwise(found):
        if not chunk.header.first:
            assert shared_fault(chunk, before) is None
    return found


def _limits(machine: Machine) -> NativeLimits:
    return NativeLimits(**asdict(program_limits(machine)), chunk=1)


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _file(tmp_path_factory.mktemp("wave"), _wave(45))


@pytest.fixture(scope="module")
def waves(wave: Path, machine: Machine) -> list[list[Chunk]]:
    """The same job in chunks of three sizes."""
    return [_chunks(wave, machine, most) for most in SIZES]


def test_chunks_of_any_size_switch_as_the_whole(
    waves: list[list[Chunk]], wave: Path, machine: Machine
) -> None:
    job = load_job(wave, machine, 0.01)
    given = job.sections[0].pipeline.events
    assert len({len(chunks) for chunks in waves}) == len(SIZES)
    for chunks in waves:
        run = simulate_chunks(chunks, _limits(machine), "fixed", machine.counts_per_mm)
        program = concatenated(chunks)
        # Chunks add up arc lengths part by part, so places may be rounded to the next 2^-40 mm.
        apart = program.events["place"].astype(np.int64) - given["place"].astype(np.int64)
        assert np.abs(apart).max() <= 1
        assert [one.item()[1:] for one in program.events] == [one.item()[1:] for one in given]
        whole = NativeProgram(encode(program))
        points, counts = whole.setpoints("fixed", machine.counts_per_mm)
        assert hashlib.sha256(counts.tobytes()).hexdigest() == run.setpoints_sha256
        digital, analogue = whole.outputs(
            points["arc_length_q40_mm"], np.zeros(len(points), dtype=np.int64)
        )
        both = np.column_stack((digital.view(np.int16), analogue))
        assert hashlib.sha256(both.astype("<i2").tobytes()).hexdigest() == run.outputs_sha256
        assert len(np.unique(both, axis=0)) > 20


def _shared_events(first: Chunk, second: Chunk) -> int:
    end_q40 = first.program.length_q40 - second.header.arc_shift_q40
    return int(np.count_nonzero(second.program.events["place"] <= end_q40))


def test_a_chunk_with_other_events_is_refused(waves: list[list[Chunk]], machine: Machine) -> None:
    """By the controller and by the host: one event less, one more, another place or value in the shared part."""
    starts = [(wave[0], wave[1]) for wave in waves]
    first, second = next(
        two for two in starts if 2 < _shared_events(*two) < len(two[1].program.events)
    )
    program = decode(second.image)
    moved, valued = program.events.copy(), program.events.copy()
    moved["place"][1] -= 1
    valued["value"][1] ^= 1
    more = np.insert(program.events, 1, program.events[1])
    for events in (np.delete(program.events, 1), more, moved, valued):
        wrong = replace(second, image=encode(replace(program, events=events)))
        assert shared_fault(wrong, first) is not None
        stream = OfflineStream("fixed", _limits(machine))
        assert stream.give(first.encode()) is None
        fault = stream.give(wrong.encode())
        assert fault is not None
        assert fault.code == ProgramError.CHUNK_EVENT
        assert stream.give(second.encode()) is None


def _run(chunks: list[Chunk], machine: Machine) -> tuple[np.ndarray, np.ndarray]:
    """Arc lengths of the job in mm and outputs of all setpoints; each chunk comes when the one before is under way."""
    stream = OfflineStream("fixed", _limits(machine))
    for chunk in chunks:
        assert stream.give(chunk.encode()) is None
    points, values = stream.run_with_outputs(100_000)
    return np.ldexp(points["arc_length_q40_mm"].astype(float), -40), values


def _levels(values: np.ndarray) -> list[tuple[int, int]]:
    """Ticks in which the digital outputs change, and what they become."""
    digital = np.concatenate(([0], values["digital"].astype(int)))
    at = np.flatnonzero(np.diff(digital))
    return [(int(k), int(digital[k + 1])) for k in at]


RESTS = [
    "M64 P0",
    "G1 X10",
    "M64 P1",
    "G4 P0.1",
    "M65 P0",
    "G1 X20",
    "M64 P2",
    "G1 X25",
    "M65 P1",
    "M65 P2",
]


def test_outputs_at_rests(tmp_path: Path, machine: Machine) -> None:
    """Before a dwell with the last setpoint, after it with the first one; at an exact stop with the first; at the end
    with the last.
    """
    chunks = _chunks(_file(tmp_path, iter(RESTS)), machine)
    way, values = _run(chunks, machine)
    end_10, start_10 = int(np.argmax(way >= 10.0)), int(np.argmax(way > 10.0))
    start_20 = int(np.argmax(way > 20.0))
    assert start_10 - end_10 > 100
    assert _levels(values) == [
        (0, 0b001),
        (end_10, 0b011),
        (start_10 - 1, 0b010),
        (start_20 - 1, 0b110),
        (len(way) - 1, 0b000),
    ]


def test_sections_of_the_whole_switch_the_same(tmp_path: Path, machine: Machine) -> None:
    """Whole programs begin with all outputs off and repeat what is on; chunks go on with what is."""
    file = _file(tmp_path, iter(RESTS))
    sections = [one.pipeline.events.tolist() for one in load_job(file, machine, 0.01).sections]
    streamed = [chunk.program.events.tolist() for chunk in _chunks(file, machine)]
    assert len(sections) == len(streamed) == 3
    assert streamed[0] == sections[0]
    for whole, chunk in zip(sections[1:], streamed[1:], strict=True):
        assert whole[0][0] == 0
        assert whole[1:] == chunk


@pytest.mark.parametrize("share", [0.6])
def test_a_job_that_goes_on_begins_with_what_is_on(
    wave: Path, waves: list[list[Chunk]], machine: Machine, share: float
) -> None:
    program = concatenated(waves[1])
    arc_q40 = round(share * program.length_q40)
    before = SwitchedOutputs()
    before.act(program.events[program.events["place"] <= arc_q40])
    begun = _chunks(wave, machine, begin=Place(0, arc_q40))[0].program.events
    at_start = SwitchedOutputs()
    at_start.act(begun[begun["place"] == 0])
    assert at_start.begin().tolist() == before.begin().tolist()
    later = program.events[program.events["place"] > arc_q40][: np.count_nonzero(begun["place"])]
    moved = begun[begun["place"] > 0]
    assert np.abs(moved["place"] + arc_q40 - later["place"]).max() < 2**14
    assert (moved["value"] == later["value"]).all()


def test_a_job_that_goes_on_in_a_later_section(tmp_path: Path, machine: Machine) -> None:
    chunks = _chunks(_file(tmp_path, iter(RESTS)), machine, begin=Place(2))
    assert chunks[0].header.first
    _, values = _run(chunks, machine)
    assert _levels(values) == [(0, 0b110), (len(values) - 1, 0)]


def test_what_events_leave() -> None:
    made = SwitchedOutputs()
    made.act(
        events_of(
            [
                Event(5, DIGITAL, 0, 0b111, 0b011),
                Event(6, DIGITAL, 0, 0b001, 0),
                Event(7, PROPORTIONAL, 0, 0, 9),
                Event(8, ANALOGUE, 1, 0, 4),
                Event(9, ANALOGUE, 1, 0, 0),
            ]
        )
    )
    assert made.begin().tolist() == [(0, DIGITAL, 0, 0b010, 0b010), (0, PROPORTIONAL, 0, 0, 9)]
    assert SwitchedOutputs().begin().dtype == EVENT


def test_the_feed_is_lowered_where_outputs_are_dense(tmp_path: Path, machine: Machine) -> None:
    """An event each 15 um at 100 mm/s, where a tick at 200 % may go 240 um; elsewhere the feed stays."""
    lines = [f"G1 X{20 + 0.015 * k:.3f}\nM67 E0 Q{k % 90}" for k in range(100)]
    chunks = _chunks(_file(tmp_path, iter(["G1 X20", *lines, "G1 X40"])), machine, 24 * 1024)
    way, _ = _run(chunks, machine)
    feed = np.diff(way) / (1e-6 * machine.period_us)
    dense = (way[:-1] > 20.1) & (way[:-1] < 21.4)
    assert feed[dense].max() < 16 * 15.0 / 2.0
    assert feed.max() > 99.0


def test_more_than_a_tick_takes_are_refused_with_the_line(tmp_path: Path, machine: Machine) -> None:
    lines = ["G1 X10", *(f"M{62 + k % 2} P{k % 3}" for k in range(17)), "G1 X20"]
    with pytest.raises(PlanError, match=r"job\.ngc:3: more than 16 outputs switch"):
        _chunks(_file(tmp_path, iter(lines)), machine)


# -- outputs that the machine does not have ---------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("M62 P9", "no digital output 9"),
        ("m 6 4 p1 0 (all)", "no digital output 10"),
        ("M65 P#1", "no digital output 9"),
        ("M[60+2] P9", "no digital output 9"),
        ("M67 E3 Q1", "no analogue output 3"),
        ("M68 E0 Q101", "is 33095 on the bus"),
        ("N7 M03 S101", "is 33095 on the bus"),
    ],
)
def test_a_late_output_is_refused_before_anything_moves(
    tmp_path: Path, machine: Machine, line: str, message: str
) -> None:
    file = _file(tmp_path, iter(["#1=9", "G1 X1", line, "G1 X2"]))
    with pytest.raises(InputError, match=f"job.ngc:5: .*{message}"):
        require_outputs(file, machine, ReadOptions())


def test_a_file_that_is_well_is_not_read_twice(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [
        "M64 P0 (M62 P9)",
        "G1 X1 M3 S50 ; M62 P9",
        "M67 E0 Q99.9",
        "/M5",
        "#1=[2+3]",
        "G1 X[#1]",
    ]
    file = _file(tmp_path, iter(lines))
    monkeypatch.setattr(output_check, "_read", lambda *_: pytest.fail("read"))
    require_outputs(file, machine, ReadOptions())
    require_outputs(Path("-"), machine, ReadOptions())


def test_what_is_not_executed_is_not_refused(tmp_path: Path, machine: Machine) -> None:
    """Behind the end of the program; and on a machine without outputs, where they are noted."""
    file = tmp_path / "job.ngc"
    file.write_text(HEAD + "G1 X1\nM2\nM62 P9\n")
    require_outputs(file, machine, ReadOptions())
    file.write_text(HEAD + "G1 X1\nM62 P9\nG1 X2\nM2\n")
    require_outputs(file, load_machine(ROOT / "examples" / "machines" / "mill.toml"), ReadOptions())


def test_the_live_page_marks_each_place_once(waves: list[list[Chunk]], machine: Machine) -> None:
    """Whatever the chunks repeat; with the points on the path, and anew with another job."""
    found = []
    for chunks in waves:
        job = JobMarks(machine.outputs)
        for chunk in chunks:
            job.add(chunk)
        found.append(job)
    places = np.unique(concatenated(waves[0]).events["place"] * 2.0**-40)
    for job in found:
        assert np.allclose([mark.place_mm for mark in job.marks], places, atol=1e-6)
        assert [mark.text for mark in job.marks] == [mark.text for mark in found[0].marks]
        at = np.array([[mark["x"], mark["y"]] for mark in job.drawn])
        assert np.all(np.diff(at[:, 0]) >= 0.0)
        assert np.abs(at[:, 0] / 2.0 - np.round(at[:, 0] / 2.0)).max() < 0.02
    message = job_message(7, np.zeros((1, 2)), found[0].drawn)
    assert len(message["marks"]) == len(places)
    first = waves[0][0]
    found[0].add(replace(first, header=replace(first.header, job=8)))
    assert len(found[0].marks) <= len(first.program.events)


# -- path files -------------------------------------------------------------------------------------

PATHS = """
[[path]]
closed = false
through = [[0, 0], [10, 4], [20, 0]]
[[path.output]]
name = "valve"
at_mm = 5.0
on = true
[[path.output]]
name = "power"
at_fraction = 1.0
per_mm_s = 0.5

[[path]]
closed = false
through = [[20, 0], [32, 20], [20, 40]]
dwell_ms = 50
[[path.output]]
name = "needle"
at_point = 1
on = true

[[path]]
closed = false
through = [[20, 40], [14, 37], [10, 32]]
[[path.output]]
name = "valve"
at_mm = 0.0
on = false
[feed]
profile = "optimal"
nominal_mm_s = 100
"""


def test_a_list_of_paths(tmp_path: Path, machine: Machine) -> None:
    file = tmp_path / "paths.toml"
    file.write_text(PATHS)
    chunks = _chunks(file, machine, 24 * 1024)
    way, values = _run(chunks, machine)
    ends = np.cumsum([chunk.program.length_q40 for chunk in chunks]) * 2.0**-40
    places = [5.0, ends[0] + 0.5 * chunks[1].program.length_q40 * 2.0**-40]
    found = [int(np.argmax(way >= place - 1e-9)) for place in places]
    third = int(np.argmax(way > ends[1])) - 1
    assert _levels(values) == [(found[0], 0b01), (found[1], 0b11), (third, 0b10)]
    second = int(np.argmax(way > ends[0]))
    assert not values["analogue"][:second, 0].any()
    assert values["analogue"][second:-1, 0].max() > 1000
    assert values["analogue"][-1, 0] == 0
    begun = _chunks(file, machine, 24 * 1024, Place(1, 12 << 40))
    assert begun[0].program.events.tolist()[:2] == [
        (0, DIGITAL, 0, 1, 1),
        (0, PROPORTIONAL, 0, 0, round(0.5 * 327.67 * 65536)),
    ]
    place = begun[0].program.events.tolist()[2][0]
    assert abs(place * 2.0**-40 + 12 - (places[1] - ends[0])) < 1e-6


def test_outputs_of_a_list_are_checked(tmp_path: Path, machine: Machine) -> None:
    file = tmp_path / "paths.toml"
    file.write_text(PATHS.replace('"needle"', '"laster"'))
    with pytest.raises(
        InputError, match=r'path 2: \[\[path.output\]\] 0: the machine has no output "laster"'
    ):
        require_outputs(file, machine, ReadOptions())
    file.write_text('[[output]]\nname = "valve"\nat_mm = 1.0\non = true\n' + PATHS)
    with pytest.raises(InputError, match=r"put \[\[path.output\]\] after its \[\[path\]\]"):
        load_paths(file)
