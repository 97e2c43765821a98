# SPDX-License-Identifier: MIT
"""tools/with-vcan --forward: a server beside the bus is reached from outside. All tests share one bus. Run by pytest;
starts tools/with-vcan and Python, and writes to temporary folders.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WITH_VCAN = str(ROOT / "tools/with-vcan")
HANGS_S = 600.0
NAME = f"forward-{os.getpid()}"
INSIDE, NOBODY = 8499, 9

# Echoes every connection; one that begins with "bulk" gets 4 MB, one with "bye" is ended by the server.
SERVER = """
import socketserver, sys
class Echo(socketserver.BaseRequestHandler):
    def handle(self):
        while data := self.request.recv(65536):
            if data.startswith(b"bulk"):
                self.request.sendall(bytes(range(256)) * 16384)
                return
            if data.startswith(b"bye"):
                return
            self.request.sendall(data)
        self.request.sendall(b"end seen")
class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = daemon_threads = True
with Server(("127.0.0.1", int(sys.argv[1])), Echo) as server:
    print("up", flush=True)
    server.serve_forever()
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def serving(port: int, *options: str, inside: int = INSIDE) -> Iterator[subprocess.Popen[bytes]]:
    """A server beside the bus, which is at `port` here."""
    command = [WITH_VCAN, *options, "--forward", f"{port}:{inside}"]
    with running([*command, sys.executable, "-c", SERVER, str(inside)]) as process:
        yield process


@contextlib.contextmanager
def running(command: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    """A command that runs a server, until a signal ends it."""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline() == b"up\n"
            yield process
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(HANGS_S) == 128 + signal.SIGTERM


@dataclass(frozen=True)
class Ports:
    """Where the server is found here, and where a port at which nobody listens."""

    served: int
    empty: int


@pytest.fixture(scope="module")
def ports() -> Iterator[Ports]:
    ports = Ports(free_port(), free_port())
    more = ("--user-mode", "--name", NAME, "--forward", f"{ports.empty}:{NOBODY}")
    with serving(ports.served, *more):
        yield ports


@pytest.fixture
def port(ports: Ports) -> int:
    return ports.served


def connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), HANGS_S)


def read_all(connection: socket.socket) -> bytes:
    parts = []
    while data := connection.recv(65536):
        parts.append(data)
    return b"".join(parts)


def test_bytes_pass_both_ways_and_so_does_the_end(port: int) -> None:
    with connect(port) as connection:
        connection.sendall(b"hello")
        assert connection.recv(100) == b"hello"
        connection.shutdown(socket.SHUT_WR)
        assert read_all(connection) == b"end seen"


def test_the_server_may_end_it(port: int) -> None:
    with connect(port) as connection:
        connection.sendall(b"bye")
        assert read_all(connection) == b""


def test_megabytes_arrive_whole(port: int) -> None:
    with connect(port) as connection:
        connection.sendall(b"bulk")
        assert read_all(connection) == bytes(range(256)) * 16384


def test_megabytes_go_in_whole(port: int) -> None:
    data = os.urandom(300_000)
    with connect(port) as connection:
        threading.Thread(target=lambda: connection.sendall(data), daemon=True).start()
        found = bytearray()
        while len(found) < len(data):
            found += connection.recv(65536)
    assert bytes(found) == data


def test_a_slow_reader_holds_up_only_itself(port: int) -> None:
    with connect(port) as slow, connect(port) as quick:
        slow.sendall(b"bulk")
        assert slow.recv(1, socket.MSG_PEEK)  # the rest is on its way, and has no room
        for i in range(20):
            quick.sendall(b"%d" % i)
            assert quick.recv(100) == b"%d" % i
        assert len(read_all(slow)) == 4 * 2**20


def test_many_at_once(port: int) -> None:
    with contextlib.ExitStack() as stack:
        connections = [stack.enter_context(connect(port)) for _ in range(30)]
        for i, connection in enumerate(connections):
            connection.sendall(b"number %d" % i)
        for i, connection in enumerate(connections):
            assert connection.recv(100) == b"number %d" % i


def test_nobody_inside_is_an_end_at_once(ports: Ports) -> None:
    with connect(ports.empty) as connection:
        assert read_all(connection) == b""


def test_a_joined_command_has_its_own_forwarding(port: int) -> None:
    other = free_port()
    with (
        serving(other, "--join", "--bus", NAME, inside=8498),
        connect(other) as connection,
    ):
        connection.sendall(b"joined")
        assert connection.recv(100) == b"joined"
    with pytest.raises(ConnectionRefusedError):
        connect(other)


def test_a_port_in_use_is_said_in_one_line(port: int) -> None:
    done = subprocess.run(
        [WITH_VCAN, "--user-mode", "--forward", str(port), "true"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 125
    assert f"port {port} cannot be served".encode() in done.stderr
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("text", ["x", "0", "70000", "1:2:3", "80:"])
def test_a_wrong_forward_is_a_usage_error(text: str) -> None:
    done = subprocess.run(
        [WITH_VCAN, "--forward", text, "true"], capture_output=True, timeout=HANGS_S, check=False
    )
    assert done.returncode == 2
    assert b"--forward" in done.stderr


def test_a_port_of_a_namespace_is_reached_until_the_command_ends(ports: Ports) -> None:
    """Inside user-mode Linux is a kernel with CAN, so that the bus is one in a namespace there."""
    port = free_port()
    forward = f'"{WITH_VCAN}" --own --forward 8497:8496 "$@"; exec sleep 600'
    command = [WITH_VCAN, "--join", "--bus", NAME, "--forward", f"{port}:8497"]
    command += ["sh", "-c", forward, "-", sys.executable, "-c", SERVER, "8496"]
    with running(command), connect(port) as connection:
        connection.sendall(b"across")
        assert connection.recv(100) == b"across"


def test_beside_a_namespace_a_process_relays_until_the_command_ends(tmp_path: Path) -> None:
    """What --forward does where the kernel has CAN; the namespace itself takes such a kernel."""
    outside, inside = free_port(), free_port()
    script = (
        "import os, sys\n"
        f"sys.path.insert(0, {str(ROOT / 'tools')!r})\n"
        "from vcan import forward\n"
        f"forwards = [forward.Forward({outside}, {inside})]\n"
        "forward.beside(forwards, forward.listen(forwards))\n"
        f"os.execv(sys.executable, [sys.executable, '-c', {SERVER!r}, '{inside}'])\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"up\n"
        with connect(outside) as connection:
            connection.sendall(b"across")
            assert connection.recv(100) == b"across"
        process.kill()
    # Until the relay has noticed: if it lives on, this test hangs. A connection is reset if the relay ends meanwhile.
    with contextlib.suppress(ConnectionRefusedError):
        while True:
            with contextlib.suppress(ConnectionResetError):
                connect(outside).close()
