# SPDX-License-Identifier: MIT
"""Cases in which an upload breaks off: the old program has to stay active. Used by faults/disturb. Starts and kills a
process, reads and writes objects by SDO, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

import zlib

import numpy as np

from ..bus.capture.recorder import Recorder
from ..bus.clock import Clock
from ..bus.processes import Process
from ..bus.sdo.controller import FAULT_STATE, READY, Controller
from ..errors import BusError, RefusedError, RunError
from .bench import FaultBench
from .case_run import LIMIT_S, LOOK_S, CaseRun, load_clean_run
from .fault_actions import cut_upload, spawn_command

_SDO_ASK = 0x600


def disturb_upload(
    record: CaseRun, bench: FaultBench, controller: Controller, control: Recorder
) -> None:
    """Breaks off an upload of another program; the old one has to stay."""
    other = load_clean_run(record.clean_run.other).image
    record.began_us = controller.clock.stamp_ns() // 1000
    if record.case.scenario.action == "kill-upload":
        process = spawn_command(
            bench.clock, "upload", str(record.clean_run.other), "--bus", str(bench.bus)
        )
        _await_frames(
            controller.clock,
            control,
            _SDO_ASK + controller.node_id,
            int(record.case.drawn["frames"]),
            process,
        )
        process.kill()
        process.end()
    else:
        at = int(record.case.drawn["permille"]) * len(other) // 1000
        cut_upload(controller, other, at, polite=record.case.drawn["manner"] == "abort")
    crc, wanted = _crc_after_cut(controller), zlib.crc32(record.clean_run.image[16:])
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
    clock: Clock, control: Recorder, identifier: int, more: int, process: Process
) -> None:
    """Waits until so many frames have come, or the process has ended."""

    def count() -> int:
        return int(np.count_nonzero(control.so_far()["id"] == identifier))

    wanted = count() + more
    deadline = clock.now_s() + LIMIT_S
    while count() < wanted and not process.ended() and clock.now_s() < deadline:
        clock.sleep(LOOK_S)


def _crc_after_cut(controller: Controller) -> int | None:
    """The program's CRC after the server has ended the broken transfer (a read ends it)."""
    deadline = controller.clock.now_s() + 5.0
    while True:
        try:
            return controller.program_crc()
        except (BusError, RefusedError):  # remaining frames of the old transfer
            if controller.clock.now_s() > deadline:
                raise
            controller.clock.sleep(0.05)


def _run_old(record: CaseRun, controller: Controller) -> None:
    """Runs the old program, which has to give the same setpoints."""
    controller.start()
    deadline = controller.clock.now_s() + LIMIT_S
    while controller.state() != READY:
        if controller.state() == FAULT_STATE or controller.clock.now_s() > deadline:
            raise RunError(f"the old program does not run: {controller.fault_text()}")
        controller.clock.sleep(LOOK_S)
