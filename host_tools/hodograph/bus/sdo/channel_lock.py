# SPDX-License-Identifier: MIT
"""The SDO channel lock: connections of one computer use the one SDO channel of a controller one after the other. Used
by sdo/node and, for its files, by sdo/job_lock. Opens and locks files, and waits by the clock of the bus, real or
virtual.

CANopen gives a server one default channel and assumes one client. `hodograph status` during `hodograph run` is a second
client. A lock file per bus and node lets them alternate, transfer by transfer. A client learns whether another one had
the lock before it: it then discards late answers to the other. Two connections of one process count as different
clients.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import lock_descriptor, unlock_descriptor

from ...errors import BusyError
from ..address import BusAddress
from ..clock import REAL_CLOCK, Clock

TURN_WAIT_S = 30.0
"""Default wait for the lock. It is long, since giving up within a job would cost more than waiting."""
_LOOK_S = 0.002
_SIGN_BYTES = 8
LOCK_FOLDER = Path("/run/lock")


class Turns:
    """The lock of one bus and node. Without writable lock files it is always granted at once.

    A second lock is held while waiting for the first. So a client that released the lock cannot get it again before
    those that wait.
    """

    def __init__(self, address: BusAddress, node: int, clock: Clock = REAL_CLOCK) -> None:
        self._clock = clock
        self.while_waiting: Callable[[], None] = _nothing
        """Called at each attempt to take a lock that is not free; may use the channel without the lock."""
        self._who = f"node {node} on {address}"
        self._depth = 0
        self._sign = os.urandom(_SIGN_BYTES)
        self._files: list[int] = []
        with suppress(OSError):
            for ending in ("next", "lock"):
                self._files.append(opened_lock(address, node, ending))

    def close(self) -> None:
        """Closes the lock files."""
        while self._files:
            os.close(self._files.pop())

    @contextmanager
    def turn(self, wait_s: float = TURN_WAIT_S) -> Iterator[bool]:
        """Holds the lock inside the context; True: another client had it before. May be nested. Raises BusyError: other
        clients keep the lock for longer than `wait_s`.
        """
        if len(self._files) < 2 or self._depth:
            yield False
            return
        self._take(wait_s)
        self._depth += 1
        try:
            yield _put_down(self._sign, self._files[1])
        finally:
            self._depth -= 1
            unlock_descriptor(self._files[1])

    def is_wanted(self) -> bool:
        """Whether another client waits for the lock, while this one holds it."""
        if len(self._files) < 2:
            return False
        following = self._files[0]
        if lock_descriptor(following, blocking=False):
            unlock_descriptor(following)
            return False
        return True

    def _take(self, wait_s: float) -> None:
        deadline = self._clock.now_s() + wait_s
        following, turn = self._files
        try:
            got = self._lock(following, deadline) and self._lock(turn, deadline)
        finally:
            unlock_descriptor(following)
        if not got:
            raise BusyError(
                f"another hodograph command is using {self._who}: no turn in {wait_s:g} s, "
                "try again when it is done (one that Ctrl-Z has stopped goes on with fg)"
            )

    def _lock(self, file: int, deadline: float) -> bool:
        while not lock_descriptor(file, blocking=False):
            if self._clock.now_s() >= deadline:
                return False
            self.while_waiting()
            self._clock.sleep(_LOOK_S)  # the clock may be that of a bus in virtual time
        return True


def _nothing() -> None:
    """Does nothing."""


def _folder(address: BusAddress) -> Path:
    """The folder where all users of this bus, and no others, find the same files; that of a local bus is removed with
    the bus.
    """
    if address.is_local:
        return Path(address.channel).resolve().parent
    return LOCK_FOLDER if os.access(LOCK_FOLDER, os.W_OK) else Path(tempfile.gettempdir())


def opened_lock(address: BusAddress, node: int, ending: str) -> int:
    """A descriptor of a lock file of one bus and node, made if it is not there. Raises OSError."""
    name = re.sub(r"[^A-Za-z0-9]+", "-", f"hodograph-{address}-{node}")
    return _open(_folder(address) / f"{name}.{ending}")


def _open(file: Path) -> int:
    with suppress(FileNotFoundError):
        return os.open(file, os.O_RDWR | os.O_CLOEXEC)
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    with suppress(PermissionError):  # another user made it first, and sets its permissions
        os.fchmod(descriptor, 0o666)
    return descriptor


def _put_down(sign: bytes, file: int) -> bool:
    """Writes the mark of this client; True: that of another one was there."""
    last = os.pread(file, 2 * _SIGN_BYTES, 0)
    if last != sign:
        os.ftruncate(file, 0)
        os.pwrite(file, sign, 0)
    return bool(last) and last != sign
