# SPDX-License-Identifier: MIT
"""python canopen, an implementation that is not ours, as the client of firmware/canopen.

The node is C, compiled into a shared library. Frames go from call to call and can be lost on the way; time is what the
client waits for. Run by pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import queue
import random
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

ROOT = Path(__file__).resolve().parents[3]
EDS_FILES = {
    "controller": ROOT / "firmware" / "app" / "controller.eds",
    "drive": ROOT / "sim" / "node" / "drive.eds",
}
STEP_US = 1000
LIMIT_US = 10_000_000


class Frame(ctypes.Structure):
    """struct can_msg."""

    _fields_ = [("id", ctypes.c_uint32), ("len", ctypes.c_uint8), ("data", ctypes.c_uint8 * 8)]


class Message(NamedTuple):
    """A frame on the way, in either direction."""

    identifier: int
    data: bytes


def from_c(frame: Frame) -> Message:
    return Message(frame.id, bytes(frame.data[: frame.len]))


def to_c(message: Message) -> Frame:
    data = (ctypes.c_uint8 * 8)(*message.data)
    return Frame(message.identifier, len(message.data), data)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("device")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools")}
    for name, eds in EDS_FILES.items():
        command = [sys.executable, "-m", "eds.to_c", str(eds), name, str(folder)]
        subprocess.run(command, check=True, env=environment)
    sources = [Path(__file__).with_name("device.c"), *(ROOT / "firmware" / "canopen").glob("*.c")]
    made = folder / "device.so"
    command = [os.environ.get("CC", "cc"), "-std=c99", "-O1", "-fPIC", "-shared"]
    command += [f"-I{ROOT / 'firmware'}", f"-I{folder}", "-o", str(made)]
    command += [*map(str, sources), *map(str, folder.glob("od_*.c"))]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(made))


class Device(canopen.Network):
    """The node, as the network that python canopen talks to: what is sent is answered before the call returns."""

    def __init__(self, library: ctypes.CDLL, name: str, node: int, block: int) -> None:
        super().__init__()
        self.library = library
        self.lose: Callable[[Message], bool] = lambda message: False
        self.now_us = 0
        library.device_init(int(name == "drive"), node, block)

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """See canopen.Network."""
        message = Message(can_id, bytes(data))
        if not remote and not self.lose(message):
            request, answer = to_c(message), Frame()
            if self.library.device_receive(ctypes.byref(request), ctypes.byref(answer)):
                self.deliver(answer)
            self.process(0)

    def process(self, elapsed_us: int) -> None:
        """Lets time pass for the node."""
        frame = Frame()
        self.now_us += elapsed_us
        while self.library.device_process(elapsed_us, ctypes.byref(frame)):
            self.deliver(frame)
            elapsed_us = 0

    def deliver(self, frame: Frame) -> None:
        message = from_c(frame)
        if not self.lose(message):
            self.notify(message.identifier, bytearray(message.data), self.now_us * 1e-6)

    def until(self, happened: Callable[[], bool], limit_us: int = LIMIT_US) -> bool:
        """Lets time pass until it has happened; false when it has not by then."""
        end_us = self.now_us + limit_us
        while not happened() and self.now_us < end_us:
            self.process(STEP_US)
        return happened()

    def image(self) -> bytes:
        data = ctypes.POINTER(ctypes.c_uint8)()
        size = self.library.device_image(ctypes.byref(data))
        return ctypes.string_at(data, size)


class Answers:
    """What an SDO client takes for its queue of answers; time passes while it waits for one."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.waiting: deque[bytes] = deque()

    def put(self, answer: bytes) -> None:
        self.waiting.append(answer)

    def empty(self) -> bool:
        """True, always: what came before a request is no answer to it."""
        self.waiting.clear()
        return True

    def get(self, block: bool = True, timeout: float = 0.0) -> bytes:
        if not self.device.until(lambda: bool(self.waiting), round(timeout * 1e6) if block else 0):
            raise queue.Empty
        return self.waiting.popleft()


class Pair:
    """A device and the python canopen node that talks to it."""

    def __init__(self, library: ctypes.CDLL, name: str, node: int, block: int) -> None:
        self.device = Device(library, name, node, block)
        self.node = canopen.RemoteNode(node, str(EDS_FILES[name]))
        self.device.add_node(self.node)
        self.node.sdo.responses = Answers(self.device)
        self.node.sdo.RESPONSE_TIMEOUT = 1.0
        self.heartbeats: list[int] = []
        self.node.nmt.add_heartbeat_callback(self.heartbeats.append)
        self.device.process(0)
        assert self.heartbeats == [0]

    def command(self, state: str, heartbeat: int) -> None:
        """An NMT command; waits for the heartbeat with the new state."""
        self.heartbeats.clear()
        self.node.nmt.state = state
        assert self.device.until(lambda: bool(self.heartbeats))
        assert self.heartbeats == [heartbeat]


@pytest.fixture
def controller(library: ctypes.CDLL) -> Pair:
    return Pair(library, "controller", 1, 127)


@pytest.fixture
def drive(library: ctypes.CDLL) -> Pair:
    return Pair(library, "drive", 5, 127)


def image_of(size: int) -> bytes:
    return random.Random(size).randbytes(size)


def download(pair: Pair, data: bytes) -> None:
    with pair.node.sdo[0x2000][1].open("wb", size=len(data), block_transfer=True) as stream:
        stream.write(data)


# Blocks hold 889 bytes: whole ones, and one more or less.
@pytest.mark.parametrize("size", [1, 6, 7, 8, 14, 888, 889, 890, 1778, 5000, 100000])
def test_block_download_in_one_call(controller: Pair, size: int) -> None:
    download(controller, image_of(size))
    assert controller.device.image() == image_of(size)


def test_segmented_download_and_upload(controller: Pair) -> None:
    data = image_of(1000)
    controller.node.sdo.download(0x2000, 1, data)
    assert controller.device.image() == data
    assert controller.node.sdo.upload(0x2000, 1) == data


@pytest.mark.parametrize("size", [5, 7, 889, 1000, 20000])
def test_block_upload(controller: Pair, size: int) -> None:
    data = image_of(size)
    download(controller, data)
    with controller.node.sdo[0x2000][1].open("rb", block_transfer=True) as stream:
        assert stream.read() == data


def test_block_download_that_the_device_refuses(controller: Pair) -> None:
    with pytest.raises(SdoAbortedError) as caught:
        download(controller, b"bad image")
    assert caught.value.code == 0x06090030


def test_block_download_repeats_a_lost_segment(library: ctypes.CDLL) -> None:
    pair = Pair(library, "controller", 1, 32)
    segments = itertools.count()
    lost = []

    def lose(message: Message) -> bool:
        is_segment = message.identifier == 0x601 and message.data[0] & 0x7F in range(1, 33)
        if is_segment and next(segments) in (10, 75):
            lost.append(message.data[0])
            return True
        return False

    data = image_of(3000)
    pair.device.lose = lose
    download(pair, data)
    assert pair.device.image() == data
    assert len(lost) == 2


def test_an_interrupted_download_can_be_begun_again(controller: Pair) -> None:
    data = image_of(5000)
    controller.device.lose = lambda message: message.identifier == 0x581
    with pytest.raises(SdoCommunicationError):
        download(controller, data)
    controller.device.lose = lambda message: False
    download(controller, data)
    assert controller.device.image() == data


ABORTS = [
    (0x3000, 0, None, 0x06020000),
    (0x2000, 99, None, 0x06090011),
    (0x2001, 0, None, 0x06010001),
    (0x2002, 0, b"\x00", 0x06010002),
    (0x2001, 0, b"\x01\x00", 0x06070012),
    (0x2001, 0, b"\x63", 0x06090031),
    (0x1006, 0, b"\x01\x00\x00\x00", 0x06090032),
    (0x1006, 0, b"\x01\x00", 0x06070013),
]


@pytest.mark.parametrize(("index", "sub", "data", "code"), ABORTS)
def test_abort_codes(controller: Pair, index: int, sub: int, data: bytes | None, code: int) -> None:
    sdo = controller.node.sdo
    if data is None:
        with pytest.raises(SdoAbortedError) as caught:
            sdo.upload(index, sub)
    else:
        with pytest.raises(SdoAbortedError) as caught:
            sdo.download(index, sub, data)
    assert caught.value.code == code


def variables(od: canopen.ObjectDictionary) -> Iterator[ODVariable]:
    for index in od:
        entry = od[index]
        yield from [entry] if isinstance(entry, ODVariable) else list(entry.values())


@pytest.mark.parametrize("name", sorted(EDS_FILES))
def test_every_object_reads_back_as_the_eds_declares_it(
    name: str, request: pytest.FixtureRequest
) -> None:
    pair: Pair = request.getfixturevalue(name)
    checked = 0
    for variable in variables(pair.node.object_dictionary):
        if not variable.readable or variable.data_type == datatypes.DOMAIN:
            continue
        raw = pair.node.sdo.upload(variable.index, variable.subindex)
        if variable.data_type == datatypes.VISIBLE_STRING:
            assert raw.decode("ascii") == variable.default
        else:
            assert len(raw) * 8 == len(variable), variable.qualname
            assert variable.decode_raw(raw) == variable.default, variable.qualname
        checked += 1
    assert checked > 80


@pytest.mark.parametrize("name", sorted(EDS_FILES))
def test_every_writable_number_keeps_what_is_written(
    name: str, request: pytest.FixtureRequest
) -> None:
    pair: Pair = request.getfixturevalue(name)
    changed = 0
    for variable in variables(pair.node.object_dictionary):
        if not (variable.readable and variable.writable) or variable.data_type == datatypes.DOMAIN:
            continue
        asked = (variable.max, variable.min, 3, 4)
        value = next(x for x in asked if x is not None and x != variable.default)
        raw = variable.encode_raw(value)
        assert pair.node.sdo.upload(variable.index, variable.subindex) != raw, variable.qualname
        pair.node.sdo.download(variable.index, variable.subindex, raw)
        assert pair.node.sdo.upload(variable.index, variable.subindex) == raw, variable.qualname
        changed += 1
    assert changed > 40


def test_network_management_and_heartbeat(drive: Pair) -> None:
    assert drive.device.until(lambda: len(drive.heartbeats) == 2)
    assert drive.heartbeats == [0, 0x7F]
    drive.command("OPERATIONAL", 0x05)
    drive.command("STOPPED", 0x04)
    with pytest.raises(SdoCommunicationError):
        drive.node.sdo.upload(0x1000, 0)
    drive.command("RESET", 0x00)
    assert drive.node.sdo["Device type"].raw == 0x00020192


def test_emergency(drive: Pair) -> None:
    log = drive.node.emcy.log
    drive.device.library.device_raise(0x8611, 0x20)
    drive.device.process(0)
    assert len(log) == 1
    assert (log[0].code, log[0].register, log[0].data) == (0x8611, 0x21, b"\x01\x02\x03\x04\x05")
    assert drive.node.sdo["Error register"].raw == 0x21
    assert drive.node.sdo["Predefined error field"][0].raw == 1
    assert drive.node.sdo["Predefined error field"][1].raw == 0x02018611
    drive.device.library.device_clear(0x20)
    drive.device.process(0)
    assert len(log) == 2
    assert (log[1].code, log[1].register) == (0, 0)
