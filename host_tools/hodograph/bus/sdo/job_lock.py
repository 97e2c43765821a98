# SPDX-License-Identifier: MIT
"""The job lock: while a command runs a job on a controller, the others of this computer know of it, also while the job
rests in a dwell or at a program stop, where the state of the controller does not show it. Used by sdo/controller. Opens
and locks a file.

The system releases the lock when the process ends, however it ends. The lock is a file of this computer: a command on
another computer of the same bus does not know of the job.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from filelock import lock_descriptor, unlock_descriptor

from ...errors import RefusedError
from ..address import BusAddress
from .channel_lock import opened_lock

_PID_BYTES = 20


class JobLock:
    """The job lock of one bus and node. Without a writable lock file it is always free.

    Look at it, and take it, within a turn of the channel lock: a look takes it for an instant.
    """

    def __init__(self, address: BusAddress, node: int) -> None:
        self._who = f"node {node} on {address}"
        self._held = False
        self._file: int | None = None
        with suppress(OSError):
            self._file = opened_lock(address, node, "job")

    def close(self) -> None:
        """Closes the lock file."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def require_free(self) -> None:
        """Raises RefusedError: another connection runs a job."""
        if self._file is None or self._held:
            return
        self._take(self._file)
        unlock_descriptor(self._file)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Holds the lock, which is taken at once, inside the context. Raises RefusedError as `require_free`."""
        if self._file is None:
            yield
            return
        self._take(self._file)
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, str(os.getpid()).encode(), 0)
        self._held = True
        try:
            yield
        finally:
            self._held = False
            unlock_descriptor(self._file)

    def _take(self, file: int) -> None:
        if not lock_descriptor(file, blocking=False):
            process = os.pread(file, _PID_BYTES, 0).decode("ascii", "replace")
            raise RefusedError(
                f"{self._who}: another hodograph command runs a job (process {process}), which may rest in a dwell or "
                "at a program stop: wait for its end, or end it with hodograph stop"
            )
