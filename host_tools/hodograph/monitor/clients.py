# SPDX-License-Identifier: MIT
"""The browsers of the live page: client slots, and a bounded queue of messages for each.

A socket that has not said hello yet only waits; when too many wait, the one that has waited longest goes. A browser
that only watches is refused when all slots are taken. One with the token always gets a slot: if need be that of the
oldest browser with the token.

All methods but `publish` belong to the event loop.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Any, Generic, TypeVar

from .messages import encode

MOST_CLIENTS = 16
"""Who look on, and as many again who may command."""
MOST_WAITING = 64

Socket = TypeVar("Socket")


class ClientSlots(Generic[Socket]):
    """The sockets of the server by what they are; `enter` and `take_slot` give the one that has to go, if any."""

    def __init__(self) -> None:
        self._waiting: list[Socket] = []
        self._lookers: list[Socket] = []
        self._operators: list[Socket] = []

    def enter(self, socket: Socket) -> Socket | None:
        """Somebody new."""
        self._waiting.append(socket)
        return self._waiting.pop(0) if len(self._waiting) > MOST_WAITING else None

    def take_slot(self, socket: Socket, *, may_command: bool) -> Socket | None:
        """It has said hello: a browser that only watches is returned itself when there is no slot."""
        if socket in self._waiting:
            self._waiting.remove(socket)
        if may_command:
            self._operators.append(socket)
            return self._operators.pop(0) if len(self._operators) > MOST_CLIENTS else None
        if len(self._lookers) >= MOST_CLIENTS:
            return socket
        self._lookers.append(socket)
        return None

    def leave(self, socket: Socket) -> None:
        """It has gone."""
        for group in (self._waiting, self._lookers, self._operators):
            if socket in group:
                group.remove(socket)

    def everybody(self) -> list[Socket]:
        """All sockets there are."""
        return [*self._waiting, *self._lookers, *self._operators]


QUEUE = 100
"""Messages that wait for one browser: some four seconds."""
HISTORY = 1500
"""Messages of rows kept for browsers that come later: a minute at the machine's own pace."""
EVENTS = 50
QUEUED = ("rows", "event")
"""Types of which every message counts; of the others only the latest."""


class Client:
    """What waits for one browser: the latest message of each type, and a bounded queue of rows and events."""

    def __init__(self) -> None:
        self._latest: dict[str, str] = {}
        self._queue: deque[str] = deque()
        self._there = asyncio.Event()
        self.dropped = 0

    def put_latest(self, kind: str, text: str) -> None:
        """Replaces the message of this type that still waits."""
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
        """What waits belongs to a past that is of no interest any more."""
        self._queue.clear()

    async def get(self) -> str:
        """The next message."""
        while not self._latest and not self._queue:
            self._there.clear()
            await self._there.wait()
        if self._latest:
            return self._latest.pop(next(iter(self._latest)))
        return self._queue.popleft()


class Hub:
    """What every browser sees: rows and events as they come, and the latest message of each other type."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._clients: set[Client] = set()
        self._latest: dict[str, str] = {}
        self._rows: deque[str] = deque(maxlen=HISTORY)
        self._events: deque[str] = deque(maxlen=EVENTS)

    def publish(self, message: dict[str, Any]) -> None:
        """From any thread. After the loop has ended nothing happens."""
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
        """A new browser; it gets what there is."""
        client = Client()
        for kind, text in self._latest.items():
            client.put_latest(kind, text)
        history = ",".join([*self._rows, *self._events])
        client.put(f'{{"type":"history","messages":[{history}]}}')
        self._clients.add(client)
        return client

    def leave(self, client: Client) -> None:
        """The browser has gone."""
        self._clients.discard(client)

    @property
    def count(self) -> int:
        """Browsers that look on."""
        return len(self._clients)
