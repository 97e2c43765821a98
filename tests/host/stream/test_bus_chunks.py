# SPDX-License-Identifier: MIT
"""Chunks from the frames of a bus: whole ones, with lost segments that come again, refused ones; and their drawing. Run
by pytest; starts and writes nothing.
"""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.monitor.messages import job_message
from hodograph.stream.bus_chunks import ChunkCapture, JobPoints
from hodograph.stream.chunk import Chunk, parse
from straight_job import chunks

NODE = 1
BLOCK = 127
JOB = 5


def _frames(rows: list[tuple[int, bytes]]) -> Frames:
    found = np.zeros(len(rows), dtype=RECORD_DTYPE)
    for row, (identifier, data) in zip(found, rows, strict=True):
        row["id"], row["length"] = identifier, 8
        row["data"] = np.frombuffer(data.ljust(8, b"\0"), dtype=np.uint8)
    return found


def _download(
    data: bytes, *, object_: bytes = b"\x60\x20\x01", lost: int = 0, end: bytes = b"\xa1"
) -> list[tuple[int, bytes]]:
    """A block download; of the first block the segments from number `lost` on are lost once."""
    request, response = 0x600 + NODE, 0x580 + NODE
    rows = [(request, b"\xc6" + object_ + len(data).to_bytes(4, "little"))]
    rows.append((response, b"\xa4" + object_ + bytes([BLOCK])))
    segments = [data[at : at + 7].ljust(7, b"\0") for at in range(0, len(data), 7)]
    at = 0
    while at < len(segments):
        block = segments[at : at + BLOCK]
        for number, segment in enumerate(block, 1):
            last = 0x80 if at + number == len(segments) else 0
            rows.append((request, bytes([number | last]) + segment))
            rows.append((0x080, b"\1"))
        came = lost - 1 if lost and at == 0 else len(block)
        lost = 0
        at += came
        rows.append((response, bytes([0xA2, came, BLOCK])))
    unused = -len(data) % 7
    rows.append((request, bytes([0xC1 | unused << 2, 0, 0])))
    rows.append((response, end))
    return rows


def _parts() -> list[Chunk]:
    return [parse(one) for one in chunks(3, JOB)]


@pytest.mark.parametrize("lost", [0, 1, 2, 100])
@pytest.mark.parametrize("cut", [1, 7, 1000])
def test_chunks_come_out_as_they_were(lost: int, cut: int) -> None:
    """However the frames are handed over."""
    sent = chunks(3, JOB)
    rows = _frames([row for data in sent for row in _download(data, lost=lost)])
    capture = ChunkCapture(NODE)
    found = [one for at in range(0, rows.size, cut) for one in capture.feed(rows[at : at + cut])]
    assert [one.encode() for one in found] == list(sent)


def test_what_is_no_accepted_chunk_is_left_out() -> None:
    data = chunks(3, JOB)[0]
    capture = ChunkCapture(NODE)
    program = _download(data, object_=b"\x00\x20\x01")
    refused = _download(data, end=b"\x80\x60\x20\x01\x30\x00\x09\x06")
    gap = _download(data)
    del gap[40]
    broken = [*_download(data)[:50], (0x600 + NODE, b"\x80\x60\x20\x01\0\0\4\5")]
    for rows in (program, refused, gap, broken):
        assert capture.feed(_frames(rows)) == []
    (found,) = capture.feed(_frames(_download(data)))
    assert found.encode() == data


def test_chunks_of_version_1_are_read_too() -> None:
    """Those of a recording that was made before version 2."""
    data = bytearray(chunks(3, JOB)[0])
    data[4:6] = (1).to_bytes(2, "little")
    data[12:16] = zlib.crc32(data[16:], zlib.crc32(data[4:12])).to_bytes(4, "little")
    (found,) = ChunkCapture(NODE).feed(_frames(_download(bytes(data))))
    assert found.encode() == chunks(3, JOB)[0]
    data[4] = 3
    data[12:16] = zlib.crc32(data[16:], zlib.crc32(data[4:12])).to_bytes(4, "little")
    assert ChunkCapture(NODE).feed(_frames(_download(bytes(data)))) == []


def _message(drawing: JobPoints) -> dict[str, Any]:
    return job_message(drawing.job, drawing.points_mm)


def test_the_drawing_goes_on_without_tails() -> None:
    parts = _parts()
    drawing = JobPoints()
    drawing.add(parts[0])
    first = _message(drawing)
    assert first["name"] == f"job {JOB}"
    end_mm = parts[0].program.length_q40 * 2.0**-40
    assert abs(first["x"][-1] - end_mm) < 1e-3
    for one in parts[1:]:
        drawing.add(one)
    x = _message(drawing)["x"]
    assert (np.diff(x) >= 0.0).all()
    assert set(_message(drawing)["y"]) == {0.0}
    end_q40 = parts[-1].header.job_start_q40 + parts[-1].program.length_q40
    assert abs(x[-1] - end_q40 * 2.0**-40) < 1e-3
    other = Chunk(replace(parts[0].header, job=JOB + 1), parts[0].image)
    drawing.add(other)
    assert _message(drawing)["x"] == first["x"]


def test_a_long_job_has_few_points() -> None:
    drawing = JobPoints()
    part = _parts()[0]
    length_q40 = part.program.length_q40
    for k in range(300):
        header = replace(part.header, first=k == 0, sequence=k, job_start_q40=k * length_q40)
        drawing.add(Chunk(header, part.image))
    assert 1000 < len(_message(drawing)["x"]) <= 3000
