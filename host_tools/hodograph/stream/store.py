# SPDX-License-Identifier: MIT
"""Keeps planned chunks (parts of a job) on disk until they are sent, in temporary files of bounded size, without a
name. Each is closed, and its space freed, after its chunks were read. Used by plan.py, which calls it only under its
lock, or after the planner thread has ended: it is not thread-safe. Writes and reads these files, in the folder for
temporary files.
"""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from array import array
from collections import deque
from io import FileIO
from pathlib import Path

from ..errors import RunError

PART_BYTES = 4 << 20
"""Size at which a new file begins."""
RESERVE_BYTES = 64 << 20
"""Bytes that stay free on the disk: the journal and recordings may be on it too."""


def store_folder() -> Path:
    """$TMPDIR, else /var/tmp where there is one: /tmp is often a file system in memory (tmpfs)."""
    if "TMPDIR" not in os.environ and os.access("/var/tmp", os.W_OK):
        return Path("/var/tmp")
    return Path(tempfile.gettempdir())


class ChunkStore:
    """Encoded chunks, numbered from 0. Chunks before the newest one that was read are forgotten. The newest one is also
    kept in memory, since it may be sent again after its file is closed.
    """

    def __init__(self) -> None:
        self.folder = store_folder()
        self._ends = array("q", [0])
        self._parts: deque[tuple[int, FileIO]] = deque()
        """First byte of each file, in the order of all bytes that were ever put."""
        self._read = 0
        self._newest = (-1, b"")

    def put(self, data: bytes) -> bool:
        """Appends a chunk. False: the disk has no room for it now, and nothing has changed.

        Raises RunError: the folder cannot be written.
        """
        begin = self._ends[-1]
        try:
            if not self._parts or begin - self._parts[-1][0] >= PART_BYTES:
                if shutil.disk_usage(self.folder).free < RESERVE_BYTES + PART_BYTES:
                    return False
                self._parts.append((begin, self._new_part()))
            first, part = self._parts[-1]
            _write(part, data, begin - first)
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT):
                return False
            raise RunError(
                f"{self.folder}: the plan of the job cannot be kept there: {error.strerror}: set TMPDIR"
            ) from None
        self._ends.append(begin + len(data))
        return True

    def get(self, index: int) -> bytes:
        """A chunk; those before it are forgotten."""
        if index == self._newest[0]:
            return self._newest[1]
        self._read = max(self._read, index + 1)
        begin, end = self._ends[index], self._ends[index + 1]
        while len(self._parts) > 1 and self._parts[1][0] <= begin:
            self._parts.popleft()[1].close()
        first, part = self._parts[0]
        self._newest = (index, os.pread(part.fileno(), end - begin, begin - first))
        return self._newest[1]

    def forget_all(self) -> None:
        """Gives back the room of chunks that have all been read."""
        while self._parts:
            self._parts.popleft()[1].close()

    @property
    def count(self) -> int:
        """Chunks that were put."""
        return len(self._ends) - 1

    @property
    def waiting(self) -> int:
        """Of these, those that were not read yet."""
        return self.count - self._read

    @property
    def waiting_bytes(self) -> int:
        """Of those."""
        return self._ends[-1] - self._ends[self._read]

    @property
    def byte_count(self) -> int:
        """Of all chunks that were put."""
        return self._ends[-1]

    def end_of(self, index: int) -> int:
        """Bytes of the chunks before this one."""
        return self._ends[index]

    def _new_part(self) -> FileIO:
        return FileIO(_unlinked(self.folder), "r+b")


def _unlinked(folder: Path) -> int:
    """A descriptor of a file that has no name, so that nothing of it remains."""
    descriptor, name = tempfile.mkstemp(prefix="hodograph-stream-", dir=folder)
    Path(name).unlink()
    return descriptor


def _write(part: FileIO, data: bytes, at: int) -> None:
    while data:
        written = os.pwrite(part.fileno(), data, at)
        data, at = data[written:], at + written
