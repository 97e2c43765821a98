# SPDX-License-Identifier: MIT
"""The arguments of the commands that need no bus: first files, paths and programs, simulation, tuning. Used by
cli/arguments. No I/O.
"""

from __future__ import annotations

from pathlib import Path

from ..names import INTERPOLATIONS, SHELLS
from . import options
from .options import (
    Command,
    at_least_one,
    finite,
    positive,
)


def _init(command: Command) -> None:
    init = command("init", "write a machine file, a path file and a drive file to begin with")
    init.add_argument(
        "folder",
        metavar="DIR",
        type=Path,
        nargs="?",
        default=Path(),
        help="folder (default: the current one)",
    )


def _schema(command: Command) -> None:
    schema = command("schema", "print the JSON schema of an input file, for editors")
    schema.add_argument(
        "name", metavar="NAME", nargs="?", help="path, machine, drive, campaign or scenario"
    )
    schema.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="write DIR/NAME.schema.json; without NAME all schemas",
    )


def _completion(command: Command) -> None:
    completion = command("completion", "print what a shell needs to complete commands and options")
    completion.add_argument("shell", metavar="SHELL", choices=SHELLS, help="bash, zsh or fish")


def _spline(command: Command) -> None:
    spline = command("spline", "compute the PH spline of a path")
    options.file(spline)
    options.json(spline)
    options.at(spline, "arc lengths in mm at which to give point, tangent and curvature")


def _feed(command: Command) -> None:
    feed = command("feed", "plan the feed along a path")
    options.file(feed)
    options.machine(feed)
    options.json(feed)
    options.at(feed, "times in s at which to give arc length and feed")


def _compile(command: Command) -> None:
    compile_ = command("compile", "make the program image that the controller runs")
    options.file(compile_, what="path file (TOML), or a toolpath of one section")
    options.machine(compile_)
    options.toolpath(compile_)
    options.json(compile_)
    compile_.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="IMAGE",
        help="image file (default: FILE with .hdgp, in the current folder)",
    )


def _inspect(command: Command) -> None:
    inspect = command("inspect", "print what a program image contains")
    inspect.add_argument("file", metavar="FILE", type=Path, help="program image, or a path file")
    options.machine(inspect)
    options.json(inspect)
    inspect.add_argument("--full", action="store_true", help="print every segment and piece")


def _verify(command: Command) -> None:
    verify = command("verify", "check whether a program keeps the limits of its path file")
    options.file(verify, what=f"path file (TOML), or {options.TOOLPATH}")
    options.toolpath(verify)
    options.machine(verify)
    options.json(verify)
    verify.add_argument(
        "--program", type=Path, metavar="IMAGE", help="check this image instead of planning FILE"
    )


def _import(command: Command) -> None:
    import_ = command("import", "show what becomes of a toolpath of another program")
    options.file(import_, what=options.TOOLPATH)
    options.machine(import_)
    options.toolpath(import_)
    import_.add_argument(
        "-o", "--output", type=Path, metavar="TOML", help="write sections and commands to this file"
    )
    options.json(import_)


def _simulate(command: Command) -> None:
    simulate = command("simulate", "run a path without a bus, as fast as the computer can")
    options.file(simulate, what=f"path file (TOML), or {options.TOOLPATH}")
    options.toolpath(simulate)
    options.machine(simulate)
    options.kernel(simulate)
    options.json(simulate)
    simulate.add_argument(
        "--trace",
        type=Path,
        metavar="CSV",
        help="write one row a tick; for each stop write a file of its own too, CSV.KIND-S.csv",
    )
    for name, text in (
        ("hold", "feed hold"),
        ("stop", "stop"),
        ("fault", "fault stop"),
    ):
        simulate.add_argument(
            f"--{name}-at",
            type=finite,
            nargs="+",
            action="extend",
            default=[],
            metavar="S",
            help=f"{text} at these times in seconds, each in a run of its own",
        )


def _report(command: Command) -> None:
    report = command("report", "simulate paths and write a report with figures")
    options.file(report, many=True, what="path files (TOML), or one toolpath")
    options.toolpath(report)
    options.machine(report)
    options.kernel(report)
    report.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("report"),
        metavar="DIR",
        help="folder (default: report)",
    )


def _campaign(command: Command) -> None:
    campaign = command("campaign", "make many simulated runs on all cores, or on a cluster")
    options.file(campaign, what="campaign file (TOML)")
    campaign.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="DIR",
        help="folder (default: FILE without .toml, in the current folder)",
    )
    campaign.add_argument(
        "--workers", type=at_least_one, metavar="N", help="processes (default: one for each core)"
    )
    campaign.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="address of the scheduler of a Dask cluster, such as tcp://host:8786",
    )
    campaign.add_argument(
        "--fresh", action="store_true", help="make all runs, also those that DIR already holds"
    )
    options.json(campaign)


def _paper(command: Command) -> None:
    paper = command("paper", "print the paper's numbers next to ours")
    options.json(paper)


def _dbc(command: Command) -> None:
    dbc = command("dbc", "write the bus of a machine as a DBC file for other CAN tools")
    dbc.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    dbc.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="DBC file (default: MACHINE with .dbc, in the current folder)",
    )
    dbc.add_argument(
        "--eds",
        type=Path,
        metavar="EDS",
        help="EDS file of the drives (default: that of the simulated drives)",
    )


def _tune(command: Command) -> None:
    tune = command("tune", "compute servo gains and feedforward of a machine from its plant model")
    tune.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    tune.add_argument(
        "--path",
        type=Path,
        action="append",
        metavar="FILE",
        help="print contour errors of this path; without --bandwidth search the best loop for it (may be repeated)",
    )
    tune.add_argument(
        "--bandwidth", type=positive, metavar="HZ", help="natural frequency of the closed loop"
    )
    tune.add_argument(
        "--damping", type=positive, metavar="Z", help="damping of the closed loop (default 1)"
    )
    tune.add_argument(
        "--stiffness",
        type=positive,
        metavar="N/UM",
        help="least force that moves the table by 1 um",
    )
    tune.add_argument(
        "--interpolation",
        choices=INTERPOLATIONS,
        help="how the drives join setpoints (default: as in their files)",
    )
    tune.add_argument(
        "--velocity",
        choices=("drive", "bus"),
        default="drive",
        help="velocity feedforward by the drive's k_pf (default) or by 0x60B1 over the bus",
    )
    tune.add_argument(
        "--margin",
        type=positive,
        default=0.5,
        metavar="M",
        help="least modulus margin (default 0.5)",
    )
    tune.add_argument(
        "--delay-us",
        type=finite,
        default=125.0,
        metavar="US",
        help="additional dead time with which the margins must hold (default 125)",
    )
    tune.add_argument("--report", type=Path, metavar="DIR", help="write a report with figures")
    tune.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write a machine file and its drive files"
    )
    tune.add_argument("--force", action="store_true", help="replace files that are there")
    options.json(tune)


def _identify(command: Command) -> None:
    identify = command("identify", "fit the plant of each axis to a recorded run")
    identify.add_argument(
        "recording", metavar="RECORDING", type=Path, help="recorded run (.log, .asc, .blf)"
    )
    identify.add_argument(
        "--machine",
        type=Path,
        required=True,
        metavar="FILE",
        help="machine file of that run: nodes, and drive files with the servo loops",
    )
    identify.add_argument(
        "--channel", metavar="NAME", help="channel to read, if the recording has several"
    )
    identify.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write a machine file and its drive files"
    )
    identify.add_argument("--force", action="store_true", help="replace files that are there")
    options.json(identify)


OFFLINE = (
    *(_spline, _feed, _compile, _inspect, _verify, _import, _simulate, _report),
    *(_campaign, _identify, _tune, _paper, _dbc),
)

BEGINNING = (_init, _schema, _completion)
"""Commands for first steps."""
