# SPDX-License-Identifier: MIT
"""Runs one command on a user-mode bus: its streams, signals and exit status pass through as if it ran here. Used by
vcan/main. Sends and receives on a socket of the broker; catches signals of this process.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
from pathlib import Path

from vcan import frames
from vcan.errors import BusUnavailable

_FORWARDED = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGHUP,
    signal.SIGQUIT,
    signal.SIGUSR1,
    signal.SIGUSR2,
)


_PATIENCE = 5
"""A command that has not ended when the fifth signal comes is ended with its bus, or left, if it only joined."""


class Client:
    """One command; `run` returns its exit status."""

    def __init__(self, broker: socket.socket, command: list[str]) -> None:
        self._broker = broker
        self._decoder = frames.Decoder()
        self._credit = frames.WINDOW
        self._queues = {frames.STDOUT: bytearray(), frames.STDERR: bytearray()}
        self._stdin_open = True
        self._started = False
        self._signals = 0
        self._status: int | None = None
        self._wake, wake_in = os.pipe()
        os.set_blocking(self._wake, False)
        os.set_blocking(wake_in, False)
        signal.set_wakeup_fd(wake_in)
        for number in _FORWARDED:
            signal.signal(number, lambda *_: None)
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
        self._send(frames.OPEN, json.dumps(_request(command)).encode())

    def run(self) -> int:
        """Until the command has ended and all its output is out. BusUnavailable: the bus ended first."""
        while self._status is None or any(self._queues.values()):
            readers = [self._wake]
            if self._status is None:
                readers.append(self._broker.fileno())
                if self._stdin_open and self._credit > 0:
                    readers.append(frames.STDIN)
            writers = [stream for stream, queue in self._queues.items() if queue]
            self._turn(*select.select(readers, writers, [])[:2])
        return self._status

    def _turn(self, ready: list[int], writable: list[int]) -> None:
        for stream in writable:
            self._write(stream)
        if self._wake in ready:
            for number in os.read(self._wake, 64):
                self._signal(number)
        if self._broker.fileno() in ready:
            self._receive()
        if frames.STDIN in ready:
            self._read_stdin()

    def _signal(self, number: int) -> None:
        self._signals += 1
        if self._started and self._signals < _PATIENCE:
            self._send(frames.SIGNAL, frames.STATUS.pack(number))
        else:  # there is no command yet that could have an opinion, or it has none
            self._status = 128 + number

    def _send(self, kind: int, payload: bytes) -> None:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self._broker.sendall(frames.encode(kind, 0, payload))

    def _read_stdin(self) -> None:
        try:
            data = os.read(frames.STDIN, min(frames.CHUNK, self._credit))
        except OSError:  # closed, or a terminal that another process group has
            data = b""
        self._stdin_open = bool(data)
        self._credit -= len(data)
        self._send(frames.DATA, bytes([frames.STDIN]) + data)

    def _receive(self) -> None:
        try:
            data = self._broker.recv(65536)
        except ConnectionResetError:
            data = b""
        if not data:
            raise BusUnavailable("the bus has ended: its broker was killed")
        for kind, _, payload in self._decoder.feed(data):
            self._started = True
            if kind == frames.DATA:
                self._queues[payload[0]] += payload[1:]
            elif kind == frames.CREDIT:
                self._credit += frames.COUNT.unpack(payload)[1]
            elif kind == frames.EXIT:
                (self._status,) = frames.STATUS.unpack(payload)
            elif kind == frames.FAIL and self._status is None:
                raise BusUnavailable(payload.decode())

    def _write(self, stream: int) -> None:
        """At most 4096 bytes: select promises that many without blocking."""
        queue = self._queues[stream]
        chunk = bytes(queue[: frames.CHUNK])
        try:
            count = os.write(stream, chunk)
        except BlockingIOError:
            return
        except OSError:  # the reader is gone: what a command itself would learn by this signal
            count = len(chunk)
            self._send(frames.SIGNAL, frames.STATUS.pack(signal.SIGPIPE))
        del queue[:count]
        self._send(frames.CREDIT, frames.COUNT.pack(stream, count))


def _request(command: list[str]) -> dict[str, object]:
    umask = os.umask(0o022)
    os.umask(umask)
    return {
        "argv": command,
        "env": dict(os.environ),
        "cwd": str(Path.cwd()),
        "umask": umask,
        "uid": os.getuid(),
        "gid": os.getgid(),
        "groups": os.getgroups(),
    }
