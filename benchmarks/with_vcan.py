# SPDX-License-Identifier: MIT
"""The bus of tools/with-vcan: time to boot, round trip of a frame between two sockets, frames a second.

Run by `make bench`. Starts tools/with-vcan, sends and receives on its bus; prints the figures, writes the file of
--json.

Round trip: a process sends a frame and waits; another one, waiting, sends it back. So both ways wake a process that
sleeps, as with a controller and a drive.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import socket
import statistics
import subprocess
import sys
import time
from pathlib import Path

from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
WITH_VCAN = [str(ROOT / "tools/with-vcan"), "--own"]
FRAME = bytes([1, 0, 0, 0, 8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8])
ROUNDS = 5000
FRAMES = 50_000


def opened() -> socket.socket:
    """A raw socket on vcan0."""
    bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    bus.bind(("vcan0",))
    return bus


def echo(rounds: int) -> None:
    """Sends each received frame back: the other end of the round trip."""
    bus = opened()
    for _ in range(rounds):
        select.select([bus], [], [])
        bus.send(bus.recv(16))


def round_trips_us() -> list[float]:
    """There and back between two processes."""
    bus = opened()
    child = os.fork()
    if child == 0:
        echo(ROUNDS)
        os._exit(0)
    time.sleep(0.2)
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        bus.send(FRAME)
        bus.recv(16)
        times.append((time.perf_counter() - start) * 1e6)
    os.waitpid(child, 0)
    return times


def frames_per_s() -> float:
    """Sent by one socket and received by another of one process."""
    out, back = opened(), opened()
    start = time.perf_counter()
    for _ in range(FRAMES // 100):
        for _ in range(100):
            out.send(FRAME)
        for _ in range(100):
            back.recv(16)
    return FRAMES / (time.perf_counter() - start)


def timer_lateness_us() -> list[float]:
    """How late a 1 kHz timer is, over two seconds."""
    due = time.monotonic() + 0.01
    late = []
    for _ in range(2000):
        time.sleep(max(0.0, due - time.monotonic()))
        late.append((time.monotonic() - due) * 1e6)
        due += 0.001
    return late


def inside() -> dict[str, float]:
    """What is measured on the bus."""
    trips, late = sorted(round_trips_us()), sorted(timer_lateness_us())
    return {
        "round_trip_median_us": statistics.median(trips),
        "round_trip_99_percent_us": trips[len(trips) * 99 // 100],
        "frames_per_s": frames_per_s(),
        "timer_late_median_us": statistics.median(late),
        "timer_late_99_percent_us": late[len(late) * 99 // 100],
        "timer_late_worst_us": late[-1],
    }


def boot_s() -> float:
    """From nothing to nothing: open a bus, run `true`, end."""
    start = time.perf_counter()
    subprocess.run([*WITH_VCAN, "true"], stdin=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> None:
    """Figures as JSON."""
    parser = figures_parser(__doc__)
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        print(json.dumps(inside()))
        return
    figures: dict[str, float] = {"open_and_close_s": min(boot_s() for _ in range(3))}
    command = [*WITH_VCAN, sys.executable, __file__, "--inside"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=True)
    figures |= json.loads(done.stdout)
    write_figures(options.json, figures)
    if options.json is None:
        print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
