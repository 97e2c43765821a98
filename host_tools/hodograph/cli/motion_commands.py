# SPDX-License-Identifier: MIT
"""Commands that plan and speak to a controller: upload, goto, run, rig."""

from __future__ import annotations

import zlib
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..bus.address import BusAddress
from ..bus.capture.recordings import check_suffix
from ..bus.goto import goto as goto_point
from ..bus.own_bus import bus_address, opened_bus
from ..bus.run import BusRun, rig_until_interrupted, run_program, run_session
from ..bus.sdo.follow import Follower
from ..bus.sdo.status import loaded_program
from ..bustime import require_fit
from ..config import Machine, load_machine, read_toml
from ..errors import BusError, InputError
from ..native import NativeProgram
from ..pipeline import Pipeline, load_pipeline, program_limits
from ..simulate import write_trace
from .bus_commands import reached, stopping
from .output import note, print_json, print_rows, progress
from .path_commands import motion_rows, print_notes, read_image
from .targets import DEFAULT_BITRATE


def _image_and_machine(options: Namespace) -> tuple[bytes, Machine | None]:
    image = read_image(options.file)
    if image is not None:
        machine = load_machine(options.machine) if options.machine else None
        if machine is not None:
            program_limits(machine)
            require_fit(machine)
        return image, machine
    pipeline = load_pipeline(options.file, options.machine)
    require_fit(pipeline.machine)
    image = pipeline.image
    print_notes(pipeline, pipeline.compilation.plan)
    return image, pipeline.machine


def upload(options: Namespace) -> None:
    """hodograph upload."""
    address = bus_address(options.bus)
    image, machine = _image_and_machine(options)
    node, bitrate = (machine.node, machine.bitrate) if machine else (1, DEFAULT_BITRATE)
    with reached(address, node, bitrate, options.wait) as controller:
        if machine is not None:
            controller.configure(machine, options.kernel or machine.kernel)
        with progress("upload", "B", len(image)) as bar:
            controller.upload(image, bar)
        program = loaded_program(controller)
    if options.json:
        told = {"bus": str(address), "node": node, "bytes": len(image)}
        print_json(told | {"program": asdict(program)})
    else:
        print(
            f"{len(image)} bytes on node {node}: {program.segments} segments, {program.pieces} feed "
            f"pieces, {program.ticks} ticks, CRC-32 {zlib.crc32(image[16:]):08x}"
        )


def goto(options: Namespace) -> None:
    """hodograph goto."""
    address = bus_address(options.bus)
    image: bytes | None = None
    if options.to is None:
        image, named = _image_and_machine(options)
        if named is None:
            raise InputError(f"{options.file}: a program image needs --machine FILE")
        machine = named
    else:
        machine = machine_of(options.file, options.machine)
        require_fit(machine)
    end = _end_counts(options, machine, image)
    with reached(address, machine.node, machine.bitrate, options.wait) as controller:
        controller.require_standing()
        controller.configure(machine, options.kernel or machine.kernel)
        with stopping(controller):
            controller.enable()
            follower = Follower(controller, note)
            way_mm = goto_point(controller, machine, end, follower, unhomed=options.unhomed)
        if image is not None:
            controller.upload(image)
    place = ", ".join(f"{counts / machine.counts_per_mm:g}" for counts in end)
    print(f"at ({place}) mm after {way_mm:.6g} mm" if way_mm else f"at ({place}) mm already")


def _end_counts(options: Namespace, machine: Machine, image: bytes | None) -> tuple[int, int]:
    if image is None:
        reach = 2**31 / machine.counts_per_mm
        if max(map(abs, options.to)) >= reach:
            raise InputError(f"--to: must be within ±{reach:.0f} mm")
        x, y = (round(mm * machine.counts_per_mm) for mm in options.to)
        return x, y
    _, setpoints = NativeProgram(image).setpoints(
        options.kernel or machine.kernel, machine.counts_per_mm, 0, 1
    )
    return int(setpoints[0, 0]), int(setpoints[0, 1])


def machine_of(file: Path, given: Path | None) -> Machine:
    """The machine of a machine file, or the one that a path file names."""
    if given is not None:
        return load_machine(given)
    if "axis" in (data := read_toml(file)) or "path" not in data:
        return load_machine(file)
    return load_pipeline(file).machine


def run(options: Namespace) -> None:
    """hodograph run."""
    with opened_bus(options.bus, note, None if options.pace == "fast" else 1.0) as address:
        _run_all(options, address)


def _run_all(options: Namespace, address: BusAddress) -> None:
    if not address.is_raw:
        raise BusError(
            f"{address}: run records at full bus load, which takes SocketCAN: use socketcan:CHANNEL "
            "(slcand makes one of a serial adapter)"
        )
    if options.trace is not None and len(options.files) > 1:
        raise InputError("--trace: takes one FILE; run the others by themselves")
    if options.record is not None:
        check_suffix(options.record)
        if len(options.files) > 1:
            raise InputError("--record: takes one FILE; run the others by themselves")
    pipelines = [load_pipeline(file, options.machine) for file in options.files]
    for pipeline in pipelines:
        require_fit(pipeline.machine)
        pipeline.image  # noqa: B018  (all that can be wrong with the input shows before anything moves)
    runs = [_run_one(pipeline, address, options) for pipeline in pipelines]
    if options.trace is not None:
        write_trace(runs[0].motion, options.trace)
    if options.report is not None:
        from ..report import write_report

        cases = [(pipeline, run.motion, run) for pipeline, run in zip(pipelines, runs, strict=True)]
        note(f"report: {write_report(cases, options.report)}")
    _print_runs(pipelines, runs, options.json)


def _run_one(pipeline: Pipeline, address: BusAddress, options: Namespace) -> BusRun:
    machine = pipeline.machine
    print_notes(pipeline, pipeline.compilation.plan)
    with (
        run_session(
            machine, address, options.pace or "real-time", options.wait, note, options.controller
        ) as at,
        progress(f"run {pipeline.file.name}", "tick", pipeline.program.ticks) as bar,
    ):
        if options.pace is not None and at.pace is None:
            note("--pace has no effect on a controller that is running already")
        if options.controller is not None and at.pace is None:
            note("--controller has no effect where one is running already")
        kernel = options.kernel or machine.kernel
        return run_program(
            at, machine, pipeline.image, kernel, bar, options.record, unhomed=options.unhomed
        )


def _print_runs(pipelines: list[Pipeline], runs: list[BusRun], as_json: bool) -> None:
    if as_json:
        results: list[dict[str, Any]] = [run.summary() for run in runs]
        if len(results) == 1:
            print_json(results[0])
        else:
            files = [{"file": str(pipeline.file.file)} for pipeline in pipelines]
            print_json([a | b for a, b in zip(files, results, strict=True)])
        return
    for pipeline, result in zip(pipelines, runs, strict=True):
        print_run(str(pipeline.file.file), result)


def print_run(title: str, result: BusRun) -> None:
    """A run's results for people."""
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
                ("time", f"{result.wall_s:.2f} s for {nominal_s:.2f} s of motion"),
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
    "run": run,
    "rig": rig,
}
