# SPDX-License-Identifier: MIT
"""Another node on the bus that sends unexpected frames, drives that report a vendor, and checks of the machine
afterwards. Used by the tests in this folder; starts controllers and drives, and sends frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import can
import numpy as np
from canopen_bench import NOTHING
from numpy.typing import NDArray

from bench import Bench
from hodograph.bus.capture.decode import RPDO1, SYNC_ID
from hodograph.bus.capture.recorder import Frames
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process, controller_command, drive_command, virtual_clock
from hodograph.bus.sdo.controller import FAULT_STATE, OFF, READY, connect
from hodograph.bus.sdo.objects import FAULT
from hodograph.cli.main import main
from hodograph.config import Machine

START, STOP, PRE_OPERATIONAL, RESET_NODE = 0x01, 0x02, 0x80, 0x81
LIMIT_S = 20.0


class OtherNode:
    """A node that sends any frames, in the time of the test."""

    def __init__(self, channel: str) -> None:
        self._bus = LocalBus(channel, can_filters=NOTHING)

    def send(self, identifier: int, data: bytes) -> None:
        """One frame."""
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def nmt(self, command: int, node: int) -> None:
        """An NMT command; node 0: to all."""
        self.send(0, bytes([command, node]))

    def write(self, node: int, index: int, sub: int, value: int, size: int) -> None:
        """An SDO download of up to four bytes; the answer is not read."""
        head = bytes([0x23 | (4 - size) << 2]) + index.to_bytes(2, "little") + bytes([sub])
        self.send(0x600 + node, head + value.to_bytes(size, "little").ljust(4, b"\0"))

    def close(self) -> None:
        self._bus.shutdown()


@contextmanager
def other_node(hub: LocalHub) -> Iterator[OtherNode]:
    """Another node on the bus."""
    made = OtherNode(hub.address.channel)
    try:
        yield made
    finally:
        made.close()


FRAME_BITS_LEAST = 111
"""Of a frame of eight bytes, without stuff bits; at 1 Mbit/s as many microseconds."""


def flood(other: OtherNode, identifier: int, seconds: float) -> None:
    """Occupies the bus for this time without a gap: all frames are queued at once, as from a node with a broken
    driver.
    """
    for _ in range(round(seconds * 1e6 / FRAME_BITS_LEAST)):
        other.send(identifier, b"\xaa" * 8)


def latched(frames: Frames, node: int) -> NDArray[np.int64]:
    """The target that a drive has at each SYNC, in counts, from the first one on."""
    setpoints = frames["id"] == RPDO1 + node
    targets = np.ascontiguousarray(frames["data"][:, 2:6]).view("<i4")[:, 0].astype(np.int64)
    latest = np.maximum.accumulate(np.where(setpoints, np.arange(frames.size), -1))
    at = latest[frames["id"] == SYNC_ID]
    return targets[at[at >= 0]]


@contextmanager
def real_drives(
    hub: LocalHub, machine: Machine, *, vendor: int = 0x123, controller: tuple[str, ...] = ()
) -> Iterator[Bench]:
    """A machine whose drives name a vendor, as real ones do: configured, drives off. The processes are `drives` and
    `controller-1`; `controller` are more words of its command line.
    """
    clock = virtual_clock(hub.address)
    assert clock is not None
    words = [
        f"{word},vendor={vendor}" if word.startswith("node=") else word
        for word in drive_command(machine, hub.address)
    ]
    with ExitStack() as stack:
        stack.callback(clock.release)
        commands = (
            ("drives", words),
            ("controller-1", [*controller_command(machine, hub.address, "real-time"), *controller]),
        )
        for name, command in commands:
            stack.callback(Process(name, command, clock).end)
        node = stack.enter_context(connect(hub.address, machine.node, machine.bitrate))
        node.require(5.0)
        node.configure(machine, "fixed")
        node.wait_for((OFF,), 10.0)
        yield Bench(machine, None, node, hub.address)  # type: ignore[arg-type]


def settled(bench: Bench, limit_s: float = LIMIT_S) -> tuple[int, int, int]:
    """Lets time pass until the controller is ready, off or in fault; then state, fault code and node."""
    end_s = bench.clock.now_s() + limit_s
    while (state := bench.controller.state()) not in (READY, OFF, FAULT_STATE):
        assert bench.clock.now_s() < end_s, f"still in state {state}"
        bench.clock.sleep(0.01)
    return state, bench.controller.read(FAULT, 1), bench.controller.read(FAULT, 2)


def runs_again(path: str, reset: Callable[[], int] = lambda: main(["reset"])) -> None:
    """The recovery that the documentation names, and the program as if nothing had been."""
    assert reset() == 0
    assert main(["goto", path]) == 0
    assert main(["start", "--follow"]) == 0
