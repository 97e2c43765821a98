# SPDX-License-Identifier: MIT
"""The browsers of the live page: client slots, and a bounded queue of messages for each.

A new socket waits until its browser has sent a hello message. At most 64 sockets wait; one more, and the oldest is
closed. A browser that only watches is refused when all 16 slots are taken. A browser with the token always gets a slot,
if necessary that of the oldest browser with the token.

Used by `server` and `session`. All methods except `Broadcaster.publish` have to be called in the event loop. No I/O:
the server closes the sockets and sends the messages.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Any, Generic, TypeVar

from .messages import encode

MOST_CLIENTS = 16
"""Slots for browsers that only watch, and as many for browsers that may command."""
MOST_WAITING = 64
"""Sockets without a hello message."""

Socket = TypeVar("Socket")


class ClientSlots(Generic[Socket]):
    """The sockets of the server by role. `enter` and `take_slot` return the socket that has to be closed, or None."""

    def __init__(self) -> None:
        self._waiting: list[Socket] = []
        self._watchers: list[Socket] = []
        self._operators: list[Socket] = []

    def enter(self, socket: Socket) -> Socket | None:
        """Adds a new socket, which waits."""
        self._waiting.append(socket)
        return self._waiting.pop(0) if len(self._waiting) > MOST_WAITING else None

    def take_slot(self, socket: Socket, *, may_command: bool) -> Socket | None:
        """Gives a socket its slot after its hello message. Returns a browser that only watches if none is free."""
        if socket in self._waiting:
            self._waiting.remove(socket)
        if may_command:
            self._operators.append(socket)
            return self._operators.pop(0) if len(self._operators) > MOST_CLIENTS else None
        if len(self._watchers) >= MOST_CLIENTS:
            return socket
        self._watchers.append(socket)
        return None

    def leave(self, socket: Socket) -> None:
        """Removes a socket that has been closed."""
        for group in (self._waiting, self._watchers, self._operators):
            if socket in group:
                group.remove(socket)

    def everybody(self) -> list[Socket]:
        """All sockets."""
        return [*self._waiting, *self._watchers, *self._operators]


QUEUE = 100
"""Messages that wait for one browser: about four seconds."""
HISTORY = 1500
"""Messages of rows that are kept for later browsers: a minute in real time."""
EVENTS = 50
"""Events that are kept for later browsers."""
QUEUED = ("rows", "event")
"""Types of which every message is sent; of the other types only the latest."""


class Client:
    """Messages that wait for one browser: the latest of each type, and a bounded queue of rows and events."""

    def __init__(self) -> None:
        self._latest: dict[str, str] = {}
        self._queue: deque[str] = deque()
        self._there = asyncio.Event()
        self.dropped = 0

    def put_latest(self, kind: str, text: str) -> None:
        """Replaces the waiting message of this type."""
        self._latest[kind] = text
        self._there.set()

    def put(self, text: str) -> None:
        """Queues a message; the oldest is dropped when there is no space."""
        if len(self._queue) >= QUEUE:
            self._queue.popleft()
            self.dropped += 1
        self._queue.append(text)
        self._there.set()

    def clear_rows(self) -> None:
        """Empties the queue: its messages belong to a past run."""
        self._queue.clear()

    async def get(self) -> str:
        """The next message."""
        while not self._latest and not self._queue:
            self._there.clear()
            await self._there.wait()
        if self._latest:
            return self._latest.pop(next(iter(self._latest)))
        return self._queue.popleft()


class Broadcaster:
    """Sends messages to every browser: rows and events as they come, and the latest message of each other type."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._clients: set[Client] = set()
        self._latest: dict[str, str] = {}
        self._rows: deque[str] = deque(maxlen=HISTORY)
        self._events: deque[str] = deque(maxlen=EVENTS)

    def publish(self, message: dict[str, Any]) -> None:
        """Sends a message to every browser. From any thread; without effect after the event loop has ended."""
        text = encode(message)
        try:
            self._loop.call_soon_threadsafe(self._deliver, str(message["type"]), text)
        except RuntimeError:
            return

    def _deliver(self, kind: str, text: str) -> None:
        if kind == "restart":
            self._rows.clear()
            for client in self._clients:
                client.clear_rows()
                client.put(text)
        elif kind in QUEUED:
            (self._rows if kind == "rows" else self._events).append(text)
            for client in self._clients:
                client.put(text)
        else:
            self._latest[kind] = text
            for client in self._clients:
                client.put_latest(kind, text)

    def join(self) -> Client:
        """Adds a browser. It gets the latest messages and the history."""
        client = Client()
        for kind, text in self._latest.items():
            client.put_latest(kind, text)
        history = ",".join([*self._rows, *self._events])
        client.put(f'{{"type":"history","messages":[{history}]}}')
        self._clients.add(client)
        return client

    def leave(self, client: Client) -> None:
        """Removes a browser."""
        self._clients.discard(client)

    @property
    def count(self) -> int:
        """Number of browsers."""
        return len(self._clients)
