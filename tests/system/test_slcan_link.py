# SPDX-License-Identifier: MIT
"""An emulated board in real time, with SLCAN on its UART: no frame is lost in thousands of ticks, either way.

Its pace is printed, beside how late this computer itself was, and not judged: a tick that the host keeps the board from
is left out, and no frame is lost by that. Run by pytest; starts an emulator, and opens a TCP port of this computer.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from lateness import Lateness
from marks import long

ROOT = Path(__file__).resolve().parents[2]
EMULATE = ROOT / "tools/emulate.py"
MANY_TICKS = 10_000
FLOOD = 66_000  # characters
COUNTER_OVERFLOW = 240
HANGS_S = 600.0
LOOK_S = 0.01
OBJECTS = (b"\x00\x10\x00", b"\x18\x10\x01", b"\x18\x10\x02", b"\x06\x10\x00")
"""Index and subindex, little-endian, of objects that can be read in one frame."""


def free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def address() -> Iterator[tuple[str, int]]:
    """Where a board serves its UART; all are on one core, as waking across cores is slow."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    port = free_port()
    words = [sys.executable, str(EMULATE), "an386", "--serve", f"127.0.0.1:{port}"]
    board = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    try:
        _await_listener(board, port)
        yield "127.0.0.1", port
        board.send_signal(signal.SIGTERM)
        assert board.wait(HANGS_S) == 0, board.communicate()[1]
    finally:
        board.kill()
        board.communicate()
        os.sched_setaffinity(0, before)


def _await_listener(board: subprocess.Popen[str], port: int) -> None:
    """Until somebody listens at the port: the first who connects to it gets the board."""
    listening = f" 0100007F:{port:04X} 00000000:0000 0A "
    while listening not in Path("/proc/net/tcp").read_text():
        assert board.poll() is None, board.communicate()[1]
        time.sleep(LOOK_S)


class Peer:
    """Asks for an object at every SYNC of the first `ticks` before which the last one was answered."""

    def __init__(self, stream: socket.socket, ticks: int) -> None:
        self.stream = stream
        self.ticks = ticks
        self.syncs = 0
        self.first_s = self.last_s = 0.0
        self.last_counter = 0
        self.asked: bytes | None = None
        self.answers = 0
        self.rest = b""

    def on_sync(self, counter: int) -> bytes:
        assert counter == self.last_counter % COUNTER_OVERFLOW + 1, f"SYNC {self.syncs}"
        self.last_counter = counter
        self.syncs += 1
        self.last_s = time.monotonic()
        self.first_s = self.first_s or self.last_s
        if self.asked is not None or self.syncs > self.ticks:
            return b""
        self.asked = OBJECTS[self.syncs % len(OBJECTS)]
        return b"t601840" + self.asked.hex().encode() + b"00000000\r"

    def on_answer(self, data: bytes) -> None:
        assert data[0] & 0xE3 == 0x43, f"answer {self.answers}: {data.hex()}"
        assert data[1:4] == self.asked, f"answer {self.answers}"
        self.asked = None
        self.answers += 1

    def take(self) -> None:
        """What has come, and what belongs after it."""
        text = self.stream.recv(65536)
        assert text, "the board is gone"
        *lines, self.rest = (self.rest + text).split(b"\r")
        out = b""
        for line in lines:
            if line.startswith(b"t0801"):
                out += self.on_sync(int(line[5:7], 16))
            elif line.startswith(b"t5818"):
                self.on_answer(bytes.fromhex(line[5:].decode()))
        if out:
            self.stream.sendall(out)


@pytest.mark.parametrize("ticks", [2500, long(MANY_TICKS)])
def test_no_frame_is_lost(address: tuple[str, int], ticks: int) -> None:
    with socket.create_connection(address, timeout=HANGS_S) as stream:
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer = Peer(stream, ticks)
        with Lateness() as host:
            while peer.syncs < ticks or peer.asked is not None:
                peer.take()
    rate = (peer.syncs - 1) / (peer.last_s - peer.first_s)
    late_ms = 1000 * host.worst_s
    print(f"{peer.syncs} ticks, {peer.answers} answers, {rate:.1f} ticks/s; host {late_ms:.1f} ms")
    assert peer.answers > ticks / 100


def test_a_flood_is_taken(address: tuple[str, int]) -> None:
    """Frames that nobody wants as fast as the UART takes them, and after them a question, which is answered."""
    flood = b"t12380011223344556677\r" * (FLOOD // 22)
    peer = Peer(socket.create_connection(address, timeout=HANGS_S), MANY_TICKS)
    with peer.stream as stream:
        while peer.syncs == 0:
            peer.take()
        while peer.asked is not None:
            peer.take()
        began_s = time.monotonic()
        peer.asked = OBJECTS[0]
        question = b"t601840" + peer.asked.hex().encode() + b"00000000\r"
        answers = peer.answers
        sender = threading.Thread(target=stream.sendall, args=(flood + question,))
        sender.start()
        while peer.answers == answers:
            peer.take()
        sender.join()
        wall_s = time.monotonic() - began_s
    load = os.getloadavg()[0]
    print(f"{len(flood)} characters, {len(flood) / wall_s:.0f} a second at load {load:.1f}")
