# SPDX-License-Identifier: MIT
"""Runs fault cases (start, program, disturbance, recovery, the program again) and judges them. A case is one scenario
with one seed. Called by cli/faults_command. Starts processes, reads and writes objects by SDO, receives frames, and
waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress

from ..bus.address import BusAddress, check_raw, is_virtual
from ..bus.capture.recorder import Recorder
from ..bus.clock import Clock
from ..bus.diagnostics.texts import STATES
from ..bus.hub import LocalHub
from ..bus.run import RunSession, run_program
from ..bus.sdo.controller import (
    FAULT_STATE,
    OFF,
    READY,
    RESET,
    CommandRefusedError,
    Controller,
    connect,
)
from ..errors import BusError, HodographError, RunError
from .bench import FaultBench
from .case_record import CaseRecord
from .case_run import LIMIT_S, CaseRun, load_clean_run
from .disturb import disturb
from .judge import Verdict, judge
from .scenario import Case, Scenario, draw

_TAKE_S = 0.05


Buses = tuple[BusAddress, BusAddress]
"""The controller's and the drives'."""


def run_campaign(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    buses: Buses | None,
    part: tuple[int, int] = (1, 1),
) -> Iterator[Verdict]:
    """Runs and judges every scenario with every seed; of `part` (k, n) every n-th case, from the k-th on.

    Without buses each case has its own. Raises BusError when those given are not virtual ones.
    """
    for address in buses or ():
        check_raw(address)
        if not is_virtual(address):
            raise BusError(f"{address}: not a virtual CAN: faults are for simulated machines only")
    cases = [draw(scenario, seed) for scenario in scenarios for seed in seeds]
    for case in cases[part[0] - 1 :: part[1]]:
        yield judge(run_case(case, buses))


def run_case(case: Case, buses: Buses | None) -> CaseRun:
    """Runs a case to its end; errors go into the record. Raises BusError: there is no bus.

    Without buses it has its own, in virtual time: the same record each time.
    """
    if buses is not None:
        return _run(case, *buses)
    with LocalHub(buses=2) as hub:
        return _run(case, hub.addresses[0], hub.addresses[1])


def _run(case: Case, bus: BusAddress, drives_bus: BusAddress) -> CaseRun:
    began_s = time.monotonic()
    record = CaseRun(case, load_clean_run(case.scenario.path))
    machine = record.clean_run.machine
    one_process_each = case.scenario.action == "kill-one-drive"
    with (
        FaultBench(
            machine, bus, drives_bus, case.rules, one_process_each=one_process_each
        ) as bench,
        connect(bus, machine.node, machine.bitrate) as controller,
        Recorder(bus, _TAKE_S) as control,
        Recorder(drives_bus, _TAKE_S) as drives,
    ):
        try:
            disturb(record, bench, controller, control)
        except HodographError as error:
            record.troubles.append(f"disturbed run: {error}")
        _gather(record, bench, controller.clock, control, drives)
        try:
            _recover(record, bench, controller)
        except HodographError as error:
            record.troubles.append(f"recovery: {error}")
        record.control = control.so_far()
        record.troubles += bench.complaints()
    record.wall_s = time.monotonic() - began_s
    return record


def _gather(
    record: CaseRun, bench: FaultBench, clock: Clock, control: Recorder, drives: Recorder
) -> None:
    record.injections = bench.injections()
    record.evidence = CaseRecord(control.so_far(), drives.so_far(), record.clean_run.machine.nodes)
    if control.dropped or drives.dropped:
        record.troubles.append("the kernel dropped frames of a recording")
    if record.injections and not record.began_us:
        ns = int(str(record.injections[0]["t_ns"]))
        offset_ns = 0 if clock.is_virtual else time.time_ns() - time.monotonic_ns()
        record.began_us = (ns + offset_ns) // 1000


def _recover(record: CaseRun, bench: FaultBench, controller: Controller) -> None:
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
    """Resets until the fault is gone and the drives are found, which may take a while after braking."""
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
