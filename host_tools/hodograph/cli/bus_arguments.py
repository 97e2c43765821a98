# SPDX-License-Identifier: MIT
"""The arguments of the commands on a bus: moving, operating and watching a machine. Used by cli/arguments. No I/O."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from ..names import PACES
from . import options
from .options import (
    Command,
    assignment,
    bit_rate,
    count,
    finite,
    node_number,
    node_or_own,
    part,
    percentage,
    port_number,
    seconds,
)

_JOBS = 2
"""Processes that prepare a streamed job."""


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
        help="continue the job of the journal from where the axes stand",
    )
    begin = stream.add_mutually_exclusive_group()
    begin.add_argument(
        "--from-line",
        type=int,
        metavar="N",
        help="begin at source line N, where the axes must stand",
    )
    begin.add_argument(
        "--from",
        dest="from_mm",
        type=float,
        metavar="MM",
        help="begin at this arc length of the job, where the axes must stand",
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
        default=_JOBS,
        metavar="N",
        help="processes that prepare the job: 1, or 2 (default); the chunks are the same",
    )
    stream.add_argument(
        "--record",
        type=Path,
        metavar="RECORDING",
        help="keep all frames of the bus meanwhile: .log (candump), .asc or .blf",
    )
    stream.add_argument(
        "--override",
        type=options.percentage,
        metavar="PERCENT",
        help="feed override with which it begins, also the move to the start (default 100; with --continue the present "
        "one)",
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
    # A job that does not fit the controller's memory is streamed, with the defaults of `stream`.
    run.set_defaults(from_line=None, from_mm=None, journal=None, jobs=_JOBS, override=None)
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


MOVING = (_upload, _goto, _run, _stream, _demo, _rig)


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
        ("hold", "hold the feed: come to standstill on the path until resumed"),
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
    check = command("check", "compare the objects of the drives with what a machine needs")
    check.add_argument("file", metavar="MACHINE", type=Path, help="machine file (TOML)")
    options.bus_name(check)
    options.answer_wait(check)
    check.add_argument("--all", action="store_true", help="also print objects that fit")
    options.json(check)


def _machine_file(parser: ArgumentParser, then: str = "", *, required: bool = False) -> None:
    """Adds a FILE, optional unless `required`; `then`: help text about its use."""
    parser.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        nargs=None if required else "?",
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
        ("quick-stop", "drives brake by their own ramps, possibly off the path, and switch off"),
        ("reset", "reset a fault; the drives are then configured again, and are off"),
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


def _output(command: Command) -> None:
    output = command("output", "switch outputs by hand at standstill, or print them")
    _machine_file(output, required=True)
    output.add_argument(
        "assignments",
        metavar="NAME=VALUE",
        nargs="*",
        help="valve=on, valve=off, power=30: the drives are switched on, and the outputs stay until the next start, "
        "a stop or a fault (default: print the outputs)",
    )
    options.machine(output)
    options.bus(output)
    options.kernel(output)
    options.json(output)


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


OPERATING = (
    _scan,
    _check,
    _start,
    _stop,
    _hold,
    _home,
    _configure,
    _quick_stop,
    _override,
    _output,
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
    faults = command("faults", "inject faults into simulated machines and check the reaction")
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


WATCHING = (_monitor, _record, _replay, _latency, _faults)
