# SPDX-License-Identifier: MIT
"""hodograph monitor: the live page, on a bus or from a recording. Started by cli/main. Reads files, uses the bus,
serves HTTP, and prints to stderr.
"""

from __future__ import annotations

import asyncio
from argparse import Namespace
from pathlib import Path

from ..bus.capture.frames import Frames
from ..bus.capture.setpoint_check import step_limits
from ..bus.own_bus import bus_address
from ..config import PLANE_AXES, SPACE_AXES, Machine, load_machine
from ..errors import InputError
from ..job_view import curve_view
from ..monitor.decoder import nodes_in
from ..monitor.derived import ProgramPath
from ..monitor.pump import Layout
from ..monitor.security import make_token
from ..monitor.session import Live, LivePage, PageAddress, Replay
from ..names import is_toolpath
from ..native import NativeProgram
from ..pipeline import load_pipeline
from ..program.image import read_image
from .output import note
from .targets import DEFAULT_BITRATE
from .toolpath_commands import refuse_toolpath_options, toolpath_job

_USUAL_PERIOD_US = 1000
_USUAL_COUNTS_PER_MM = 1_000_000


def monitor(options: Namespace) -> None:
    """hodograph monitor."""
    image: bytes | None = None
    machine: Machine | None
    toolpath = None
    if options.program is not None and is_toolpath(options.program):
        job = toolpath_job(options, options.program)
        machine, toolpath = job.machine, curve_view(job)
    else:
        refuse_toolpath_options(options, options.program or Path("monitor"))
        image, machine = _image_and_machine(options)
    place = PageAddress(options.host, options.port, make_token(_token(options)))
    if options.replay is not None:
        what, layout = _replay(options, machine, image)
    elif machine is not None:
        what, layout = Live(bus_address(options.bus), machine.node), machine_layout(machine)
    else:
        raise InputError("monitor: needs --machine FILE, or a path file as --program")
    asyncio.run(LivePage(what, layout, place, image, note, toolpath).serve())


def _replay(
    options: Namespace, machine: Machine | None, image: bytes | None
) -> tuple[Live | Replay, Layout]:
    from ..monitor.source import ReplaySource, load_recording

    if not options.speed > 0:
        raise InputError(f"--speed: must be more than 0, but is {options.speed:g}")
    frames = load_recording(options.replay)
    layout = _recorded_layout(frames, image) if machine is None else machine_layout(machine)
    what = Replay(
        options.replay.name,
        options.speed,
        lambda: ReplaySource(frames, layout.period_us, options.speed),
    )
    return what, layout


def _recorded_layout(frames: Frames, image: bytes | None) -> Layout:
    """Machine data without a machine file: the drives that send frames, the period of the program, and defaults."""
    nodes = nodes_in(frames)
    names = tuple("xyzabc"[i] if i < 6 else str(node) for i, node in enumerate(nodes))
    period_us = NativeProgram(image).period_us if image is not None else _USUAL_PERIOD_US
    return Layout(
        names=names,
        nodes=nodes,
        counts_per_unit=(_USUAL_COUNTS_PER_MM,) * len(nodes),
        units=("mm",) * len(nodes),
        drawn=PLANE_AXES if image is None else ProgramPath(image, _USUAL_COUNTS_PER_MM).axes,
        period_us=period_us,
        bitrate=DEFAULT_BITRATE,
    )


def machine_layout(machine: Machine) -> Layout:
    """The data of this machine that are needed to decode its frames."""
    return Layout(
        names=tuple(axis.name for axis in machine.axes),
        nodes=tuple(axis.node for axis in machine.axes),
        counts_per_unit=tuple(axis.counts_per_unit for axis in machine.axes),
        units=tuple(axis.unit for axis in machine.axes),
        drawn=min(machine.path_count, SPACE_AXES),
        path_axes=machine.path_count,
        period_us=machine.period_us,
        bitrate=machine.bitrate,
        limits=step_limits(machine),
        controller=machine.node,
        outputs=machine.outputs,
    )


def _image_and_machine(options: Namespace) -> tuple[bytes | None, Machine | None]:
    machine = load_machine(options.machine) if options.machine is not None else None
    if options.program is None:
        return None, machine
    image = read_image(options.program)
    if image is not None:
        return image, machine
    pipeline = load_pipeline(options.program, options.machine, allow_space=True)
    return pipeline.image, pipeline.machine


def _token(options: Namespace) -> str | None:
    if options.token_file is None:
        return str(options.token) if options.token is not None else None
    file: Path = options.token_file
    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as a token: {error}") from None


COMMANDS = {"monitor": monitor}
