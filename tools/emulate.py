#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""emulate.py TARGET --bus INTERFACE ...: the controller on an emulated board, in place of hodograph-controller.

Used by tools/til, tools/count_til and tools/stream_soak. Started as a process, by these, by tests or by hand.

Starts QEMU with the image of `make firmware`, and hodograph-bridge, which joins it to the bus; ends both. Writes to a
temporary folder, and prints errors to stderr. Takes the options of hodograph-controller and has its exit status.
docs/guides/target.md has more.
"""

from __future__ import annotations

import argparse
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MACHINES = {
    "an385": ["mps2-an385"],  # Cortex-M3
    "an386": ["mps2-an386"],  # Cortex-M4F
    "an500": ["mps2-an500"],  # Cortex-M7
    "an505": ["mps2-an505"],  # Cortex-M33
    # Cortex-M0: RAM for the controller, and for programs (firmware/targets/microbit_controller.ld)
    "microbit": ["microbit", "-global", f"nrf51-soc.sram-size={48 * 2**10 + 2**24}"],
}
TARGETS = tuple(MACHINES)
_SHIFTS = {"microbit": 5}
"""Of -icount: an instruction takes 2**shift ns. 32 ns: a Cortex-M0 of 48 MHz, about."""
_SHIFT = 6
"""Of the other boards, where --icount does not say another one."""
_BUS_STATUS, _MACHINE_STATUS, _USAGE_STATUS = 4, 1, 2
_GRACE_S = 60.0
"""Longest time in which the board notices that its bridge is gone, and vice versa."""
_UNBEGUN_S = 5.0
"""Longest wait for the end of a board after the command to end, or with SLCAN. A board that waits for its FIFO or for
datagrams would not end.
"""
_LOOK_S = 0.1
"""Time between two checks whether the time for an end is over."""
_PRIORITY = 15
"""Of a board in real time, where permitted: below the simulated drives (20), above everything ordinary. One for all its
threads and its bridge, which take turns: one above another would be woken by each character.
"""
_SO_RCVBUFFORCE = 33
_BUFFER_BYTES = 4 * 2**20
_STOP_S = 8.0
"""In real time, for the controller to stop the axes and switch them off, which takes at most 6 s. With FIFOs it has its
own clock, and its time here is not known: a second signal ends it.
"""


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="emulate.py", description="The Hodograph controller on a board emulated by QEMU."
    )
    parser.add_argument(
        "target", choices=TARGETS, help="board: Cortex-M3, -M4F, -M7, -M33, -M0 in this order"
    )
    parser.add_argument(
        "--bus",
        help="what the board is joined to: a CAN interface such as vcan0, or the path of a hodograph-hub",
    )
    parser.add_argument("--node", type=int, default=1, help="node number (default 1)")
    parser.add_argument("--pace", choices=("real-time", "fast"), default="real-time")
    parser.add_argument("--verbose", action="store_true", help="notes about states on stderr")
    parser.add_argument(
        "--link",
        choices=("fifo", "slcan"),
        default="fifo",
        help="fifo (default): the clock of the board stands still while it waits; slcan: SLCAN on its UART, real time",
    )
    parser.add_argument(
        "--serve",
        metavar="HOST:PORT",
        help="SLCAN on this TCP port instead of a bus (python-can, with pyserial: slcan:socket://HOST:PORT)",
    )
    parser.add_argument(
        "--icount",
        type=int,
        choices=range(3, 8),
        help="an instruction takes 2^N ns of the board's time (default 6, microbit 5); fifo only",
    )
    parser.add_argument("--image", type=Path, help="another image than that of make firmware")
    parser.add_argument("--plugin", help="a plugin for QEMU, with its words (tools/count_til.py)")
    parser.add_argument("--build", type=Path, default=ROOT / "build", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if (options.bus is None) == (options.serve is None):
        parser.error("either --bus or --serve is needed")
    if options.serve is not None:
        options.link = "slcan"
    if options.link == "slcan" and options.pace == "fast":
        parser.error("--pace fast needs --link fifo: a real clock cannot hurry")
    if options.link == "slcan" and options.target == "microbit":
        parser.error("microbit has --link fifo only: its UART is not that of the other boards")
    return options


def qemu_command(options: argparse.Namespace, ports: tuple[int, int]) -> list[str]:
    """What runs the board, in the folder of its FIFOs; `ports`: the bridge's and its own, of UDP."""
    words = [f"node={options.node}", f"link={options.link}", f"pace={options.pace}"]
    words += ["verbose"] if options.verbose else []
    command = ["qemu-system-arm", "-M", *MACHINES[options.target], "-display", "none"]
    command += ["-monitor", "none", "-accel", "tcg,tb-size=32"]
    if options.link == "fifo":
        shift = options.icount
        if shift is None:
            shift = _SHIFTS.get(options.target, _SHIFT)
        command += ["-serial", "none", "-icount", f"shift={shift},sleep=off"]
    else:
        command += ["-chardev", f"{_uart(options, ports)},id=uart,mux=on"]
        command += ["-serial", "chardev:uart"]
    command += ["-plugin", options.plugin] if options.plugin else []
    command += ["-kernel", str(image(options))]
    semihosting = ["enable=on", "target=native", *(f"arg={word}" for word in words)]
    return [*command, "-semihosting-config", ",".join(semihosting)]


def _uart(options: argparse.Namespace, ports: tuple[int, int]) -> str:
    """What the UART is joined to. A multiplexed device (mux=on, with one user) has a buffer of 32 characters, which
    goes on filling while the UART is full and gives the next one when the board has read the last. Datagrams are taken
    from the socket as a whole, where a stream costs a turn of QEMU's main loop for each character
    (docs/guides/target.md).
    """
    if options.serve is None:
        return f"udp,host=127.0.0.1,port={ports[0]},localaddr=127.0.0.1,localport={ports[1]}"
    host, _, port = options.serve.rpartition(":")
    return f"socket,host={host},port={port},nodelay=on,server=on,wait=on"


def image(options: argparse.Namespace) -> Path:
    if options.image is not None:
        return Path(options.image).resolve()
    folder: Path = options.build
    target: str = options.target
    return folder / "firmware" / target / "controller.elf"


def bridge_command(options: argparse.Namespace, folder: Path, uart: int) -> list[str]:
    command = [str(Path(options.build) / "bin/hodograph-bridge"), "--bus", options.bus]
    if options.link == "slcan":
        return [*command, "--slcan", f"fd:{uart}"]
    return [*command, "--out", str(folder / "out"), "--in", str(folder / "in")]


def missing(options: argparse.Namespace) -> str | None:
    """What has to be done first."""
    if shutil.which("qemu-system-arm") is None or not image(options).exists():
        return "make firmware"
    if not (Path(options.build) / "bin/hodograph-bridge").exists():
        return "make build"
    return None


def datagrams() -> tuple[socket.socket, tuple[int, int]]:
    """The bridge's end of the UART, and the ports of both."""
    ends = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for end in ends:
        end.bind(("127.0.0.1", 0))
    ports = (int(ends[0].getsockname()[1]), int(ends[1].getsockname()[1]))
    ends[0].connect(("127.0.0.1", ports[1]))
    for option in (_SO_RCVBUFFORCE, socket.SO_RCVBUF):
        with suppress(PermissionError):
            ends[0].setsockopt(socket.SOL_SOCKET, option, _BUFFER_BYTES)
            break
    ends[1].close()  # QEMU binds it anew
    return ends[0], ports


def spawn(command: list[str], folder: Path, *descriptors: int) -> subprocess.Popen[bytes]:
    """A child that does not outlive us, and gets no Ctrl-C: we stop it in our way."""
    guard = shutil.which("setpriv")
    guarded = [guard, "--pdeathsig", "KILL", "--", *command] if guard else command
    return subprocess.Popen(
        guarded,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        start_new_session=True,
        pass_fds=descriptors,
    )


class Board:
    """QEMU, and the bridge unless the UART is served."""

    def __init__(self, options: argparse.Namespace, folder: Path) -> None:
        for name in ("out", "in"):
            os.mkfifo(folder / name)
        self._stopping_since: float | None = None
        self._options = options
        uart, ports = datagrams()
        self.qemu = spawn(qemu_command(options, ports), folder)
        self.bridge = None
        if options.bus is not None:
            command = bridge_command(options, folder, uart.fileno())
            self.bridge = spawn(command, folder, uart.fileno())
        uart.close()

    def stop(self) -> None:
        """Asks the controller to end, through the bridge, as a board has no signals; without one, pulls the plug.

        Asked twice, it ends at once.
        """
        self._stopping_since = self._stopping_since or time.monotonic()
        (self.qemu if self.bridge is None else self.bridge).terminate()

    def wait(self) -> int:
        """Exit status, when both have ended."""
        parts = [part for part in (self.qemu, self.bridge) if part is not None]
        ends = [os.pidfd_open(part.pid) for part in parts]
        while all(part.poll() is None for part in parts) and not self._is_overdue():
            select.select(ends, [], [], _LOOK_S)
        for end in ends:
            os.close(end)
        return self._status()

    def _is_overdue(self) -> bool:
        since_s = self._stopping_since
        in_real_time = self._options.link == "slcan"
        return in_real_time and since_s is not None and time.monotonic() > since_s + _STOP_S

    def _status(self) -> int:
        if self.bridge is not None and self.bridge.poll() == _BUS_STATUS:
            self.qemu.kill()
            return _BUS_STATUS
        asked = self._stopping_since is not None
        if self.bridge is not None and self.qemu.poll() is not None and not asked:
            self.bridge.terminate()  # what waits for a FIFO, or for datagrams, does not notice the end
        notified = not asked and self._options.link == "fifo"
        qemu = _end(self.qemu, _GRACE_S if notified else _UNBEGUN_S)
        bridge = 0 if self.bridge is None else _end(self.bridge, _GRACE_S)
        if bridge == _BUS_STATUS:
            return _BUS_STATUS
        if asked and qemu < 0 and bridge == 0:
            return 0  # it had not begun
        return qemu if qemu >= 0 else _MACHINE_STATUS


def _end(child: subprocess.Popen[bytes], wait_s: float) -> int:
    """QEMU answers no SIGTERM while it waits for a FIFO."""
    try:
        return child.wait(wait_s)
    except subprocess.TimeoutExpired:
        child.kill()
        return child.wait()


def main(arguments: list[str]) -> int:
    """Exit status."""
    options = parse(arguments)
    first = missing(options)
    if first is not None:
        print(f"emulate.py: something is missing: {first}", file=sys.stderr)
        return _USAGE_STATUS
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # waking across cores costs too much
    if options.link == "slcan":
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hodograph-")))
        board = Board(options, folder)
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
                signal.signal(number, lambda *_: board.stop())
        return board.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
