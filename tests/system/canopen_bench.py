# SPDX-License-Identifier: MIT
"""Parts of the tests with python canopen as client: devices on a local bus in virtual time, a client of them, and
frames made by hand. Used by the tests in this folder; starts processes of the devices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import can
import canopen
from canopen.objectdictionary import ODVariable

from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process, virtual_clock
from hodograph.bus.sdo.network import Network
from hodograph.data import object_dictionary

ROOT = Path(__file__).resolve().parents[2]
CONTROLLER_EDS = ROOT / "firmware/app/controller.eds"
DRIVE_EDS = ROOT / "sim/node/drive.eds"
FIGURES = (
    "gain_rad_s_v=83.0089,time_constant_s=0.19936,screw_mm_rad=1.59,torque_to_volts=1.39664804469,"
    "volts_limit=5,k_pp_rad_s_mm=97.38,k_pv_nm_s_rad=1.19,k_iv_per_s=252.8,k_pf_rad_mm=0.8,k_vf=0.85"
)
CONTROLLER, DRIVE = 1, 42
NOTHING = [{"can_id": 0x7FF, "can_mask": 0x7FF}]
"""Filters of a member that only sends: no frame of a node passes. Without filters each frame wakes the test."""

READ_ONLY, WRITE_ONLY = 0x06010002, 0x06010001
NO_OBJECT, NO_SUB = 0x06020000, 0x06090011
TOGGLE, TIMEOUT, COMMAND = 0x05030000, 0x05040000, 0x05040001
BLOCK_SIZE, SEQUENCE, CRC = 0x05040002, 0x05040003, 0x05040004
TOO_LONG, TOO_SHORT = 0x06070012, 0x06070013
VALUE, TOO_HIGH, TOO_LOW = 0x06090030, 0x06090031, 0x06090032
STATE, BUSY = 0x08000022, 0x08000021

LOOK_S = 0.001


def frames_of(*bases: int, node: int) -> list[dict[str, Any]]:
    """Filters for these services of a node."""
    return [{"can_id": base + node, "can_mask": 0x7FF} for base in bases]


def listener(hub: LocalHub, *bases: int, node: int = 0) -> LocalBus:
    """Receives these services of a node; with no base all frames."""
    return LocalBus(hub.address.channel, can_filters=frames_of(*bases, node=node) or None)


def until(network: Network, happened: Callable[[], Any], limit_s: float = 30.0) -> None:
    """Lets time pass until it has happened: looks after each frame that comes, and every millisecond."""
    end_s = network.clock.now_s() + limit_s
    while not network.wait_until(happened, LOOK_S):
        assert network.clock.now_s() < end_s, f"it did not happen within {limit_s:g} s"


def let_pass(network: Network, seconds: float) -> None:
    """Takes the frames of this time."""
    network.wait_until(lambda: False, seconds)


def drain(bus: can.BusABC) -> None:
    """Forgets the frames that are waiting."""
    while bus.recv(0) is not None:
        pass


@contextmanager
def process(hub: LocalHub, node: int, *words: str) -> Iterator[Process]:
    """A device, from its boot-up frame to its end."""
    clock = virtual_clock(hub.address)
    assert clock is not None
    try:
        with listener(hub, 0x700, node=node) as bus:
            device = Process(f"node-{node}", list(words), clock)
            try:
                frame = bus.recv(1.0)
                assert frame is not None, f"no boot-up frame within 1 s: {device.text()}"
                assert (frame.arbitration_id, bytes(frame.data)) == (0x700 + node, b"\0")
                yield device
            finally:
                device.kill()
                device.end()
    finally:
        clock.release()


def drive_process(
    hub: LocalHub, node: int = DRIVE, axis: str = ""
) -> AbstractContextManager[Process]:
    """A simulated drive."""
    program, figures = str(ROOT / "build/bin/hodograph-drive"), f"node={node},{FIGURES}{axis}"
    return process(hub, node, program, "--bus", hub.address.channel, "--axis", figures)


def controller_process(hub: LocalHub, node: int = CONTROLLER) -> AbstractContextManager[Process]:
    """A controller; without drives it stays in state boot."""
    program = str(ROOT / "build/bin/hodograph-controller")
    return process(hub, node, program, "--bus", hub.address.channel, "--node", str(node))


@contextmanager
def client(hub: LocalHub, node: canopen.RemoteNode) -> Iterator[Network]:
    """A network with this node; receives of it SDO, EMCY, heartbeats and its first three TPDOs."""
    network = Network(listener(hub, 0x080, 0x180, 0x280, 0x380, 0x580, 0x700, node=node.id))
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = 3.0
    try:
        yield network
    finally:
        network.disconnect()


@contextmanager
def drive_node(hub: LocalHub, node: int = DRIVE, axis: str = "") -> Iterator[canopen.RemoteNode]:
    """A simulated drive just switched on, as python canopen has it."""
    remote = canopen.RemoteNode(node, object_dictionary(DRIVE_EDS, node))
    with drive_process(hub, node, axis), client(hub, remote):
        yield remote


@contextmanager
def controller_node(hub: LocalHub, node: int = CONTROLLER) -> Iterator[canopen.RemoteNode]:
    """A controller just switched on, as python canopen has it."""
    remote = canopen.RemoteNode(node, object_dictionary(CONTROLLER_EDS, node))
    with controller_process(hub, node), client(hub, remote):
        yield remote


class Hand:
    """SDO frames made by hand."""

    def __init__(self, hub: LocalHub, node: int) -> None:
        self.node = node
        self.bus = listener(hub, 0x580, node=node)

    def send(self, data: bytes, length: int = 8) -> None:
        """A request, filled up with zeros."""
        self.bus.send(
            can.Message(
                arbitration_id=0x600 + self.node,
                data=data.ljust(length, b"\0"),
                is_extended_id=False,
            )
        )

    def answer(self, wait_s: float = 3.0) -> bytes:
        """The next answer."""
        frame = self.bus.recv(wait_s)
        assert frame is not None, f"no answer within {wait_s:g} s"
        assert (frame.arbitration_id, frame.dlc) == (0x580 + self.node, 8)
        return bytes(frame.data)

    def silence(self, wait_s: float = 0.5) -> None:
        """No answer comes."""
        frame = self.bus.recv(wait_s)
        assert frame is None, frame

    def ask(self, data: bytes) -> bytes:
        """Request and answer. Answers to another client are forgotten before."""
        drain(self.bus)
        self.send(data)
        return self.answer()

    def aborted(self, answer: bytes) -> int:
        """The abort code of an answer, which must be an abort."""
        assert answer[0] == 0x80, answer.hex(" ")
        return int.from_bytes(answer[4:8], "little")

    def close(self) -> None:
        self.bus.shutdown()


@contextmanager
def hand(hub: LocalHub, node: int) -> Iterator[Hand]:
    """A client by hand, for a node."""
    made = Hand(hub, node)
    try:
        yield made
    finally:
        made.close()


def object_bytes(index: int, sub: int) -> bytes:
    """Bytes 1 to 3 of an initiate request."""
    return index.to_bytes(2, "little") + bytes([sub])


def abort_code(attempt: Callable[[], Any]) -> int:
    """The code with which the device aborts; 0 when it does not."""
    try:
        attempt()
    except canopen.SdoAbortedError as error:
        return int(error.code)
    return 0


def variables(od: canopen.ObjectDictionary) -> Iterator[ODVariable]:
    """All values of a dictionary."""
    for entry in od.values():
        yield from [entry] if isinstance(entry, ODVariable) else list(entry.values())


def name_of(variable: ODVariable) -> str:
    """Index and sub-index for messages."""
    return f"0x{variable.index:04X} sub {variable.subindex} {variable.qualname}"


def program(name: str) -> bytes:
    """A golden program image."""
    return (ROOT / "tests/data/programs" / f"{name}.hdgp").read_bytes()
