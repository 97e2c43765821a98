# SPDX-License-Identifier: MIT
"""Emulated boards: how they are started, and the processes that make one. Used by tests/system. Starts processes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from pathlib import Path

from hodograph.bus.address import BusAddress
from hodograph.bus.clock import VirtualClock
from hodograph.bus.processes import Process

EMULATE = Path(__file__).resolve().parents[2] / "tools/emulate.py"
QEMU, BRIDGE = "qemu-system-arm", "hodograph-bridge"


def board(
    target: str, address: BusAddress, node: int, clock: VirtualClock | None, *options: str
) -> Process:
    """A board on a bus, under the name of a controller where time is virtual (`clock`)."""
    words = [sys.executable, str(EMULATE), target, "--bus", address.channel, "--node", str(node)]
    return Process(f"controller-{node}", [*words, *options], clock)


def children(parent: int, name: str) -> list[int]:
    """Processes of this program that it has started."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text()
            command = (folder / "cmdline").read_bytes().split(b"\0")[0].decode()
        except OSError:
            continue
        if int(stat.rpartition(")")[2].split()[1]) == parent and Path(command).name == name:
            found.append(int(folder.name))
    return found


def stop_for(process: int, seconds: float) -> None:
    """Stops a process; it goes on after so long in real time."""
    os.kill(process, signal.SIGSTOP)
    threading.Timer(seconds, os.kill, (process, signal.SIGCONT)).start()
