# SPDX-License-Identifier: MIT
"""Reading and writing recordings. The file's name gives the format. Used by bus/, cli/ and monitor/source. Reads and
writes the files that it is given.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from ....errors import InputError
from ..frames import Frames
from .candump import candump_lines, read_candump

FORMATS = {".log": "candump", ".asc": "Vector ASC", ".blf": "Vector BLF"}


def check_suffix(file: Path) -> str:
    """The suffix in lower case. Raises InputError when it names none of `FORMATS`."""
    suffix = file.suffix.lower()
    if suffix not in FORMATS:
        known = ", ".join(f"{name} ({text})" for name, text in FORMATS.items())
        raise InputError(f"{file}: the end of its name gives the format of a recording: {known}")
    return suffix


def read_recording(file: Path, channel: str | None = None) -> Frames:
    """The frames of one channel of a recording, the only one when `channel` is None.

    Raises InputError: unknown suffix, no such file, broken (with the place), several channels.
    """
    suffix = check_suffix(file)
    try:
        return _reader(suffix)(file, channel)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None


def _reader(suffix: str) -> Callable[[Path, str | None], Frames]:
    if suffix == ".log":
        return read_candump
    from .vector import read_asc, read_blf  # python-can's formats take a while to load

    return read_asc if suffix == ".asc" else read_blf


class _Writer(Protocol):
    def write(self, frames: Frames) -> None: ...

    def close(self) -> None: ...


class _CandumpWriter:
    def __init__(self, file: Path, channel: str) -> None:
        self._out = file.open("wb")
        self._channel = channel

    def write(self, frames: Frames) -> None:
        self._out.write(candump_lines(frames, self._channel))

    def close(self) -> None:
        self._out.close()


def _begin(file: Path, suffix: str, channel: str) -> _Writer:
    if suffix == ".log":
        return _CandumpWriter(file, channel)
    from .vector import VectorWriter

    return VectorWriter(file)


class RecordingWriter:
    """Writes a recording in parts; a context manager. Each method raises InputError: the file cannot be written."""

    def __init__(self, file: Path, channel: str = "vcan0") -> None:
        """Begins the file, in place of one that is there. Only candump keeps the name of the channel."""
        self._file = file
        suffix = check_suffix(file)
        try:
            self._writer = _begin(file, suffix, channel)
        except OSError as error:
            raise self._refused(error) from None

    def _refused(self, error: OSError) -> InputError:
        return InputError(f"{self._file}: cannot be written: {error.strerror}")

    def write(self, frames: Frames) -> None:
        """Appends frames (`RECORD_DTYPE`)."""
        try:
            self._writer.write(frames)
        except OSError as error:
            raise self._refused(error) from None

    def close(self) -> None:
        """Completes the file."""
        try:
            self._writer.close()
        except OSError as error:
            raise self._refused(error) from None

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def write_recording(file: Path, frames: Frames, channel: str = "vcan0") -> None:
    """Writes all frames (`RECORD_DTYPE`). Raises InputError."""
    with RecordingWriter(file, channel) as writer:
        writer.write(frames)
