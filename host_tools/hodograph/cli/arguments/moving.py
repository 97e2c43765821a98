# SPDX-License-Identifier: MIT
"""Commands that plan and speak to a controller."""

from __future__ import annotations

from pathlib import Path

from ...names import PACES
from ..values import finite
from . import options
from .options import Command


def _upload(command: Command) -> None:
    upload = command("upload", "configure the controller and send it a program")
    upload.add_argument("file", metavar="FILE", type=Path, help="path file, or a program image")
    options.machine(upload)
    options.bus(upload)
    options.kernel(upload)
    options.json(upload)


def _goto(command: Command) -> None:
    goto = command("goto", "move straight to a program's start and load the program")
    goto.add_argument(
        "file", metavar="FILE", type=Path, help="path file, or a machine file with --to"
    )
    goto.add_argument(
        "--to", type=finite, nargs=2, metavar=("X", "Y"), help="move there instead (machine mm)"
    )
    options.unhomed(goto)
    options.machine(goto)
    options.bus(goto)
    options.kernel(goto)


def _run(command: Command) -> None:
    run = command("run", "run paths on the bus, record and analyse")
    options.file(run, many=True)
    options.unhomed(run)
    options.machine(run)
    options.bus(run, can_serve=True)
    options.kernel(run)
    options.json(run)
    run.add_argument(
        "--pace", choices=PACES, help="of a controller started here (default real-time)"
    )
    options.controller(run)
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


def _demo(command: Command) -> None:
    demo = command(
        "demo", "run the paper's alpha on a simulated machine, with live page and report"
    )
    demo.add_argument(
        "--output",
        type=Path,
        default=Path("hodograph-demo"),
        metavar="DIR",
        help="folder of the report (default hodograph-demo)",
    )
    demo.add_argument(
        "--no-browser", action="store_true", help="print the address of the live page only, and end"
    )
    options.json(demo)


def _rig(command: Command) -> None:
    rig = command("rig", "bring up a simulated machine on a virtual bus until Ctrl-C")
    rig.add_argument(
        "file", metavar="FILE", type=Path, help="machine file, or a path file that names one"
    )
    options.bus(rig, can_serve=True)
    options.kernel(rig)
    rig.add_argument("--pace", choices=PACES, default="real-time")
    options.controller(rig)


ALL = (_upload, _goto, _run, _demo, _rig)
