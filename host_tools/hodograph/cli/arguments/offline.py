# SPDX-License-Identifier: MIT
"""Commands that need no bus."""

from __future__ import annotations

from pathlib import Path

from ...names import INTERPOLATIONS
from ..values import at_least_one, finite, positive
from . import options
from .options import Command


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
    options.file(compile_)
    options.machine(compile_)
    options.json(compile_)
    compile_.add_argument(
        "-o", "--output", type=Path, metavar="IMAGE", help="default: FILE with .hdgp, here"
    )


def _inspect(command: Command) -> None:
    inspect = command("inspect", "print what a program image holds")
    inspect.add_argument("file", metavar="FILE", type=Path, help="program image, or a path file")
    options.machine(inspect)
    options.json(inspect)
    inspect.add_argument("--full", action="store_true", help="print every segment and piece")


def _verify(command: Command) -> None:
    verify = command("verify", "look whether a program keeps the limits of its path file")
    options.file(verify)
    options.machine(verify)
    options.json(verify)
    verify.add_argument(
        "--program", type=Path, metavar="IMAGE", help="look at this image, not at FILE planned anew"
    )


def _simulate(command: Command) -> None:
    simulate = command("simulate", "run a path without a bus, as fast as it goes")
    options.file(simulate)
    options.machine(simulate)
    options.kernel(simulate)
    options.json(simulate)
    simulate.add_argument(
        "--trace",
        type=Path,
        metavar="CSV",
        help="write one row a tick; with stops a file for each, CSV.KIND-S.csv, as well",
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
    options.file(report, many=True)
    options.machine(report)
    options.kernel(report)
    report.add_argument(
        "-o", "--output", type=Path, default=Path("report"), metavar="DIR", help="default: report"
    )


def _campaign(command: Command) -> None:
    campaign = command("campaign", "make many simulated runs on all cores, or on a cluster")
    options.file(campaign, what="campaign file")
    campaign.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="default: FILE without .toml, here"
    )
    campaign.add_argument(
        "--workers", type=at_least_one, metavar="N", help="processes (default: one for each core)"
    )
    campaign.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster, as tcp://host:8786"
    )
    campaign.add_argument(
        "--fresh", action="store_true", help="begin anew, whatever DIR holds already"
    )
    options.json(campaign)


def _paper(command: Command) -> None:
    paper = command("paper", "print the paper's numbers beside ours")
    options.json(paper)


def _dbc(command: Command) -> None:
    dbc = command("dbc", "write the bus of a machine as a DBC file for other CAN tools")
    dbc.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    dbc.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="default: MACHINE with .dbc, here"
    )
    dbc.add_argument(
        "--eds", type=Path, metavar="EDS", help="of the drives (default: the simulated drive's)"
    )


def _tune(command: Command) -> None:
    tune = command("tune", "compute servo gains and feedforward of a machine from its plant model")
    tune.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    tune.add_argument(
        "--path",
        type=Path,
        action="append",
        metavar="FILE",
        help="path for the table of contour errors, and, without --bandwidth, to be best for (may be repeated)",
    )
    tune.add_argument(
        "--bandwidth", type=positive, metavar="HZ", help="natural frequency of the closed loop"
    )
    tune.add_argument("--damping", type=positive, metavar="Z", help="of it (default 1)")
    tune.add_argument(
        "--stiffness",
        type=positive,
        metavar="N/UM",
        help="least force that moves the table by 1 um",
    )
    tune.add_argument(
        "--interpolation",
        choices=INTERPOLATIONS,
        help="of setpoints in the drives (default: as they have it)",
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
        help="dead time that the margins must stand, beyond the model's (default 125)",
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
        help="machine file it was made with: nodes, and drive files with the loops",
    )
    identify.add_argument("--channel", metavar="NAME", help="of a recording with several")
    identify.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write a machine file and its drive files"
    )
    identify.add_argument("--force", action="store_true", help="replace files that are there")
    options.json(identify)


ALL = (
    *(_spline, _feed, _compile, _inspect, _verify, _simulate, _report),
    *(_campaign, _identify, _tune, _paper, _dbc),
)
