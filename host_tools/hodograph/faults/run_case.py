# SPDX-License-Identifier: MIT
"""One scenario with one seed: bring up, run, disturb, look, recover, run again."""

from __future__ import annotations

import time

from ..bus.address import BusAddress
from ..bus.listening.recorder import Recorder
from ..bus.sdo.controller import connect
from ..errors import HodographError
from .disturb import disturb
from .evidence import Evidence
from .record import Record, load_job
from .recover import recover
from .scenario import Case
from .stand import Stand

_TAKE_S = 0.05


def run_case(case: Case, bus: BusAddress, drives_bus: BusAddress) -> Record:
    """Runs a case to its end, whatever happens; troubles are in the record. Raises BusError: no bus to run on."""
    began_s = time.monotonic()
    record = Record(case, load_job(case.scenario.path))
    machine = record.job.machine
    apart = case.scenario.action == "kill-one-drive"
    with (
        Stand(machine, bus, drives_bus, case.rules, apart=apart) as stand,
        connect(bus, machine.node, machine.bitrate) as controller,
        Recorder(bus, _TAKE_S) as control,
        Recorder(drives_bus, _TAKE_S) as drives,
    ):
        try:
            disturb(record, stand, controller, control)
        except HodographError as error:
            record.troubles.append(f"disturbed run: {error}")
        _gather(record, stand, control, drives)
        try:
            recover(record, stand, controller)
        except HodographError as error:
            record.troubles.append(f"recovery: {error}")
        record.control = control.frames()
        record.troubles += stand.complaints()
    record.wall_s = time.monotonic() - began_s
    return record


def _gather(record: Record, stand: Stand, control: Recorder, drives: Recorder) -> None:
    record.injections = stand.injections()
    record.evidence = Evidence(control.frames(), drives.frames(), record.job.machine.nodes)
    if control.dropped or drives.dropped:
        record.troubles.append("the kernel dropped frames of a recording")
    if record.injections and not record.began_us:
        ns = int(str(record.injections[0]["t_ns"]))
        record.began_us = (ns + time.time_ns() - time.monotonic_ns()) // 1000
