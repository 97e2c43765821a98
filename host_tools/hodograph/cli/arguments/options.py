# SPDX-License-Identifier: MIT
"""Options that several commands have."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from ...bus.address import BUS_VARIABLE, DEFAULT_BUS
from ...bus.own_bus import usual_bus
from ...names import KERNELS
from ..values import finite, node_number, seconds

Command = Callable[[str, str], argparse.ArgumentParser]
"""Makes the parser of a command: its name, what it does."""


def bus_name(parser: argparse.ArgumentParser, *, can_serve: bool = False) -> None:
    """--bus. `can_serve`: the command serves a local bus where there is none."""
    where = "a local bus of its own" if can_serve else "the local bus of hodograph run or rig"
    parser.add_argument(
        "--bus",
        default=None if can_serve else usual_bus(),
        metavar="INTERFACE:CHANNEL",
        help=f"as python-can has it (default ${BUS_VARIABLE}, else {DEFAULT_BUS}, else {where})",
    )


def bus(parser: argparse.ArgumentParser, *, can_serve: bool = False) -> None:
    """--bus, --wait."""
    bus_name(parser, can_serve=can_serve)
    parser.add_argument(
        "--wait", type=finite, default=2.0, metavar="S", help="how long to wait for the controller"
    )


def controller(parser: argparse.ArgumentParser) -> None:
    """--controller."""
    parser.add_argument(
        "--controller",
        metavar="COMMAND",
        help="program started as the controller, as 'tools/emulate.py an386' (default hodograph-controller)",
    )


def timeout(parser: argparse.ArgumentParser, usual: str) -> None:
    """--timeout; `usual` says what is without it."""
    parser.add_argument(
        "--timeout",
        type=seconds,
        metavar="S",
        help=f"give up waiting for the end (default: {usual})",
    )


def node(parser: argparse.ArgumentParser, why: str = "for node number and bit rate") -> None:
    """--node and --machine."""
    parser.add_argument("--node", type=node_number, help="the controller's node number (default 1)")
    parser.add_argument("--machine", type=Path, metavar="FILE", help=why)


def unhomed(parser: argparse.ArgumentParser) -> None:
    """--unhomed."""
    parser.add_argument(
        "--unhomed",
        action="store_true",
        help="move although axes with a homing method are not homed since their drive's power-on",
    )


def file(parser: argparse.ArgumentParser, *, many: bool = False, what: str = "path file") -> None:
    """FILE."""
    if many:
        parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help=f"{what} (TOML)")
    else:
        parser.add_argument("file", metavar="FILE", type=Path, help=f"{what} (TOML)")


def json(parser: argparse.ArgumentParser) -> None:
    """--json."""
    parser.add_argument("--json", action="store_true", help="print one JSON document instead")


def machine(parser: argparse.ArgumentParser) -> None:
    """--machine."""
    parser.add_argument(
        "--machine", type=Path, metavar="FILE", help="machine file instead of the one FILE names"
    )


def kernel(parser: argparse.ArgumentParser) -> None:
    """--kernel."""
    parser.add_argument("--kernel", choices=KERNELS, help="number kernel (default: machine file)")


def at(parser: argparse.ArgumentParser, what: str) -> None:
    """--at."""
    parser.add_argument("--at", type=finite, nargs="+", metavar="V", help=what)
