# SPDX-License-Identifier: MIT
"""Actions of the host in a fault case: kills processes, breaks off uploads, reads drives without a controller. Used by
faults/disturb and faults/uploads. Starts processes, sends by SDO, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ..bus.address import BusAddress
from ..bus.clock import Clock, VirtualClock
from ..bus.processes import Process
from ..bus.sdo.controller import Controller
from ..bus.sdo.network import open_network
from ..bus.sdo.objects import PROGRAM
from ..data import DRIVE_EDS, object_dictionary
from ..errors import RunError

_STATUSWORD, _POSITION = 0x6041, 0x6064
_STATE_MASK, _OPERATION_ENABLED = 0x6F, 0x27
_WATCH_S = 0.004
"""Time between two readings of the encoders."""
_STILL_LOOKS = 5
"""Equal readings after which an axis counts as standing."""


def cut_upload(controller: Controller, image: bytes, at: int, *, polite: bool) -> None:
    """Sends the first bytes of an image (a multiple of seven, or all but the end), then nothing more.

    `polite` sends an SDO abort at the end, as a process does on an error; a killed process does not.
    """
    with controller.turn():
        stream = controller.sdo.open(
            PROGRAM, 1, "wb", buffering=0, size=len(image), block_transfer=True
        )
        while stream.pos < min(at, len(image) - 1):
            stream.write(image[stream.pos : stream.pos + 7])
        stream._initialized = False  # or close() would go on with the protocol
        if polite:
            controller.sdo.abort()


def spawn_command(clock: VirtualClock | None, *words: str) -> Process:
    """A hodograph command as a process, which is killed later."""
    return Process("command", [sys.executable, "-m", "hodograph", *words], clock)


@contextmanager
def drives_at(bus: BusAddress, nodes: Sequence[int], bitrate: int) -> Iterator[list[Any]]:
    """SDO clients of the drives, for times without a controller."""
    with ExitStack() as stack:
        clients = []
        for node in nodes:
            network = stack.enter_context(open_network(bus, node, bitrate))
            client = network.add_node(node, object_dictionary(DRIVE_EDS, node)).sdo
            client.RESPONSE_TIMEOUT = 1.0
            clients.append(client)
        yield clients


def await_rest(clients: Sequence[Any], clock: Clock, tolerance_counts: int, wait_s: float) -> float:
    """Waits until the drives, by SDO, are at rest and not enabled; returns the time as `Clock.now_s`. Raises RunError:
    they never are.
    """
    deadline = clock.now_s() + wait_s
    rests = {id(client): (0, 0.0, 0) for client in clients}  # place, time since when, checks
    while True:
        for client in clients:
            place, since_s, looks = rests[id(client)]
            try:
                word, now = int(client[_STATUSWORD].raw), int(client[_POSITION].raw)
            except (SdoCommunicationError, SdoAbortedError):  # the controller asks it as well
                continue
            off = word & _STATE_MASK != _OPERATION_ENABLED
            if off and abs(now - place) <= tolerance_counts and looks > 0:
                rests[id(client)] = (place, since_s, looks + 1)
            else:
                rests[id(client)] = (now, clock.now_s(), 1 if off else 0)
        if all(looks >= _STILL_LOOKS for _, _, looks in rests.values()):
            return max(since_s for _, since_s, _ in rests.values())
        if clock.now_s() > deadline:
            raise RunError(f"without a controller, a drive is not off and at rest in {wait_s:g} s")
        clock.sleep(_WATCH_S)
