# SPDX-License-Identifier: MIT
"""The controller node as an object: configuration, programs, commands, state.

Speaks SDO through python `canopen` and the controller's EDS; objects are those of docs/protocol.md section 3.
Every failure is a BusError (nothing or nonsense comes back) or a RefusedError (it said no, and why).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ...data import CONTROLLER_EDS
from ...errors import BusError, RefusedError, RunError, one_line
from ..address import BusAddress
from ..words.texts import PROGRAM_STATES, REFUSALS, STATES, detail_text, fault_text, fault_words
from .configuration import configuration
from .network import open_network
from .node import Node
from .objects import (
    AXIS_NODE,
    BOOT,
    BUSY,
    COMMAND,
    CONFIGURATION,
    DISABLE,
    ENABLE,
    ENABLING,
    FAULT,
    FAULT_STATE,
    HELD,
    HOLD,
    HOLDING,
    HOMING,
    MOVING,
    OFF,
    ON_PATH,
    OVERRIDE,
    PROGRAM,
    READY,
    REFUSED_MOVING,
    RESET,
    RESUME,
    RUNNING,
    START,
    START_FROM,
    START_POSITION,
    STATE,
    STATISTICS,
    STOP,
    TARGET,
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
]

POLL_S = 0.02


class Controller(Node):
    """A connection to the controller node; made by `connect`."""

    # -- configuration ------------------------------------------------------------------------

    def configure(self, machine: Machine, kernel: str) -> bool:
        """Brings the controller's configuration to that of the machine file.

        Writes only what differs; switches the drives off for that when they stand still. Returns whether anything
        was written. Raises RefusedError while moving.
        """
        wanted = configuration(machine, kernel)
        different = [(key, value) for key, value in wanted if self.read(*key) != value]
        if not different:
            return False
        state = self.state()
        if state in (*BUSY, ENABLING):
            raise RefusedError(
                f"{self.who()} is {STATES.get(state, state)} with another configuration: hodograph stop first"
            )
        if state == READY:
            self.command(DISABLE)
            self.wait_for((OFF, BOOT), 5.0)
        for key, value in different:
            self.write(*key, value)
        return True

    # -- programs -----------------------------------------------------------------------------

    def upload(self, image: bytes, progress: Progress | None = None) -> None:
        """Sends a program image by block download; on a refusal the old program stays.

        `progress` is called with the number of bytes sent so far.
        """
        upload(self, image, progress)

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
            self.patiently(COMMAND, None, lambda: self._give(command))
        except SdoAbortedError as error:
            reason = self.read(FAULT, 4)
            text = REFUSALS.get(reason, str(error))
            if reason == 5:
                text = self.fault_advice()
            raise CommandRefusedError(f"{self.who()} refused: {text}", reason) from error
        except SdoCommunicationError as error:
            raise BusError(f"{self.who()} stopped answering a command") from error

    def _give(self, command: int) -> None:
        self.sdo[COMMAND].raw = command

    def wait_for(
        self, states: tuple[int, ...], wait_s: float, tick: Callable[[], None] | None = None
    ) -> int:
        """Waits until the state is one of `states`; a fault meanwhile is a RunError, no progress a BusError.

        `tick` is called at every look. `wait_s` infinite: as long as it takes.
        """
        deadline = self.clock.now_s() + wait_s
        while True:
            state = self.state()
            if state in states:
                return state
            if state == FAULT_STATE:
                raise RunError(f"{self.who()} is in fault: {self.fault_advice()}")
            if self.clock.now_s() > deadline:
                names = " or ".join(STATES[s] for s in states)
                raise BusError(
                    f"{self.who()} is still {STATES.get(state, state)} after {wait_s:g} s, "
                    f"expected {names}: {self._waiting_for(state)}"
                )
            if tick is not None:
                tick()
            self.clock.sleep(POLL_S)

    def _waiting_for(self, state: int) -> str:
        if state in (BOOT, ENABLING):
            nodes = [self.read(AXIS_NODE, i + 1) for i in range(self.read(CONFIGURATION, 1))]
            return f"are the drives (nodes {', '.join(map(str, nodes))}) on the bus?"
        return _GOES_ON.get(state, "see hodograph status")

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

    def require_standing(self) -> None:
        """Raises RefusedError while axes move: that is somebody's doing, and goes on."""
        state = self.state()
        if state in BUSY:
            raise RefusedError(
                f"{self.who()} is {STATES.get(state, state)}: wait until the axes stand, or hodograph stop"
            )

    def enable(self) -> None:
        """Switches the drives on; returns at standstill, ready."""
        state = self.state()
        if state == BOOT:
            state = self.wait_for((OFF, READY), 10.0)
        if state in (OFF, FAULT_STATE):  # refused in a fault, with the reason
            self.command(ENABLE)
        self.wait_for((READY,), 10.0)

    def start(self, wait_s: float = 10.0, from_mm: float | None = None) -> None:
        """Starts the program, waiting as long as the axes are said to be still moving.

        `from_mm`: from rest at this arc length of the path, where the axes must stand.
        """
        if from_mm is not None:
            self.write(START_POSITION, None, round(from_mm * 2**40))
        deadline = self.clock.now_s() + wait_s
        while True:
            try:
                self.command(START if from_mm is None else START_FROM)
                return
            except CommandRefusedError as error:
                moving = self.state() in MOVING
                if error.reason != REFUSED_MOVING or moving or self.clock.now_s() > deadline:
                    raise
            self.clock.sleep(POLL_S)

    def stop_and_wait(self, wait_s: float = 10.0) -> None:
        """Controlled stop on the path; returns when the axes stand."""
        to_stop = (*ON_PATH, ENABLING, HOMING)
        if self.state() in to_stop:
            try:
                self.command(STOP)
            except CommandRefusedError:
                if self.state() in to_stop:
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


_GOES_ON = {
    HOLDING: "it goes on braking; hodograph status tells when it is held",
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
            raise BusError(f"{eds}: not a usable EDS file: {one_line(error)}") from error
        controller = Controller(address, node, remote, network.clock)
        try:
            yield controller
        finally:
            controller.close()
