# SPDX-License-Identifier: MIT
"""Taking turns at the one SDO channel of a controller, among the processes of one computer.

CANopen gives a server one default channel and assumes one client. `hodograph status` beside `hodograph run` is two; a
lock file per bus and node lets them alternate, transfer by transfer. Whoever gets the turn from another process is
told so, to let pass what was still on its way to the other.
"""

from __future__ import annotations

import fcntl
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .address import BusAddress


class Turns:
    """The lock of one bus and node. Without a writable lock file every turn is granted at once."""

    def __init__(self, address: BusAddress, node: int) -> None:
        name = re.sub(r"[^A-Za-z0-9]+", "-", f"hodograph-{address}-{node}")
        self._depth = 0
        try:
            self._file = os.open(
                Path(tempfile.gettempdir()) / f"{name}.lock",
                os.O_RDWR | os.O_CREAT | os.O_CLOEXEC,
                0o666,
            )
        except OSError:
            self._file = -1

    def close(self) -> None:
        """Gives the lock file back."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    @contextmanager
    def turn(self) -> Iterator[bool]:
        """The channel is ours inside; true when another process had it before. Turns may be nested."""
        if self._file < 0 or self._depth:
            yield False
            return
        fcntl.flock(self._file, fcntl.LOCK_EX)
        self._depth += 1
        try:
            me = str(os.getpid()).encode()
            last = os.pread(self._file, 32, 0)
            if last != me:
                os.ftruncate(self._file, 0)
                os.pwrite(self._file, me, 0)
            yield bool(last) and last != me
        finally:
            self._depth -= 1
            fcntl.flock(self._file, fcntl.LOCK_UN)
