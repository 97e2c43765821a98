# SPDX-License-Identifier: MIT
"""The gateway passes on a signal to end to the board, which then stops the axes, and waits for it. Run by pytest;
starts `hodograph-bridge` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import signal
import socket
import subprocess
from pathlib import Path

import pytest

from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import find_program

HANGS_S = 600.0


def ended_by(number: signal.Signals, tmp_path: Path) -> tuple[bytes, int]:
    """What the board is told after a signal, and the exit status of the gateway after the board has closed."""
    board = tmp_path / "board"
    bridge = str(find_program("hodograph-bridge"))
    with LocalHub() as hub, socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(board))
        listener.listen()
        listener.settimeout(HANGS_S)
        bus = hub.address.channel
        with subprocess.Popen([bridge, "--bus", bus, "--slcan", str(board)]) as gateway:
            stream, _ = listener.accept()
            with stream:
                stream.settimeout(HANGS_S)
                gateway.send_signal(number)
                told = stream.recv(2)
                if told:
                    if number is signal.SIGHUP:
                        gateway.send_signal(number)
                    stream.sendall(b"C\r")
                    gateway.wait(HANGS_S)
            return told, gateway.wait(HANGS_S)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_the_board_first(number: signal.Signals, tmp_path: Path) -> None:
    """The shell and the kernel may each send SIGHUP."""
    assert ended_by(number, tmp_path) == (b"C\r", 0)
