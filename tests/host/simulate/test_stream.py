# SPDX-License-Identifier: MIT
"""A job in chunks through the controller's code, without a bus. tests/unit/test_stream_cuts.c cuts it at random."""

from __future__ import annotations

import os
import re
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.native import NativeLimits, NativeProgram, OfflineStream
from hodograph.native.feed_override import State
from hodograph.program.codes import ProgramError

ROOT = Path(__file__).resolve().parents[3]
IMAGE = (ROOT / "tests/data/programs/alpha_minimax.hdgp").read_bytes()
FIRST, LAST = 1, 2
CUTS = 1_000_000


def chunk(image: bytes, flags: int, sequence: int = 0, job: int = 7) -> bytes:
    """A chunk without a shared part."""
    behind = struct.pack("<6I qQq 4I", job, sequence, 0, 0, 0, 0, 0, 0, 0, 0, 2**32 - 1, 0, 0)
    size = 16 + len(behind) + len(image)
    crc = zlib.crc32(behind + image)
    return struct.pack("<4sHHII", b"HDGC", 1, flags, size, crc) + behind + image


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
