# SPDX-License-Identifier: MIT
"""The time of a bus: that of this computer, or the virtual time of a local bus (docs/reference/virtual-time.md). Used
by bus/, cli/, faults/ and monitor/. Speaks to the hub, waits, and starts, signals and ends processes.

Time-outs and pauses in communication with nodes are counted by the clock of the connection. In virtual time the hub
grants the time: it stands still while a participant (a process on the bus) computes, and advances while all wait. One
thread of a process is one participant; all its connections to a hub share it.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Protocol

from ..errors import BusError

NAME_VARIABLE = "HODOGRAPH_PARTICIPANT"
"""Environment variable: the name of a process in virtual time."""
MOST_FRAMES = 8
"""In a packet from the hub to a member."""
_NAME_BYTES = 32
"""Bytes of a participant's name."""
_MARK = 0xFFFFFFFF
"""Begins each packet that is no frame."""
_NEVER_NS = 2**64 - 1
"""Time of a participant that waits without limit."""
_CONTROL = struct.Struct(f"=IHHIIQ{_NAME_BYTES}s")
_WATCHES, _VIRTUAL, _SENT, _FRAMES = 1, 2, 4, 8
_VERSION = 3
"""Version of the protocol of the local bus."""
_HELLO_MEMBER, _HELLO_PARTICIPANT, _FILTER, _WAIT, _SUSPEND, _CONTINUE = 1, 2, 3, 5, 6, 7
_WELCOME, _GRANT, _JOINED, _LEFT, _INTERRUPTED = 16, 17, 18, 19, 20
_NOTICE_S = 0.05
"""Real time between two checks whether a started process has ended instead of joining."""
_WELCOME_S = 60.0
"""Longest wait in real time for the hub, which answers at once if it works."""


class Clock(Protocol):
    """The time by which waits for nodes are counted."""

    @property
    def is_virtual(self) -> bool:
        """Whether a hub grants the time, which then stands still while this process computes."""
        ...

    def now_s(self) -> float:
        """Monotonic time in s; only differences have a meaning."""
        ...

    def stamp_ns(self) -> int:
        """Now, as frames are stamped: nanoseconds since 1970."""
        ...

    def sleep(self, seconds: float) -> None:
        """Lets time pass."""
        ...


class RealClock:
    """The clock of this computer."""

    is_virtual = False

    def now_s(self) -> float:
        """See Clock."""
        return time.monotonic()

    def stamp_ns(self) -> int:
        """See Clock."""
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        """See Clock."""
        if seconds > 0:
            time.sleep(seconds)


REAL_CLOCK = RealClock()


class Inbox(Protocol):
    """Receives the frames that came for this thread while it waited."""

    def fill(self) -> None:
        """Takes the received frames from the socket."""
        ...


class VirtualClock:
    """A participant in the virtual time of a hub: one for each thread and hub, shared by its connections
    (`clock_of`).
    """

    is_virtual = True

    def __init__(self, hub: int, connection: socket.socket, number: int, now_ns: int) -> None:
        self.number = number
        self._hub = hub
        self._connection = connection
        self._now_ns = now_ns
        self._grant = 0
        self._waiting = False
        self._has_frames = False  # some came, and are not in the inboxes yet
        self._users = 0
        self._thread = threading.get_ident()
        self._signals = _signal_pipe().listen()
        self._saying = threading.Lock()
        self._inboxes: list[Inbox] = []
        self._notices: list[tuple[int, str]] = []
        self._ended: BusError | None = None

    # -- time ---------------------------------------------------------------------------------

    def now_s(self) -> float:
        """See Clock."""
        return self._now_ns * 1e-9

    def stamp_ns(self) -> int:
        """See Clock."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """See Clock."""
        until_ns = self._now_ns + round(seconds * 1e9)
        while self._now_ns < until_ns:
            self._wait(until_ns)

    def wait(self, until_s: float | None) -> None:
        """Waits until this instant (None: without a limit). Returns earlier if a frame comes for this thread, or a
        process leaves.
        """
        until_ns = _NEVER_NS if until_s is None else round(until_s * 1e9)
        if until_ns > self._now_ns:
            self._wait(until_ns)

    def activate(self) -> None:
        """Ends an interrupted wait, so that time stands still for this participant again. Call it before sending."""
        if self._waiting:
            self._say_wait(0)
            self._await_grant()

    def give_way(self) -> None:
        """Waits until no other participant is active; no time passes. A process that has just been started by one that
        is active (`spawn`) calls it: otherwise the scheduler of this computer would decide which of them sends first.
        """
        self._say_wait(0)
        self._await_grant()

    def interrupt(self) -> None:
        """Ends the wait of the thread that this clock belongs to; may be called from any thread."""
        with self._saying:
            if self._waiting:
                with suppress(BusError):
                    self._send(_WAIT, number=self._grant)

    def _wait(self, until_ns: int) -> None:
        self._require_thread()
        self.activate()
        self._say_wait(until_ns)
        self._await_grant()

    def _say_wait(self, until_ns: int) -> None:
        with self._saying:
            self._waiting = True
            self._send(_WAIT, flags=_SENT, number=self._grant, time_ns=until_ns)

    def _await_grant(self) -> None:
        while self._waiting:
            self._take()
        if self._has_frames:
            for inbox in tuple(self._inboxes):
                inbox.fill()
            self._has_frames = False

    def _take(self) -> None:
        """The next message; its kinds other than grants are kept.

        A signal such as Ctrl-C may raise an exception between any two steps of this function. A lost grant would stop
        time for ever. So a message stays in the socket until it has been processed, and may be read twice.
        """
        try:
            self._await_message()
            data = self._connection.recv(_CONTROL.size, socket.MSG_PEEK)
            if len(data) == _CONTROL.size:
                self._act_on(data)
                self._connection.recv(_CONTROL.size)
        except OSError as error:
            raise self._gone() from error
        if len(data) != _CONTROL.size:
            raise self._gone()

    def _await_message(self) -> None:
        """Waits for a message, or until the handler of a signal raises an exception."""
        signals = self._signals
        watched: list[socket.socket | int] = [self._connection] + ([signals] if signals else [])
        while self._connection not in select.select(watched, [], [])[0]:
            _signal_pipe().drain()

    def _act_on(self, data: bytes) -> None:
        _, kind, flags, number, _, now_ns, name = _CONTROL.unpack(data)
        if kind != _GRANT:
            self._notices.append((kind, name.partition(b"\0")[0].decode(errors="replace")))
        elif number != self._grant:
            self._now_ns = now_ns
            self._has_frames = self._has_frames or bool(flags & _FRAMES)
            self._waiting = False
            self._grant = number  # last: this marks it as taken

    def _send(
        self, kind: int, *, flags: int = 0, number: int = 0, time_ns: int = 0, name: str = ""
    ) -> None:
        try:
            self._connection.send(
                _control(kind, flags=flags, number=number, time_ns=time_ns, name=name)
            )
        except OSError as error:
            raise self._gone() from error

    def _gone(self) -> BusError:
        self._ended = BusError("the local bus has ended: is hodograph-hub gone?")
        return self._ended

    def _require_thread(self) -> None:
        if threading.get_ident() != self._thread:
            raise RuntimeError("a connection in virtual time belongs to the thread that opened it")
        if self._ended is not None:
            raise self._ended

    # -- other processes ----------------------------------------------------------------------

    def spawn(
        self,
        name: str,
        start: Callable[[Mapping[str, str]], subprocess.Popen[bytes]],
    ) -> subprocess.Popen[bytes]:
        """Starts a process that takes part under this name, and returns when it does, or has ended instead.

        `start` gets the variables that the environment of the process needs in addition to that of this process.
        """
        self.activate()
        self._forget(name)
        child = start({NAME_VARIABLE: name})
        self._await_notice(name, child, _JOINED)
        return child

    def await_end(
        self, name: str, child: subprocess.Popen[bytes], wait_s: float | None = None
    ) -> int:
        """Lets time pass until a process that was started by `spawn` has ended; returns its exit status.

        The process may leave and take part again; time stands still in between. Raises subprocess.TimeoutExpired after
        `wait_s` of this time.
        """
        limit_s = None if wait_s is None else self.now_s() + wait_s
        while child.poll() is None:
            if self._has_left(name):
                self.activate()
                self._take_soon()
            elif limit_s is not None and self.now_s() >= limit_s:
                raise subprocess.TimeoutExpired(child.args, wait_s or 0.0)
            else:
                self.wait(limit_s)
        return child.wait()

    def signal(self, name: str, child: subprocess.Popen[bytes], number: int) -> None:
        """Sends a signal to a process, and returns when the process has handled it at the present instant, or has
        ended.
        """
        self.activate()
        self._forget(name)
        child.send_signal(number)
        self._await_notice(name, child, _INTERRUPTED, _LEFT)

    def kill(self, name: str, child: subprocess.Popen[bytes]) -> None:
        """Kills a process at the present instant, like a crash."""
        self.activate()
        child.kill()
        child.wait()
        while not self._has_left(name):
            self._take()

    def suspend(self, name: str) -> None:
        """Suspends the process of this name while time advances, as if its processor stood still."""
        self.activate()
        self._send(_SUSPEND, name=name)

    def resume(self, name: str) -> None:
        """Resumes a suspended process."""
        self.activate()
        self._send(_CONTINUE, name=name)

    def _await_notice(self, name: str, child: subprocess.Popen[bytes], *kinds: int) -> None:
        """Waits until the hub has sent one of these notices about a process, or it has ended; time stands still."""
        while child.poll() is None and not any((kind, name) in self._notices for kind in kinds):
            self._take_soon()

    def _take_soon(self) -> None:
        """Takes the next message, if one comes soon, while time stands still."""
        if select.select([self._connection], [], [], _NOTICE_S)[0]:
            self._take()

    def _has_left(self, name: str) -> bool:
        """Whether the last notice about a process is that it left."""
        reported = [kind for kind, of in self._notices if of == name and kind in (_JOINED, _LEFT)]
        return bool(reported) and reported[-1] == _LEFT

    def _forget(self, name: str) -> None:
        self._notices = [notice for notice in self._notices if notice[1] != name]

    # -- connections --------------------------------------------------------------------------

    def attach(self, inbox: Inbox) -> None:
        """Adds an inbox, which is filled whenever time has passed."""
        self._inboxes.append(inbox)

    def detach(self, inbox: Inbox) -> None:
        """Removes an inbox."""
        with suppress(ValueError):
            self._inboxes.remove(inbox)

    def hold(self) -> VirtualClock:
        """Adds a user. Time waits for this thread until `release` was called as often."""
        self._users += 1
        return self

    def release(self) -> None:
        """Removes a user. After the last one, time does not wait for this thread."""
        self._users -= 1
        if self._users == 0:
            self._connection.close()
            _clocks().pop(self._hub, None)


class _SignalPipe:
    """A file descriptor that is readable once a signal has come for this process; for the main thread, which runs the
    handlers of Python.

    Without it, a signal just before a blocking call would be handled only after the next grant. But its sender waits
    until this process has handled it, and time waits for the sender.
    """

    def __init__(self) -> None:
        self._read, self._write = os.pipe()
        os.set_blocking(self._read, False)
        os.set_blocking(self._write, False)

    def listen(self) -> int | None:
        """The descriptor to wait for; None: this is not the main thread, or another thread receives the signals."""
        if threading.current_thread() is not threading.main_thread():
            return None
        before = signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        if before not in (-1, self._write):
            signal.set_wakeup_fd(before, warn_on_full_buffer=False)
            return None
        return self._read

    def drain(self) -> None:
        """Empties it; the handlers run next."""
        with suppress(BlockingIOError):
            os.read(self._read, 4096)


@cache
def _signal_pipe() -> _SignalPipe:
    return _SignalPipe()


_local = threading.local()


def _clocks() -> dict[int, VirtualClock]:
    """The clocks of this thread, by the process number of the hub, which may serve several buses."""
    clocks: dict[int, VirtualClock] | None = getattr(_local, "clocks", None)
    if clocks is None:
        clocks = _local.clocks = {}
    return clocks


def hub_clock(path: str) -> VirtualClock | None:
    """The participant of this thread in the virtual time of the hub at `path`; the caller has to call `release`. None:
    its time is real.

    Raises OSError: no hub serves the path.
    """
    connection = _connect(path)
    hub = _peer_process(connection)
    known = _clocks().get(hub)
    if known is not None:
        connection.close()
        return known.hold()
    name = os.environ.get(NAME_VARIABLE, "client")
    flags, number, now_ns = _handshake(connection, _HELLO_PARTICIPANT, _WATCHES, 0, name)
    if not flags & _VIRTUAL:
        connection.close()
        return None
    clock = _clocks()[hub] = VirtualClock(hub, connection, number, now_ns)
    if NAME_VARIABLE in os.environ:
        clock.give_way()
    return clock.hold()


def has_virtual_time(path: str) -> bool:
    """Whether the time of the hub at `path` is virtual. Raises OSError: no hub serves the path."""
    with _connect(path) as connection:
        flags, _, _ = _handshake(connection, _HELLO_MEMBER, 0, 0, "")
        return bool(flags & _VIRTUAL)


def _peer_process(connection: socket.socket) -> int:
    credentials = struct.Struct("=iII")
    data = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, credentials.size)
    return int(credentials.unpack(data)[0])


def member_connection(path: str, participant: int) -> socket.socket:
    """A connection for frames, which wake `participant` (0: none). Raises OSError."""
    connection = _connect(path)
    _handshake(connection, _HELLO_MEMBER, 0, participant, "")
    return connection


def filter_message(filters: Sequence[tuple[int, int]]) -> bytes:
    """Sends the frames that a member receives to the hub: identifier and mask of each kind."""
    packed = b"".join(struct.pack("=II", identifier, mask) for identifier, mask in filters)
    return struct.pack("=IHH", _MARK, _FILTER, len(filters)) + packed


def _connect(path: str) -> socket.socket:
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        connection.connect(path)
    except OSError:
        connection.close()
        raise
    return connection


def _handshake(
    connection: socket.socket, kind: int, flags: int, number: int, name: str
) -> tuple[int, int, int]:
    """Sends hello to the hub: flags, number and time of its welcome. Raises OSError, with the connection closed."""
    try:
        connection.send(_control(kind, flags=flags, number=number, name=name))
        connection.settimeout(_WELCOME_S)
        data = connection.recv(_CONTROL.size)
        if len(data) != _CONTROL.size or _CONTROL.unpack(data)[:2] != (_MARK, _WELCOME):
            raise ConnectionRefusedError("it is no hodograph-hub of this version")
        connection.settimeout(None)
    except OSError:
        connection.close()
        raise
    _, _, given, own, _, now_ns, _ = _CONTROL.unpack(data)
    return given, own, now_ns


def _control(
    kind: int, *, flags: int = 0, number: int = 0, time_ns: int = 0, name: str = ""
) -> bytes:
    text = name.encode()[: _NAME_BYTES - 1]
    return _CONTROL.pack(_MARK, kind, flags, number, _VERSION, time_ns, text)
