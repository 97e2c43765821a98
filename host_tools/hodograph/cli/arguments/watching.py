# SPDX-License-Identifier: MIT
"""Commands that look on, or disturb."""

from __future__ import annotations

from pathlib import Path

from ..values import count, finite, part, port_number, seconds
from . import options
from .options import Command


def _monitor(command: Command) -> None:
    parser = command("monitor", "serve a live page of the machine for browsers")
    options.machine(parser)
    parser.add_argument(
        "--program",
        type=Path,
        metavar="FILE",
        help="path file or program image to draw (default: the one in the controller)",
    )
    options.bus_name(parser)
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


def _record(command: Command) -> None:
    record = command("record", "record the bus into a file until Ctrl-C")
    record.add_argument("file", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf")
    record.add_argument("--seconds", type=seconds, metavar="S", help="for so long only")
    options.bus_name(record)
    options.node(record, "for nodes and limits of the setpoints (without: the controller's)")
    options.json(record)


def _replay(command: Command) -> None:
    replay = command("replay", "analyse the run that a recording holds")
    replay.add_argument(
        "recording", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf"
    )
    replay.add_argument("file", metavar="FILE", type=Path, help="path file, or a program image")
    options.machine(replay)
    options.kernel(replay)
    replay.add_argument("--channel", metavar="NAME", help="where the recording has several")
    replay.add_argument("--trace", type=Path, metavar="CSV", help="write one row a tick")
    replay.add_argument(
        "--report", type=Path, metavar="DIR", help="write report.html and figures there"
    )
    options.json(replay)


def _faults(command: Command) -> None:
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
        "--buses",
        nargs=2,
        metavar=("CONTROLLER", "DRIVES"),
        help="virtual CAN buses to use, in real time (default: local ones of its own, in virtual time)",
    )
    faults.add_argument(
        "--part",
        type=part,
        default=(1, 1),
        metavar="K/N",
        help="every N-th case only, from the K-th on",
    )
    faults.add_argument("--verbose", action="store_true", help="a line for each case on stderr")
    options.json(faults)


ALL = (_monitor, _record, _replay, _faults)
