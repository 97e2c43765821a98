# SPDX-License-Identifier: MIT
"""Who may be there at once: bounded, and nobody can take the operator's place.

A socket that has not said hello yet only waits; when too many wait, the one that has waited longest goes. Of those who
look on, a new one is sent away when all seats are taken. Who has the token always gets in: at worst the oldest of
those who have it makes room.
"""

from __future__ import annotations

from typing import Generic, TypeVar

MOST_CLIENTS = 16
"""Who look on, and as many again who may command."""
MOST_WAITING = 64

Socket = TypeVar("Socket")


class ClientSlots(Generic[Socket]):
    """The sockets of the server by what they are; `enter` and `seat` give the one that has to go, if any."""

    def __init__(self) -> None:
        self._waiting: list[Socket] = []
        self._lookers: list[Socket] = []
        self._operators: list[Socket] = []

    def enter(self, socket: Socket) -> Socket | None:
        """Somebody new."""
        self._waiting.append(socket)
        return self._waiting.pop(0) if len(self._waiting) > MOST_WAITING else None

    def seat(self, socket: Socket, *, may_command: bool) -> Socket | None:
        """It has said hello: a looker gets itself back when there is no seat."""
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
