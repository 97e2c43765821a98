# SPDX-License-Identifier: MIT
"""The first run of a fault case: starts machine and program, disturbs them, and waits until everything is at rest. Used
by faults/case_runner. Starts and kills processes, reads and writes objects by SDO, and waits by the clock of the bus,
real or virtual.
"""

from __future__ import annotations

import zlib

from ..bus.capture.recorder import Recorder
from ..bus.clock import Clock
from ..bus.diagnostics.texts import STATES
from ..bus.processes import Process
from ..bus.sdo.controller import BOOT, FAULT_STATE, OFF, READY, Controller
from ..bus.sdo.objects import ACTUAL, FAULT, MOVING, STATISTICS
from ..errors import BusError, RunError
from .bench import FaultBench
from .case_run import LIMIT_S, LOOK_S, REST_TOLERANCE_COUNTS, CaseRun
from .fault_actions import await_rest, drives_at, spawn_command
from .uploads import disturb_upload

QUIET_S = 0.25
"""Time recorded after the end of the case, so that later motion is recorded too."""
_SYNCS, _TICK = 1, 2
_STILL_LOOKS = 5
"""Equal readings after which the axes count as standing."""
_START_S = 120.0
"""Time for the start of a command process: on a busy computer it loads for longer than a case lasts."""


def disturb(record: CaseRun, bench: FaultBench, controller: Controller, control: Recorder) -> None:
    """Runs the case's program, or its upload, with the disturbance of its scenario. Raises errors of the bus tools."""
    clean_run, case = record.clean_run, record.case
    controller.require(5.0)
    controller.configure(clean_run.machine, "fixed")
    controller.override(100)
    controller.enable()
    controller.upload(clean_run.image)
    if case.scenario.action in ("cut-upload", "kill-upload"):
        disturb_upload(record, bench, controller, control)
        return
    process = None
    if case.scenario.action == "kill-host":
        process = spawn_command(bench.clock, "start", "--follow", "--bus", str(bench.bus))
    else:
        controller.start()
    try:
        state = _follow(record, bench, controller, process)
    finally:
        if process is not None:
            process.kill()
            process.end()
    if state is None:  # a new controller, which need not be asked
        return
    record.finished = (
        state == READY and controller.read(STATISTICS, _TICK) == clean_run.motion.ticks - 1
    )
    _await_end_of_rules(record, controller)
    if controller.state() == FAULT_STATE:
        record.fault_codes.append(controller.read(FAULT, 1))
    if controller.program_crc() != zlib.crc32(clean_run.image[16:]):
        record.troubles.append("the program is not the one that was uploaded")


def _follow(
    record: CaseRun, bench: FaultBench, controller: Controller, process: Process | None
) -> int | None:
    """Waits until the controller is at rest again, with the host's action in between; returns its state, None: it was
    killed.
    """
    action, started, acted = record.case.scenario.action, False, False
    deadline = controller.clock.now_s() + (LIMIT_S if process is None else _START_S)
    while True:
        state = controller.state()
        if state in MOVING and not started:
            started, deadline = True, controller.clock.now_s() + LIMIT_S
        if state in MOVING and not acted and action != "none":
            acted = controller.read(STATISTICS, _TICK) >= record.case.at
            if acted and not _act(record, bench, controller.clock, process):
                return None
        if state in (FAULT_STATE, OFF, BOOT) or (started and state == READY):
            return state
        if process is not None and not started and process.ended():
            raise RunError(f"hodograph start ended with status {process.child.returncode}")
        if controller.clock.now_s() > deadline:
            raise RunError(f"still {STATES.get(state, state)} when its time was over")
        controller.clock.sleep(LOOK_S)


def _act(record: CaseRun, bench: FaultBench, clock: Clock, process: Process | None) -> bool:
    """Executes the host's action; returns whether a controller still runs."""
    action = record.case.scenario.action
    if action == "watch-drives":
        _watch_drives(record, bench, clock)
        return True
    record.began_us = clock.stamp_ns() // 1000
    if action == "kill-drives":
        for drive in bench.drives:
            drive.kill()
    elif action == "kill-one-drive":
        bench.drives[record.clean_run.machine.nodes.index(int(record.case.drawn["node"]))].kill()
    elif process is not None:
        process.kill()
    elif action == "kill-controller":
        bench.controller.kill()
        _watch_drives(record, bench, clock)
        return False
    return True


def _watch_drives(record: CaseRun, bench: FaultBench, clock: Clock) -> None:
    machine = record.clean_run.machine
    with drives_at(bench.drives_bus, machine.nodes, machine.bitrate) as clients:
        rest_s = await_rest(clients, clock, REST_TOLERANCE_COUNTS, LIMIT_S)
    record.rest_us = round((rest_s - clock.now_s()) * 1e6) + clock.stamp_ns() // 1000


def _await_end_of_rules(record: CaseRun, controller: Controller) -> None:
    """Waits until shortly after the end of all rules; ticks continue while a controller runs."""
    case = record.case
    base = controller.read(STATISTICS, _SYNCS) - controller.read(STATISTICS, _TICK)
    deadline = controller.clock.now_s() + LIMIT_S
    while controller.read(STATISTICS, _SYNCS) < base + case.last_tick:
        if controller.clock.now_s() > deadline:
            raise BusError("SYNCs have stopped")
        controller.clock.sleep(LOOK_S)
    controller.clock.sleep(case.longest_ms / 1000)
    _await_rest(controller, len(record.clean_run.machine.axes))
    controller.clock.sleep(QUIET_S)


def _await_rest(controller: Controller, axes: int) -> None:
    """Waits until the axes stand, by the positions that the controller receives; an axis that is off may coast. If they
    do not stand, the judge reports it.
    """
    deadline = controller.clock.now_s() + LIMIT_S
    place, looks = [0] * axes, 0
    while looks < _STILL_LOOKS and controller.clock.now_s() < deadline:
        now = [controller.read(ACTUAL, axis) for axis in range(1, axes + 1)]
        away = max(abs(a - b) for a, b in zip(now, place, strict=True))
        place, looks = (place, looks + 1) if away <= REST_TOLERANCE_COUNTS else (now, 0)
        controller.clock.sleep(LOOK_S)
