# SPDX-License-Identifier: MIT
"""Command line of tools/with-vcan. Called by that script, which has nothing else. Starts processes, prints to stdout
and stderr, then becomes the command or waits for it.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from dataclasses import asdict
from json import dumps, loads
from typing import NoReturn

import packages
from vcan import broker, forward, kernel, registry, user_mode
from vcan.client import Client
from vcan.errors import BusUnavailable, NameTaken
from vcan.forward import Forward
from vcan.registry import Bus

_TROUBLE = 125
"""Exit status if the bus itself fails."""

_ABOUT = """\
Runs COMMAND with a CAN bus vcan0: the kernel's own where there is one, else one in a network namespace,
else one inside user-mode Linux (installed when missing). There is a second one, vcan1, too; beside a vcan0
of the kernel's own only where it exists or may be made. The exit status is COMMAND's, 128 + N when
signal N ended it, 127 when it was not found, 125 when there is no bus."""


def main(arguments: list[str]) -> int:
    """Exit status."""
    if arguments[:1] == ["--broker"]:
        _broker(arguments[1:])
        return 0
    options = _parse(arguments)
    try:
        if options.list:
            return _list()
        if options.join:
            return _join(options)
        return _open(options)
    except BusUnavailable as error:
        print(f"with-vcan: {error}", file=sys.stderr)
        return _TROUBLE
    except KeyboardInterrupt:  # before there is anything to end
        return 128 + signal.SIGINT


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="with-vcan", description=_ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--join", action="store_true", help="run COMMAND on a bus that is open, not a new one"
    )
    parser.add_argument(
        "--bus",
        metavar="NAME",
        help="with --join: which; default: the newest of this source tree, else the newest",
    )
    parser.add_argument("--list", action="store_true", help="list the open buses")
    parser.add_argument(
        "--own", action="store_true", help="a bus of its own, even where the kernel has a vcan0"
    )
    parser.add_argument(
        "--user-mode", action="store_true", help="user-mode Linux, even where the kernel has CAN"
    )
    parser.add_argument(
        "--forward",
        action="append",
        default=[],
        metavar="OUTSIDE[:INSIDE]",
        help="serve 127.0.0.1:OUTSIDE here, passed on to the port INSIDE beside the bus; repeatable",
    )
    parser.add_argument("--name", help="name of the new bus; default: bus-PID")
    parser.add_argument(
        "--cpu",
        type=int,
        help="core that user-mode Linux is bound to; default: the one with the fewest buses",
    )
    parser.add_argument(
        "--memory",
        default="1024M",
        help="memory of user-mode Linux (default 1024M; taken as it is touched)",
    )
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="COMMAND...")
    options = parser.parse_args(arguments)
    options.command = options.command[1:] if options.command[:1] == ["--"] else options.command
    if not options.list and not options.command:
        parser.error("COMMAND is missing")
    if not re.fullmatch(r"\d+[MG]", options.memory):
        parser.error(f"--memory {options.memory}: a number followed by M or G is needed")
    try:
        options.forward = [forward.parse(text) for text in options.forward]
    except ValueError as error:
        parser.error(f"--forward {error}")
    if options.cpu is not None and options.cpu not in os.sched_getaffinity(0):
        parser.error(f"--cpu {options.cpu}: this process may use {sorted(os.sched_getaffinity(0))}")
    return options


def _list() -> int:
    buses = registry.open_buses()
    for bus in buses:
        age_s = time.time() - bus.started_s
        cpu = "" if bus.cpu is None else f"cpu {bus.cpu}"
        print(
            f"{bus.name}\t{bus.kind}\t{cpu}\t{age_s:.0f} s\tpid {bus.pid}\t{' '.join(bus.command)}"
        )
    if not buses:
        print("no bus is open", file=sys.stderr)
    return 0


def _join(options: argparse.Namespace) -> int:
    if registry.in_user_mode_linux() and kernel.has_bus():
        options.forward = _elsewhere(options.forward)
        _become_beside(options, forward.listen(options.forward))
    bus = registry.choose(options.bus)
    listeners = forward.listen(options.forward)
    if bus.kind == "namespace":
        kernel.join_namespace(bus.pid)
        _become_beside(options, listeners)
    broker_socket = bus.folder / "socket"
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.connect(str(broker_socket))
    except OSError as error:
        raise BusUnavailable(f"bus {bus.name} does not answer: {error.strerror}") from error
    forward.through_broker(options.forward, listeners, broker_socket)
    return Client(connection, options.command).run()


def _elsewhere(forwards: list[Forward]) -> list[Forward]:
    """Forwards that are needed where the command has the loopback of this process: to other ports."""
    return [each for each in forwards if each.outside != each.inside]


def _open(options: argparse.Namespace) -> int:
    if not options.user_mode:
        if kernel.has_bus() and not options.own:
            kernel.complete()
            options.forward = _elsewhere(options.forward)
            _become_beside(options, forward.listen(options.forward))
        if kernel.can_make_namespace():
            _open_namespace(options)
    if registry.in_user_mode_linux():
        raise BusUnavailable("no further bus can be had inside user-mode Linux")
    if packages.ensure(["bus"]) != 0:
        raise BusUnavailable(
            "this kernel has no CAN (no vcan0, and none can be made), and user-mode Linux is missing: see above"
        )
    return _open_user_mode(options)


def _become_beside(options: argparse.Namespace, listeners: list[socket.socket]) -> NoReturn:
    forward.beside(options.forward, listeners)
    _become(options.command)


def _become(command: list[str]) -> NoReturn:
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"with-vcan: cannot run {command[0]}: {error.strerror}", file=sys.stderr)
        sys.exit(127 if isinstance(error, FileNotFoundError) else 126)


def _open_namespace(options: argparse.Namespace) -> NoReturn:
    lock = _locked(options)
    os.set_inheritable(
        lock, True
    )  # the bus is open as long as the command, or a child of it, lives
    listeners = forward.listen(options.forward)
    kernel.enter_new_namespace()
    _become_beside(options, listeners)


def _locked(options: argparse.Namespace) -> int:
    """The lock of a new bus. Several user-mode kernels share the host's folders and may have the same process number:
    then a bus without a name of its own has a number more.
    """
    pid = os.getpid()
    for name in (
        [options.name]
        if options.name
        else [f"bus-{pid}", *(f"bus-{pid}-{k}" for k in range(2, 100))]
    ):
        with contextlib.suppress(NameTaken):
            return registry.create(Bus(name, "namespace", pid, None, options.command))
    raise NameTaken(f"a bus named {name} is open already; tools/with-vcan --list")


def _open_user_mode(options: argparse.Namespace) -> int:
    listeners = forward.listen(options.forward)
    cpu = options.cpu if options.cpu is not None else _quietest_cpu()
    bus = Bus(options.name or f"bus-{os.getpid()}", "user-mode", os.getpid(), cpu, options.command)
    here, there = socket.socketpair()
    user_mode.adopt_orphans()
    # First, since it receives the signals: none may end this process while the broker starts.
    client = Client(here, options.command)
    process = subprocess.Popen(
        [
            sys.executable,
            sys.argv[0],
            "--broker",
            str(there.fileno()),
            options.memory,
            dumps(asdict(bus)),
        ],
        pass_fds=(there.fileno(),),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    there.close()
    forward.through_broker(options.forward, listeners, bus.folder / "socket")
    try:
        return client.run()
    finally:
        # The broker ends everything inside and is the last to go.
        with contextlib.suppress(OSError):
            here.shutdown(socket.SHUT_RDWR)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        process.wait()
        user_mode.end_children()  # there are some only where the broker itself was killed


def _quietest_cpu() -> int:
    buses = Counter(bus.cpu for bus in registry.open_buses())
    return min(sorted(os.sched_getaffinity(0)), key=lambda cpu: buses[cpu])


def _broker(arguments: list[str]) -> None:
    descriptor, memory, bus = arguments
    broker.main(Bus(**loads(bus)), socket.socket(fileno=int(descriptor)), memory)
