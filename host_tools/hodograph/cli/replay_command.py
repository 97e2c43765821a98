# SPDX-License-Identifier: MIT
"""hodograph replay: analyses a recorded run of a path file or of a program image. Started by cli/main. Reads these
files, may write a table and a report, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace

from ..bus.analysis import BusRun
from ..bus.analysis import replay as replay_frames
from ..bus.capture.recordings import check_suffix, read_recording
from ..config import Machine, load_machine
from ..errors import InputError, RunError
from ..pipeline import Pipeline, load_pipeline
from ..program.image import read_image
from ..simulate import write_trace
from .motion_commands import print_run
from .output import note, print_json, require_places
from .path_commands import print_notes


def replay(options: Namespace) -> None:
    """hodograph replay."""
    check_suffix(options.recording)
    require_places(options.trace, folders=[options.report])
    pipeline, image, machine = _program_of(options)
    found = _analysed(options, image, machine)
    if options.trace is not None:
        write_trace(found.motion, options.trace)
    if pipeline is not None and options.report is not None:
        from ..report import write_report

        note(f"report: {write_report([(pipeline, found.motion, found)], options.report)}")
    if options.json:
        print_json(found.summary())
    else:
        print_run(str(options.file), found)


def _program_of(options: Namespace) -> tuple[Pipeline | None, bytes, Machine]:
    """The program that was recorded, and its machine. The pipeline is None for an image. Raises InputError."""
    image = read_image(options.file)
    if image is None:
        pipeline = load_pipeline(options.file, options.machine, allow_space=True)
        image = pipeline.image
        print_notes(pipeline, pipeline.compilation.plan)
        return pipeline, image, pipeline.machine
    if options.machine is None:
        raise InputError(f"{options.file}: a program image needs --machine FILE")
    if options.report is not None:
        raise InputError("--report: takes a path file, an image holds no polygon")
    return None, image, load_machine(options.machine)


def _analysed(options: Namespace, image: bytes, machine: Machine) -> BusRun:
    """The run in the recording. Raises RunError, which names the recording."""
    frames = read_recording(options.recording, options.channel)
    kernel = options.kernel or machine.kernel
    try:
        return replay_frames(frames, str(options.recording), image, machine, kernel)
    except RunError as error:
        raise RunError(f"{options.recording}: {error}") from error


COMMANDS = {"replay": replay}
