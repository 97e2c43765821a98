# SPDX-License-Identifier: MIT
"""The command line: one sub-command per job, usage errors as InputError."""

from __future__ import annotations

import argparse
import difflib
import re
from pathlib import Path
from typing import NoReturn

from .. import __version__
from ..bus.address import DEFAULT_BUS
from ..errors import InputError
from ..names import KERNELS, PACES
from .values import count, finite, node_number, part, percentage, port_number, seconds

DESCRIPTION = (
    "From a control polygon to encoder counts: jerk-limited motion on PH splines over CAN."
)
EPILOG = (
    "exit status: 0 done, 1 internal or build, 2 wrong input, 3 path or feed not possible, 4 bus or node, "
    "5 refused by the controller, 6 run failed, 130 interrupted (docs/cli.md)"
)


class _Parser(argparse.ArgumentParser):
    """Raises InputError with one line instead of printing usage."""

    def error(self, message: str) -> NoReturn:
        match = re.match(r"argument COMMAND: invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if match:
            names = re.findall(r"[\w-]+", match[2])
            near = difflib.get_close_matches(match[1], names, n=1)
            advice = f'did you mean "{near[0]}"?' if near else "one of: " + ", ".join(names)
            message = f'there is no command "{match[1]}"; {advice}'
        raise InputError(f"{message} (see {self.prog} --help)")


def _bus_name(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--bus",
        default=DEFAULT_BUS,
        metavar="INTERFACE:CHANNEL",
        help=f"as python-can has it (default {DEFAULT_BUS})",
    )


def _bus(parser: argparse.ArgumentParser) -> None:
    _bus_name(parser)
    parser.add_argument(
        "--wait", type=finite, default=2.0, metavar="S", help="how long to wait for the controller"
    )


def _controller(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--controller",
        metavar="COMMAND",
        help="program started as the controller, as 'tools/emulate.py an386' (default hodograph-controller)",
    )


def _timeout(parser: argparse.ArgumentParser, usual: str) -> None:
    parser.add_argument(
        "--timeout",
        type=seconds,
        metavar="S",
        help=f"give up waiting for the end (default: {usual})",
    )


def _node(parser: argparse.ArgumentParser, why: str = "for node number and bit rate") -> None:
    parser.add_argument("--node", type=node_number, help="the controller's node number (default 1)")
    parser.add_argument("--machine", type=Path, metavar="FILE", help=why)


def _file(parser: argparse.ArgumentParser, *, many: bool = False, what: str = "path file") -> None:
    if many:
        parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help=f"{what} (TOML)")
    else:
        parser.add_argument("file", metavar="FILE", type=Path, help=f"{what} (TOML)")


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print one JSON document instead")


def _machine(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--machine", type=Path, metavar="FILE", help="machine file instead of the one FILE names"
    )


def _kernel(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kernel", choices=KERNELS, help="number kernel (default: machine file)")


def _at(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument("--at", type=finite, nargs="+", metavar="V", help=what)


def _monitor(parser: argparse.ArgumentParser) -> None:
    _machine(parser)
    parser.add_argument(
        "--program",
        type=Path,
        metavar="FILE",
        help="path file or program image to draw (default: the one in the controller)",
    )
    parser.add_argument(
        "--bus",
        default=DEFAULT_BUS,
        metavar="INTERFACE:CHANNEL",
        help=f"as python-can has it (default {DEFAULT_BUS})",
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to serve (default 127.0.0.1: this machine only)",
    )
    parser.add_argument("--port", type=port_number, default=8402, help="default 8402")
    parser.add_argument("--token", help="what commands need (default: made up, and printed)")
    parser.add_argument("--token-file", type=Path, metavar="FILE", help="a file that holds it")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="a recording instead of a bus")
    parser.add_argument(
        "--speed", type=finite, default=1.0, metavar="N", help="of the replay (default 1)"
    )


def make_parser() -> argparse.ArgumentParser:
    """The whole command line."""
    parser = _Parser(prog="hodograph", description=DESCRIPTION, epilog=EPILOG)
    parser.add_argument("--version", action="version", version=f"hodograph {__version__}")
    parser.add_argument(
        "--debug", action="store_true", help="show tracebacks (or HODOGRAPH_DEBUG=1)"
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        return commands.add_parser(name, help=text, description=text.capitalize() + ".")

    spline = command("spline", "compute the PH spline of a path")
    _file(spline)
    _json(spline)
    _at(spline, "arc lengths in mm at which to give point, tangent and curvature")

    feed = command("feed", "plan the feed along a path")
    _file(feed)
    _machine(feed)
    _json(feed)
    _at(feed, "times in s at which to give arc length and feed")

    compile_ = command("compile", "make the program image that the controller runs")
    _file(compile_)
    _machine(compile_)
    _json(compile_)
    compile_.add_argument(
        "-o", "--output", type=Path, metavar="IMAGE", help="default: FILE with .hdgp, here"
    )

    inspect = command("inspect", "print what a program image holds")
    inspect.add_argument("file", metavar="FILE", type=Path, help="program image, or a path file")
    _machine(inspect)
    _json(inspect)

    inspect.add_argument("--full", action="store_true", help="print every segment and piece")

    upload = command("upload", "configure the controller and send it a program")
    upload.add_argument("file", metavar="FILE", type=Path, help="path file, or a program image")
    _machine(upload)
    _bus(upload)
    _kernel(upload)
    _json(upload)

    goto = command("goto", "move straight to a program's start and load the program")
    goto.add_argument(
        "file", metavar="FILE", type=Path, help="path file, or a machine file with --to"
    )
    goto.add_argument(
        "--to", type=finite, nargs=2, metavar=("X", "Y"), help="move there instead (machine mm)"
    )
    _machine(goto)
    _bus(goto)
    _kernel(goto)

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
    _bus(start)
    _node(start)

    stop = command("stop", "stop on the path, jerk-limited")
    stop.add_argument("--off", action="store_true", help="then switch the drives off")
    _bus(stop)
    _node(stop)

    for name, text in (
        ("hold", "hold the feed: come to rest on the path until resumed"),
        ("resume", "go on after a hold"),
    ):
        parser_ = command(name, text)
        _bus(parser_)
        _node(parser_)
        if name == "hold":
            _timeout(parser_, "as long as braking takes")

    home = command(
        "home", "find the zero of every axis that has a homing method; drives off before and after"
    )
    home.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        nargs="?",
        help="machine file, or a path file that names one: configure the controller from it first",
    )
    _bus(home)
    _node(home)
    _timeout(home, "what the controller allows")

    for name, text in (
        ("quick-stop", "all drives brake by their own ramps at once, off the path, and switch off"),
        ("reset", "reset a fault; the drives are then configured anew and off"),
    ):
        parser_ = command(name, text)
        _bus(parser_)
        _node(parser_)
        _timeout(parser_, "10 s")

    override = command("override", "set the feed override")
    override.add_argument("percent", metavar="PERCENT", type=percentage, help="0 to 200")
    _bus(override)
    _node(override)

    status = command("status", "print the state of controller, drives, program and bus")
    _bus(status)
    status.add_argument("--node", type=node_number, help="the controller's node number (default 1)")
    status.add_argument(
        "--machine", type=Path, metavar="FILE", help="for node number, bit rate, names of the axes"
    )
    _json(status)
    status.add_argument(
        "--watch",
        action="store_true",
        help="again and again until Ctrl-C; with --json a line each time",
    )
    status.add_argument(
        "--interval", type=seconds, default=0.5, metavar="S", help="of --watch (default 0.5)"
    )

    _monitor(command("monitor", "serve a live page of the machine for browsers"))

    simulate = command("simulate", "run a path without a bus, as fast as it goes")
    _file(simulate)
    _machine(simulate)
    _kernel(simulate)
    _json(simulate)
    simulate.add_argument("--trace", type=Path, metavar="CSV", help="write one row a tick")

    run = command("run", "run paths on the bus, record and analyse")
    _file(run, many=True)
    _machine(run)
    _bus(run)
    _kernel(run)
    _json(run)
    run.add_argument(
        "--pace", choices=PACES, help="of a controller started here (default real-time)"
    )
    _controller(run)
    run.add_argument(
        "--trace", type=Path, metavar="CSV", help="write one row a tick (one FILE only)"
    )
    run.add_argument(
        "--report", type=Path, metavar="DIR", help="write report.html and figures there"
    )

    run.add_argument(
        "--record",
        type=Path,
        metavar="RECORDING",
        help="keep the frames in a .log (candump), .asc or .blf file (one FILE only)",
    )

    record = command("record", "record the bus into a file until Ctrl-C")
    record.add_argument("file", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf")
    record.add_argument("--seconds", type=seconds, metavar="S", help="for so long only")
    _bus_name(record)
    _node(record, "for nodes and limits of the setpoints (without: the controller's)")
    _json(record)

    replay = command("replay", "analyse the run that a recording holds")
    replay.add_argument(
        "recording", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf"
    )
    replay.add_argument("file", metavar="FILE", type=Path, help="path file, or a program image")
    _machine(replay)
    _kernel(replay)
    replay.add_argument("--channel", metavar="NAME", help="where the recording has several")
    replay.add_argument("--trace", type=Path, metavar="CSV", help="write one row a tick")
    replay.add_argument(
        "--report", type=Path, metavar="DIR", help="write report.html and figures there"
    )
    _json(replay)

    report = command("report", "simulate paths and write a report with figures")
    _file(report, many=True)
    _machine(report)
    _kernel(report)
    report.add_argument(
        "-o", "--output", type=Path, default=Path("report"), metavar="DIR", help="default: report"
    )

    paper = command("paper", "print the paper's numbers beside ours")
    _json(paper)

    dbc = command("dbc", "write the bus of a machine as a DBC file for other CAN tools")
    dbc.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    dbc.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="default: MACHINE with .dbc, here"
    )
    dbc.add_argument(
        "--eds", type=Path, metavar="EDS", help="of the drives (default: the simulated drive's)"
    )

    faults = command("faults", "inject faults into simulated machines and judge what comes of it")
    faults.add_argument(
        "scenarios",
        metavar="SCENARIO",
        nargs="*",
        help="names or files; default: all of examples/faults",
    )
    faults.add_argument("--seeds", type=count, default=5, metavar="N", help="cases a scenario")
    faults.add_argument("--seed", type=count, metavar="N", help="one case only, with this seed")
    faults.add_argument("--folder", type=Path, metavar="DIR", help="of other scenario files")
    faults.add_argument(
        "--drives-bus",
        default="socketcan:vcan1",
        metavar="INTERFACE:CHANNEL",
        help="the drives' side (default socketcan:vcan1)",
    )
    faults.add_argument(
        "--part",
        type=part,
        default=(1, 1),
        metavar="K/N",
        help="every N-th case only, from the K-th on",
    )
    faults.add_argument("--verbose", action="store_true", help="a line for each case on stderr")
    _bus(faults)
    _json(faults)

    rig = command("rig", "bring up a simulated machine on a virtual bus until Ctrl-C")
    rig.add_argument(
        "file", metavar="FILE", type=Path, help="machine file, or a path file that names one"
    )
    _bus(rig)
    _kernel(rig)
    rig.add_argument("--pace", choices=PACES, default="real-time")
    _controller(rig)
    return parser
