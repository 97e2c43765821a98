# SPDX-License-Identifier: MIT
"""Commands that only speak to a controller."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from ..values import finite, node_number, node_or_own, percentage, seconds
from . import options
from .options import Command


def _start(command: Command) -> None:
    start = command("start", "switch the drives on if need be and start the loaded program")
    start.add_argument("--reset", action="store_true", help="reset a fault first")
    start.add_argument(
        "--from",
        dest="from_mm",
        type=finite,
        metavar="MM",
        help="from rest at this arc length, where the axes must stand",
    )
    start.add_argument("--follow", action="store_true", help="return when the axes stand again")
    options.unhomed(start)
    options.bus(start)
    options.node(start)


def _stop(command: Command) -> None:
    stop = command("stop", "stop on the path, jerk-limited")
    stop.add_argument("--off", action="store_true", help="then switch the drives off")
    options.bus(stop)
    options.node(stop)


def _hold(command: Command) -> None:
    for name, text in (
        ("hold", "hold the feed: come to rest on the path until resumed"),
        ("resume", "go on after a hold"),
    ):
        parser_ = command(name, text)
        options.bus(parser_)
        options.node(parser_)
        if name == "hold":
            options.timeout(parser_, "as long as braking takes")


def _machine_file(parser: ArgumentParser, then: str = "") -> None:
    """FILE, which may be left out; `then` says what is done with it."""
    parser.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        nargs="?",
        help=f"machine file, or a path file that names one{then}",
    )


def _home(command: Command) -> None:
    home = command(
        "home", "find the zero of every axis that has a homing method; drives off before and after"
    )
    _machine_file(home, ": configure the controller from it first")
    options.bus(home)
    options.node(home)
    options.timeout(home, "what the controller allows")


def _configure(command: Command) -> None:
    configure = command(
        "configure", "bring the controller's configuration to a machine file, keep it, or forget it"
    )
    _machine_file(configure)
    configure.add_argument(
        "--store",
        action="store_true",
        help="keep the parameters over a loss of power, until they are stored again",
    )
    configure.add_argument(
        "--forget",
        action="store_true",
        help="forget what is stored: after the next power-on the controller has no configuration",
    )
    configure.add_argument(
        "--set-node",
        type=node_or_own,
        metavar="N",
        help="node number of the controller after the next power-on, stored with all parameters; 0: the board's own",
    )
    options.bus(configure)
    options.kernel(configure)
    options.node(configure)


def _quick_stop(command: Command) -> None:
    for name, text in (
        ("quick-stop", "all drives brake by their own ramps at once, off the path, and switch off"),
        ("reset", "reset a fault; the drives are then configured anew and off"),
    ):
        parser_ = command(name, text)
        options.bus(parser_)
        options.node(parser_)
        options.timeout(parser_, "10 s")


def _override(command: Command) -> None:
    override = command("override", "set the feed override")
    override.add_argument("percent", metavar="PERCENT", type=percentage, help="0 to 200")
    options.bus(override)
    options.node(override)


def _status(command: Command) -> None:
    status = command("status", "print the state of controller, drives, program and bus")
    options.bus(status)
    status.add_argument("--node", type=node_number, help="the controller's node number (default 1)")
    status.add_argument(
        "--machine", type=Path, metavar="FILE", help="for node number, bit rate, names of the axes"
    )
    options.json(status)
    status.add_argument(
        "--watch",
        action="store_true",
        help="again and again until Ctrl-C; with --json a line each time",
    )
    status.add_argument(
        "--interval", type=seconds, default=0.5, metavar="S", help="of --watch (default 0.5)"
    )


ALL = (_start, _stop, _hold, _home, _configure, _quick_stop, _override, _status)
