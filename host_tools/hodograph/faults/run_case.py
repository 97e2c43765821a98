# SPDX-License-Identifier: MIT
"""Runs one scenario with one seed: start, run, disturbance, judgement, recovery, second run."""

from __future__ import annotations

import time

from ..bus.address import BusAddress
from ..bus.capture.recorder import Recorder
from ..bus.clock import Clock
from ..bus.hub import LocalHub
from ..bus.sdo.controller import connect
from ..errors import HodographError
from .bench import FaultBench
from .case_record import CaseRecord
from .case_run import CaseRun, load_clean_run
from .disturb import disturb
from .recover import recover
from .scenario import Case

_TAKE_S = 0.05


Buses = tuple[BusAddress, BusAddress]
"""The controller's and the drives'."""


def run_case(case: Case, buses: Buses | None) -> CaseRun:
    """Runs a case to its end, whatever happens; troubles are in the record. Raises BusError: no bus to run on.

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
            recover(record, bench, controller)
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
