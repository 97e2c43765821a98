# SPDX-License-Identifier: MIT
"""TCP ports of this machine's loopback, passed on to the same or another port beside the bus. Used by vcan/main.
Listens at ports; starts a thread or a process (vcan/relay).

`--forward OUTSIDE[:INSIDE]` serves 127.0.0.1:OUTSIDE as long as the command runs; each connection becomes one to
127.0.0.1:INSIDE there. User-mode Linux is reached through the broker, a network namespace by a process within it.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vcan.errors import BusUnavailable


@dataclass(frozen=True)
class Forward:
    """A port here and the port there."""

    outside: int
    inside: int


def parse(text: str) -> Forward:
    """`OUTSIDE` or `OUTSIDE:INSIDE`. Raises ValueError."""
    found = re.fullmatch(r"(\d{1,5})(?::(\d{1,5}))?", text)
    if found is None:
        raise ValueError(f"{text}: PORT or OUTSIDE:INSIDE is needed")
    outside, inside = int(found[1]), int(found[2] or found[1])
    if not (1 <= outside <= 65535 and 1 <= inside <= 65535):
        raise ValueError(f"{text}: ports are 1 to 65535")
    return Forward(outside, inside)


def listen(forwards: Sequence[Forward]) -> list[socket.socket]:
    """Takes the ports outside. Raises BusUnavailable when one is in use."""
    listeners = []
    for forward in forwards:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("127.0.0.1", forward.outside))
            listener.listen()
        except OSError as error:
            raise BusUnavailable(
                f"--forward: port {forward.outside} cannot be served: {error.strerror}: "
                "choose another one, OUTSIDE:INSIDE"
            ) from error
        listeners.append(listener)
    return listeners


def through_broker(
    forwards: Sequence[Forward], listeners: Sequence[socket.socket], broker: Path
) -> None:
    """Passes on to ports inside user-mode Linux, in a thread, until this process ends."""
    if forwards:
        from vcan import relay  # importing what it needs takes long

        relay.start_thread([each.inside for each in forwards], listeners, broker)


def beside(forwards: Sequence[Forward], listeners: Sequence[socket.socket]) -> None:
    """Passes on to ports of the network namespace that this process is in now, in a process of its own.

    It ends with this one, whatever program that has become.
    """
    if forwards:
        from vcan import relay

        relay.start_process([each.inside for each in forwards], listeners)
