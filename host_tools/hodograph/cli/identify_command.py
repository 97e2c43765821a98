# SPDX-License-Identifier: MIT
"""hodograph identify: fits the plant (motor, screw and encoder) of each axis to a recorded run. Started by cli/main.
Reads the recording, the machine file and its drive files; with --output writes a machine file and drive files. Prints
to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from ..bus.capture.recordings import read_recording
from ..config import load_machine
from ..config.rewrite import rewritten
from ..errors import RunError
from .output import note, print_json, require_new, require_places, write_files


def identify(options: Namespace) -> None:
    """hodograph identify."""
    from ..identify import Plant, identify_axis, plant_json, plant_text, stretches

    require_places(options.output)
    require_new(options.output, force=options.force)
    machine = load_machine(options.machine)
    drives = machine.models(machine.axes)
    frames = read_recording(options.recording, options.channel)
    found: dict[int, Plant] = {}
    for index, (axis, drive) in enumerate(zip(machine.axes, drives, strict=True)):
        try:
            motions = stretches(frames, axis.node)
            found[index] = identify_axis(motions, drive, axis.counts_per_unit, machine.period_us)
        except RunError as error:
            note(f"{options.recording}: axis {axis.name}: {error}")
    if not found:
        raise RunError(f"{options.recording}: no axis can be identified from it")
    files: dict[Path, str] = {}
    if options.output is not None:
        plants = {index: plant.drive(drives[index]) for index, plant in found.items()}
        files = rewritten(machine, plants, {}, options.output, "identify")
        write_files(files, force=options.force)
    names = {index: machine.axes[index].name for index in found}
    if options.json:
        axes = [plant_json(names[index], plant) for index, plant in found.items()]
        print_json({"axes": axes, "files": [str(file) for file in files]})
        return
    print("\n\n".join(plant_text(names[index], plant) for index, plant in found.items()))
    for file in files:
        print(file)


COMMANDS = {"identify": identify}
