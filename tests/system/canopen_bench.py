# SPDX-License-Identifier: MIT
"""What the tests with python canopen as client share: one device on vcan0, a client of it, and frames made by hand."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import canopen
from canopen.objectdictionary import ODVariable

ROOT = Path(__file__).resolve().parents[2]
CONTROLLER_EDS = ROOT / "firmware/app/controller.eds"
DRIVE_EDS = ROOT / "sim/node/drive.eds"
FIGURES = (
    "gain_rad_s_v=83.0089,time_constant_s=0.19936,screw_mm_rad=1.59,torque_to_volts=1.39664804469,"
    "volts_limit=5,k_pp_rad_s_mm=97.38,k_pv_nm_s_rad=1.19,k_iv_per_s=252.8,k_pf_rad_mm=0.8,k_vf=0.85"
)
CONTROLLER, DRIVE = 1, 42

READ_ONLY, WRITE_ONLY = 0x06010002, 0x06010001
NO_OBJECT, NO_SUB = 0x06020000, 0x06090011
TOGGLE, TIMEOUT, COMMAND = 0x05030000, 0x05040000, 0x05040001
BLOCK_SIZE, SEQUENCE, CRC = 0x05040002, 0x05040003, 0x05040004
TOO_LONG, TOO_SHORT = 0x06070012, 0x06070013
VALUE, TOO_HIGH, TOO_LOW = 0x06090030, 0x06090031, 0x06090032
STATE = 0x08000022


def frames_of(*bases: int, node: int) -> list[dict[str, int]]:
    """Filters for these services of a node."""
    return [{"can_id": base + node, "can_mask": 0x7FF} for base in bases]


def until(happened: Callable[[], Any], limit_s: float = 30.0) -> None:
    """Waits for what a thread or process does."""
    end = time.monotonic() + limit_s
    while not happened():
        assert time.monotonic() < end, f"it did not happen within {limit_s:g} s"
        time.sleep(0.005)


def drain(bus: can.BusABC) -> None:
    """Forgets the frames that are waiting."""
    while bus.recv(0) is not None:
        pass


@contextmanager
def process(node: int, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A device, from its boot-up frame to its end."""
    filters = frames_of(0x700, node=node)
    with can.Bus(interface="socketcan", channel="vcan0", can_filters=filters) as bus:
        drain(bus)  # what came before the filters were set
        device = subprocess.Popen(words, stderr=subprocess.DEVNULL)
        try:
            frame = bus.recv(10)
            assert frame is not None, "no boot-up frame within 10 s"
            assert (frame.arbitration_id, bytes(frame.data)) == (0x700 + node, b"\0")
            yield device
        finally:
            device.kill()
            device.wait()


def drive_process(node: int = DRIVE, axis: str = "") -> Any:
    """A simulated drive."""
    axis = f"node={node},{FIGURES}{axis}"
    return process(node, str(ROOT / "build/bin/hodograph-drive"), "--bus", "vcan0", "--axis", axis)


def controller_process(node: int = CONTROLLER) -> Any:
    """A controller; without drives it stays in state boot."""
    program = str(ROOT / "build/bin/hodograph-controller")
    return process(node, program, "--bus", "vcan0", "--node", str(node))


@contextmanager
def client(node: canopen.RemoteNode) -> Iterator[canopen.Network]:
    """A network with this node; hears of it SDO, EMCY, heartbeats and its first three TPDOs."""
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    filters = frames_of(0x080, 0x180, 0x280, 0x380, 0x580, 0x700, node=node.id)
    network.connect(interface="socketcan", channel="vcan0", can_filters=filters)
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = 10.0
    try:
        yield network
    finally:
        network.disconnect()


class Hand:
    """SDO frames made by hand."""

    def __init__(self, node: int) -> None:
        self.node = node
        self.bus = can.Bus(
            interface="socketcan", channel="vcan0", can_filters=frames_of(0x580, node=node)
        )
        drain(self.bus)

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

    def silence(self, wait_s: float = 0.1) -> None:
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
def hand(node: int) -> Iterator[Hand]:
    """A client by hand, for a node."""
    made = Hand(node)
    try:
        yield made
    finally:
        made.close()


def settle(node: canopen.RemoteNode) -> None:
    """python canopen forgets the answers to a client by hand, which it has heard too.

    All that came before the answer to a question of its own is old.
    """
    question = object_bytes(0x1018, 2)
    node.network.send_message(0x600 + node.id, b"\x40" + question + bytes(4))
    while node.sdo.responses.get(timeout=5.0)[:4] != b"\x43" + question:
        pass


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
