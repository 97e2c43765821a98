# SPDX-License-Identifier: MIT
"""One scenario with one seed: bring up, run, disturb, look, recover, run again."""

from __future__ import annotations

import subprocess
import time
import zlib
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bus.address import BusAddress
from ..bus.controller import (
    BOOT,
    FAULT_STATE,
    OFF,
    READY,
    RESET,
    CommandRefusedError,
    Controller,
    connect,
)
from ..bus.objects import FAULT, MOVING, STATISTICS
from ..bus.recorder import Recorder
from ..bus.run import Station, run_program
from ..bus.texts import STATES
from ..chain import load_chain
from ..config import Machine
from ..errors import BusError, HodographError, RefusedError, RunError
from ..native import NativeProgram
from ..simulate import Motion, simulate
from .actions import await_rest, cut_upload, drives_at, kill, spawn_command, spawn_upload
from .evidence import Evidence
from .scenario import Case
from .stand import Stand

QUIET_S = 0.25
"""Recorded after everything has come to an end, so that what still moves is seen."""
REST_TOLERANCE_COUNTS = 2000
_LIMIT_S = 30.0
_LOOK_S = 0.02
_TAKE_S = 0.05
_SYNCS, _TICK = 1, 2
SDO_ASK = 0x600


@dataclass(frozen=True, eq=False)
class Job:
    """A program with its machine and what a clean run of it gives."""

    machine: Machine
    image: bytes
    other: Path
    """Another path for the same machine."""
    clean: Motion
    setpoints: NDArray[np.int32]


@dataclass
class Record:
    """What happened in a case, for the judge."""

    case: Case
    job: Job
    injections: list[dict[str, object]] = field(default_factory=list)
    evidence: Evidence | None = None
    began_us: int = 0
    """When the first thing was injected or done; 0: nothing was."""
    fault_codes: list[int] = field(default_factory=list)
    """Codes that object 0x2003 showed."""
    rest_us: int | None = None
    """When the drives were at rest, asked one by one."""
    troubles: list[str] = field(default_factory=list)
    """What went wrong on the way, each a violation."""
    again: Motion | None = None
    """The run after the recovery."""
    finished: bool = False
    """The disturbed program came to its end."""
    wall_s: float = 0.0


@lru_cache(maxsize=8)
def load_job(path: Path) -> Job:
    """The program of a path file; raises InputError, PlanError."""
    chain = load_chain(path)
    machine, image = chain.machine, chain.image
    _, setpoints = NativeProgram(image).setpoints("fixed", machine.counts_per_mm)
    clean = simulate(
        image,
        machine.models(machine.plane),
        counts_per_mm=machine.counts_per_mm,
        feedforward=machine.plane_feedforward,
        keep_rows=False,
    )
    return Job(machine, image, path.with_name("other.toml"), clean, setpoints)


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
            _disturbed(record, stand, controller, control)
        except HodographError as error:
            record.troubles.append(f"disturbed run: {error}")
        _gather(record, stand, control, drives)
        try:
            _recover(record, stand, controller)
        except HodographError as error:
            record.troubles.append(f"recovery: {error}")
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


def _disturbed(record: Record, stand: Stand, controller: Controller, control: Recorder) -> None:
    job, case = record.job, record.case
    controller.require(5.0)
    controller.configure(job.machine, "fixed")
    controller.override(100)
    controller.enable()
    controller.upload(job.image)
    if case.scenario.action in ("cut-upload", "kill-upload"):
        _disturb_upload(record, stand, controller, control)
        return
    process = None
    if case.scenario.action == "kill-host":
        process = spawn_command("start", "--follow", "--bus", str(stand.bus))
    else:
        controller.start()
    try:
        state = _follow(record, stand, controller, process)
    finally:
        if process is not None:
            kill(process)
    if state is None:  # a fresh controller: nothing to ask it
        return
    record.finished = state == READY and controller.read(STATISTICS, _TICK) == job.clean.ticks - 1
    _await_end_of_rules(record, controller)
    if controller.state() == FAULT_STATE:
        record.fault_codes.append(controller.read(FAULT, 1))
    if controller.program_crc() != zlib.crc32(job.image[16:]):
        record.troubles.append("the program is not the one that was uploaded")


def _follow(
    record: Record, stand: Stand, controller: Controller, process: subprocess.Popen[bytes] | None
) -> int | None:
    """Until the controller is at rest again, acting on the way; its state, None when it was killed."""
    action, started, acted = record.case.scenario.action, False, False
    deadline = time.monotonic() + _LIMIT_S
    while True:
        state = controller.state()
        started = started or state in MOVING
        if state in MOVING and not acted and action != "none":
            acted = controller.read(STATISTICS, _TICK) >= record.case.at
            if acted and not _act(record, stand, process):
                return None
        if state in (FAULT_STATE, OFF, BOOT) or (started and state == READY):
            return state
        if time.monotonic() > deadline:
            raise RunError(f"still {STATES.get(state, state)} after {_LIMIT_S:g} s")
        time.sleep(_LOOK_S)


def _act(record: Record, stand: Stand, process: subprocess.Popen[bytes] | None) -> bool:
    """Does what the scenario asks of the host; whether there still is a controller."""
    action = record.case.scenario.action
    if action == "watch-drives":
        _watch_drives(record, stand)
        return True
    record.began_us = time.time_ns() // 1000
    if action == "kill-drives":
        for drive in stand.drives:
            drive.kill()
    elif action == "kill-one-drive":
        stand.drives[record.job.machine.nodes.index(int(record.case.drawn["node"]))].kill()
    elif process is not None:
        kill(process)
    elif action == "kill-controller":
        stand.controller.kill()
        _watch_drives(record, stand)
        return False
    return True


def _watch_drives(record: Record, stand: Stand) -> None:
    machine = record.job.machine
    with drives_at(stand.drives_bus, machine.nodes, machine.bitrate) as clients:
        rest_s = await_rest(clients, REST_TOLERANCE_COUNTS, _LIMIT_S)
    record.rest_us = int((rest_s + time.time() - time.monotonic()) * 1e6)


def _await_end_of_rules(record: Record, controller: Controller) -> None:
    """Until no rule acts any more, and a little longer; ticks go on as long as there is a controller."""
    case = record.case
    base = controller.read(STATISTICS, _SYNCS) - controller.read(STATISTICS, _TICK)
    deadline = time.monotonic() + _LIMIT_S
    while controller.read(STATISTICS, _SYNCS) < base + case.last_tick:
        if time.monotonic() > deadline:
            raise BusError("SYNCs have stopped")
        time.sleep(_LOOK_S)
    time.sleep(case.longest_ms / 1000 + QUIET_S)


def _disturb_upload(
    record: Record, stand: Stand, controller: Controller, control: Recorder
) -> None:
    """Breaks an upload of another program off; what was there must stay."""
    other = load_job(record.job.other).image
    at = int(record.case.drawn["permille"]) * len(other) // 1000
    record.began_us = time.time_ns() // 1000
    if record.case.scenario.action == "kill-upload":
        process = spawn_upload(record.job.other, stand.bus)
        _await_frames(
            control, SDO_ASK + controller.node_id, int(record.case.drawn["frames"]), process
        )
        kill(process)
    else:
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
    deadline = time.monotonic() + _LIMIT_S
    while count() < wanted and process.poll() is None and time.monotonic() < deadline:
        time.sleep(_LOOK_S)


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
    deadline = time.monotonic() + _LIMIT_S
    while controller.state() != READY:
        if controller.state() == FAULT_STATE or time.monotonic() > deadline:
            raise RunError(f"the old program does not run: {controller.fault_text()}")
        time.sleep(_LOOK_S)


def _recover(record: Record, stand: Stand, controller: Controller) -> None:
    """Resets what is left of the fault, and runs the program again from its start."""
    job = record.job
    if stand.controller.ended():
        stand.start_controller()
        controller.require(5.0)
    if any(drive.ended() for drive in stand.drives):
        for drive in stand.drives:
            drive.end()
        stand.start_drives(faulty=False)
    _reset(controller)
    run = run_program(Station(controller, "fast", None), job.machine, job.image, "fixed")
    record.again = run.motion


def _reset(controller: Controller) -> None:
    """Resets until the fault is gone and the drives are found: braking comes first, drives take their time."""
    deadline = time.monotonic() + _LIMIT_S
    while (state := controller.state()) not in (OFF, READY):
        if time.monotonic() > deadline:
            raise RunError(
                f"{STATES.get(state, state)} after {_LIMIT_S:g} s of resets: {controller.fault_text()}"
            )
        if state == FAULT_STATE:
            with suppress(CommandRefusedError):
                controller.command(RESET)
        time.sleep(0.05)
