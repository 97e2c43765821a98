# SPDX-License-Identifier: MIT
"""Options of several commands, and converters of values on the command line, whose messages name the error. Used by
cli/bus_arguments and cli/offline_arguments. No I/O.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable
from pathlib import Path

from ..bus.address import BUS_VARIABLE, DEFAULT_BUS
from ..names import KERNELS, LENGTH_UNITS_MM


def finite(text: str) -> float:
    """A finite number on the command line."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number') from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'"{text}" is not finite')
    return value


def seconds(text: str) -> float:
    """A time above zero."""
    value = finite(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a time above 0')
    return value


def waiting_time(text: str) -> float:
    """A time that is not below zero."""
    value = finite(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f'"{text}" is below 0')
    return value


def positive(text: str) -> float:
    """A number above zero."""
    value = finite(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number above 0')
    return value


def length_unit(text: str) -> float:
    """A unit of length, in mm."""
    if text in LENGTH_UNITS_MM:
        return LENGTH_UNITS_MM[text]
    try:
        return positive(text)
    except argparse.ArgumentTypeError:
        names = ", ".join(LENGTH_UNITS_MM)
        raise argparse.ArgumentTypeError(
            f'"{text}" is no unit: one of {names}, or a number of mm'
        ) from None


def named_feed(text: str) -> tuple[str, float]:
    """A name and its feed: NAME=MM/S."""
    name, found, feed = text.rpartition("=")
    if not (found and name):
        raise argparse.ArgumentTypeError(f'"{text}" is not NAME=MM/S')
    return name, positive(feed)


def column_names(text: str) -> tuple[str, ...]:
    """Names, separated by commas."""
    return tuple(name.strip() for name in text.split(","))


def node_or_own(text: str) -> int:
    """A node number, or 0."""
    if not text.isdigit() or int(text) > 127:
        raise argparse.ArgumentTypeError(f'"{text}" is not a node number from 1 to 127, or 0')
    return int(text)


def percentage(text: str) -> int:
    """A feed override."""
    if not text.isdigit() or int(text) > 200:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 0 to 200')
    return int(text)


def count(text: str) -> int:
    """A count, 0 or more."""
    if not text.isdigit() or int(text) > 100_000:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 0 to 100000')
    return int(text)


def at_least_one(text: str) -> int:
    """A count, 1 or more."""
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number from 1 to 1000')
    return int(text)


def bit_rate(text: str) -> int:
    """A bit rate of CAN."""
    if not text.isdigit() or not 10_000 <= int(text) <= 1_000_000:
        raise argparse.ArgumentTypeError(f'"{text}" is not a bit rate from 10000 to 1000000')
    return int(text)


def assignment(text: str) -> tuple[int | None, int]:
    """Serial number, or None, and the node number to assign."""
    match = re.fullmatch(r"(?:(0[xX][0-9a-fA-F]{1,8}|\d{1,10})=)?(\d{1,3})", text)
    serial = (
        None
        if match is None or match[1] is None
        else int(match[1], 0 if "x" in match[1].lower() else 10)
    )
    if match is None or not 1 <= int(match[2]) <= 127 or (serial or 0) >= 2**32:
        raise argparse.ArgumentTypeError(
            f'"{text}" is no node number from 1 to 127, with or without SERIAL= before it'
        )
    return serial, int(match[2])


def part(text: str) -> tuple[int, int]:
    """One of several equal parts."""
    match = re.fullmatch(r"(\d{1,3})/(\d{1,3})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise argparse.ArgumentTypeError(f'"{text}" is no part such as 1/2')
    return int(match[1]), int(match[2])


def node_number(text: str) -> int:
    """A CANopen node number."""
    if not text.isdigit() or not 1 <= int(text) <= 127:
        raise argparse.ArgumentTypeError(f'"{text}" is not a node number (1 to 127)')
    return int(text)


def port_number(text: str) -> int:
    """A TCP port that an ordinary user may serve."""
    if not text.isdigit() or not 1 <= int(text) <= 65535:
        raise argparse.ArgumentTypeError(f'"{text}" is not a port (1 to 65535)')
    return int(text)


Command = Callable[[str, str], argparse.ArgumentParser]
"""Makes the parser of a command from its name and its help text."""


def bus_name(parser: argparse.ArgumentParser, *, can_serve: bool = False) -> None:
    """--bus. `can_serve`: the command serves a local bus if there is none."""
    where = "a local bus of its own" if can_serve else "the local bus of hodograph run or rig"
    parser.add_argument(
        "--bus",
        metavar="INTERFACE:CHANNEL",
        help=f"bus, in the notation of python-can (default ${BUS_VARIABLE}, else {DEFAULT_BUS}, else {where})",
    )


def bus(parser: argparse.ArgumentParser, *, can_serve: bool = False) -> None:
    """--bus, --wait."""
    bus_name(parser, can_serve=can_serve)
    parser.add_argument(
        "--wait",
        type=waiting_time,
        default=2.0,
        metavar="S",
        help="how long to wait for the controller (default 2)",
    )


def answer_wait(parser: argparse.ArgumentParser) -> None:
    """--wait, for nodes."""
    parser.add_argument(
        "--wait",
        type=seconds,
        default=0.5,
        metavar="S",
        help="how long to wait for answers (default 0.5)",
    )


def controller(parser: argparse.ArgumentParser) -> None:
    """--controller."""
    parser.add_argument(
        "--controller",
        metavar="COMMAND",
        help="program to start as the controller, such as 'tools/emulate.py an386' (default hodograph-controller)",
    )


def timeout(parser: argparse.ArgumentParser, usual: str) -> None:
    """Adds --timeout; `usual`: help text about the default."""
    parser.add_argument(
        "--timeout",
        type=seconds,
        metavar="S",
        help=f"give up waiting for the end (default: {usual})",
    )


def node(
    parser: argparse.ArgumentParser, why: str = "machine file, for node number and bit rate"
) -> None:
    """--node and --machine."""
    parser.add_argument("--node", type=node_number, help="the controller's node number (default 1)")
    parser.add_argument("--machine", type=Path, metavar="FILE", help=why)


def unhomed(parser: argparse.ArgumentParser) -> None:
    """--unhomed."""
    parser.add_argument(
        "--unhomed",
        action="store_true",
        help="move although axes with a homing method are not homed",
    )


TOOLPATH = "toolpath: G-code (.ngc .nc .gcode .tap, or - for standard input), .dxf, .svg, points (.csv .txt)"
"""Help text for a toolpath FILE."""


def file(
    parser: argparse.ArgumentParser, *, many: bool = False, what: str = "path file (TOML)"
) -> None:
    """FILE."""
    if many:
        parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help=what)
    else:
        parser.add_argument("file", metavar="FILE", type=Path, help=what)


def json(parser: argparse.ArgumentParser) -> None:
    """--json."""
    parser.add_argument("--json", action="store_true", help="print one JSON document instead")


def machine(parser: argparse.ArgumentParser) -> None:
    """--machine."""
    parser.add_argument(
        "--machine",
        type=Path,
        metavar="FILE",
        help="machine file; replaces the one that a path file names",
    )


def toolpath(parser: argparse.ArgumentParser) -> None:
    """--tolerance, --feed, and options for drawings and points."""
    parser.add_argument(
        "--tolerance",
        type=finite,
        metavar="MM",
        help="of a toolpath: greatest distance of the curves from it (default 0.01; 0: stop at the end of each move)",
    )
    parser.add_argument(
        "--feed",
        type=positive,
        metavar="MM/S",
        help="of a toolpath: feed instead of its own ones; drawings need it",
    )
    parser.add_argument(
        "--feed-of",
        type=named_feed,
        action="append",
        default=[],
        metavar="NAME=MM/S",
        help="of a drawing: feed of this layer or colour (may be repeated; --feed is that of the others)",
    )
    for name, text in (
        ("layer", "of a drawing: this layer only (may be repeated: in this order)"),
        ("id", "of a drawing: this element only, by its id or handle (may be repeated)"),
    ):
        parser.add_argument(f"--{name}", action="append", default=[], metavar="NAME", help=text)
    for name, unit, text in (
        (
            "gap",
            "MM",
            "of a drawing: join ends of contours that are at most this far apart (default 0.01)",
        ),
        ("lift", "MM", "of a drawing: height of rapid moves above it (default 0: in its plane)"),
        ("scale", "K", "of a drawing or of points: factor of all lengths"),
        (
            "noise",
            "MM",
            "of points: greatest distance of the points from the curve that they sample",
        ),
    ):
        parser.add_argument(f"--{name}", type=finite, metavar=unit, help=text)
    parser.add_argument(
        "--unit",
        type=length_unit,
        metavar="UNIT",
        help="of a drawing or of points: mm, cm, m, um, in, or a number of mm (default: as the file says)",
    )
    parser.add_argument(
        "--columns",
        type=column_names,
        default=(),
        metavar="NAMES",
        help='of points: x, y, z, a, b, c, feed, or "-" for a column that is not read, as --columns=x,y,-,feed',
    )
    for name, text in (
        ("closed", "of points: return to the first one"),
        ("block-delete", "of G-code: leave out lines that begin with /"),
        ("skip-optional-stops", "of G-code: leave out M1"),
    ):
        parser.add_argument(f"--{name}", action="store_true", help=text)


def kernel(parser: argparse.ArgumentParser) -> None:
    """--kernel."""
    parser.add_argument("--kernel", choices=KERNELS, help="number kernel (default: machine file)")


def at(parser: argparse.ArgumentParser, what: str) -> None:
    """--at."""
    parser.add_argument("--at", type=finite, nargs="+", metavar="V", help=what)
