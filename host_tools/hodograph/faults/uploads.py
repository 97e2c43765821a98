# SPDX-License-Identifier: MIT
"""Uploads that break off: what was there before must stay."""

from __future__ import annotations

import subprocess
import time
import zlib

import numpy as np

from ..bus.listening.recorder import Recorder
from ..bus.sdo.controller import FAULT_STATE, READY, Controller
from ..errors import BusError, RefusedError, RunError
from .actions import cut_upload, kill, spawn_upload
from .record import LIMIT_S, LOOK_S, Record, load_job
from .stand import Stand

_SDO_ASK = 0x600


def disturb_upload(record: Record, stand: Stand, controller: Controller, control: Recorder) -> None:
    """Breaks an upload of another program off; what was there must stay."""
    other = load_job(record.job.other).image
    record.began_us = time.time_ns() // 1000
    if record.case.scenario.action == "kill-upload":
        process = spawn_upload(record.job.other, stand.bus)
        _await_frames(
            control, _SDO_ASK + controller.node_id, int(record.case.drawn["frames"]), process
        )
        kill(process)
    else:
        at = int(record.case.drawn["permille"]) * len(other) // 1000
        cut_upload(controller, other, at, polite=record.case.drawn["manner"] == "abort")
    crc, wanted = _crc_after_cut(controller), zlib.crc32(record.job.image[16:])
    whole = record.case.scenario.action == "kill-upload" and crc == zlib.crc32(other[16:])
    if crc != wanted and not whole:
        record.troubles.append(f"after a broken upload the program has CRC {crc}, not {wanted}")
    if crc == wanted:
        _run_old(record, controller)
    controller.upload(other)
    if controller.program_crc() != zlib.crc32(other[16:]):
        record.troubles.append("the upload after the broken one did not arrive")
    record.finished = True


def _await_frames(
    control: Recorder, identifier: int, more: int, process: subprocess.Popen[bytes]
) -> None:
    """Until so many frames have come since now, or the process has ended."""

    def count() -> int:
        return int(np.count_nonzero(control.frames()["id"] == identifier))

    wanted = count() + more
    deadline = time.monotonic() + LIMIT_S
    while count() < wanted and process.poll() is None and time.monotonic() < deadline:
        time.sleep(LOOK_S)


def _crc_after_cut(controller: Controller) -> int | None:
    """The program's CRC when the server has done with the broken transfer (a read ends it)."""
    deadline = time.monotonic() + 5.0
    while True:
        try:
            return controller.program_crc()
        except (BusError, RefusedError):  # the rest of the old transfer
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


def _run_old(record: Record, controller: Controller) -> None:
    """The program that was there before runs as if nothing had been."""
    controller.start()
    deadline = time.monotonic() + LIMIT_S
    while controller.state() != READY:
        if controller.state() == FAULT_STATE or time.monotonic() > deadline:
            raise RunError(f"the old program does not run: {controller.fault_text()}")
        time.sleep(LOOK_S)
