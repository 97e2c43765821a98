# SPDX-License-Identifier: MIT
"""Vector's ASC and BLF, by python-can's readers and writers, which handle one message at a time. Used by
recordings/files. Reads and writes the files that it is given.
"""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import can
import numpy as np
from can.io.asc import ASCReader, ASCWriter
from can.io.blf import BLFParseError, BLFReader, BLFWriter

from ....bustime.frame_bits import ERROR, EXTENDED, REMOTE
from ....errors import InputError, one_line
from ..frames import RECORD_DTYPE, Frames
from .channels import chosen_channel

_FURTHEST_S = 1e11
"""More than three thousand years from 1970."""
_OLDEST_S = 631_152_000
"""Python-can writes no start time into a BLF before 1990."""


class _Lines(io.TextIOWrapper):
    """A text file that counts its lines; the end of the file ends the reading without an error."""

    line = 0

    def __next__(self) -> str:  # type: ignore[override]  # typeshed has bytes here
        self.line += 1
        try:
            text = super().__next__()
        except StopIteration:
            self.line -= 1
            raise
        if not text.endswith("\n"):
            raise ValueError("the line is cut off")
        return text


def read_asc(file: Path, channel: str | None) -> Frames:
    """Frames of an ASC file. Raises InputError naming the line; OSError."""
    columns = _Columns()
    with file.open("rb") as source:
        lines = _Lines(source, encoding="utf-8")
        reader = ASCReader(lines, relative_timestamp=False)
        try:
            for message in reader:
                columns.add(message)
        except (ValueError, IndexError, TypeError, OverflowError) as error:
            raise InputError(
                f"{file}: line {lines.line} is not as ASC has it: {one_line(error)}"
            ) from error
    if reader.date is None and not columns.times_us:
        raise InputError(f'{file}: no ASC file: it should begin with "date"')
    return columns.frames(file, channel)


def read_blf(file: Path, channel: str | None) -> Frames:
    """Frames of a BLF file. Raises InputError naming the place; OSError."""
    size = file.stat().st_size
    columns = _Columns()
    with file.open("rb") as source:
        try:
            reader = BLFReader(source)
            if reader.file_size > size:
                raise InputError(f"{file}: cut off: {size} of {reader.file_size} bytes are there")
            for message in reader:
                columns.add(message)
        except (BLFParseError, struct.error, zlib.error, ValueError, OverflowError) as error:
            raise InputError(
                f"{file}: not as BLF has it after frame {len(columns.times_us)}: {one_line(error)}"
            ) from error
    return columns.frames(file, channel)


class _Columns:
    """Messages of python-can, gathered."""

    def __init__(self) -> None:
        self._identifiers: list[int] = []
        self._lengths: list[int] = []
        self._data: list[bytes] = []
        self.times_us: list[int] = []
        self._channels: list[str] = []

    def add(self, message: can.Message) -> None:
        """The next message; raises ValueError when it is none of classic CAN."""
        if message.is_fd:
            raise ValueError("a frame of CAN FD; classic frames only")
        flags = message.is_remote_frame * REMOTE
        flags |= ERROR if message.is_error_frame else message.is_extended_id * EXTENDED
        longest = 0x1FFF_FFFF if message.is_extended_id or message.is_error_frame else 0x7FF
        if not 0 <= message.arbitration_id <= longest:
            raise ValueError(f"an identifier of {message.arbitration_id:#x}, above {longest:#x}")
        if not abs(message.timestamp) <= _FURTHEST_S:
            raise ValueError(f"a time of {message.timestamp:g} s")
        size = min(message.dlc, 8)
        if len(message.data) != size and not flags & (REMOTE | ERROR):
            raise ValueError(f"{len(message.data)} of {size} data bytes")
        self._identifiers.append(message.arbitration_id | flags)
        self._lengths.append(size)
        self._data.append(bytes(message.data[:8]).ljust(8, b"\0"))
        self.times_us.append(round(message.timestamp * 1e6))
        self._channels.append(str(message.channel))

    def frames(self, file: Path, channel: str | None) -> Frames:
        """All of one channel. Raises InputError as `chosen_channel`."""
        frames = np.zeros(len(self.times_us), dtype=RECORD_DTYPE)
        frames["id"] = self._identifiers
        frames["length"] = self._lengths
        frames["data"] = np.frombuffer(b"".join(self._data), dtype=np.uint8).reshape(-1, 8)
        frames["time_us"] = self.times_us
        names = list(dict.fromkeys(self._channels))
        wanted = chosen_channel(file, names, channel)
        if len(names) <= 1:
            return frames
        return frames[[found == wanted for found in self._channels]]


class VectorWriter:
    """Writes ASC or BLF, which number their channels: this is the first."""

    def __init__(self, file: Path) -> None:
        """Begins the file. Raises OSError."""
        writer = ASCWriter if file.suffix.lower() == ".asc" else BLFWriter
        self._writer: ASCWriter | BLFWriter = writer(file)
        self._started_us: int | None = None

    def write(self, frames: Frames) -> None:
        """Appends frames."""
        if not frames.size:
            return
        if self._started_us is None:
            self._started_us = self._begin(int(frames["time_us"][0]))
        times_us = np.maximum(frames["time_us"], self._started_us)
        for identifier, length, data, time_us in zip(
            frames["id"].tolist(),
            frames["length"].tolist(),
            frames["data"],
            times_us.tolist(),
            strict=True,
        ):
            self._writer.on_message_received(_message(identifier, length, data, time_us))

    def _begin(self, first_us: int) -> int:
        """Sets the time that the file's times count from, as exactly as python-can reads it back."""
        whole_s = first_us // 1_000_000
        if isinstance(self._writer, ASCWriter):  # it writes fractions of the start wrongly
            self._writer.log_event("Start of measurement", float(whole_s))
            return 1_000_000 * whole_s
        self._writer.start_timestamp = float(whole_s) if whole_s >= _OLDEST_S else 0.0
        return int(1_000_000 * self._writer.start_timestamp)

    def close(self) -> None:
        """Completes the file."""
        self._writer.stop()


def _message(identifier: int, length: int, data: Any, time_us: int) -> can.Message:
    remote = bool(identifier & REMOTE)
    return can.Message(
        timestamp=time_us / 1e6,
        arbitration_id=identifier & 0x1FFF_FFFF,
        is_extended_id=bool(identifier & EXTENDED),
        is_remote_frame=remote,
        is_error_frame=bool(identifier & ERROR),
        dlc=length,
        data=None if remote else data[:length].tobytes(),
        channel=0,
    )
