# SPDX-License-Identifier: MIT
"""The controller node as an object: configuration, programs, commands, state.

Speaks SDO through python `canopen` and the controller's EDS; objects are those of docs/protocol.md section 3.
Every failure is a BusError (nothing or nonsense comes back) or a RefusedError (it said no, and why).
"""

from __future__ import annotations

import os
import queue
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import can
import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ..data import CONTROLLER_EDS
from ..errors import BusError, RefusedError, RunError
from ..names import KERNELS
from .address import BusAddress
from .network import open_network
from .texts import PROGRAM_STATES, REFUSALS, STATES, fault_text
from .turns import TURN_WAIT_S, Turns

if TYPE_CHECKING:
    from ..config import Machine

DEVICE_TYPE, PERIOD = 0x1000, 0x1006
PROGRAM, COMMAND, STATE, FAULT = 0x2000, 0x2001, 0x2002, 0x2003
CONFIGURATION, AXIS_NODE, TRAVEL_MINIMUM, TRAVEL_MAXIMUM = 0x2004, 0x2005, 0x2006, 0x2007
STATISTICS, MOTION = 0x2008, 0x2009
STATUSWORD, ACTUAL, DRIVE_ERROR, TARGET = 0x200A, 0x200B, 0x200C, 0x200D
OVERRIDE, START_POSITION = 0x2010, 0x2011

ENABLE, START, STOP, DISABLE, RESET, HOLD, RESUME, START_FROM = 1, 2, 3, 4, 5, 6, 7, 8
BOOT, OFF, ENABLING, READY, RUNNING, STOPPING, FAULT_STATE, HOLDING, HELD = range(9)
ON_PATH = (RUNNING, HOLDING, HELD)
"""States in which a stop has something to stop."""
REFUSED_MOVING = 3

ABORT_VALUE_RANGE, ABORT_STATE = 0x06090030, 0x08000022
IDENTITY_OBJECT = 0x1018
IDENTITY = ((1, "vendor", 0), (2, "product code", 0), (3, "revision", 16))
"""Sub-index, name, low bits that may differ (the minor revision)."""

POLL_S = 0.02
NOWHERE = 0x5000
LET_PASS_S = 1.0


class Controller:
    """A connection to the controller node; made by `connect`."""

    def __init__(self, address: BusAddress, node_id: int, node: canopen.RemoteNode) -> None:
        self.address = address
        self.node_id = node_id
        self._turns = Turns(address, node_id)
        self._identified = False
        self._sdo: Any = node.sdo
        self._sdo.RESPONSE_TIMEOUT = 3.0

    def close(self) -> None:
        """Gives back what was opened for taking turns."""
        self._turns.close()

    @contextmanager
    def _turn(self, wait_s: float = TURN_WAIT_S) -> Iterator[None]:
        with self._turns.turn(wait_s) as handed_over:
            if handed_over:
                self._let_pass()
            yield

    def _let_pass(self) -> None:
        """Throws away answers to another process: all that come before the answer to a question only we ask.

        The question is for an object that does not exist, so the answer is an abort that names it.
        """
        index = NOWHERE | (os.getpid() & 0xFFF)
        self._sdo.send_request(bytearray(struct.pack("<BHBL", 0x40, index, 0, 0)))
        deadline = time.monotonic() + LET_PASS_S
        with suppress(queue.Empty):
            while (left := deadline - time.monotonic()) > 0:
                answer = self._sdo.responses.get(timeout=left)
                if struct.unpack_from("<H", answer, 1)[0] == index:
                    return

    def read(self, index: int, sub: int | None = None) -> int:
        """An integer object."""
        return int(self._guarded(lambda: self._variable(index, sub).raw, index, sub))

    def write(self, index: int, sub: int | None, value: int) -> None:
        """Writes an integer object. A refusal is an SdoAbortedError's text in a RefusedError."""

        def action() -> None:
            self._variable(index, sub).raw = value

        self._guarded(action, index, sub)

    def _variable(self, index: int, sub: int | None) -> Any:
        return self._sdo[index] if sub is None else self._sdo[index][sub]

    def _guarded(self, action: Callable[[], Any], index: int, sub: int | None) -> Any:
        try:
            with self._turn():
                return action()
        except SdoAbortedError as error:
            raise RefusedError(
                f"{self._who()} refused object {_name(index, sub)}: {error}"
            ) from error
        except SdoCommunicationError as error:
            raise BusError(
                f"{self._who()} stopped answering (object {_name(index, sub)}): "
                "is its process or its power gone?"
            ) from error
        except KeyError as error:
            raise BusError(
                f"the EDS file has no object {_name(index, sub)}: wrong version?"
            ) from error
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.address}: cannot send: {_one_line(error)}") from error

    def _who(self) -> str:
        return f"node {self.node_id} on {self.address}"

    def answers(self, wait_s: float, turn_wait_s: float = TURN_WAIT_S) -> bool:
        """Whether the node answers an SDO within `wait_s`.

        Raises BusError when another command keeps it to itself for longer than `turn_wait_s`.
        """
        patience, self._sdo.RESPONSE_TIMEOUT = self._sdo.RESPONSE_TIMEOUT, min(0.25, wait_s)
        deadline = time.monotonic() + wait_s
        try:
            while True:
                try:
                    with self._turn(turn_wait_s):
                        self._variable(STATE, None).raw  # noqa: B018
                    self._check_identity()
                    return True
                except SdoAbortedError as error:
                    raise BusError(
                        f"{self._who()} is not a Hodograph controller: {error}"
                    ) from error
                except SdoCommunicationError:
                    if time.monotonic() >= deadline:
                        return False
                except (can.CanError, OSError) as error:
                    raise BusError(f"{self.address}: cannot send: {_one_line(error)}") from error
        finally:
            self._sdo.RESPONSE_TIMEOUT = patience

    def _check_identity(self) -> None:
        """Raises BusError when the node is not what the EDS file describes."""
        if self._identified:
            return
        for sub, name, kept in IDENTITY:
            wanted = int(self._sdo.od[IDENTITY_OBJECT][sub].default or 0) >> kept
            found = self.read(IDENTITY_OBJECT, sub)
            if found >> kept != wanted:
                raise BusError(
                    f"{self._who()} has {name} {found:#x}, the EDS file of these host tools {wanted << kept:#x}: "
                    "controller and host tools are of different versions, rebuild both"
                )
        self._identified = True

    def require(self, wait_s: float) -> None:
        """Raises BusError unless the node, and before it our turn at it, comes within `wait_s`."""
        if not self.answers(wait_s, wait_s):
            raise BusError(
                f"no answer from {self._who()} in {wait_s:g} s: start the controller "
                f"(hodograph rig --bus {self.address} brings up a simulated machine)"
            )

    # -- configuration ------------------------------------------------------------------------

    def configure(self, machine: Machine, kernel: str) -> bool:
        """Brings the controller's configuration to that of the machine file.

        Writes only what differs; switches the drives off for that when they stand still. Returns whether anything
        was written. Raises RefusedError while moving.
        """
        wanted = _configuration(machine, kernel)
        different = [(key, value) for key, value in wanted if self.read(*key) != value]
        if not different:
            return False
        state = self.state()
        if state in (*ON_PATH, STOPPING, ENABLING):
            raise RefusedError(
                f"{self._who()} is {STATES[state]} with another configuration: hodograph stop first"
            )
        if state == READY:
            self.command(DISABLE)
            self.wait_for((OFF, BOOT), 5.0)
        for key, value in different:
            self.write(*key, value)
        return True

    # -- programs -----------------------------------------------------------------------------

    def upload(self, image: bytes, progress: Callable[[int], None] | None = None) -> None:
        """Sends a program image by block download; on a refusal the old program stays.

        `progress` is called with the number of bytes sent so far.
        """
        patience, self._sdo.RESPONSE_TIMEOUT = self._sdo.RESPONSE_TIMEOUT, 5.0
        try:
            with self._turn():
                self._block_download(image, progress)
        except SdoAbortedError as error:
            raise self._upload_refusal(error) from error
        except (SdoCommunicationError, RuntimeError) as error:
            raise BusError(
                f"upload to {self._who()} broke off: {_one_line(error)}: the old program is unharmed; "
                "upload again"
            ) from error
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.address}: cannot send: {_one_line(error)}") from error
        finally:
            self._sdo.RESPONSE_TIMEOUT = patience

    def _block_download(self, image: bytes, progress: Callable[[int], None] | None) -> None:
        stream = self._sdo.open(PROGRAM, 1, "wb", buffering=0, size=len(image), block_transfer=True)
        try:
            while stream.pos < len(image):
                stream.write(image[stream.pos : stream.pos + 7])
                if progress is not None:
                    progress(stream.pos)
        except BaseException as error:
            stream._initialized = False  # or close() would go on with the protocol
            if not isinstance(error, SdoAbortedError):
                self._sdo.abort()
            raise
        stream.close()

    def _upload_refusal(self, error: SdoAbortedError) -> RefusedError | BusError:
        if error.code == ABORT_STATE:
            return RefusedError(
                f"{self._who()} takes no program now ({STATES.get(self.state(), '?')}): "
                "wait until the axes stand, or hodograph stop"
            )
        if error.code != ABORT_VALUE_RANGE:
            return BusError(f"upload to {self._who()} failed: {error}: the old program stays")
        code, index = self.read(PROGRAM, 3), self.read(PROGRAM, 4)
        return RefusedError(
            f"{self._who()} refused the program: {program_fault_text(code, index)}; "
            "the old program stays"
        )

    def program_crc(self) -> int | None:
        """CRC-32 of the active program, None when there is none."""
        return self.read(PROGRAM, 5) if self.read(PROGRAM, 2) == 2 else None

    # -- commands -----------------------------------------------------------------------------

    def state(self) -> int:
        """Object 0x2002."""
        return self.read(STATE)

    def command(self, command: int) -> None:
        """Gives a command; raises RefusedError with the controller's reason."""
        try:
            with self._turn():
                self._sdo[COMMAND].raw = command
        except SdoAbortedError as error:
            reason = self.read(FAULT, 4)
            text = REFUSALS.get(reason, str(error))
            if reason == 5:
                text = f"{self.fault_text()}; fix the cause, then hodograph start --reset"
            raise CommandRefusedError(f"{self._who()} refused: {text}", reason) from error
        except SdoCommunicationError as error:
            raise BusError(f"{self._who()} stopped answering a command") from error
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.address}: cannot send: {_one_line(error)}") from error

    def wait_for(
        self, states: tuple[int, ...], wait_s: float, tick: Callable[[], None] | None = None
    ) -> int:
        """Waits until the state is one of `states`; a fault meanwhile is a RunError, no progress a BusError.

        `tick` is called at every look. `wait_s` infinite: as long as it takes.
        """
        deadline = time.monotonic() + wait_s
        while True:
            state = self.state()
            if state in states:
                return state
            if state == FAULT_STATE:
                raise RunError(f"{self._who()} is in fault: {self.fault_text()}")
            if time.monotonic() > deadline:
                names = " or ".join(STATES[s] for s in states)
                raise BusError(
                    f"{self._who()} is still {STATES.get(state, state)} after {wait_s:g} s, "
                    f"expected {names}: {self._waiting_for(state)}"
                )
            if tick is not None:
                tick()
            time.sleep(POLL_S)

    def _waiting_for(self, state: int) -> str:
        if state in (BOOT, ENABLING):
            nodes = [self.read(AXIS_NODE, i + 1) for i in range(self.read(CONFIGURATION, 1))]
            return f"are the drives (nodes {', '.join(map(str, nodes))}) on the bus?"
        return "see hodograph status"

    def fault_text(self) -> str:
        """The present fault in words."""
        code, node, detail = (self.read(FAULT, sub) for sub in (1, 2, 3))
        return f"{fault_text(code)} (code 0x{code:04X}, node {node}, detail {detail})"

    def enable(self) -> None:
        """Switches the drives on; returns at standstill, ready."""
        state = self.state()
        if state == BOOT:
            state = self.wait_for((OFF, READY), 10.0)
        if state == OFF:
            self.command(ENABLE)
        self.wait_for((READY,), 10.0)

    def start(self, wait_s: float = 10.0, from_mm: float | None = None) -> None:
        """Starts the program, waiting as long as the axes are said to be still moving.

        `from_mm`: from rest at this arc length of the path, where the axes must stand.
        """
        if from_mm is not None:
            self.write(START_POSITION, None, round(from_mm * 2**40))
        deadline = time.monotonic() + wait_s
        while True:
            try:
                self.command(START if from_mm is None else START_FROM)
                return
            except CommandRefusedError as error:
                moving = self.state() in (*ON_PATH, STOPPING)
                if error.reason != REFUSED_MOVING or moving or time.monotonic() > deadline:
                    raise
            time.sleep(POLL_S)

    def stop_and_wait(self, wait_s: float = 10.0) -> None:
        """Controlled stop on the path; returns when the axes stand."""
        if self.state() in (*ON_PATH, ENABLING):
            try:
                self.command(STOP)
            except CommandRefusedError:
                if self.state() in (*ON_PATH, ENABLING):
                    raise
        self.wait_for((BOOT, OFF, READY), wait_s)

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
        state = self.read(PROGRAM, 2)
        return {"state": PROGRAM_STATES.get(state, str(state))} | {
            name: self.read(PROGRAM, sub) for name, sub in _PROGRAM
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


class CommandRefusedError(RefusedError):
    """The controller refused a command; `reason` is object 0x2003 sub 4."""

    def __init__(self, message: str, reason: int) -> None:
        super().__init__(message)
        self.reason = reason


@contextmanager
def connect(
    address: BusAddress, node: int, bitrate: int, eds: Path | None = None
) -> Iterator[Controller]:
    """Opens the bus for talking to one controller. The node need not be there yet."""
    eds = eds or CONTROLLER_EDS
    with open_network(address, node, bitrate) as network:
        try:
            remote = network.add_node(node, str(eds))
        except Exception as error:
            raise BusError(f"{eds}: not a usable EDS file: {_one_line(error)}") from error
        controller = Controller(address, node, remote)
        try:
            yield controller
        finally:
            controller.close()


def _configuration(machine: Machine, kernel: str) -> list[tuple[tuple[int, int | None], int]]:
    counts = machine.counts_per_mm
    wanted: list[tuple[tuple[int, int | None], int]] = [
        ((PERIOD, None), machine.period_us),
        ((CONFIGURATION, 1), len(machine.axes)),
        ((CONFIGURATION, 2), round(machine.feed_mm_s * 1000)),
        ((CONFIGURATION, 3), round(machine.acceleration_mm_s2 * 1000)),
        ((CONFIGURATION, 4), round(machine.jerk_mm_s3)),
        ((CONFIGURATION, 5), KERNELS.index(kernel)),
        ((CONFIGURATION, 6), machine.start_tolerance_counts),
        ((CONFIGURATION, 7), counts),
    ]
    for i, axis in enumerate(machine.axes, start=1):
        wanted.append(((AXIS_NODE, i), axis.node))
        wanted.append(((TRAVEL_MINIMUM, i), round(axis.travel_min_mm * counts)))
        wanted.append(((TRAVEL_MAXIMUM, i), round(axis.travel_max_mm * counts)))
    return wanted


def program_fault_text(code: int, index: int) -> str:
    """A refusal code of program_check in words, with its place."""
    from ..program.check import Fault
    from ..program.codes import ProgramError

    try:
        fault = Fault(ProgramError(code), index)
    except ValueError:
        return f"code {code} at {index}, unknown to this version of the host tools"
    return f"{fault.code.text} ({fault.code.name}, code {code}, {fault.place})"


def _name(index: int, sub: int | None) -> str:
    return f"0x{index:04X}" if sub is None else f"0x{index:04X} sub {sub}"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
