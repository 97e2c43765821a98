# SPDX-License-Identifier: MIT
"""Runs a program on the bus: configures the machine, moves to the start, runs, records and analyses. Used by all
modules that run programs on a bus. Starts processes, reads and writes objects of the controller by SDO, receives
frames, writes recordings, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..config import Machine
from ..errors import BusError, HodographError, RunError
from ..native import NativeProgram
from ..simulate import settling_ticks
from .address import BusAddress, check_raw, is_virtual
from .analysis import REACHED_AFTER, BusRun, analyse_recording, first_tick, measured_pace
from .capture.decode import unhomed_starts
from .capture.frames import Frames
from .capture.recorder import Recorder
from .capture.recordings import write_recording
from .goto import goto, switch_on
from .processes import SimulatedMachine
from .sdo.controller import DISABLE, STATISTICS, Controller, connect
from .sdo.follow import Follower
from .signals import interrupts_ignored

__all__ = [
    "BusRun",
    "Recorded",
    "RunSession",
    "analysed",
    "bring_up",
    "first_tick",
    "measured_pace",
    "record_program",
    "rig_until_interrupted",
    "run_program",
    "run_session",
]

_SYNCS, _TICK, _MISSES = 1, 2, 3
_MARGIN_TICKS = 50
"""Ticks recorded beyond the necessary ones, so that late answers differ from lost ones."""
_REST_TICKS = 10
"""Time recorded before the start: `hodograph identify` needs the rest before a motion."""
_OUTPUTS_TICKS = 80
"""The same on a machine with outputs: outputs that are on at rest are in the recording, which has one frame of them in
64 ticks.
"""

FULL_OVERRIDE = 100
"""Feed override with which programs and jobs begin, per cent."""

Progress = Callable[[int], None]


def _silent(text: str) -> None:
    del text


@dataclass(frozen=True)
class RunSession:
    """A run session: a controller that answers; `pace` is None unless this process started it. `note` takes lines for
    the user.
    """

    controller: Controller
    pace: str | None
    rig: SimulatedMachine | None
    note: Callable[[str], None] = _silent


@contextmanager
def run_session(
    machine: Machine,
    address: BusAddress,
    pace: str,
    wait_s: float,
    note: Callable[[str], None],
    controller_program: str | None = None,
) -> Iterator[RunSession]:
    """A session with the machine's controller on this bus. On a virtual bus without a controller a simulated machine is
    started.

    `controller_program`: command of its controller in place of hodograph-controller.

    On an interrupt, and on an error after a motion of this session, the axes are stopped. Started processes are ended.
    """
    with ExitStack() as stack:
        controller = stack.enter_context(connect(address, machine.node, machine.bitrate))
        rig = None
        answered = is_virtual(address) and controller.answers(0.3)
        if is_virtual(address) and not answered and not controller.is_heard:
            rig = stack.enter_context(SimulatedMachine(machine, address, pace, controller_program))
            _await_rig(controller, rig, max(wait_s, 5.0))
        elif not answered:
            controller.require(wait_s)
        if rig is None:
            controller.require_standing()
            note(f"node {machine.node} is on {address} already: using it and its drives")
        try:
            yield RunSession(controller, pace if rig is not None else None, rig, note)
        except BaseException as error:
            controller.stop_after(error)
            raise
        if rig is not None:
            with suppress(HodographError):
                controller.command(DISABLE)


def _await_rig(controller: Controller, rig: SimulatedMachine, wait_s: float) -> None:
    deadline = controller.clock.now_s() + wait_s
    while not controller.answers(0.25):
        rig.check()
        if controller.clock.now_s() > deadline:
            raise BusError(f"the controller started here does not answer within {wait_s:g} s")


def run_program(
    at: RunSession,
    machine: Machine,
    image: bytes,
    kernel: str,
    progress: Progress | None = None,
    record: Path | None = None,
    *,
    unhomed: bool = False,
    on: Machine | None = None,
    start: list[int] | None = None,
) -> BusRun:
    """Moves to the start of a program image, runs it, and analyses the recording, which is kept in `record`.

    unhomed    also if axes with a homing method are not homed
    on, start  the machine with all axes of its path, and their start in counts; None: those of the program

    Raises RefusedError, BusError, and RunError when the recording is incomplete, a setpoint jumps, or the setpoints are
    not those that the same kernel gives here.
    """
    whole = on or machine
    if start is None:
        start = NativeProgram(image).counts_at(kernel, machine.path_counts)
    with at.controller.ending_at_stops():
        bring_up(at, whole, kernel)
        goto(at.controller, whole, start, unhomed=unhomed)
        recorded = record_program(at, machine, image, progress, unhomed=unhomed)
    return analysed(at, machine, image, kernel, recorded, record)


def bring_up(at: RunSession, machine: Machine, kernel: str, override: int = FULL_OVERRIDE) -> None:
    """Configures the controller, sets the feed override (per cent) and switches the drives on."""
    at.controller.configure(machine, kernel)
    at.controller.override(override)
    switch_on(at.controller, machine)


@dataclass(frozen=True, eq=False)
class Recorded:
    """The frames from shortly before a program's start until its axes have settled.

    dropped  frames that the Linux kernel dropped
    misses   deadline misses of the controller
    took_s   from the start to standstill, by the clock of the bus
    """

    frames: Frames
    dropped: int
    misses: int
    took_s: float


def record_program(
    at: RunSession,
    machine: Machine,
    image: bytes,
    progress: Progress | None = None,
    *,
    unhomed: bool = False,
    outputs_stay: bool = False,
) -> Recorded:
    """Uploads a program at whose start the axes stand, starts it, and waits until they stand again. `outputs_stay`:
    the outputs stay on at its end, although the configuration switches them off there.

    Raises RefusedError, BusError, and RunError for a fault.
    """
    controller = at.controller
    controller.upload(image)
    with Recorder(controller.address) as recorder:
        _await_syncs(controller, _REST_TICKS if machine.outputs is None else _OUTPUTS_TICKS)
        begun_s = controller.clock.now_s()
        controller.start(unhomed=unhomed, image=image, outputs_stay=outputs_stay)
        _follow(at, progress)
        took_s = controller.clock.now_s() - begun_s
        after = settling_ticks(machine.period_us) + REACHED_AFTER + _MARGIN_TICKS
        _await_syncs(controller, after)
    misses = controller.read(STATISTICS, _MISSES)  # of this run: start sets it to 0
    return Recorded(recorder.frames(), recorder.dropped, misses, took_s)


def analysed(
    at: RunSession,
    machine: Machine,
    image: bytes,
    kernel: str,
    recorded: Recorded,
    record: Path | None = None,
) -> BusRun:
    """The run that was recorded; its frames are kept in `record`. Raises RunError as `run_program` does."""
    if recorded.dropped:
        raise RunError(
            f"the kernel dropped {recorded.dropped} frames of the recording: run again, as root if you can "
            "(larger receive buffer)"
        )
    frames = recorded.frames
    if record is not None:
        write_recording(record, frames, at.controller.address.name)
    motion, load = analyse_recording(frames, image, machine, kernel)
    return BusRun(
        motion=motion,
        bus=str(at.controller.address),
        deadline_misses=recorded.misses,
        pace=at.pace or measured_pace(motion, recorded.took_s),
        frames=int(frames.size),
        wall_s=recorded.took_s,
        load=load,
        unhomed_starts=unhomed_starts(frames, machine.node),
    )


def _follow(at: RunSession, progress: Progress | None) -> None:
    controller, follower = at.controller, Follower(at.controller, at.note)

    def tick() -> None:
        if at.rig is not None:
            at.rig.check()
        if progress is not None:
            progress(controller.read(STATISTICS, _TICK))
        follower()

    controller.wait_for_end(tick=tick)


def _await_syncs(controller: Controller, count: int) -> None:
    end = controller.read(STATISTICS, _SYNCS) + count
    deadline = controller.clock.now_s() + 30.0
    while controller.read(STATISTICS, _SYNCS) < end:
        if controller.clock.now_s() > deadline:
            raise BusError("the controller has stopped sending SYNC: see hodograph status")
        controller.clock.sleep(0.01)


def rig_until_interrupted(
    machine: Machine,
    address: BusAddress,
    pace: str,
    kernel: str,
    note: Callable[[str], None],
    controller_program: str | None = None,
) -> None:
    """Controller and drives on a virtual bus, configured, until Ctrl-C."""
    check_raw(address)
    if not is_virtual(address):
        raise BusError(f"{address}: not a virtual CAN: a simulated machine stays off real buses")
    with connect(address, machine.node, machine.bitrate) as controller:
        if controller.answers(0.3) or controller.is_heard:
            raise BusError(f"{address}: node {machine.node} is there already: end it first")
        with SimulatedMachine(machine, address, pace, controller_program) as rig:
            _await_rig(controller, rig, 5.0)
            controller.configure(machine, kernel)
            names = ", ".join(f"{axis.name} (node {axis.node})" for axis in machine.axes)
            note(f"node {machine.node} and the drives {names} are on {address}; Ctrl-C ends them")
            try:
                while True:
                    rig.check()
                    controller.clock.sleep(0.2)
            except KeyboardInterrupt:
                with interrupts_ignored(), suppress(HodographError):
                    controller.stop_and_wait()
