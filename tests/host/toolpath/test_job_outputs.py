# SPDX-License-Identifier: MIT
"""Outputs of G-code become events of the sections' programs. Run by pytest; reads examples/machines; starts threads and
processes, and writes to temporary folders.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError
from hodograph.events import Event, SwitchedOutputs, events_of
from hodograph.job import Job, load_job
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.reading import StreamReader
from hodograph.toolpath.files import ReadOptions
from hodograph.toolpath.moves import Command, Dwell, SwitchedAtRest

ROOT = Path(__file__).parents[3]
MACHINES = ROOT / "examples" / "machines"
MM = 1 << 40


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(MACHINES / "dispenser.toml")


def job(tmp_path: Path, machine: Machine, text: str) -> Job:
    file = tmp_path / "job.ngc"
    file.write_text(f"G21 G17 G90 G94 G64 P0.02\nG1 F600\n{text}\nM30\n")
    return load_job(file, machine)


def events(found: Job) -> list[list[tuple[float, int, int, int, int]]]:
    """By section: place in mm, kind, channel, mask, value."""
    return [
        [(round(place / MM, 6), *rest) for place, *rest in one.pipeline.events.tolist()]
        for one in found.sections
    ]


def test_synchronised_outputs_stand_at_their_place_on_the_smoothed_path(
    tmp_path: Path, machine: Machine
) -> None:
    found = job(
        tmp_path,
        machine,
        "M62 P0\nG1 X20\nM63 P0\nM67 E0 Q50\nG1 X20 Y20\nM62 P1\nG1 X0",
    )
    (section,) = found.sections
    on, off, power, needle, power_off = section.pipeline.events.tolist()
    assert on == (0, 1, 0, 1, 1)
    assert (*off[1:], *power[1:]) == (1, 0, 1, 0, 2, 0, 0, 16384)
    assert off[0] == power[0]
    assert power_off[1:] == (2, 0, 0, 0)  # it is the speed of the spindle too: M30 switches it off
    for event, corner in ((off, (20.0, 0.0)), (needle, (20.0, 20.0))):
        at = section.pipeline.curve.point(np.array([event[0] / MM]))[0]
        assert abs(at - complex(*corner)) <= 0.02 + 1e-9
    assert not found.notes


def test_each_section_repeats_what_is_on(tmp_path: Path, machine: Machine) -> None:
    text = "M64 P1\nM68 E0 Q10\nG1 X10\nM64 P0\nG1 X20\nM65 P1\nM68 E0 Q0\nG1 X30\nM65 P0"
    assert events(job(tmp_path, machine, text)) == [
        [(0.0, 1, 0, 2, 2), (0.0, 2, 0, 0, 3277)],
        [(0.0, 1, 0, 2, 2), (0.0, 2, 0, 0, 3277), (0.0, 1, 0, 1, 1)],
        [
            (0.0, 1, 0, 3, 3),
            (0.0, 2, 0, 0, 3277),
            (0.0, 1, 0, 2, 0),
            (0.0, 2, 0, 0, 0),
            (10.0, 1, 0, 1, 0),
        ],
    ]


def test_outputs_before_a_dwell_belong_to_the_end_of_the_motion_before_it(
    tmp_path: Path, machine: Machine
) -> None:
    """Before the first motion the host switches them; the first program repeats them."""
    text = "M64 P1\nG4 P0.1\nG1 X10\nM64 P0\nG4 P0.5\nM65 P0\nG1 X20"
    assert events(job(tmp_path, machine, text)) == [
        [(0.0, 1, 0, 2, 2), (10.0, 1, 0, 1, 1)],
        [(0.0, 1, 0, 3, 3), (0.0, 1, 0, 1, 0)],
    ]


def at_rest(commands: tuple[Command, ...]) -> list[tuple[int, ...] | float]:
    """What happens at a rest, in its order: digital outputs and the first analogue one, and dwells in s."""
    found: list[tuple[int, ...] | float] = []
    for one in commands:
        if isinstance(one, SwitchedAtRest):
            found.append((one.values.digital, one.values.analogue[0]))
        elif isinstance(one, Dwell):
            found.append(one.duration_s)
    return found


def streamed(found: Job, machine: Machine) -> tuple[tuple[Command, ...], list[Event], StreamReader]:
    """Commands before the first section, the events of the first one, and the reader at the end of the file."""
    reader = StreamReader(found.file, machine, 0.01, ReadOptions())
    sections = [(one, list(one.blocks)) for one in reader.sections()]
    first, blocks = sections[0]
    return first.before, [Event._make(one) for one in blocks[0].events.tolist()], reader


OPENINGS = [
    ("M3 S40\nG4 P2\nG1 X10", [(4, 13107), 2.0], [(4, 4), (0, 13107)]),
    ("G4 P2\nM3 S40\nG1 X10", [2.0], [(4, 4), (0, 13107)]),
    ("M64 P0\nG4 P2\nM65 P0\nG4 P3\nG1 X10", [(1, 0), 2.0, (0, 0), 3.0], []),
    ("M64 P0\nG4 P2\nM64 P1\nG1 X10", [(1, 0), 2.0], [(1, 1), (2, 2)]),
    ("M3 S40\nM0\nM64 P0\nG4 P2\nM5\nG1 X10", None, [(1, 1), (4, 0), (0, 0)]),
    ("M64 P0\nG1 X10", [], [(1, 1)]),
]


@pytest.mark.parametrize(("text", "rest", "begin"), OPENINGS)
def test_outputs_before_a_wait_at_the_start_of_a_file(
    tmp_path: Path,
    machine: Machine,
    text: str,
    rest: list[tuple[int, ...] | float] | None,
    begin: list[tuple[int, int]],
) -> None:
    """A spindle turns before the axes move. In a job, and in the streamed one."""
    found = job(tmp_path, machine, text)
    before, first, _ = streamed(found, machine)
    own = [Event._make(one) for one in found.sections[0].pipeline.events.tolist()]
    assert before == found.sections[0].before
    assert first == own
    assert rest is None or at_rest(before) == rest
    state = SwitchedOutputs()
    state.act(events_of([one for one in own if one.place_q40 == 0]))
    wanted = SwitchedOutputs()
    wanted.act(events_of(Event(0, 1 if mask else 2, 0, mask, value) for mask, value in begin))
    assert state.at_rest == wanted.at_rest


ENDINGS = [
    ("M3 S40\nG1 X10\nM64 P0\nG4 P1\nM65 P0\nG4 P2", [1.0, (4, 13107), 2.0, (0, 0)]),
    ("G1 X10\nM64 P0\nG4 P1", [1.0]),
    ("M3 S40\nG1 X10", []),
    ("M3 S40\nG1 X10\nM0", [(0, 0)]),
]


@pytest.mark.parametrize(("text", "rest"), ENDINGS)
def test_outputs_after_a_wait_at_the_end_of_a_file(
    tmp_path: Path, machine: Machine, text: str, rest: list[tuple[int, ...] | float]
) -> None:
    found = job(tmp_path, machine, text)
    assert at_rest(found.after) == rest
    assert streamed(found, machine)[2].after == found.after


def test_a_wait_for_the_spindle(tmp_path: Path, machine: Machine) -> None:
    """Where it starts or turns over; not where its speed changes or where it turns already."""
    text = "M3 S40\nG1 X5\nS50\nG1 X10\nM3\nG1 X15\nM4\nG1 X20\nM5\nG1 X25\nM3\nG1 X30"
    assert machine.outputs is not None
    codes = replace(machine.outputs.codes, spindle_wait_s=4.0)
    waiting = replace(machine, outputs=replace(machine.outputs, codes=codes))
    found = job(tmp_path, waiting, text)
    assert found.dwell_s == 12.0
    assert at_rest(found.sections[0].before) == [(4, 13107), 4.0]
    assert job(tmp_path, machine, text).dwell_s == 0.0


def test_a_job_that_begins_within_a_toolpath_switches_on_first(
    tmp_path: Path, machine: Machine
) -> None:
    """At a section that a wait precedes, and inside a section while the spindle turns."""
    assert machine.outputs is not None
    codes = replace(machine.outputs.codes, spindle_wait_s=4.0)
    waiting = replace(machine, outputs=replace(machine.outputs, codes=codes))
    found = job(tmp_path, machine, "M3 S40\nG1 X10\nM64 P0\nG4 P1\nG1 X20\nM5\nG1 X30")
    on = (5, 13107)
    for place, plain, long in (
        (Place(1, 0), [on, 1.0], [on, 4.0, 1.0]),
        (Place(1, 5 * MM), [], [on, 4.0]),
        (Place(2, 5 * MM), [], []),
        (Place(2, 0), [], []),
    ):
        for one, wanted in ((machine, plain), (waiting, long)):
            files = JobFiles((found.file,), one, 0.01, ReadOptions())
            with JobPlan(files, 16 * 1024, 1, place) as plan:
                item = plan.item(0, 60.0)
                assert item is not None
                assert at_rest(item[0].before) == wanted


def test_spindle_words_that_the_machine_file_maps(tmp_path: Path, machine: Machine) -> None:
    found = job(tmp_path, machine, "M3 S40\nG1 X10\nM5\nG1 X20\nM7\nG1 X30")
    laser, power = (0.0, 1, 0, 4, 4), (0.0, 2, 0, 0, 13107)
    assert events(found) == [
        [laser, power],
        [laser, power, (0.0, 1, 0, 4, 0), (0.0, 2, 0, 0, 0)],
        [],
    ]
    assert [note.split(":")[-2] for note in found.notes] == [" coolant (M7, M8, M9)"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("M62 P9\nG1 X10", r"job.ngc:3: the machine has no digital output 9: add it"),
        ("G1 X10\nM68 E1 Q1\nG1 X20", r"job.ngc:4: the machine has no analogue output 1: add it"),
        ("M67 E0 Q101\nG1 X10", r"job.ngc:3: 101 % of output power is 33095"),
    ],
)
def test_outputs_that_the_machine_does_not_have(
    tmp_path: Path, machine: Machine, text: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        job(tmp_path, machine, text)


def test_a_machine_without_outputs_notes_them(tmp_path: Path) -> None:
    plain = load_machine(MACHINES / "tuned.toml")
    found = job(tmp_path, plain, "M62 P0\nG1 X10")
    assert "outputs (M62 to M65, M67, M68): the machine file has no output for it" in found.notes[0]
    assert events(found) == [[]]


def test_the_end_of_the_program_switches_the_spindle_off(tmp_path: Path, machine: Machine) -> None:
    """As M5 does; other outputs stay."""
    assert events(job(tmp_path, machine, "M64 P1\nM3 S50\nG1 X20")) == [
        [
            (0.0, 1, 0, 2, 2),
            (0.0, 1, 0, 4, 4),
            (0.0, 2, 0, 0, 16384),
            (20.0, 1, 0, 4, 0),
            (20.0, 2, 0, 0, 0),
        ]
    ]


@pytest.fixture(scope="module")
def laser(machine: Machine) -> Machine:
    """S is the power in %, 327.67 on the bus."""
    assert machine.outputs is not None
    codes = replace(machine.outputs.codes, laser_mode=True)
    return replace(machine, outputs=replace(machine.outputs, codes=codes))


def gain(power: float, feed_mm_s: float) -> int:
    return round(power / feed_mm_s * 327.67 * 65536)


def test_power_of_a_laser_follows_the_feed_after_m4(tmp_path: Path, laser: Machine) -> None:
    """S at the feed of the block, 0 in rapid moves; it changes in motion, and M3 is constant."""
    text = "M4 S50\nG1 X20\nS30\nG1 X40\nF1200\nG1 X60\nG0 X80\nG1 X90\nM5\nM3 S20\nG1 X100"
    first, second = job(tmp_path, laser, text).sections
    power = [
        (place / MM, kind, value)
        for place, kind, channel, _, value in first.pipeline.events.tolist()
        if kind != 1
    ]
    assert power == [
        (0.0, 3, gain(50, 10)),
        (pytest.approx(20.0), 3, gain(30, 10)),
        (pytest.approx(40.0), 3, gain(30, 20)),
        (pytest.approx(60.0), 3, 0),
        (pytest.approx(80.0), 3, gain(30, 20)),
    ]
    analogue = [
        (kind, value) for _, kind, _, _, value in second.pipeline.events.tolist() if kind != 1
    ]
    assert analogue == [(3, gain(30, 20)), (2, 6553), (2, 0)]


def test_a_laser_streams_the_same_events(tmp_path: Path, laser: Machine) -> None:
    rows = [f"G{int(k % 9 == 0)} X{k} Y{k % 3} S{k % 50} F{600 + 60 * (k % 3)}" for k in range(60)]
    found = job(tmp_path, laser, "\n".join(["M4 S10", *rows, "M5"]))
    whole = [event for one in found.sections for event in one.pipeline.events.tolist()]
    assert sum(kind == 3 for _, kind, *_ in whole) > 60
    reader = StreamReader(found.file, laser, 0.01, ReadOptions())
    streamed = [
        event
        for section in reader.sections()
        for block in section.blocks
        for event in block.events.tolist()
    ]
    values = [one[1:] for one in whole]
    assert [one[1:] for one in streamed] == values


def test_laser_mode_needs_an_output_for_the_power(tmp_path: Path) -> None:
    text = (MACHINES / "dispenser.toml").read_text()
    file = tmp_path / "machine.toml"
    file.write_text(
        re.sub(r"^speed = .*$", "laser_mode = true", text, flags=re.M).replace(
            "../", f"{MACHINES.parent}/"
        )
    )
    with pytest.raises(
        InputError, match='laser_mode needs an analogue output for the power: add speed = "NAME"'
    ):
        load_machine(file)


def test_the_end_of_the_program_switches_off_what_the_same_rest_switches_on(
    tmp_path: Path, machine: Machine
) -> None:
    (events_before,) = events(job(tmp_path, machine, "G1 X10\nM3 S50 M8"))
    state = {}
    for _, kind, channel, mask, value in events_before:
        state[kind, channel, mask] = value
    assert set(state.values()) == {0}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("M64 P0\nG4 P1\nM65 P0\nG1 X10", None),
        ("G1 X10\nM64 P0\nG4 P1\nM65 P0", None),
        ("G1 X10\nM64 P0\nG4 P1\nM65 P0\nG4 P1\nM64 P0\nG4 P1\nM65 P0\nG1 X20", 6),
        ("G1 X10\nM64 P0\nG4 P1\nM65 P0\nG1 X20", None),
        ("G1 X10\nM64 P0\nM65 P0\nG4 P1\nG1 X20", None),
        ("M5\nM6 T1\nM3 S20\nG1 X10\nM5\nM6 T2\nM3 S20\nG1 X20\nM5\nM6 T0", None),
    ],
)
def test_a_switch_that_another_one_replaces_after_a_wait_is_noted(
    tmp_path: Path, machine: Machine, text: str, line: int | None
) -> None:
    found = job(tmp_path, machine, text)
    reader = StreamReader(found.file, machine, 0.01, ReadOptions())
    for section in reader.sections():
        assert list(section.blocks)
    for given in (found.notes, reader.notes):  # of the whole job, and of the streamed one
        notes = [note for note in given if "without effect" in note]
        assert len(notes) == (line is not None)
        assert all(f":{line}: output switched without effect" in note for note in notes)
