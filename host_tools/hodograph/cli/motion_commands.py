# SPDX-License-Identifier: MIT
"""Commands that use a controller and a machine file: upload, goto, output, rig; and the text for the result of a run.
Started by cli/main. Used by cli/action_commands, cli/demo_command, cli/replay_command and cli/run_command. Reads files,
starts processes, reads and writes objects of the controller by SDO, and prints to stdout and stderr.
"""

from __future__ import annotations

import zlib
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path

from ..bus.goto import goto as goto_point
from ..bus.goto import switch_on
from ..bus.outputs import outputs_of, set_outputs
from ..bus.own_bus import bus_address, opened_bus
from ..bus.run import BusRun, rig_until_interrupted
from ..bus.sdo.follow import Follower
from ..bus.sdo.status import loaded_program
from ..bustime import require_fit
from ..config import SPACE_AXES, Machine, load_machine, read_toml
from ..config.outputs import assigned
from ..errors import InputError
from ..events import SwitchedOutputs, events_of
from ..machine_limits import program_limits
from ..names import is_toolpath
from ..native import NativeProgram
from ..pipeline import load_pipeline, program_start_counts, start_counts
from ..program.image import read_image
from .bus_commands import reached, stopping
from .output import duration_text, note, print_json, print_rows, progress, size_text
from .path_commands import motion_rows, print_notes
from .targets import DEFAULT_BITRATE


def _image_and_machine(options: Namespace) -> tuple[bytes, Machine | None, list[int] | None]:
    """The program image of FILE, its machine, and the position of all axes of the path at its start, in counts.

    The last two are None for an image without --machine.
    """
    image = read_image(options.file)
    if image is not None:
        machine = load_machine(options.machine) if options.machine else None
        if machine is not None:
            program_limits(machine)
            kernel = options.kernel or machine.kernel
            start = program_start_counts(NativeProgram(image), machine, kernel)
            require_fit(machine)
            return image, machine, start
        return image, None, None
    pipeline = load_pipeline(options.file, options.machine, allow_space=True)
    machine = pipeline.whole_machine
    require_fit(machine)
    image = pipeline.image
    print_notes(pipeline, pipeline.compilation.plan)
    return image, machine, start_counts(pipeline, options.kernel or machine.kernel)


def upload(options: Namespace) -> None:
    """hodograph upload."""
    address = bus_address(options.bus)
    image, machine, _ = _image_and_machine(options)
    node, bitrate = (machine.node, machine.bitrate) if machine else (1, DEFAULT_BITRATE)
    with reached(address, node, bitrate, options.wait) as controller:
        if machine is not None:
            controller.configure(machine, options.kernel or machine.kernel)
        with progress("upload", "B", len(image)) as bar:
            controller.upload(image, bar)
        program = loaded_program(controller)
    if options.json:
        result = {"bus": str(address), "node": node, "bytes": len(image)}
        print_json(result | {"program": asdict(program)})
    else:
        print(
            f"{size_text(len(image))} on node {node}: {program.segments} segments, {program.pieces} feed "
            f"pieces, {program.ticks} ticks, CRC-32 {zlib.crc32(image[16:]):08x}"
        )


def goto(options: Namespace) -> None:
    """hodograph goto."""
    address = bus_address(options.bus)
    image: bytes | None = None
    if options.to is None:
        image, named, start = _image_and_machine(options)
        if named is None or start is None:
            raise InputError(f"{options.file}: a program image needs --machine FILE")
        if options.z is not None:
            raise InputError("--z: goes with --to")
        machine, end = named, start
    else:
        machine = machine_of(options.file, options.machine)
        require_fit(machine)
        end = _given_point(options, machine)
    with reached(address, machine.node, machine.bitrate, options.wait) as controller:
        controller.require_standing()
        controller.configure(machine, options.kernel or machine.kernel)
        with stopping(controller):
            switch_on(controller, machine)
            follower = Follower(controller, note)
            distance_mm = goto_point(controller, machine, end, follower, unhomed=options.unhomed)
        if image is not None:
            controller.upload(image)
    drawn = zip(end, machine.path_axes[:SPACE_AXES], strict=False)
    place = ", ".join(f"{counts / axis.counts_per_unit:g}" for counts, axis in drawn)
    print(
        f"at ({place}) mm after {distance_mm:.6g} mm" if distance_mm else f"at ({place}) mm already"
    )


def output(options: Namespace) -> None:
    """hodograph output."""
    address = bus_address(options.bus)
    machine = machine_of(options.file, options.machine)
    if machine.outputs is None:
        raise InputError(f"{machine.file}: has no [outputs]: the machine switches none")
    wanted = [assigned(text, machine.outputs) for text in options.assignments]
    with reached(address, machine.node, machine.bitrate, options.wait) as controller:
        if wanted:
            require_fit(machine)
            controller.require_standing()
            controller.configure(machine, options.kernel or machine.kernel)
            switch_on(controller, machine)
            state = SwitchedOutputs(outputs_of(controller))
            state.act(events_of(wanted))
            set_outputs(controller, state.at_rest)
        values = outputs_of(controller)
    if options.json:
        print_json({one.name: one.level(values) for one in machine.outputs.channels})
    else:
        print_rows([(one.name, one.level_text(values)) for one in machine.outputs.channels])


def _given_point(options: Namespace, machine: Machine) -> list[int]:
    """The point of --to and --z in counts. Raises InputError: the machine cannot reach it."""
    to = [*options.to, *([] if options.z is None else [options.z])]
    if options.z is not None and len(machine.path_axes) < SPACE_AXES:
        raise InputError(f"--z: the path of {machine.file} has two axes: leave it out")
    reach = 2**31 / machine.counts_per_mm
    if max(map(abs, to)) >= reach:
        raise InputError(f"--to: must be within ±{reach:.0f} mm")
    return [round(mm * machine.counts_per_mm) for mm in to]


def machine_of(file: Path, given: Path | None) -> Machine:
    """The machine of a machine file, or the one that a path file names."""
    if given is not None:
        return load_machine(given)
    if not is_toolpath(file) and ("axis" in (data := read_toml(file)) or "path" not in data):
        return load_machine(file)
    return load_pipeline(file, allow_space=True).whole_machine


def print_run(title: str, result: BusRun) -> None:
    """A run's results as text."""
    motion = result.motion
    nominal_s = motion.ticks * motion.period_us / 1e6
    misses = (
        [] if result.deadline_misses is None else [("deadline misses", str(result.deadline_misses))]
    )
    unhomed = [("homing", "waived (--unhomed)")] if result.unhomed_starts else []
    print(title)
    print_rows(
        [
            (f"  {name}", value)
            for name, value in [
                ("bus", f"{result.bus}, pace {result.pace}, {result.frames} frames"),
                (
                    "time",
                    f"{duration_text(result.wall_s)} for {duration_text(nominal_s)} of motion",
                ),
                *misses,
                *unhomed,
                ("bus load", result.load.text()),
                *motion_rows(motion),
            ]
        ]
    )


def rig(options: Namespace) -> None:
    """hodograph rig."""
    machine = machine_of(options.file, None)
    require_fit(machine)
    kernel = options.kernel or machine.kernel
    with opened_bus(options.bus, note) as address:
        rig_until_interrupted(machine, address, options.pace, kernel, note, options.controller)


COMMANDS = {
    "upload": upload,
    "goto": goto,
    "output": output,
    "rig": rig,
}
