# SPDX-License-Identifier: MIT
"""A job in chunks through the controller's code, without a bus. tests/unit/test_stream_cuts.c cuts it at random. Run by
pytest; starts processes.
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.native import NativeLimits, NativeProgram, OfflineStream
from hodograph.native.feed_override import State
from hodograph.program import check, decode, encode
from hodograph.program.codes import ProgramError
from hodograph.program.image import Program
from hodograph.stream.chunk import Chunk, ChunkHeader

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT / "tests/data/programs"
IMAGE = (DATA / "alpha_minimax.hdgp").read_bytes()
FIRST, LAST = 1, 2
JOB = 7
CUTS = 1_000_000
REACH_Q40 = 1 << 26
"""The least length of a tail for a takeover in motion: how far a piece may reach beyond its end."""


def chunk(image: bytes, flags: int, sequence: int = 0, job: int = JOB) -> bytes:
    """A chunk that shares nothing."""
    header = ChunkHeader(bool(flags & FIRST), bool(flags & LAST), job, sequence)
    return Chunk(header, image).encode()


def after_piece(program: Program, first: int) -> tuple[Program, ChunkHeader]:
    """The program from this piece on, in motion, and what it shares; the predecessor may end as it does."""
    pieces, stops = program.pieces, program.stops
    start = int(pieces.start_q40[first])
    segment = int(np.searchsorted(program.start_q40, start, side="right")) - 1
    arc = int(program.start_q40[segment])
    time = sum(int(one) for one in pieces.duration_q32_s[:first])
    kept = {field.name: getattr(pieces, field.name)[first:] for field in fields(pieces)}
    bounds = stops.bound_us[first:]
    rest = replace(
        program,
        moving=True,
        closed=False,
        duration_q32_s=program.duration_q32_s - time,
        length_q40=program.length_q40 - arc,
        start_q40=program.start_q40[segment:] - arc,
        point_q40=program.point_q40[:, segment:],
        a_q44=program.a_q44[:, segment:],
        extra_q40=program.extra_q40[:, segment:],
        pieces=replace(pieces, **kept | {"start_q40": pieces.start_q40[first:] - arc}),
        stops=replace(
            stops,
            codes=stops.codes[first:],
            bound_us=bounds,
            worst_us=(int(bounds[:, 0].max()), int(bounds[:, 1].max())),
        ),
    )
    far = rest.length_q40 - rest.pieces.start_q40 >= REACH_Q40
    return rest, ChunkHeader(
        first=False,
        last=False,
        job=JOB,
        sequence=0,
        piece_shift=first,
        segment_shift=segment,
        shared_pieces=int(np.count_nonzero(far)) - 1,
        shared_segments=rest.segment_count,
        arc_shift_q40=arc,
        time_shift_q32_s=time,
    )


@pytest.mark.parametrize("kernel", ["fixed", "float", "double"])
def test_a_job_of_one_chunk_has_the_setpoints_of_its_program(kernel: str) -> None:
    stream = OfflineStream(kernel)
    assert stream.give(chunk(IMAGE, FIRST | LAST)) is None
    found = stream.run(5000)
    expected = NativeProgram(IMAGE)
    expected.require()
    assert np.array_equal(found, expected.setpoints(kernel, 1_000_000)[0])
    assert stream.state is State.ENDED
    assert stream.run(10).size == 0
    assert (stream.sequence, stream.takeovers, stream.underruns) == (0, (0, 0), 0)


@pytest.mark.parametrize("name", ["alpha_exponential", "heart_exponential", "space3", "space6"])
@pytest.mark.parametrize("kernel", ["fixed", "float", "double"])
def test_any_number_of_axes_goes_on_bit_for_bit(name: str, kernel: str) -> None:
    image = (DATA / f"{name}.hdgp").read_bytes()
    whole = NativeProgram(image)
    whole.require()
    expected = whole.setpoints(kernel, 1_000_000)[0]
    stream = OfflineStream(kernel)
    assert stream.give(chunk(image, FIRST)) is None
    program, made, job_start = decode(image), [], 0
    step = max(program.piece_count // 5, 1)
    for sequence in range(1, 4):
        made.append(stream.run(expected.size // 5))
        program, header = after_piece(program, step)
        job_start += header.arc_shift_q40
        header = replace(header, sequence=sequence, last=sequence == 3, job_start_q40=job_start)
        assert stream.give(Chunk(header, encode(program)).encode()) is None
    made.append(stream.run(2 * expected.size))
    assert np.array_equal(np.concatenate(made), expected)
    assert stream.takeovers[0] == 3
    assert stream.sequence == 3


@pytest.mark.parametrize("name", ["alpha_exponential", "space6"])
def test_both_checks_accept_a_program_in_motion_in_a_chunk_only(name: str) -> None:
    def codes(program: Program, *, in_chunk: bool) -> set[int]:
        native = NativeProgram(encode(program)).check(NativeLimits(chunk=in_chunk))
        python = check(program, chunk=in_chunk)
        return {one.code if one else 0 for one in (native, python)}

    moving, _ = after_piece(decode((DATA / f"{name}.hdgp").read_bytes()), 10)
    assert codes(moving, in_chunk=True) == {0}
    assert codes(moving, in_chunk=False) == {ProgramError.FLAGS}
    resting = replace(moving, moving=False)
    assert codes(resting, in_chunk=True) == {
        ProgramError.PIECE_FIRST if moving.pieces.start_q40[0] else ProgramError.START_MOVING
    }
    away = moving.pieces.start_q40 + moving.start_q40[1] - moving.pieces.start_q40[0]
    elsewhere = replace(moving, pieces=replace(moving.pieces, start_q40=away))
    assert codes(elsewhere, in_chunk=True) == {ProgramError.PIECE_FIRST}


def test_without_the_last_chunk_it_rests_at_the_end_and_waits() -> None:
    stream = OfflineStream()
    assert stream.sequence is None
    assert stream.run(10).size == 0
    assert stream.give(chunk(IMAGE, FIRST)) is None
    ticks = NativeProgram(IMAGE).ticks
    assert stream.run(5000, until_rest=True).size == ticks
    assert stream.waits
    assert stream.state is State.RUNNING
    assert stream.underruns == 1
    rest = stream.run(50)
    assert rest.size == 50
    assert np.unique(rest).size == 1
    stream.stop()
    assert stream.state is State.STOPPED
    assert stream.run(50).size == 0


def test_commands_take_effect() -> None:
    stream = OfflineStream()
    assert stream.give(chunk(IMAGE, FIRST | LAST)) is None
    stream.run(300)
    stream.hold()
    stream.run(400)
    assert stream.state is State.HELD
    stream.resume()
    stream.override(50)
    assert stream.run(9000).size > 1500
    assert stream.state is State.ENDED


def test_what_is_refused_changes_nothing() -> None:
    stream = OfflineStream(limits=NativeLimits(feed_um_s=1000))
    fault = stream.give(chunk(IMAGE, FIRST | LAST))
    assert fault is not None
    assert fault.code == ProgramError.FEED
    stream = OfflineStream()
    wrong = {
        ProgramError.CHUNK_FORMAT: b"HDGP" + chunk(IMAGE, FIRST)[4:],
        ProgramError.CHUNK_CRC: chunk(IMAGE, FIRST)[:-1] + b"?",
        ProgramError.CHUNK_JOB: chunk(IMAGE, FIRST, job=0),
        ProgramError.CHUNK_SEQUENCE: chunk(IMAGE, FIRST, sequence=1),
        ProgramError.CHUNK_FIRST: chunk(IMAGE, 0),
    }
    for code, bytes_ in wrong.items():
        fault = stream.give(bytes_)
        assert fault is not None
        assert fault.code == code
        assert fault.text == code.text.replace('"', "'")
        assert stream.run(5).size == 0
    assert stream.give(chunk(IMAGE, FIRST)) is None
    fault = stream.give(chunk(IMAGE, FIRST))
    assert fault is not None
    assert fault.code == ProgramError.CHUNK_SEQUENCE
    with pytest.raises(InputError, match="kernel"):
        OfflineStream("none")


@pytest.mark.long
def test_a_million_cuts() -> None:
    binary = ROOT / "build" / "host" / "tests" / "test_stream_cuts"
    subprocess.run(["make", "-s", str(binary.relative_to(ROOT))], cwd=ROOT, check=True)
    ran = subprocess.run(
        [binary],
        cwd=ROOT,
        env=os.environ | {"HODOGRAPH_CASES": str(CUTS)},
        capture_output=True,
        text=True,
        check=False,
    )
    print(ran.stdout)
    assert ran.returncode == 0, ran.stdout
    counted = re.search(r"^(\d+) cuts", ran.stdout, re.MULTILINE)
    assert counted is not None
    assert int(counted.group(1)) == CUTS
