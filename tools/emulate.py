#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""emulate.py TARGET --bus INTERFACE ...: the controller on an emulated board, in place of hodograph-controller.

Starts QEMU with the image of `make firmware`, and hodograph-bridge, which joins it to the bus; ends both. Takes the
options of hodograph-controller and has its exit status. docs/target.md tells more.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGETS = ("an385", "an386", "an500", "an505")
_BUS_STATUS, _MACHINE_STATUS, _USAGE_STATUS = 4, 1, 2
_GRACE_S = 5.0
"""For the board to notice that its bridge is gone, and the other way round."""
_STOP_S = 8.0
"""For the controller to stop the axes and switch them off: it takes 6 s at most."""


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="emulate.py", description="The Hodograph controller on a board emulated by QEMU."
    )
    parser.add_argument(
        "target", choices=TARGETS, help="board: Cortex-M3, -M4F, -M7, -M33 in this order"
    )
    parser.add_argument("--bus", help="CAN interface that the board is joined to, such as vcan0")
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
        help="SLCAN on this TCP port instead of a bus, for python-can's slcan:socket://HOST:PORT",
    )
    parser.add_argument("--plugin", help="a plugin for QEMU, with its words (tools/count_til.py)")
    parser.add_argument("--build", type=Path, default=ROOT / "build", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if (options.bus is None) == (options.serve is None):
        parser.error("either --bus or --serve is needed")
    if options.serve is not None:
        options.link = "slcan"
    if options.link == "slcan" and options.pace == "fast":
        parser.error("--pace fast needs --link fifo: a real clock cannot hurry")
    return options


def qemu_command(options: argparse.Namespace, folder: Path) -> list[str]:
    """What runs the board; FIFOs and sockets have their names relative to `folder`."""
    words = [f"node={options.node}", f"link={options.link}", f"pace={options.pace}"]
    words += ["verbose"] if options.verbose else []
    command = ["qemu-system-arm", "-M", f"mps2-{options.target}", "-display", "none"]
    command += ["-monitor", "none", "-accel", "tcg,tb-size=32"]
    if options.link == "fifo":
        command += ["-serial", "none", "-icount", "shift=6,sleep=off"]
    elif options.serve is not None:
        command += ["-serial", f"tcp:{options.serve},server=on,wait=on,nodelay=on"]
    else:
        command += ["-serial", f"unix:{folder / 'uart'},server=on,wait=on"]
    command += ["-plugin", options.plugin] if options.plugin else []
    command += ["-kernel", str(image(options))]
    semihosting = ["enable=on", "target=native", *(f"arg={word}" for word in words)]
    return [*command, "-semihosting-config", ",".join(semihosting)]


def image(options: argparse.Namespace) -> Path:
    folder: Path = options.build
    target: str = options.target
    return folder / "firmware" / target / "controller.elf"


def bridge_command(options: argparse.Namespace, folder: Path) -> list[str]:
    command = [str(Path(options.build) / "bin/hodograph-bridge"), "--bus", options.bus]
    if options.link == "slcan":
        return [*command, "--slcan", str(folder / "uart")]
    return [*command, "--out", str(folder / "out"), "--in", str(folder / "in")]


def missing(options: argparse.Namespace) -> str | None:
    """What has to be done first."""
    if shutil.which("qemu-system-arm") is None or not image(options).exists():
        return "make firmware"
    if not (Path(options.build) / "bin/hodograph-bridge").exists():
        return "make build"
    return None


def spawn(command: list[str], folder: Path) -> subprocess.Popen[bytes]:
    """A child that does not outlive us, and hears no Ctrl-C: we stop it in our way."""
    guard = shutil.which("setpriv")
    guarded = [guard, "--pdeathsig", "KILL", "--", *command] if guard else command
    return subprocess.Popen(guarded, cwd=folder, stdin=subprocess.DEVNULL, start_new_session=True)


class Board:
    """QEMU, and the bridge unless the UART is served."""

    def __init__(self, options: argparse.Namespace, folder: Path) -> None:
        for name in ("out", "in"):
            os.mkfifo(folder / name)
        self._stopping_since: float | None = None
        self._options = options
        self.qemu = spawn(qemu_command(options, folder), folder)
        self.bridge = None
        if options.bus is not None:
            if options.link == "slcan":
                self._await_socket(folder / "uart")
            self.bridge = spawn(bridge_command(options, folder), folder)

    def _await_socket(self, path: Path) -> None:
        deadline = time.monotonic() + 5.0
        while not path.exists() and self.qemu.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)

    def stop(self) -> None:
        """Asks the controller to end; by the FIFOs, as a board has no signals."""
        self._stopping_since = self._stopping_since or time.monotonic()
        if self.bridge is not None:
            self.bridge.terminate()
        if self._options.link == "slcan":
            self.qemu.terminate()

    def wait(self) -> int:
        """Exit status, when both have ended."""
        while self.qemu.poll() is None and (self.bridge is None or self.bridge.poll() is None):
            if (
                self._stopping_since is not None
                and time.monotonic() > self._stopping_since + _STOP_S
            ):
                break
            time.sleep(0.02)
        return self._status()

    def _status(self) -> int:
        if self.bridge is not None and self.bridge.poll() == _BUS_STATUS:
            self.qemu.kill()
            return _BUS_STATUS
        qemu = _end(self.qemu)
        bridge = 0 if self.bridge is None else _end(self.bridge)
        if bridge == _BUS_STATUS:
            return _BUS_STATUS
        asked = self._stopping_since is not None
        if asked and (self._options.link == "slcan" or (qemu < 0 and bridge == 0)):
            return 0  # it has no way to end by itself, or had not begun
        return qemu if qemu >= 0 else _MACHINE_STATUS


def _end(child: subprocess.Popen[bytes]) -> int:
    """QEMU answers no SIGTERM while it waits for a FIFO."""
    try:
        return child.wait(_GRACE_S)
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
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hodograph-")))
        board = Board(options, folder)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: board.stop())
        return board.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
