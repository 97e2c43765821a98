# SPDX-License-Identifier: MIT
"""Owns a user-mode Linux process with a vcan0 and joins clients to the agent inside it. Used by vcan/main, which starts
it as a process. Serves a socket in the folder of the bus.

Runs as a process in a session of its own, so that a Ctrl-C at the terminal does not reach it. The client
that opened the bus is connected from the start; when that connection ends, for whatever reason, the kernel
inside is ended and everything removed. If the broker itself is killed, the process that opened the bus ends
the kernel; if both are killed, the kernel gets SIGTERM, and its agent stops it when the line is cut.
"""

from __future__ import annotations

import contextlib
import selectors
import signal
import socket
import sys
import time

from vcan import frames, registry, user_mode
from vcan.errors import BusUnavailable
from vcan.registry import Bus

BOOT_LIMIT_S = 60.0


class Client:
    """A connection: one command."""

    def __init__(self, connection: socket.socket, channel: int) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.channel = channel
        self.decoder = frames.Decoder()
        self.queue = bytearray()
        self.ended = False


class Broker:
    """The loop between the line into the kernel and the clients."""

    def __init__(self, bus: Bus, owner: socket.socket, memory: str) -> None:
        self._bus = bus  # its folder is there and locked
        self._selector = selectors.DefaultSelector()
        self._clients: dict[int, Client] = {}
        self._channels = 0
        self._line_queue = bytearray()
        self._line_room = frames.LINE_IN
        self._line_taken = 0
        self._ready = False
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(bus.folder / "socket"))
        self._listener.listen()
        self._selector.register(self._listener, selectors.EVENT_READ, self._accept)
        self._owner = self._add(owner)
        self._line, inner = socket.socketpair()
        self._line.setblocking(False)
        self._decoder = frames.Decoder()
        self._kernel = user_mode.boot(bus, inner, memory)
        inner.close()
        self._selector.register(self._line, selectors.EVENT_READ, self._line_turn)

    def serve(self) -> None:
        """Serves until the owner is gone or the kernel has ended; then removes everything."""
        trouble = "the bus has ended"
        limit = time.monotonic() + BOOT_LIMIT_S
        try:
            while not self._owner.ended:
                self._watch()
                for key, events in self._selector.select(None if self._ready else 1.0):
                    key.data(events)
                if not self._ready and time.monotonic() > limit:
                    raise BusUnavailable(f"user-mode Linux did not start in {BOOT_LIMIT_S:.0f} s")
        except BusUnavailable as error:
            trouble = f"{error}{self._log_end()}"
        finally:
            user_mode.end(self._kernel)
            registry.remove(self._bus)
            self._report_end(trouble)

    def _watch(self) -> None:
        """Asks for readiness to write only where something waits."""
        both = selectors.EVENT_READ | selectors.EVENT_WRITE
        waiting = self._ready and bool(self._line_queue) and self._line_room > 0
        self._selector.modify(
            self._line, both if waiting else selectors.EVENT_READ, self._line_turn
        )
        for client in self._clients.values():
            wanted = both if client.queue else selectors.EVENT_READ
            key = self._selector.get_key(client.connection)
            if key.events != wanted:
                self._selector.modify(client.connection, wanted, key.data)

    def _add(self, connection: socket.socket) -> Client:
        self._channels += 1
        client = Client(connection, self._channels)
        self._clients[client.channel] = client
        self._selector.register(
            connection, selectors.EVENT_READ, lambda events: self._client_turn(client, events)
        )
        return client

    def _accept(self, _events: int) -> None:
        client = self._add(self._listener.accept()[0])
        if self._ready:
            client.queue += frames.encode(frames.READY, 0)

    def _client_turn(self, client: Client, events: int) -> None:
        try:
            if events & selectors.EVENT_WRITE and client.queue:
                del client.queue[: client.connection.send(client.queue)]
            if events & selectors.EVENT_READ:
                data = client.connection.recv(65536)
                if not data:
                    self._drop(client)
                for kind, _, payload in client.decoder.feed(data):
                    self._line_queue += frames.encode(kind, client.channel, payload)
        except BlockingIOError:
            pass
        except (OSError, ValueError):
            self._drop(client)

    def _drop(self, client: Client) -> None:
        if client.ended:
            return
        client.ended = True
        self._selector.unregister(client.connection)
        del self._clients[client.channel]
        if client is not self._owner:
            client.connection.close()
        self._line_queue += frames.encode(frames.CLOSE, client.channel)

    def _line_turn(self, events: int) -> None:
        data = b""
        try:
            if events & selectors.EVENT_WRITE and self._line_queue:
                count = self._line.send(self._line_queue[: self._line_room])
                del self._line_queue[:count]
                self._line_room -= count
            if not events & selectors.EVENT_READ:
                return
            data = self._line.recv(65536)
        except ConnectionError:
            pass
        if not data:
            raise BusUnavailable(
                "user-mode Linux has ended" if self._ready else "user-mode Linux did not start"
            )
        for kind, channel, payload in self._decoder.feed(data):
            if kind == frames.LINE_ACK:
                self._line_room += frames.ACK.unpack(payload)[0]
            elif kind == frames.READY:
                self._ready = True
                for client in self._clients.values():
                    client.queue += frames.encode(frames.READY, 0)
            elif kind == frames.DATA:
                self._acknowledge(frames.HEADER.size + len(payload))
            if kind != frames.LINE_ACK and channel in self._clients:
                self._clients[channel].queue += frames.encode(kind, 0, payload)

    def _acknowledge(self, count: int) -> None:
        """In few frames, so that they take little of the line."""
        self._line_taken += count
        if self._line_taken >= frames.LINE_OUT // 4:
            self._line_queue += frames.encode(frames.LINE_ACK, 0, frames.ACK.pack(self._line_taken))
            self._line_taken = 0

    def _log_end(self) -> str:
        with contextlib.suppress(OSError):
            lines = (self._bus.folder / "log").read_text(errors="replace").splitlines()
            return "".join(f"\n    {line}" for line in lines[-12:])
        return ""

    def _report_end(self, trouble: str) -> None:
        """The last word to every client; the owner's connection is closed last, when nothing is left."""
        others = [client for client in self._clients.values() if client is not self._owner]
        for client in [*others, self._owner]:
            with contextlib.suppress(OSError):
                client.connection.settimeout(1.0)
                client.connection.sendall(
                    client.queue + frames.encode(frames.FAIL, 0, trouble.encode())
                )
            client.connection.close()


def main(bus: Bus, owner: socket.socket, memory: str) -> None:
    """The process: serves one bus from boot to end."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGPIPE):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    user_mode.adopt_orphans()  # stubs whose kernel has died: `user_mode.end` waits for them
    try:
        registry.create(bus)  # the lock is held to the end of this process
        try:
            broker = Broker(bus, owner, memory)
        except BaseException:
            registry.remove(bus)
            raise
        broker.serve()
    except BusUnavailable as error:
        with contextlib.suppress(OSError):
            owner.sendall(frames.encode(frames.FAIL, 0, str(error).encode()))
