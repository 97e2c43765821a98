# SPDX-License-Identifier: MIT
"""The controller by SDO, in a thread of its own: its state a few times a second, and the commands of browsers in
between.

A command does not wait until a state has been read: it is sent between two objects of it, and it breaks off the
transfer of a program. So does another client of the SDO channel that waits too long. A hold, a stop and a quick stop do
not wait for other commands either, nor for other clients of the controller's SDO channel. In virtual time the thread is
a participant, and its waits are counted in that time.

Used by monitor/session. Reads and writes objects of the controller by SDO; a participant is a process on a bus in
virtual time.
"""

from __future__ import annotations

import queue
import threading
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from typing import Any

import can
from canopen.sdo.exceptions import SdoAbortedError, SdoError

from ..bus.address import BusAddress
from ..bus.clock import Clock, VirtualClock
from ..bus.diagnostics.texts import STATES
from ..bus.sdo.controller import Controller
from ..bus.sdo.network import open_network
from ..bus.sdo.objects import (
    AT_ONCE,
    DISABLE,
    ENABLE,
    HOLD,
    HOME,
    MOTION,
    OVERRIDE,
    PROGRAM,
    QUICK_STOP,
    RESET,
    RESUME,
    START,
    STOP,
)
from ..bus.sdo.status import read_status, stream_dict
from ..bus.sdo.stream_channel import ENDED, STOPPED
from ..data import CONTROLLER_EDS, object_dictionary
from ..errors import BusError, HodographError, InputError, RefusedError
from ..fixed_point import MM_PER_Q40
from .pump import Publish

PAUSE_S = 0.2
WHOLE_S = 1.5
"""Period of reading the state and moving values, and period of reading all values."""
_ANSWER_S = 3.0
"""Longest time until an answer of the controller."""
_RETRY_S = 1.0
"""Time between two attempts to connect."""
_OF_A_JOB = -1
"""In place of a CRC-32: the page shows the path of a streamed job."""
_MOVES = ("running", "holding", "held")
LONGEST_UPLOAD = 256 * 1024
"""A program up to this size is read from the controller and drawn; larger ones would occupy the bus for too long."""

PATIENCE_S = (3.0, 6.0, 12.0, 20.0)
"""How long another client of the SDO channel waits for the end of the transfer of a program, by attempt. It would give
up after TURN_WAIT_S, and a `run` would end by that.
"""

Command = Callable[[Controller], None]


class _Prompt(Controller):
    """A controller that calls a function before each object is read."""

    before_read: Callable[[], None]

    def read(self, index: int, sub: int | None = None) -> int:
        self.before_read()
        return super().read(index, sub)


class Link:
    """`show_program` is called with the image of the controller's program, or None and the reason. `given` is the image
    that is shown already.
    """

    def __init__(
        self,
        address: BusAddress,
        node: int,
        bitrate: int,
        publish: Publish,
        show_program: Callable[[bytes | None, str], None],
        given: bytes | None,
    ) -> None:
        self._address, self._node, self._bitrate = address, node, bitrate
        self._publish = publish
        self._show_program = show_program
        self._given = given
        self._given_crc32 = None if given is None else zlib.crc32(given[16:])
        self._crc32: int | None = self._given_crc32
        self._commands: queue.SimpleQueue[tuple[Command, Future[None]]] = queue.SimpleQueue()
        self._stops: queue.SimpleQueue[tuple[Command, Future[None]]] = queue.SimpleQueue()
        self._wake = threading.Event()
        self._ending = threading.Event()
        self._in_command = self._in_stop = False
        self._program_runs = False
        self._attempts = (0, 0)
        """CRC-32 of a program, and how often other clients have broken off its transfer."""
        self._clock: VirtualClock | None = None
        """Clock of the present connection in virtual time."""
        self._thread = threading.Thread(target=self._work, name="monitor-link", daemon=True)

    def start(self) -> None:
        """Starts the thread, which waits for the controller."""
        self._thread.start()

    def close(self) -> None:
        """Ends the thread; commands that wait fail."""
        self._ending.set()
        self._wake_up()
        if self._thread.is_alive():
            self._thread.join()
        self._fail_commands(BusError("the monitor has ended"))

    @property
    def alive(self) -> bool:
        """Whether the thread works; it ends by `close` alone."""
        return self._thread.is_alive()

    def submit(self, command: Command, *, at_once: bool = False) -> Future[None]:
        """Queues a command; the future gets a HodographError if the controller does not accept it.

        `at_once`: the controller accepts it at any time (AT_ONCE), so it overtakes the others.
        """
        done: Future[None] = Future()
        (self._stops if at_once else self._commands).put((command, done))
        self._wake_up()
        return done

    def _wake_up(self) -> None:
        """Wakes the thread."""
        self._wake.set()
        clock = self._clock
        if clock is not None:
            clock.interrupt()

    # -- in the thread ------------------------------------------------------------------------

    def _work(self) -> None:
        while not self._ending.is_set():
            try:
                with self._open() as controller:
                    self._attend(controller)
            except (HodographError, can.CanError) as error:
                self._lost(str(error))
                self._ending.wait(_RETRY_S)

    @contextmanager
    def _open(self) -> Iterator[_Prompt]:
        with open_network(self._address, self._node, self._bitrate) as network:
            remote = network.add_node(self._node, object_dictionary(CONTROLLER_EDS, self._node))
            controller = _Prompt(self._address, self._node, remote, network.clock)
            controller.sdo.RESPONSE_TIMEOUT = _ANSWER_S
            controller.before_read = lambda: self._execute(controller)
            controller.call_while_waiting(lambda: self._execute_stops(controller))
            if isinstance(network.clock, VirtualClock):
                self._clock = network.clock
            try:
                yield controller
            finally:
                self._clock = None
                controller.close()

    def _attend(self, controller: _Prompt) -> None:
        status: dict[str, Any] | None = None
        clock = controller.clock
        whole_due_s = 0.0
        failures = 0
        while not self._ending.is_set():
            self._execute_stops(controller)
            if not controller.answers(_ANSWER_S):
                status = None
                self._lost(
                    f"no answer from {controller.who()}: waiting for a controller to be started"
                )
                continue
            begun_s = clock.now_s()
            try:
                if status is None or begun_s >= whole_due_s or _changed(controller, status):
                    status = read_status(controller)
                    self._look_at_program(controller, status)
                    took_s = clock.now_s() - begun_s
                    whole_due_s = begun_s + max(WHOLE_S, 5 * took_s)
                else:
                    status = status | _moving_part(controller)
            except BusError as error:
                failures += 1
                if failures > 1:  # one answer may be late
                    self._lost(str(error))
                continue
            failures = 0
            self._publish({"type": "status", "connected": True, "note": "", "status": status})
            self._execute(controller)
            # On a slow bus or computer, too, the controller's channel is free for other clients most of the time.
            self._pause(clock, max(PAUSE_S, 2 * (clock.now_s() - begun_s)))

    def _pause(self, clock: Clock, seconds: float) -> None:
        """Waits until the thread is woken."""
        if isinstance(clock, VirtualClock):
            until_s = clock.now_s() + seconds
            while not self._wake.is_set() and clock.now_s() < until_s:
                clock.wait(until_s)
        else:
            self._wake.wait(seconds)
        self._wake.clear()

    def _lost(self, note: str) -> None:
        self._publish({"type": "status", "connected": False, "note": note, "status": None})
        self._fail_commands(BusError(note))

    def _fail_commands(self, error: HodographError) -> None:
        for waiting in (self._stops, self._commands):
            with suppress(queue.Empty):
                while True:
                    waiting.get_nowait()[1].set_exception(error)

    def _execute(self, controller: Controller) -> None:
        """Executes the queued commands."""
        self._execute_stops(controller)
        if self._in_command or self._in_stop:
            return
        self._in_command = True
        try:
            while not self._commands.empty():
                _carry_out(*self._commands.get(), controller)
                self._execute_stops(controller)
        finally:
            self._in_command = False

    def _execute_stops(self, controller: Controller) -> None:
        """Executes the queued commands that need not wait, also while another command waits for its turn."""
        if self._in_stop or self._stops.empty():
            return
        patience, controller.sdo.RESPONSE_TIMEOUT = controller.sdo.RESPONSE_TIMEOUT, _ANSWER_S
        self._in_stop = True
        try:
            while not self._stops.empty():
                _carry_out(*self._stops.get(), controller)
        finally:
            self._in_stop = False
            controller.sdo.RESPONSE_TIMEOUT = patience

    def _look_at_program(self, controller: Controller, status: dict[str, Any]) -> None:
        """Reads the program to draw if it is not the one before, or the path of a job is drawn in its place."""
        if self._shows_job(status):
            return
        program = status["program"]
        crc32 = program["crc32"] if program["state"] == "ready" else self._given_crc32
        if crc32 == self._crc32:
            return
        self._crc32 = crc32
        if crc32 is None:
            self._show_program(None, "no program is loaded")
        elif crc32 == self._given_crc32:
            self._show_program(self._given, "")
        elif program["size"] > LONGEST_UPLOAD:
            self._show_program(None, "the program is too long to be fetched: give it as --program")
        else:
            self._read_program(controller, crc32)

    def _read_program(self, controller: Controller, crc32: int) -> None:
        """Reads the program in the controller, if other clients leave the time for it."""
        attempt = self._attempts[1] if self._attempts[0] == crc32 else 0
        if attempt == len(PATIENCE_S):
            self._show_program(
                None, "other commands use the controller: give the program as --program"
            )
            return
        others = _Others(controller, PATIENCE_S[attempt])
        image = None
        with suppress(RefusedError, BusError):
            image = _fetch(controller, lambda: self._has_other_work() or others.wait_too_long())
        if others.gave_way:
            self._attempts = (crc32, attempt + 1)
        if image is None:
            self._crc32 = None  # once more at the next poll
        else:
            self._show_program(image, "")

    def _shows_job(self, status: dict[str, Any]) -> bool:
        """Whether the path of a streamed job is the one to show: until the controller has none any more, or runs its
        program though the job is over, in two successive reads.
        """
        stream = status["stream"]
        if stream is None:
            return False
        if stream["state"] not in (ENDED, STOPPED):
            self._crc32, self._program_runs = _OF_A_JOB, False
            return True
        before, self._program_runs = self._program_runs, status["state"] in _MOVES
        return self._crc32 == _OF_A_JOB and not (before and self._program_runs)

    def _has_other_work(self) -> bool:
        return self._ending.is_set() or not (self._commands.empty() and self._stops.empty())


class _Others:
    """Watches whether another client of the SDO channel waits for longer than `patience_s`."""

    def __init__(self, controller: Controller, patience_s: float) -> None:
        self._controller = controller
        self._patience_s = patience_s
        self._since_s: float | None = None
        self.gave_way = False
        """Whether `wait_too_long` was true."""

    def wait_too_long(self) -> bool:
        """Call it at each segment."""
        now_s = self._controller.clock.now_s()
        if not self._controller.is_wanted():
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
        self.gave_way = self._since_s is not None and now_s - self._since_s >= self._patience_s
        return self.gave_way


def _carry_out(command: Command, done: Future[None], controller: Controller) -> None:
    try:
        command(controller)
        done.set_result(None)
    except HodographError as error:
        done.set_exception(error)


def _changed(controller: Controller, status: dict[str, Any]) -> bool:
    return bool(STATES.get(controller.state()) != status["state"])


def _moving_part(controller: Controller) -> dict[str, Any]:
    """The values that change often: some objects instead of all, with the keys of `read_status`."""
    return {
        "stream": stream_dict(controller),
        "motion": {
            "arc_length_mm": controller.read(MOTION, 1) * MM_PER_Q40,
            "feed_mm_s": controller.read(MOTION, 2) / 1000,
            "time_s": controller.read(MOTION, 3) * 2.0**-32,
        },
        "override": {
            "wanted_percent": controller.read(OVERRIDE, 1),
            "actual_percent": 100 * controller.read(OVERRIDE, 2) * 2.0**-30,
            "saturated": bool(controller.read(OVERRIDE, 3)),
        },
    }


def _fetch(controller: Controller, give_up: Callable[[], bool]) -> bytes | None:
    """The image of the active program; None: a command broke off the transfer, which takes seconds for a large one."""
    try:
        with controller.turn():
            stream = controller.sdo.open(PROGRAM, 1, "rb", buffering=0)
            segments = []
            while segment := stream.read(7):
                segments.append(segment)
                if give_up():
                    controller.sdo.abort()
                    return None
            return b"".join(segments)
    except SdoAbortedError as error:
        raise RefusedError(f"{controller.who()} gives no program: {error}") from error
    except SdoError as error:
        raise BusError(f"{controller.who()} stopped answering: {error}") from error


MOST_PERCENT = 200

_BUTTONS = {
    "enable": ENABLE,
    "disable": DISABLE,
    "start": START,
    "hold": HOLD,
    "resume": RESUME,
    "stop": STOP,
    "quick-stop": QUICK_STOP,
    "reset": RESET,
    "home": HOME,
}
"""Names as in the page, and commands of object 0x2001."""


def read_command(request: dict[str, Any]) -> Command:
    """The command of a browser's request. Raises InputError: there is no such command."""
    name = request.get("name")
    if name == "override":
        percent = request.get("percent")
        if type(percent) is not int or not 0 <= percent <= MOST_PERCENT:
            raise InputError(f"override: a whole number from 0 to {MOST_PERCENT} is needed")
        return lambda controller: controller.override(percent)
    if not isinstance(name, str) or name not in _BUTTONS:
        raise InputError("there is no such command")
    return _button(_BUTTONS[name])


def is_stop(request: dict[str, Any]) -> bool:
    """Whether the controller accepts the command of a request at any time."""
    name = request.get("name")
    return isinstance(name, str) and _BUTTONS.get(name) in AT_ONCE


def _button(number: int) -> Command:
    def give(controller: Controller) -> None:
        controller.command(number)

    return give
