# SPDX-License-Identifier: MIT
"""Sections as chains of chunks: every chunk is accepted, shares what it says, and together they are one program. Run by
pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine
from hodograph.errors import InputError
from hodograph.events import SwitchedOutputs
from hodograph.feed.optimal.plan_limits import PlanLimits
from hodograph.feed.optimal.window import Solution
from hodograph.job import load_job
from hodograph.machine_limits import program_limits
from hodograph.native import NativeProgram
from hodograph.native.program import NativeFault, NativeLimits
from hodograph.native.stream import OfflineStream
from hodograph.program import Program, encode
from hodograph.program.check import REACH_Q40, check, check_image
from hodograph.program.codes import ProgramError
from hodograph.spline import PHSpline, from_control_polygon
from hodograph.stream.chunk import LEAST_SHARED_PIECES, Chunk, parse, shared_fault
from hodograph.stream.chunks import FEWEST_SHARED_PIECES, RAMP_S, SectionChunks
from hodograph.stream.geometry import Block, StreamPath, blocks_from, with_joints
from hodograph.stream.plan import JobFiles, JobPlan, Place, PlanRests
from hodograph.stream.reading import StreamReader
from hodograph.stream.simulation import (
    StreamedMotion,
    concatenated,
    from_rest_to_rest,
    simulate_chunks,
)
from hodograph.stream.tails import Tails
from hodograph.stream.windows import SectionFeed
from hodograph.toolpath.files import ReadOptions
from marks import long

ROOT = Path(__file__).resolve().parents[3]
MOST = 16 * 1024


@pytest.fixture(scope="module")
def machine() -> Machine:
    """The mill of the examples."""
    return load_machine(ROOT / "examples" / "machines" / "mill.toml")


def _walk(seed: int, count: int, step_mm: float, turn_rad: float) -> str:
    """G-code of a random walk whose direction changes little from line to line, with changing feeds."""
    draw = np.random.default_rng(seed)
    heading = np.cumsum(draw.normal(0.0, turn_rad, count))
    step = step_mm * draw.uniform(0.4, 2.0, count)
    x, y = np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading))
    z = np.cumsum(draw.normal(0.0, 0.02 * step_mm, count))
    feed = np.where(draw.random(count) < 0.05, draw.uniform(600.0, 6000.0, count), 0.0)
    lines = ["G21 G90 G64 P0.01", "F3000"]
    for k in range(count):
        speed = f" F{feed[k]:.0f}" if feed[k] else ""
        lines.append(f"G1 X{x[k]:.4f} Y{y[k]:.4f} Z{z[k]:.4f}{speed}")
    return "\n".join([*lines, "M2", ""])


def _sections(file: Path, machine: Machine, most: int = MOST) -> Iterator[list[Chunk]]:
    reader = StreamReader(file, machine, 0.01, ReadOptions())
    for number, section in enumerate(reader.sections(), 1):
        made = SectionChunks(machine, file.stem, section.blocks, number, most)
        yield [one.chunk for one in made.chunks()]


def _limits(machine: Machine) -> NativeLimits:
    return NativeLimits(**asdict(program_limits(machine)), chunk=1)


def _shares_enough(chunk: Chunk, fewest: int | None) -> bool:
    """So many pieces; None: as many as the longest look-ahead has, or what the longest ramp takes."""
    count, times = chunk.header.shared_pieces, chunk.program.pieces.duration_q32_s
    if fewest is not None:
        return count >= fewest
    lasts = sum(map(int, times[:count])) >= RAMP_S * 2**32
    return count >= LEAST_SHARED_PIECES or (count >= FEWEST_SHARED_PIECES and lasts)


def _verify(
    chunks: list[Chunk],
    machine: Machine,
    most: int = MOST,
    shared: int | None = None,
    *,
    rests: bool = False,
) -> StreamedMotion:
    """Both checks of every chunk, the shared parts, and one program of all, whose setpoints are those of the stream.
    Returns the motion of the stream.

    `rests`: where the axes rest between two chunks, the second one may be taken over at that rest, then a longer one.
    """
    before: Chunk | None = None
    for chunk in chunks:
        assert parse(chunk.encode()).header == chunk.header
        assert check_image(chunk.image, program_limits(machine), chunk=True) is None
        assert shared_fault(chunk, before) is None
        assert chunk.size <= most
        alone = before is None or chunk.header.rest is not None
        assert alone or _shares_enough(chunk, shared)
        before = chunk
    assert before is not None
    assert before.header.last
    programs = []
    for part in from_rest_to_rest(chunks):
        whole = concatenated(part)
        assert check(whole, replace(program_limits(machine), stop_time_ms=0)) is None
        program = NativeProgram(encode(whole))
        # Its fault stops may take longer than those of chunks, whose ends are near: only pieces and joints count here.
        assert program.check(replace(_limits(machine), chunk=0, stop_time_ms=0)) is None
        programs.append(program)
    run = simulate_chunks(chunks, _limits(machine), "fixed", machine.counts_per_mm)
    assert sum(run.takeovers) == len(chunks) - 1
    if rests and run.takeovers[1]:
        assert run.ticks >= sum(program.ticks for program in programs)
        return run
    (program,) = programs
    _, setpoints = program.setpoints("fixed", machine.counts_per_mm)
    # A chunk that shares little may be shorter than a slice of the simulation, which takes it over at its rest.
    assert shared is not None or run.takeovers == (len(chunks) - 1, 0)
    assert run.ticks == program.ticks
    assert run.setpoints_sha256 == hashlib.sha256(setpoints.tobytes()).hexdigest()
    return run


@pytest.mark.parametrize(
    ("seed", "count", "step_mm", "turn_rad"), [(1, 40, 1.0, 0.1), (2, 10, 6.0, 0.5)]
)
def test_random_paths(
    tmp_path: Path, machine: Machine, seed: int, count: int, step_mm: float, turn_rad: float
) -> None:
    file = tmp_path / "walk.ngc"
    file.write_text(_walk(seed, count, step_mm, turn_rad))
    for chunks in _sections(file, machine):
        _verify(chunks, machine)


def test_pieces_beside_short_segments_are_as_slow(machine: Machine) -> None:
    """The controller counts a piece that ends where a pair of short segments begins as one on them."""
    path = StreamPath(machine.offset_mm, machine.period_us)
    x = np.array([0.0, 8.0, 8.01, 8.02, 16.0])
    w = np.sqrt(np.diff(x))[:, None] * np.ones(3)
    path.append(
        Block(PHSpline(x.astype(complex), w.astype(complex), False), np.full(4, 50.0), np.arange(4))
    )
    nominal, zones = path.feeds(machine.feed_mm_s)
    slowest = min(zones, key=lambda zone: zone.feed_mm_s)
    assert slowest.feed_mm_s < 0.02 / (2e-6 * machine.period_us) < nominal
    reach_mm = REACH_Q40 * 2.0**-40
    assert slowest.from_mm < 8.0 - reach_mm
    assert slowest.to_mm > 8.02 + reach_mm


@pytest.mark.long
def test_rest_of_a_window_is_divided(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is found in motion: each window is followed by its own rest, of more bytes than a chunk takes."""
    solved = SectionFeed._solved

    def none_in_motion(
        feed: SectionFeed, limits: PlanLimits, high: float, stop_s: float
    ) -> Solution | None:
        return solved(feed, limits, high, stop_s) if feed._moving is None else None

    monkeypatch.setattr(SectionFeed, "_solved", none_in_motion)
    file, most = tmp_path / "wave.ngc", 7600
    file.write_text(_wave(300))
    (chunks,) = _sections(file, machine, most)
    _verify(chunks, machine, most, FEWEST_SHARED_PIECES)


def _wave(count: int) -> str:
    """Long pieces over many segments: the last 16 before a joint take more than half of a chunk."""
    lines = [f"G1 X{0.5 * k:.1f} Y{3.0 * np.sin(0.1 * k):.4f}" for k in range(1, count)]
    return "\n".join(["G21 G90 G64 P0.01", "F3600", *lines, "M2", ""])


def test_fewer_pieces_are_shared_where_there_is_no_room(tmp_path: Path, machine: Machine) -> None:
    """Rather than that the job ends with an error."""
    file, most = tmp_path / "wave.ngc", 7600
    file.write_text(_wave(110))
    (chunks,) = _sections(file, machine, most)
    _verify(chunks, machine, most, FEWEST_SHARED_PIECES)
    assert min(chunk.header.shared_pieces for chunk in chunks[1:]) < LEAST_SHARED_PIECES


@pytest.mark.parametrize("most", [4000, long(3400)])
def test_axes_rest_where_no_chunk_goes_on(tmp_path: Path, machine: Machine, most: int) -> None:
    """At the end of a chunk, rather than that the job ends with an error."""
    file = tmp_path / "wave.ngc"
    file.write_text(_wave(60))
    (roomy,) = _sections(file, machine)
    (section,) = StreamReader(file, machine, 0.01, ReadOptions()).sections()
    maker = SectionChunks(machine, "wave", section.blocks, 1, most)
    made = list(maker.chunks())
    assert maker.rest_lines
    assert maker.rest_lines == sorted(maker.rest_lines)
    tight = [one.chunk for one in made]
    _verify(tight, machine, most, 1, rests=True)
    duration_s = concatenated(tight).duration_s
    assert duration_s > concatenated(roomy).duration_s + 0.02
    assert sum(one.new_s for one in made) == pytest.approx(duration_s, abs=1e-9)


def test_where_the_end_is_refused_the_tail_to_it_ends_the_section(
    tmp_path: Path, machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No part of the section that is in a chunk is planned again."""
    file = tmp_path / "wave.ngc"
    file.write_text(_wave(60))
    (section,) = StreamReader(file, machine, 0.01, ReadOptions()).sections()
    maker = SectionChunks(machine, "wave", section.blocks, 1, MOST)
    accepted, refused = maker._with_stops, []

    def stops(tails: Tails, joint: int) -> tuple[Program, NativeFault | None]:
        program, fault = accepted(tails, joint)
        if joint == tails.window.count and maker._feed.at_end(tails.window):
            fault = NativeFault(ProgramError.AXIS_JERK, 0, "jerk")
            refused.append(joint)
        return program, fault

    monkeypatch.setattr(maker, "_with_stops", stops)
    made = list(maker.chunks())
    assert refused
    chunks = [one.chunk for one in made]
    _verify(chunks, machine, shared=1, rests=True)
    places = [one.arc_q40 for one in made]
    assert places == sorted(places)
    assert sum(one.new_s for one in made) == pytest.approx(
        concatenated(chunks).duration_s, abs=1e-9
    )


def test_rests_that_no_command_asks_for_are_counted(tmp_path: Path, machine: Machine) -> None:
    file = tmp_path / "wave.ngc"
    file.write_text(_wave(60))
    job = JobFiles((file,), machine, 0.01, ReadOptions())
    found = []
    for most in (MOST, 4000):
        with JobPlan(job, most, 1, Place(), processes=1) as plan:
            for chunks in plan.by_job():
                assert all(chunk.size <= most for chunk in chunks)
            found.append(plan.rests)
    roomy, tight = found
    assert roomy == PlanRests()
    assert roomy.text == "0"
    assert tight.count > 0
    assert tight.text.startswith(f"{tight.count}, the first at {file}:")


@pytest.mark.long
@pytest.mark.parametrize("name", ["dispensing", "engraving", "pocket"])
def test_examples(machine: Machine, name: str) -> None:
    file = ROOT / "examples" / "toolpaths" / f"{name}.ngc"
    for chunks in _sections(file, machine):
        _verify(chunks, machine, shared=1, rests=True)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10, 22))
def test_more_random_paths(tmp_path: Path, machine: Machine, seed: int) -> None:
    draw = np.random.default_rng(seed)
    file = tmp_path / "walk.ngc"
    step, turn = 10.0 ** draw.uniform(-0.7, 1.0), draw.uniform(0.02, 1.5)
    file.write_text(_walk(seed, int(draw.integers(50, 900)), float(step), float(turn)))
    for chunks in _sections(file, machine):
        _verify(chunks, machine, shared=1, rests=True)


@pytest.fixture(scope="module")
def short(machine: Machine, tmp_path_factory: pytest.TempPathFactory) -> list[Chunk]:
    """Some chunks."""
    file = tmp_path_factory.mktemp("short") / "walk.ngc"
    file.write_text(_walk(3, 25, 2.0, 0.1))
    (chunks,) = _sections(file, machine)
    return chunks


def test_the_time_is_that_of_the_whole_plan(
    short: list[Chunk], machine: Machine, tmp_path: Path
) -> None:
    file = tmp_path / "walk.ngc"
    file.write_text(_walk(3, 25, 2.0, 0.1))
    (section,) = load_job(file, machine).sections
    streamed_s = concatenated(short).duration_s
    assert streamed_s < 1.01 * section.pipeline.plan.duration_s


def test_a_piece_that_ends_beside_short_segments_has_their_feed(
    tmp_path: Path, machine: Machine
) -> None:
    """A sharp corner has segments of some um. What ends within 0.13 um before them counts as on them."""
    file = tmp_path / "corner.ngc"
    points = [(-15.2243, -13.5313), (-17.6244, -13.3879), (-18.7938, -16.2978), (-20.551, -17.163)]
    points += [(-18.0121, -17.453), (-13.9031, -13.3827), (-12.589, -13.2255)]
    height = [0.1431, 0.1869, 0.2042, 0.1749, 0.0441, 0.078, 0.125]
    moves = [f"G1 X{x} Y{y} Z{z}" for (x, y), z in zip(points, height, strict=True)]
    file.write_text("\n".join(["G21 G90 G64 P0.01", "F3000", *moves, "M2", ""]))
    for chunks in _sections(file, machine):
        _verify(chunks, machine, shared=1, rests=True)


def test_a_plunge_after_a_rapid_move_in_its_direction_takes_its_time(
    tmp_path: Path, machine: Machine
) -> None:
    file = tmp_path / "drill.ngc"
    file.write_text("G21 G90\nG0 Z-4\nG1 Z-6.5 F200\nM2\n")
    (section,) = load_job(file, machine).sections
    (chunks,) = _sections(file, machine)
    streamed_s = concatenated(chunks).duration_q32_s * 2.0**-32
    assert streamed_s < 1.005 * section.pipeline.plan.duration_s


def test_segments_are_cut_at_arc_lengths() -> None:
    curve = from_control_polygon(np.array([0, 10 + 5j, 20 - 3j, 33 + 4j, 50 - 7j]), False).spline
    at_mm = np.array([1.0, 2.0, 2.5, 0.6 * curve.length_mm])
    cut = with_joints(curve, at_mm)
    assert np.allclose(np.setdiff1d(np.round(at_mm, 9), np.round(cut.segment_starts_mm, 9)), [])
    s_mm = np.linspace(0.0, curve.length_mm, 200)
    assert cut.segment_count == curve.segment_count + at_mm.size
    points = [one.position(*one.locate(s_mm)) for one in (curve, cut)]
    assert np.abs(points[1] - points[0]).max() < 1e-11


@pytest.mark.long
@pytest.mark.timeout(7200)
def test_a_million_lines_take_little_memory(tmp_path: Path) -> None:
    script, figures = ROOT / "benchmarks" / "streaming.py", tmp_path / "figures.json"
    lines = ["--no-ring", "--lines", "100000", "--fit-lines", "1000000"]
    subprocess.run([sys.executable, script, *lines, "--json", figures], check=True)
    planned, fitted = json.loads(figures.read_text())["jobs"]
    assert (planned["lines"], fitted["lines"]) == (100_000, 1_000_000)
    assert max(planned["memory_mb"], fitted["memory_mb"]) < 250.0


def test_a_late_chunk_rests_on_the_path_and_goes_on(short: list[Chunk], machine: Machine) -> None:
    stream = OfflineStream("fixed", _limits(machine))
    for chunk in short:
        assert stream.give(chunk.encode()) is None
        points = stream.run(60_000, until_rest=True)
        assert len(points) < 60_000
        assert stream.waits or chunk.header.last
    whole = concatenated(short)
    assert points["arc_length_q40_mm"][-1] == whole.length_q40
    assert stream.underruns == len(short) - 1


@pytest.mark.parametrize("at", [0, 5, 9, 17, 40, 70, 200])
def test_a_changed_byte_is_refused(short: list[Chunk], at: int) -> None:
    data = bytearray(short[1].encode())
    data[at] ^= 0x40
    with pytest.raises(InputError, match="chunk"):
        parse(bytes(data))


def test_what_does_not_follow_is_found(short: list[Chunk]) -> None:
    one, two = short[0], short[1]
    assert shared_fault(two, one) is None
    assert shared_fault(two, None) is not None
    for changed in (
        replace(two.header, piece_shift=two.header.piece_shift + 1),
        replace(two.header, arc_shift_q40=two.header.arc_shift_q40 + 1),
        replace(two.header, sequence=2),
        replace(two.header, time_shift_q32_s=two.header.time_shift_q32_s + 1),
        replace(two.header, shared_segments=two.header.shared_segments - 1),
    ):
        assert shared_fault(replace(two, header=changed), one) is not None


@pytest.mark.parametrize("share", [long(0.9975), 0.995])
def test_pieces_that_the_proof_refuses_are_slower_and_allow_less_override(
    tmp_path: Path, machine: Machine, share: float
) -> None:
    """The proof of the axis limits may find more between two samples than the planner. Here it finds it everywhere."""
    file = tmp_path / "walk.ngc"
    file.write_text(_walk(0, 6, 2.0, 0.5))
    (section,) = StreamReader(file, machine, 0.01, ReadOptions()).sections()
    made = SectionChunks(machine, "walk", section.blocks, 1, MOST)
    limits = made._limits
    jerk = tuple(round(share * most) for most in limits.axis_jerk_mm_s3)
    made._limits = replace(limits, axis_jerk_mm_s3=jerk)
    chunks = [one.chunk for one in made.chunks()]
    assert sum(chunk.header.rest is None for chunk in chunks) > 1, "goes on in motion"
    for chunk in chunks:
        assert NativeProgram(chunk.image).check(made._limits) is None


def test_a_part_of_a_section_begins_where_it_is_asked_for(tmp_path: Path, machine: Machine) -> None:
    file = tmp_path / "walk.ngc"
    file.write_text(_walk(3, 25, 2.0, 0.1))
    reader = StreamReader(file, machine, 0.01, ReadOptions())
    (section,) = reader.sections()
    blocks = list(section.blocks)
    begin_mm = 0.37 * sum(block.curve.length_mm for block in blocks)
    begin_q40 = round(begin_mm * 2**40)
    made = SectionChunks(
        machine, "walk", blocks_from(iter(blocks), begin_mm, SwitchedOutputs()), 1, MOST, begin_q40
    )
    chunks = [one.chunk for one in made.chunks()]
    assert chunks[0].header.job_start_q40 == begin_q40
    first = chunks[0].program
    wanted = blocks[0].curve.point(begin_mm)
    assert np.allclose(first.point_q40[:, 0] * 2.0**-40, wanted, atol=1e-9)
    stream = OfflineStream("fixed", _limits(machine))
    for chunk in chunks:
        assert stream.give(chunk.encode()) is None
        points = stream.run(60_000, until_rest=True)
    length_q40 = round(sum(block.curve.length_mm for block in blocks) * 2**40)
    assert abs(int(points["arc_length_q40_mm"][-1]) - length_q40) < 2**12


def test_the_shared_pieces_are_those_of_the_core() -> None:
    header = (Path(__file__).parents[3] / "firmware" / "core" / "chunk.h").read_text()
    assert f"#define CHUNK_SHARED_PIECES {LEAST_SHARED_PIECES}u\n" in header
