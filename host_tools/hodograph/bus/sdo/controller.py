# SPDX-License-Identifier: MIT
"""The controller node as an object: configuration, programs, commands, state. Used by many modules of host_tools:
commands, the Python API, streaming, the live page, fault cases. Reads and writes its objects by SDO, and waits by the
clock of the bus, real or virtual.

Speaks SDO through python `canopen` and the controller's EDS; objects are those of docs/reference/protocol.md section 3.
Each failure is a BusError (no answer, or a wrong one) or a RefusedError (the controller refuses, with its reason).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ...data import CONTROLLER_EDS, object_dictionary
from ...errors import BusError, HodographError, InputError, RefusedError, RunError, one_line
from ...fixed_point import MM_PER_Q40, nearest_q40
from ..address import BusAddress
from ..clock import REAL_CLOCK, Clock
from ..diagnostics.boot_texts import BootTrouble, boot_trouble
from ..diagnostics.texts import (
    PROGRAM_STATES,
    REFUSALS,
    STATES,
    detail_text,
    fault_text,
    fault_words,
)
from ..signals import interrupts_ignored
from .configuration import configuration, configuration_crc32
from .job_lock import JobLock
from .network import open_network
from .node import BROKEN, IDENTITY_OBJECT, NO_OBJECT, Node
from .objects import (
    AT_ONCE,
    AXIS_NODE,
    BOOT,
    BOOT_TROUBLE,
    BUSY,
    COMMAND,
    CONFIGURATION,
    CONFIGURATION_STATE,
    DISABLE,
    ENABLE,
    ENABLING,
    EXPECTED_VENDOR,
    FAULT,
    FAULT_STATE,
    HELD,
    HOLD,
    HOLDING,
    HOME,
    HOMING,
    LOAD,
    MOTION,
    MOVING,
    NAMED_START,
    NODE_NUMBER,
    OFF,
    ON_PATH,
    OVERRIDE,
    PROGRAM,
    READY,
    REFUSED_MOVING,
    REFUSED_OTHER,
    REFUSED_STOPPED,
    RESET,
    RESTORE_DEFAULTS,
    RESUME,
    RUNNING,
    SAVE,
    STANDSTILL_OUTPUTS,
    START,
    START_FROM,
    START_POSITION,
    STATE,
    STATISTICS,
    STOP,
    STOP_COMMANDS,
    STORE,
    STREAM,
    TARGET,
    UNHOMED_START,
    Object,
)
from .upload import Progress, upload

if TYPE_CHECKING:
    from ...config import Machine

__all__ = [
    "BOOT",
    "DISABLE",
    "FAULT_STATE",
    "HELD",
    "HOLD",
    "OFF",
    "ON_PATH",
    "READY",
    "RESET",
    "RESUME",
    "RUNNING",
    "STATISTICS",
    "CommandRefusedError",
    "Controller",
    "connect",
    "lacks_object",
    "needs_standstill_outputs",
]

POLL_S = 0.02
ROUNDING_MM = 1e-6
"""A place may be beyond an end of the path by this, since arc lengths are copied from output with fewer digits."""


class Controller(Node):
    """A connection to the controller node; made by `connect`."""

    acted: bool = False
    """Whether a command of this connection may have set axes in motion, or switched outputs at standstill."""
    _stops: int | None = None
    """Stop commands at the beginning of a job; None: no job, or the controller does not count them."""

    def __init__(
        self, address: BusAddress, node_id: int, node: canopen.RemoteNode, clock: Clock = REAL_CLOCK
    ) -> None:
        super().__init__(address, node_id, node, clock)
        self._job = JobLock(address, node_id)

    def close(self) -> None:
        """Closes the locks."""
        self._job.close()
        super().close()

    # -- configuration ------------------------------------------------------------------------

    def configure(self, machine: Machine, kernel: str) -> bool:
        """Writes the configuration of the machine file to the controller, and confirms it.

        Only objects that differ are written; drives at standstill are switched off for that. Returns whether an object
        was written. Raises RefusedError: axes move.
        """
        wanted = configuration(machine, kernel)
        crc32 = configuration_crc32(wanted, self.sdo.od)
        if self.configuration_crc() == crc32:
            return False
        different = [(key, value) for key, value in wanted if self.read(*key) != value]
        if different:
            self._write_configuration(different)
        self._confirm(crc32)
        return bool(different)

    def _write_configuration(self, different: list[tuple[Object, int]]) -> None:
        self.require_no_other_job()
        state = self.state()
        if state in (*BUSY, ENABLING):
            raise RefusedError(
                f"{self.who()} is {STATES.get(state, state)} with another configuration: hodograph stop first"
            )
        if state == READY:
            self.command(DISABLE)
            self.wait_for((OFF, BOOT), 5.0)
            self._expect_no_stop()
        for key, value in different:
            self.write(*key, value)

    def _confirm(self, crc32: int) -> None:
        try:
            self.write(CONFIGURATION_STATE, 2, crc32)
        except RefusedError as error:
            raise RefusedError(
                f"{self.who()} does not hold the configuration that it was given: another command has changed it "
                "meanwhile (give this one again), or host tools and controller are of different versions (rebuild both)"
            ) from error

    def configuration_crc(self) -> int | None:
        """CRC-32 of the configuration that was confirmed, or restored after power-on; None: there is none."""
        return self.read(CONFIGURATION_STATE, 2) if self.read(CONFIGURATION_STATE, 3) else None

    def store(self) -> None:
        """Stores all parameters, so that they stay after a loss of power (0x1010)."""
        self._keep(STORE, SAVE, "stored")

    def restore_defaults(self) -> None:
        """Deletes the stored parameters: from the next power-on on the defaults apply (0x1011)."""
        self._keep(RESTORE_DEFAULTS, LOAD, "forgotten")

    def _keep(self, index: int, signature: int, done: str) -> None:
        state = self.state()
        if state not in (BOOT, OFF, FAULT_STATE):
            raise RefusedError(
                f"{self.who()} is {STATES.get(state, state)}: parameters are {done} with the drives off only: "
                "hodograph stop --off first"
            )
        try:
            self.write(index, 1, signature)
        except RefusedError as error:
            raise RefusedError(
                f"{error}: the memory of the controller did not take it, what was stored before stays"
            ) from error

    def set_node_number(self, number: int) -> None:
        """Sets the node number from the next power-on on; 0: the board's own. It has to be stored."""
        self.write(NODE_NUMBER, None, number)

    # -- programs -----------------------------------------------------------------------------

    def upload(self, image: bytes, progress: Progress | None = None) -> None:
        """Sends a program image by block download; on a refusal the old program stays.

        `progress` is called with the number of bytes sent so far.
        """
        upload(self, image, progress)

    def program_crc(self) -> int | None:
        """CRC-32 of the active program, None when there is none."""
        return self.read(PROGRAM, 5) if self.read(PROGRAM, _STATE) == _READY else None

    # -- commands -----------------------------------------------------------------------------

    def state(self) -> int:
        """Object 0x2002."""
        return self.read(STATE)

    def command(self, command: int) -> None:
        """Sends a command; raises RefusedError with the controller's reason. Commands to stop never wait for the
        channel. If the answer is lost, the state shows whether the command has been executed.
        """
        self._give(command, COMMAND, None, command)

    def _give(self, command: int, index: int, sub: int | None, value: int) -> None:
        """A command, given by writing this value to an object."""
        acted, self.acted = self.acted, self.acted or command in _SETS_IN_MOTION
        try:
            if command in AT_ONCE:
                self.write_at_once(index, value)
            else:
                self.patiently(index, sub, lambda: self._put(index, sub, value))
        except SdoAbortedError as error:
            if error.code in BROKEN:
                self._require_executed(command, error)
                return
            self.acted = acted
            if index == NAMED_START and error.code in NO_OBJECT:
                raise
            reason = self.read(FAULT, 4)
            text = REFUSALS.get(reason, str(error))
            if reason == 5:
                text = self.fault_advice()
            raise CommandRefusedError(f"{self.who()} refused: {text}", reason) from error
        except SdoCommunicationError as error:
            self._require_executed(command, error)

    def _require_executed(self, command: int, cause: Exception) -> None:
        """After a lost answer, or a transfer that broke off. Raises BusError: the state does not show that the command
        has been executed.
        """
        state = self.state()
        if state in _EXECUTED.get(command, ()):
            return
        if command in _TWICE:
            with suppress(SdoCommunicationError):
                self.patiently(COMMAND, None, lambda: self._put(COMMAND, None, command))
                return
        raise BusError(
            f"{self.who()} did not answer a command and is {STATES.get(state, state)}: the command did not reach it, "
            "or what it began is over already: see hodograph status"
        ) from cause

    def wait_for(
        self, states: tuple[int, ...], wait_s: float, tick: Callable[[], None] | None = None
    ) -> int:
        """Waits until the state is one of `states`. `tick` is called at each poll. `wait_s` infinite: without a limit.

        Raises RunError: a fault occurred. Raises BusError: the state is not reached in time.
        """
        deadline = self.clock.now_s() + wait_s
        while True:
            state = self.state()
            if state in states:
                return state
            if state == FAULT_STATE:
                raise self.fault_error()
            if self.clock.now_s() > deadline:
                names = " or ".join(STATES[s] for s in states)
                raise BusError(
                    f"{self.who()} is still {STATES.get(state, state)} after {wait_s:g} s, "
                    f"expected {names}: {self._waiting_for(state)}"
                )
            if tick is not None:
                tick()
            self.clock.sleep(POLL_S)

    def wait_for_end(
        self, wait_s: float = math.inf, tick: Callable[[], None] | None = None
    ) -> None:
        """Waits until a motion that was started is over: returns in state ready. `wait_s` and `tick` as for `wait_for`.

        Raises RunError: a fault, or the drives are off. Raises BusError: the motion is not over in time.
        """
        if self.wait_for((READY, OFF, BOOT), wait_s, tick) != READY:
            raise RunError(
                f"{self.who()}: the drives were switched off on the way, by a quick stop of another command or a "
                "restart of the controller: hodograph status, then hodograph goto"
            )

    def require_program_end(self) -> None:
        """Raises RunError: the motion is over, but the axes stand before the end of the program in the controller. Says
        nothing of a streamed job.
        """
        if self._read_if_there(STREAM, 2) or self.read(PROGRAM, _STATE) != _READY:
            return
        place_mm, end_mm = (self.read(*at) * MM_PER_Q40 for at in ((MOTION, 1), (PROGRAM, _LENGTH)))
        if place_mm < end_mm - ROUNDING_MM:
            raise RunError(
                f"{self.who()}: the program was stopped at {place_mm:.3f} of {end_mm:.3f} mm, before its end"
            )

    def _waiting_for(self, state: int) -> str:
        if state == BOOT and (trouble := self.boot_trouble()) is not None:
            return f"{trouble.text}: {trouble.remedy}"
        if state in (BOOT, ENABLING):
            nodes = [self.read(AXIS_NODE, i + 1) for i in range(self.read(CONFIGURATION, 1))]
            return f"are the drives (nodes {', '.join(map(str, nodes))}) on the bus?"
        return _GOES_ON.get(state, "see hodograph status")

    def boot_trouble(self) -> BootTrouble | None:
        """The reason why the drives are not found and configured; None: there is none, or it is not known."""
        node, place, abort_code, value = (self.read(BOOT_TROUBLE, sub) for sub in (1, 2, 3, 4))
        expected = None
        if place >> 8 == IDENTITY_OBJECT and abort_code == 0:
            axes = range(1, self.read(CONFIGURATION, 1) + 1)
            nodes = {self.read(AXIS_NODE, axis): axis for axis in axes}
            if node in nodes:
                expected = self.read(EXPECTED_VENDOR - 1 + (place & 0xFF), nodes[node])
        return boot_trouble(node, place, abort_code, value, expected)

    def fault_text(self) -> str:
        """The present fault in words."""
        code, node, detail = (self.read(FAULT, sub) for sub in (1, 2, 3))
        more = detail_text(code, detail)
        where = f"node {node}" if node else "the controller"
        return f"{fault_text(code)} (code 0x{code:04X}, {where}{', ' if more else ''}{more})"

    def fault_advice(self) -> str:
        """The present fault and what to do."""
        remedy = fault_words(self.read(FAULT, 1)).remedy
        return f"{self.fault_text()}: {remedy}; then hodograph reset"

    def fault_error(self) -> RunError:
        """The error for the present fault."""
        return RunError(f"{self.who()} is in fault: {self.fault_advice()}")

    def require_standing(self) -> None:
        """Raises RefusedError: axes move by another command, or its job rests. It is not interrupted."""
        state = self.state()
        if state in BUSY:
            raise RefusedError(
                f"{self.who()} is {STATES.get(state, state)}: wait until the axes stand, or hodograph stop"
            )
        self.require_no_other_job()

    def require_no_other_job(self) -> None:
        """Raises RefusedError: another command of this computer runs a job, which may rest now."""
        with self.turn():
            self._job.require_free()

    def state_after_boot(self) -> int:
        """The state. Waits while it is boot: until the drives are configured. Raises as `wait_for`."""
        state = self.state()
        return self.wait_for((OFF, READY), 10.0) if state == BOOT else state

    def enable(self) -> None:
        """Switches the drives on; returns at standstill, ready. Raises RunError: a stop within `ending_at_stops`."""
        state = self.state_after_boot()
        if state in (OFF, FAULT_STATE):  # refused in a fault, with the reason
            self.command(ENABLE)
        self.wait_for((READY,), 10.0, self.require_no_stop)

    def start(
        self,
        wait_s: float = 10.0,
        from_mm: float | None = None,
        *,
        unhomed: bool = False,
        image: bytes | None = None,
        job: int | None = None,
        outputs_stay: bool = False,
    ) -> None:
        """Starts the program, or the streamed job, after waiting while the controller reports that axes still move.

        from_mm  start at this arc length of the path, where the axes have to stand
        unhomed  also if axes with a homing method are not homed
        image    the program that was uploaded to be started; None: any
        job      number of the streamed job to be started; None: any
        outputs_stay  the outputs stay on at the end, although the configuration switches them off there

        Raises InputError: the path does not have the place. Raises RefusedError: another program or job is there.
        Raises RunError: a stop command came since `ending_at_stops` began.
        """
        if from_mm is not None:
            self._require_place(from_mm)
            self.write(START_POSITION, None, nearest_q40(from_mm))
        deadline = self.clock.now_s() + wait_s
        while True:
            try:
                with self.turn():
                    self._permit(unhomed=unhomed, outputs_stay=outputs_stay)
                    self._start(START if from_mm is None else START_FROM, image, job)
                return
            except CommandRefusedError as error:
                if error.reason == REFUSED_OTHER:
                    raise RefusedError(self._other_text()) from error
                if error.reason == REFUSED_STOPPED:
                    raise RunError(self._stopped_text()) from error
                moving = self.state() in MOVING
                if error.reason != REFUSED_MOVING or moving or self.clock.now_s() > deadline:
                    raise
            self.clock.sleep(POLL_S)

    def _permit(self, *, unhomed: bool, outputs_stay: bool) -> None:
        """What holds for one attempt to start, that of any client."""
        if unhomed:
            self.write(UNHOMED_START, 1, 1)
        if self._stops is not None:
            self.write(STOP_COMMANDS, 2, self._stops)
        if outputs_stay:
            with needs_standstill_outputs(self):
                self.write(STANDSTILL_OUTPUTS, _STAY_AT_END, 1)

    def _start(self, command: int, image: bytes | None, job: int | None) -> None:
        """One attempt. The start names its program or job, since a client on another computer may replace it at any
        time.
        """
        if image is None and job is None:
            self.command(command)
            return
        sub = _NAMED_JOB if image is None else _NAMED_PROGRAM[command]
        number = job if image is None else zlib.crc32(image[_PREFIX:])
        try:
            self._give(command, NAMED_START, sub, int(number or 0))
        except SdoAbortedError:  # a controller of an older minor version
            if image is not None and self.program_crc() != number:
                raise RefusedError(self._other_text()) from None
            self.command(command)

    def _other_text(self) -> str:
        return (
            f"{self.who()}: another command has loaded another program meanwhile, nothing was started: "
            "wait until it is done, then give this command again"
        )

    def _require_place(self, arc_length_mm: float) -> None:
        """Checks a place on the path; the controller takes one just beyond an end of the path as this end."""
        if self.read(PROGRAM, _STATE) != _READY:
            return  # it refuses the start with a reason
        length_mm = self.read(PROGRAM, _LENGTH) * MM_PER_Q40
        if not -ROUNDING_MM <= arc_length_mm <= length_mm + ROUNDING_MM:
            raise InputError(
                f"start from {arc_length_mm:.9g} mm: the path has arc lengths from 0 to {length_mm:.9g} mm"
            )

    @contextmanager
    def ending_at_stops(self) -> Iterator[None]:
        """For the length of a job: a stop command of any client also ends it where the axes stand, for example in a
        dwell. Then no start succeeds, and `require_no_stop` raises. Begins before the drives are switched on. Other
        commands of this computer that would move the axes meanwhile are refused. Raises RefusedError: another one runs
        a job.
        """
        with ExitStack() as stack:
            with self.turn():
                stack.enter_context(self._job.held())
            self._stops = self._stop_commands()
            try:
                yield
            finally:
                self._stops = None

    def _stop_commands(self) -> int | None:
        """The number of stop commands so far; None: the controller does not count them."""
        return self._read_if_there(STOP_COMMANDS, 1)

    def _read_if_there(self, index: int, sub: int) -> int | None:
        """The value of an object; None: a controller of an older minor version does not have it."""
        try:
            return self.read(index, sub)
        except RefusedError as error:
            if not lacks_object(error):
                raise
            return None

    def _expect_no_stop(self) -> None:
        """After a command of this connection that the controller counts as a stop: it does not end the job."""
        if self._stops is not None:
            self._stops = self.read(STOP_COMMANDS, 1)

    def require_no_stop(self) -> None:
        """Raises RunError: a stop command came since `ending_at_stops` began."""
        if self._stops is not None and self.read(STOP_COMMANDS, 1) != self._stops:
            raise RunError(self._stopped_text())

    def _stopped_text(self) -> str:
        return f"{self.who()}: a stop was commanded while the axes stood: the job ends here"

    def let_outputs_end(self) -> None:
        """Takes `outputs_stay` of `start` back while the motion lasts."""
        self.write(STANDSTILL_OUTPUTS, _STAY_AT_END, 0)

    def stop_and_wait(self, wait_s: float = 10.0) -> None:
        """Controlled stop on the path; returns when the axes stand. At standstill it switches the outputs off."""
        self.command(STOP)
        self.wait_for((BOOT, OFF, READY), wait_s)

    def stop_after(self, error: BaseException) -> None:
        """Stops the axes after an error or an interrupt, and switches outputs off. If this connection has not begun a
        motion and has not switched outputs, nothing is stopped after an error: what moves then is the motion of another
        command.
        """
        if isinstance(error, HodographError) and not self.acted:
            return
        with interrupts_ignored(), suppress(HodographError):
            self.stop_and_wait()

    def override(self, percent: int) -> None:
        """Sets the feed override, 0 to 200 per cent, for this and later programs."""
        self.write(OVERRIDE, 1, percent)

    def targets(self, axes: int) -> list[int]:
        """Target positions of the drives, in counts."""
        return [self.read(TARGET, i + 1) for i in range(axes)]

    def statistics(self) -> dict[str, int]:
        """Object 0x2008 by name."""
        return {name: self.read(STATISTICS, i + 1) for i, name in enumerate(_STATISTICS)}

    def program_summary(self) -> dict[str, Any]:
        """Object 0x2000 by name."""
        state = self.read(PROGRAM, _STATE)
        return {"state": PROGRAM_STATES.get(state, str(state))} | {
            name: self.read(PROGRAM, sub) for name, sub in _PROGRAM
        }

    def longest_stops(self) -> dict[str, dict[str, int]]:
        """The longest stop of the program of each kind, "hold" and "fault", by name; zeros without a program."""
        return {
            kind: {name: self.read(PROGRAM, first + i) for i, name in enumerate(_LONGEST)}
            for kind, first in (("hold", 16), ("fault", 20))
        }


_GOES_ON = {
    HOLDING: "it goes on braking; hodograph status shows when it is held",
    RUNNING: "the program goes on; hodograph stop ends it",
}
_STATISTICS = (
    "syncs",
    "tick",
    "deadline_misses",
    "worst_lateness_us",
    "worst_tick_ns",
    "missed_tpdos",
    "frames_not_sent",
)
_STATE, _READY, _LENGTH = 2, 2, 11
"""Of PROGRAM: subindex of its state and the state of a whole program, subindex of the length."""
_PROGRAM = (
    ("refused_code", 3),
    ("refused_index", 4),
    ("crc32", 5),
    ("size", 6),
    ("segments", 7),
    ("pieces", 8),
    ("ticks", 9),
    ("duration_q32_s", 10),
    ("length_q40_mm", 11),
    ("start_x_counts", 12),
    ("start_y_counts", 13),
    ("end_x_counts", 14),
    ("end_y_counts", 15),
)
_SETS_IN_MOTION = (START, START_FROM, HOME, RESUME)
_EXECUTED = {
    ENABLE: (ENABLING, READY),
    START: MOVING,
    START_FROM: MOVING,
    RESUME: (RUNNING,),
    DISABLE: (OFF, BOOT),
    RESET: (OFF, BOOT),
    HOME: (HOMING,),
}
"""States that show that a command without an answer has been executed."""
_TWICE = (ENABLE, DISABLE, RESET)
"""Commands that may be given again: the second one changes nothing more."""
_NAMED_PROGRAM, _NAMED_JOB = {START: 1, START_FROM: 2}, 3
"""Subindices of NAMED_START."""
_STAY_AT_END = 6
"""Subindex of STANDSTILL_OUTPUTS."""
_OUTPUTS_SINCE = "1.2"
"""First firmware version (0x1018 sub 3) with STANDSTILL_OUTPUTS."""
_PREFIX = 16
"""Bytes of a program image that its CRC-32 does not cover."""
_LONGEST = ("time_us", "distance_um", "piece", "place_um")
"""Of PROGRAM from sub 16 on for holds, from sub 20 on for fault stops."""


class CommandRefusedError(RefusedError):
    """The controller refused a command; `reason` is object 0x2003 sub 4."""

    def __init__(self, message: str, reason: int) -> None:
        super().__init__(message)
        self.reason = reason


@contextmanager
def needs_standstill_outputs(node: Node) -> Iterator[None]:
    """Uses STANDSTILL_OUTPUTS inside the context. Raises RefusedError: the firmware does not have this object."""
    try:
        yield
    except RefusedError as error:
        if not lacks_object(error):
            raise
        revision = node.read(IDENTITY_OBJECT, 3)
        raise RefusedError(
            f"{node.who()} has firmware version {revision >> 16}.{revision & 0xFFFF}, and outputs that are switched or "
            f"kept on at standstill need {_OUTPUTS_SINCE} or later: install the firmware of these host tools on the "
            "controller (docs/guides/flash-and-run.md)"
        ) from error


def lacks_object(error: RefusedError) -> bool:
    """Whether an object is missing: the controller is of an older minor version."""
    cause = error.__cause__
    return isinstance(cause, SdoAbortedError) and cause.code in NO_OBJECT


@contextmanager
def connect(
    address: BusAddress, node: int, bitrate: int, eds: Path | None = None
) -> Iterator[Controller]:
    """Opens the bus for talking to one controller. The node need not be there yet."""
    eds = eds or CONTROLLER_EDS
    with open_network(address, node, bitrate) as network:
        try:
            remote = network.add_node(node, object_dictionary(eds, node))
        except Exception as error:
            raise BusError(f"{eds}: not a usable EDS file: {one_line(error)}") from error
        controller = Controller(address, node, remote, network.clock)
        try:
            yield controller
        finally:
            controller.close()
