# SPDX-License-Identifier: MIT
"""Commands about recordings of the bus: record, replay."""

from __future__ import annotations

import time
from argparse import Namespace

from ..bus.address import BusAddress, check_socketcan, parse_address
from ..bus.recorder import Recorder
from ..bus.recordings import RecordingWriter, check_suffix, read_recording
from ..errors import BusError, InputError, RunError
from .output import print_json

_WRITE_EVERY_S = 0.5


def record(options: Namespace) -> None:
    """hodograph record."""
    check_suffix(options.file)
    address = parse_address(options.bus)
    if not address.is_socketcan:
        raise BusError(f"{address}: record takes SocketCAN: use socketcan:CHANNEL")
    check_socketcan(address)
    frames, dropped, took_s = _record(address, options)
    if dropped:
        raise RunError(
            f"{options.file}: {dropped} frames are missing, which the kernel dropped: record as root if you can "
            "(larger receive buffer)"
        )
    if options.json:
        print_json({"file": str(options.file), "frames": frames, "seconds": took_s})
    else:
        print(f"{options.file}: {frames} frames in {took_s:.1f} s")


def _record(address: BusAddress, options: Namespace) -> tuple[int, int, float]:
    """Until the time is over or Ctrl-C, which is how it is meant to end: frames, dropped ones, time."""
    with RecordingWriter(options.file, address.channel) as writer, Recorder(address) as recorder:
        begun = recorder.started_s
        try:
            while options.seconds is None or time.monotonic() - begun < options.seconds:
                left_s = _WRITE_EVERY_S
                if options.seconds is not None:
                    left_s = min(left_s, begun + options.seconds - time.monotonic())
                time.sleep(max(0.0, left_s))
                writer.write(recorder.take())
        except KeyboardInterrupt as error:
            if type(error) is not KeyboardInterrupt:  # SIGTERM ends it as well, with its own status
                raise
        finally:
            recorder.stop()
            writer.write(recorder.take())
    return recorder.frame_count, recorder.dropped, time.monotonic() - begun


def replay(options: Namespace) -> None:
    """hodograph replay."""
    from ..bus.analysis import replay as replay_frames
    from ..chain import load_chain
    from ..config import load_machine
    from ..simulate import write_trace
    from .motion_commands import print_run
    from .path_commands import print_notes, read_image

    check_suffix(options.recording)
    image = read_image(options.file)
    chain = None if image is not None else load_chain(options.file, options.machine)
    if chain is not None:
        image, machine = chain.image, chain.machine
        print_notes(chain, chain.compilation.plan)
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
    if chain is not None and options.report is not None:
        from ..report import write_report
        from .output import note

        note(f"report: {write_report([(chain, found.motion, found)], options.report)}")
    if options.json:
        print_json(found.summary())
    else:
        print_run(str(options.file), found)


COMMANDS = {"record": record, "replay": replay}
