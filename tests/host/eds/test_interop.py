# SPDX-License-Identifier: MIT
"""python canopen, an implementation that is not ours, as the client of firmware/canopen.

The node is C, compiled into a shared library; the bus is python-can's `virtual` one, so no kernel is
needed. A thread carries frames between them and can lose some on the way.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import random
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

ROOT = Path(__file__).resolve().parents[3]
EDS_FILES = {
    "controller": ROOT / "firmware" / "app" / "controller.eds",
    "drive": ROOT / "sim" / "node" / "drive.eds",
}
CHANNELS = itertools.count()


class Frame(ctypes.Structure):
    """struct can_msg."""

    _fields_ = [("id", ctypes.c_uint32), ("len", ctypes.c_uint8), ("data", ctypes.c_uint8 * 8)]


def to_c(message: can.Message) -> Frame:
    data = (ctypes.c_uint8 * 8)(*message.data)
    return Frame(message.arbitration_id, message.dlc, data)


def from_c(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.id, data=bytes(frame.data[: frame.len]), is_extended_id=False
    )


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("device")
    tool = str(ROOT / "tools" / "eds_to_c.py")
    for name, eds in EDS_FILES.items():
        subprocess.run([sys.executable, tool, str(eds), name, str(folder)], check=True)
    sources = [Path(__file__).with_name("device.c"), *(ROOT / "firmware" / "canopen").glob("*.c")]
    made = folder / "device.so"
    command = [os.environ.get("CC", "cc"), "-std=c99", "-O1", "-fPIC", "-shared"]
    command += [f"-I{ROOT / 'firmware'}", f"-I{folder}", "-o", str(made)]
    command += [*map(str, sources), *map(str, folder.glob("od_*.c"))]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(made))


class Device:
    """The node and the thread that carries its frames."""

    def __init__(
        self, library: ctypes.CDLL, name: str, node: int, block: int, channel: str
    ) -> None:
        self.library = library
        self.lock = threading.Lock()
        self.lose: Callable[[can.Message], bool] = lambda message: False
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.ended = threading.Event()
        library.device_init(int(name == "drive"), node, block)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def send(self, frame: Frame) -> None:
        message = from_c(frame)
        if not self.lose(message):
            self.bus.send(message)

    def run(self) -> None:
        frame = Frame()
        before = time.monotonic()
        while not self.ended.is_set():
            message = self.bus.recv(0.002)
            now = time.monotonic()
            elapsed_us = int((now - before) * 1e6)
            before = now
            with self.lock:
                if message is not None and not self.lose(message):
                    request = to_c(message)
                    if self.library.device_receive(ctypes.byref(request), ctypes.byref(frame)):
                        self.send(frame)
                while self.library.device_process(elapsed_us, ctypes.byref(frame)):
                    self.send(frame)
                    elapsed_us = 0

    def image(self) -> bytes:
        with self.lock:
            data = ctypes.POINTER(ctypes.c_uint8)()
            size = self.library.device_image(ctypes.byref(data))
            return ctypes.string_at(data, size)

    def close(self) -> None:
        self.ended.set()
        self.thread.join()
        self.bus.shutdown()


def eventually(happened: Callable[[], bool]) -> None:
    """Waits up to 10 s for what another thread does."""
    end = time.monotonic() + 10
    while not happened():
        assert time.monotonic() < end, "it did not happen within 10 s"
        time.sleep(0.002)


class Pair:
    """A device and the python canopen node that talks to it."""

    def __init__(self, library: ctypes.CDLL, name: str, node: int, block: int) -> None:
        channel = f"interop-{next(CHANNELS)}"
        self.network = canopen.Network(bus=can.Bus(interface="virtual", channel=channel))
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.connect()
        self.node = canopen.RemoteNode(node, str(EDS_FILES[name]))
        self.node.sdo.RESPONSE_TIMEOUT = 5.0
        self.network.add_node(self.node)
        self.heartbeats: list[int] = []
        self.node.nmt.add_heartbeat_callback(self.heartbeats.append)
        self.device = Device(library, name, node, block, channel)
        eventually(lambda: 0 in self.heartbeats)

    def command(self, state: str, heartbeat: int) -> None:
        """An NMT command; waits for the heartbeat with the new state."""
        self.heartbeats.clear()
        self.node.nmt.state = state
        eventually(lambda: heartbeat in self.heartbeats)

    def close(self) -> None:
        self.device.close()
        self.network.disconnect()


@pytest.fixture
def controller(library: ctypes.CDLL) -> Iterator[Pair]:
    pair = Pair(library, "controller", 1, 127)
    yield pair
    pair.close()


@pytest.fixture
def drive(library: ctypes.CDLL) -> Iterator[Pair]:
    pair = Pair(library, "drive", 5, 127)
    yield pair
    pair.close()


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

    def lose(message: can.Message) -> bool:
        is_segment = message.arbitration_id == 0x601 and message.data[0] & 0x7F in range(1, 33)
        if is_segment and next(segments) in (10, 75):
            lost.append(message.data[0])
        else:
            is_segment = False
        return is_segment

    try:
        data = image_of(3000)
        pair.device.lose = lose
        download(pair, data)
        assert pair.device.image() == data
        assert len(lost) == 2
    finally:
        pair.close()


def test_an_interrupted_download_can_be_begun_again(controller: Pair) -> None:
    data = image_of(5000)
    controller.device.lose = lambda message: message.arbitration_id == 0x581
    controller.node.sdo.RESPONSE_TIMEOUT = 0.1
    with pytest.raises(SdoCommunicationError):
        download(controller, data)
    controller.device.lose = lambda message: False
    controller.node.sdo.RESPONSE_TIMEOUT = 5.0
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
    for variable in variables(pair.node.object_dictionary):
        if not (variable.readable and variable.writable) or variable.data_type == datatypes.DOMAIN:
            continue
        value = variable.max if variable.max is not None else 3
        raw = variable.encode_raw(value)
        pair.node.sdo.download(variable.index, variable.subindex, raw)
        assert pair.node.sdo.upload(variable.index, variable.subindex) == raw, variable.qualname


def test_network_management_and_heartbeat(drive: Pair) -> None:
    eventually(lambda: 0x7F in drive.heartbeats)
    drive.command("OPERATIONAL", 0x05)
    drive.command("STOPPED", 0x04)
    drive.node.sdo.RESPONSE_TIMEOUT = 0.1
    with pytest.raises(SdoCommunicationError):
        drive.node.sdo.upload(0x1000, 0)
    drive.command("RESET", 0x00)
    drive.node.sdo.RESPONSE_TIMEOUT = 5.0
    assert drive.node.sdo["Device type"].raw == 0x00020192


def test_emergency(drive: Pair) -> None:
    log = drive.node.emcy.log
    with drive.device.lock:
        drive.device.library.device_raise(0x8611, 0x20)
    eventually(lambda: len(log) == 1)
    assert (log[0].code, log[0].register, log[0].data) == (0x8611, 0x21, b"\x01\x02\x03\x04\x05")
    assert drive.node.sdo["Error register"].raw == 0x21
    assert drive.node.sdo["Predefined error field"][0].raw == 1
    assert drive.node.sdo["Predefined error field"][1].raw == 0x02018611
    with drive.device.lock:
        drive.device.library.device_clear(0x20)
    eventually(lambda: len(log) == 2)
    assert (log[1].code, log[1].register) == (0, 0)
