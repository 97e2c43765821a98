# SPDX-License-Identifier: MIT
"""Commands that only need a controller: start, stop, hold, resume, override. Few imports, so that they are quick.
Started by cli/main. Used by cli/action_commands and cli/motion_commands. Reads and writes objects of the controller by
SDO, and prints to stdout and stderr.
"""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from ..bus.address import BusAddress
from ..bus.own_bus import bus_address
from ..bus.sdo import actions
from ..bus.sdo.controller import (
    BOOT,
    DISABLE,
    OFF,
    READY,
    RESUME,
    Controller,
    connect,
)
from ..bus.sdo.follow import Follower
from ..bus.sdo.objects import HOLD, MOVING, STOP
from ..bus.sdo.upload import refused_last
from ..errors import BusyError
from .output import note
from .targets import target

_BUSY_S = 0.1
"""How long a stop command waits for the channel lock to check first that the node is a controller."""
_TURN_S = 3.0
"""How long it then waits for the lock at each check that the axes stand."""


@contextmanager
def reached(address: BusAddress, node: int, bitrate: int, wait_s: float) -> Iterator[Controller]:
    """A controller that answers; raises BusError when it does not within `wait_s`."""
    with connect(address, node, bitrate) as controller:
        controller.require(wait_s)
        yield controller


@contextmanager
def commanded(
    address: BusAddress, node: int, bitrate: int, wait_s: float, command: int
) -> Iterator[Controller]:
    """A controller after a command to stop or to hold, which is sent whatever other clients do.

    Raises BusError: the controller does not answer within `wait_s`. Inside, the end of the stop can be read. That
    raises BusyError if another command of this computer keeps the channel lock, such as one suspended by Ctrl-Z or
    SIGSTOP.
    """
    with connect(address, node, bitrate) as controller:
        with suppress(BusyError):
            controller.require(wait_s, _BUSY_S)
        controller.command(command)
        controller.turn_wait_s = _TURN_S
        try:
            yield controller
        except BusyError as error:
            raise BusyError(
                f"the controller has taken the command, but whether the axes stand is not known: {error}"
            ) from error


@contextmanager
def stopping(controller: Controller) -> Iterator[None]:
    """Stops the axes if the context is interrupted, or fails after it has moved axes."""
    try:
        yield
    except BaseException as error:
        controller.stop_after(error)
        raise


def start(options: Namespace) -> None:
    """hodograph start."""
    address = bus_address(options.bus)
    to = target(options)
    with reached(address, to.node, to.bitrate, options.wait) as controller:
        controller.require_no_other_job()
        if options.reset:
            actions.reset(controller)
        if (reason := refused_last(controller)) is not None:
            note(f"a program has been refused ({reason}): the one before it is started")
        with stopping(controller):
            controller.enable()
            controller.start(from_mm=options.from_mm, unhomed=options.unhomed)
            if options.follow:
                controller.wait_for_end(tick=Follower(controller, note))
                controller.require_program_end()
    print("done" if options.follow else "running")


def stop(options: Namespace) -> None:
    """hodograph stop."""
    address = bus_address(options.bus)
    to = target(options)
    with commanded(address, to.node, to.bitrate, options.wait, STOP) as controller:
        was_running = controller.state() in MOVING
        controller.stop_and_wait()
        if options.off and controller.state() == READY:
            controller.command(DISABLE)
            controller.wait_for((OFF, BOOT), 5.0)
    print(("stopped" if was_running else "standing") + (", drives off" if options.off else ""))


def hold(options: Namespace) -> None:
    """hodograph hold."""
    address = bus_address(options.bus)
    to = target(options)
    with commanded(address, to.node, to.bitrate, options.wait, HOLD) as controller:
        held = actions.hold_reached(controller, options.timeout or math.inf)
    print("held" if held else "the program had ended")


def resume(options: Namespace) -> None:
    """hodograph resume."""
    address = bus_address(options.bus)
    to = target(options)
    with reached(address, to.node, to.bitrate, options.wait) as controller:
        controller.command(RESUME)
    print("running")


def override(options: Namespace) -> None:
    """hodograph override."""
    address = bus_address(options.bus)
    to = target(options)
    with reached(address, to.node, to.bitrate, options.wait) as controller:
        controller.override(options.percent)
    print(f"override {options.percent} %")


COMMANDS = {
    "start": start,
    "stop": stop,
    "hold": hold,
    "resume": resume,
    "override": override,
}
