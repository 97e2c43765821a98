# SPDX-License-Identifier: MIT
"""The arguments of all commands, in five groups: first steps, without a bus, moving, operating, watching. Read by
parser.py.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from ..names import INTERPOLATIONS, PACES, SHELLS
from . import options
from .options import (
    Command,
    assignment,
    at_least_one,
    bit_rate,
    count,
    finite,
    node_number,
    node_or_own,
    part,
    percentage,
    port_number,
    positive,
    seconds,
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
    inspect = command("inspect", "print what a program image holds")
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
    paper = command("paper", "print the paper's numbers beside ours")
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


_OFFLINE = (
    *(_spline, _feed, _compile, _inspect, _verify, _import, _simulate, _report),
    *(_campaign, _identify, _tune, _paper, _dbc),
)


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
        "--to",
        type=finite,
        nargs=2,
        metavar=("X", "Y"),
        help="move to this point instead (machine coordinates, mm)",
    )
    goto.add_argument(
        "--z", type=finite, metavar="Z", help="with --to: coordinate of the third path axis"
    )
    options.unhomed(goto)
    options.machine(goto)
    options.bus(goto)
    options.kernel(goto)


def _stream(command: Command) -> None:
    stream = command("stream", "run toolpaths of any length: sent part by part while they run")
    stream.add_argument(
        "files",
        metavar="FILE",
        type=Path,
        nargs="*",
        help=f"{options.TOOLPATH}, or a path file with several paths; several FILEs run one after the other",
    )
    stream.add_argument(
        "--continue",
        dest="resume",
        action="store_true",
        help="continue the job of the journal from where the machine rests",
    )
    stream.add_argument(
        "--journal",
        type=Path,
        metavar="JSON",
        help="journal of the job (default stream.json in ~/.local/state/hodograph)",
    )
    stream.add_argument(
        "--simulate",
        action="store_true",
        help="no bus: plan all chunks, check them and take them over as the controller does",
    )
    stream.add_argument(
        "--jobs",
        type=int,
        choices=(1, 2),
        default=2,
        metavar="N",
        help="processes that prepare the job: 1, or 2 (default); the chunks are the same",
    )
    stream.add_argument(
        "--record",
        type=Path,
        metavar="RECORDING",
        help="keep all frames of the bus meanwhile: .log (candump), .asc or .blf",
    )
    options.unhomed(stream)
    stream.add_argument("--machine", type=Path, metavar="FILE", help="machine file")
    options.toolpath(stream)
    stream.add_argument(
        "--no-stops",
        action="store_true",
        help="do not wait for Enter at program stops and tool changes (M0, M1, M6)",
    )
    options.bus(stream, can_serve=True)
    options.kernel(stream)
    options.json(stream)
    _pace(stream)
    options.controller(stream)


def _pace(parser: ArgumentParser) -> None:
    """--pace, of commands that find a controller or start one."""
    parser.add_argument(
        "--pace",
        choices=PACES,
        help="pace of a controller that this command starts (default real-time)",
    )


def _run(command: Command) -> None:
    run = command("run", "run paths on the bus, record and analyse")
    options.file(run, many=True, what=f"path file (TOML), or {options.TOOLPATH}")
    options.unhomed(run)
    options.machine(run)
    options.toolpath(run)
    run.add_argument(
        "--no-stops",
        action="store_true",
        help="of a toolpath: do not wait for Enter at program stops and tool changes (M0, M1, M6)",
    )
    options.bus(run, can_serve=True)
    options.kernel(run)
    options.json(run)
    _pace(run)
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
    rig.add_argument(
        "--pace",
        choices=PACES,
        default="real-time",
        help="pace of the controller (default real-time)",
    )
    options.controller(rig)


_MOVING = (_upload, _goto, _run, _stream, _demo, _rig)


def _start(command: Command) -> None:
    start = command("start", "switch the drives on if they are off, and start the loaded program")
    start.add_argument("--reset", action="store_true", help="reset a fault first")
    start.add_argument(
        "--from",
        dest="from_mm",
        type=finite,
        metavar="MM",
        help="start at this arc length, where the axes must stand",
    )
    start.add_argument("--follow", action="store_true", help="return when the axes stand again")
    options.unhomed(start)
    options.bus(start)
    options.node(start)


def _stop(command: Command) -> None:
    stop = command("stop", "stop on the path, jerk-limited")
    stop.add_argument("--off", action="store_true", help="switch the drives off afterwards")
    options.bus(stop)
    options.node(stop)


def _hold(command: Command) -> None:
    for name, text in (
        ("hold", "hold the feed: come to rest on the path until resumed"),
        ("resume", "continue after a hold"),
    ):
        parser_ = command(name, text)
        options.bus(parser_)
        options.node(parser_)
        if name == "hold":
            options.timeout(parser_, "as long as braking takes")


def _scan(command: Command) -> None:
    scan = command(
        "scan", "find the nodes on a bus, and print what its drives report about themselves"
    )
    options.bus_name(scan)
    scan.add_argument(
        "--bitrate", type=bit_rate, default=1_000_000, metavar="N", help="bit/s (default 1000000)"
    )
    options.answer_wait(scan)
    scan.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write a commented machine file"
    )
    scan.add_argument("--force", action="store_true", help="replace a file that is there")
    scan.add_argument(
        "--no-lss",
        action="store_true",
        help="do not search for nodes without a number (LSS Fastscan)",
    )
    scan.add_argument(
        "--assign",
        type=assignment,
        action="append",
        default=[],
        metavar="[SERIAL=]NODE",
        help="give this node number to the only node without one, or to that with this serial number (LSS)",
    )
    scan.add_argument(
        "--store",
        action="store_true",
        help="with --assign: the nodes keep their number without power",
    )
    options.json(scan)


def _check(command: Command) -> None:
    check = command(
        "check", "ask drives, object by object, whether they can do what a machine needs"
    )
    check.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    options.bus_name(check)
    options.answer_wait(check)
    check.add_argument("--all", action="store_true", help="also print objects that are as needed")
    options.json(check)


def _machine_file(parser: ArgumentParser, then: str = "") -> None:
    """Adds an optional FILE; `then`: help text about its use."""
    parser.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        nargs="?",
        help=f"machine file, or a path file that names one{then}",
    )


def _home(command: Command) -> None:
    home = command(
        "home", "home every axis that has a homing method; drives are off before and after"
    )
    _machine_file(home, ": configure the controller from it first")
    options.bus(home)
    options.node(home)
    options.timeout(home, "what the controller allows")


def _configure(command: Command) -> None:
    configure = command(
        "configure",
        "write a machine file's configuration to the controller, store it, or clear what is stored",
    )
    _machine_file(configure)
    configure.add_argument(
        "--store",
        action="store_true",
        help="store the parameters, so that they are kept without power",
    )
    configure.add_argument(
        "--forget",
        action="store_true",
        help="clear what is stored: after the next power-on the controller has no configuration",
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
        "--machine",
        type=Path,
        metavar="FILE",
        help="machine file, for node number, bit rate and names of the axes",
    )
    options.json(status)
    status.add_argument(
        "--watch",
        action="store_true",
        help="repeat until Ctrl-C; with --json one line each time",
    )
    status.add_argument(
        "--interval",
        type=seconds,
        default=0.5,
        metavar="S",
        help="time between two outputs of --watch (default 0.5)",
    )


_OPERATING = (
    _scan,
    _check,
    _start,
    _stop,
    _hold,
    _home,
    _configure,
    _quick_stop,
    _override,
    _status,
)


def _monitor(command: Command) -> None:
    parser = command("monitor", "serve a live page of the machine for browsers")
    options.machine(parser)
    parser.add_argument(
        "--program",
        type=Path,
        metavar="FILE",
        help="path file, program image or toolpath to draw (default: the program in the controller)",
    )
    options.toolpath(parser)
    options.bus_name(parser)
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to serve (default 127.0.0.1: this machine only)",
    )
    parser.add_argument("--port", type=port_number, default=8402, help="TCP port (default 8402)")
    parser.add_argument(
        "--token", help="token that a browser needs to give commands (default: random, printed)"
    )
    parser.add_argument("--token-file", type=Path, metavar="FILE", help="file that holds the token")
    parser.add_argument(
        "--replay", type=Path, metavar="FILE", help="show this recording instead of a bus"
    )
    parser.add_argument(
        "--speed", type=finite, default=1.0, metavar="N", help="speed of the replay (default 1)"
    )


def _record(command: Command) -> None:
    record = command("record", "record the bus into a file until Ctrl-C")
    record.add_argument("file", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf")
    record.add_argument("--seconds", type=seconds, metavar="S", help="stop after this time")
    options.bus_name(record)
    options.node(
        record,
        "machine file, for nodes and limits of the setpoints (default: the controller's limits)",
    )
    options.json(record)


def _replay(command: Command) -> None:
    replay = command("replay", "analyse the run that a recording holds")
    replay.add_argument(
        "recording", metavar="RECORDING", type=Path, help=".log (candump), .asc or .blf"
    )
    replay.add_argument("file", metavar="FILE", type=Path, help="path file, or a program image")
    options.machine(replay)
    options.kernel(replay)
    replay.add_argument(
        "--channel", metavar="NAME", help="channel to read, if the recording has several"
    )
    replay.add_argument("--trace", type=Path, metavar="CSV", help="write one row a tick")
    replay.add_argument(
        "--report", type=Path, metavar="DIR", help="write report.html and figures there"
    )
    options.json(replay)


def _latency(command: Command) -> None:
    latency = command("latency", "measure how late the ticks of a controller are on this computer")
    latency.add_argument(
        "--bus",
        metavar="INTERFACE:CHANNEL",
        help="bus of the controller to measure (default: one that is started, on a local bus in real time)",
    )
    latency.add_argument(
        "--machine",
        type=Path,
        metavar="FILE",
        help="machine file, for the period (default: an example, 1000 us)",
    )
    latency.add_argument(
        "--seconds",
        type=seconds,
        default=10.0,
        metavar="S",
        help="duration of the measurement (default 10)",
    )
    options.json(latency)


def _faults(command: Command) -> None:
    faults = command("faults", "inject faults into simulated machines and judge their reaction")
    faults.add_argument(
        "scenarios",
        metavar="SCENARIO",
        nargs="*",
        help="names or files; default: all of examples/faults",
    )
    faults.add_argument(
        "--seeds", type=count, default=5, metavar="N", help="cases for each scenario (default 5)"
    )
    faults.add_argument("--seed", type=count, metavar="N", help="one case only, with this seed")
    faults.add_argument("--folder", type=Path, metavar="DIR", help="folder of other scenario files")
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


_WATCHING = (_monitor, _record, _replay, _latency, _faults)
_BEGINNING = (_init, _schema, _completion)


ALL = (*_BEGINNING, *_OFFLINE, *_MOVING, *_OPERATING, *_WATCHING)
"""Functions that add a command, in the order of `hodograph --help`."""
