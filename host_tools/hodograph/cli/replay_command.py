# SPDX-License-Identifier: MIT
"""hodograph replay: a recorded run analysed."""

from __future__ import annotations

from argparse import Namespace

from ..bus.capture.recordings import check_suffix, read_recording
from ..errors import InputError, RunError
from .output import print_json, require_places


def replay(options: Namespace) -> None:
    """hodograph replay."""
    from ..bus.analysis import replay as replay_frames
    from ..config import load_machine
    from ..pipeline import load_pipeline
    from ..program.image import read_image
    from ..simulate import write_trace
    from .motion_commands import print_run
    from .path_commands import print_notes

    check_suffix(options.recording)
    require_places(options.trace, folders=[options.report])
    image = read_image(options.file)
    pipeline = (
        None
        if image is not None
        else load_pipeline(options.file, options.machine, allow_space=True)
    )
    if pipeline is not None:
        image, machine = pipeline.image, pipeline.machine
        print_notes(pipeline, pipeline.compilation.plan)
    elif options.machine is None:
        raise InputError(f"{options.file}: a program image needs --machine FILE")
    elif options.report is not None:
        raise InputError("--report: takes a path file, an image holds no polygon")
    else:
        machine = load_machine(options.machine)
    assert image is not None
    frames = read_recording(options.recording, options.channel)
    kernel = options.kernel or machine.kernel
    try:
        found = replay_frames(frames, str(options.recording), image, machine, kernel)
    except RunError as error:
        raise RunError(f"{options.recording}: {error}") from error
    if options.trace is not None:
        write_trace(found.motion, options.trace)
    if pipeline is not None and options.report is not None:
        from ..report import write_report
        from .output import note

        note(f"report: {write_report([(pipeline, found.motion, found)], options.report)}")
    if options.json:
        print_json(found.summary())
    else:
        print_run(str(options.file), found)


COMMANDS = {"replay": replay}
