# SPDX-License-Identifier: MIT
"""Recovery after a fault: restarts the processes that have ended, resets the fault, runs the program again."""

from __future__ import annotations

from contextlib import suppress

from ..bus.diagnostics.texts import STATES
from ..bus.run import RunSession, run_program
from ..bus.sdo.controller import FAULT_STATE, OFF, READY, RESET, CommandRefusedError, Controller
from ..errors import RunError
from .bench import FaultBench
from .case_run import LIMIT_S, CaseRun


def recover(record: CaseRun, bench: FaultBench, controller: Controller) -> None:
    """Resets the fault, and runs the program again from its start."""
    clean_run = record.clean_run
    if bench.controller.ended():
        bench.start_controller()
        controller.require(5.0)
    if any(drive.ended() for drive in bench.drives):
        for drive in bench.drives:
            drive.end()
        bench.start_drives(faulty=False)
    began_s = controller.clock.now_s()
    _reset(controller)
    record.recovery_ms = 1000 * (controller.clock.now_s() - began_s)
    run = run_program(
        RunSession(controller, "fast", None), clean_run.machine, clean_run.image, "fixed"
    )
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
