# SPDX-License-Identifier: MIT
"""The way out of a fault: what has ended is started anew, the fault is reset, the program runs again."""

from __future__ import annotations

from contextlib import suppress

from ..bus.diagnostics.texts import STATES
from ..bus.run import Station, run_program
from ..bus.sdo.controller import FAULT_STATE, OFF, READY, RESET, CommandRefusedError, Controller
from ..errors import RunError
from .bench import FaultBench
from .record import LIMIT_S, Record


def recover(record: Record, stand: FaultBench, controller: Controller) -> None:
    """Resets what is left of the fault, and runs the program again from its start."""
    job = record.job
    if stand.controller.ended():
        stand.start_controller()
        controller.require(5.0)
    if any(drive.ended() for drive in stand.drives):
        for drive in stand.drives:
            drive.end()
        stand.start_drives(faulty=False)
    began_s = controller.clock.now_s()
    _reset(controller)
    record.recovery_ms = 1000 * (controller.clock.now_s() - began_s)
    run = run_program(Station(controller, "fast", None), job.machine, job.image, "fixed")
    record.again = run.motion


def _reset(controller: Controller) -> None:
    """Resets until the fault is gone and the drives are found: braking comes first, drives take their time."""
    deadline = controller.clock.now_s() + LIMIT_S
    while (state := controller.state()) not in (OFF, READY):
        if controller.clock.now_s() > deadline:
            raise RunError(
                f"{STATES.get(state, state)} after {LIMIT_S:g} s of resets: {controller.fault_text()}"
            )
        if state == FAULT_STATE:
            with suppress(CommandRefusedError):
                controller.command(RESET)
        controller.clock.sleep(0.05)
