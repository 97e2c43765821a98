# SPDX-License-Identifier: MIT
"""Commands that take a while: sends one (hold, home, quick stop, reset) and waits until the machine is in the state
that it leads to. Used by api/bus, cli/action_commands and cli/bus_commands. Reads and writes objects of the controller
by SDO.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ...errors import BusError, RunError
from .controller import POLL_S, CommandRefusedError, Controller
from .objects import (
    AXIS_NODE,
    BOOT,
    CONFIGURATION,
    DISABLE,
    FAULT_STATE,
    HELD,
    HOME,
    HOMED,
    HOMING_METHOD,
    OFF,
    READY,
    REFUSED_MOVING,
    RESET,
)

BOOT_S = 10.0
"""Longest wait for drives to be found and configured, or to be switched on or off."""


def hold_reached(controller: Controller, wait_s: float = math.inf) -> bool:
    """Waits for the standstill that HOLD commanded; False: the program ended before, or the drives are off."""
    return controller.wait_for((HELD, READY, OFF, BOOT), wait_s) == HELD


def home(
    controller: Controller, wait_s: float = math.inf, tick: Callable[[], None] | None = None
) -> list[int]:
    """Homes the axes that the configuration names, switching drives at standstill off first; their nodes.

    Raises RunError: a fault, or a stop by another client, ended the homing.
    """
    state = controller.state()
    if state == READY:
        controller.command(DISABLE)
    if state in (READY, BOOT):
        controller.wait_for((OFF,), BOOT_S)
    controller.command(HOME)
    controller.wait_for((OFF, BOOT, READY), wait_s, tick)
    axes = range(1, controller.read(CONFIGURATION, 1) + 1)
    wanted = [axis for axis in axes if controller.read(HOMING_METHOD, axis)]
    missing = [axis for axis in wanted if not controller.read(HOMED, axis)]
    if missing:
        nodes = ", ".join(str(controller.read(AXIS_NODE, axis)) for axis in missing)
        raise RunError(f"{controller.who()}: homing was stopped before node {nodes} had its zero")
    return [controller.read(AXIS_NODE, axis) for axis in wanted]


def quick_stop_over(controller: Controller, wait_s: float = BOOT_S) -> None:
    """Waits until the drives are off after QUICK_STOP, which makes them brake by their own ramps. Raises RunError: the
    controller is in a fault then.
    """
    controller.wait_for((OFF, BOOT), wait_s)


def configure_anew(controller: Controller, wait_s: float = BOOT_S) -> None:
    """Finds the drives and writes their whole configuration, also without a fault. This overwrites values of another
    node.

    Drives at standstill are switched off. Raises RefusedError: axes move. Raises BusError: drives are missing.
    """
    controller.require_standing()
    if controller.state() == READY:
        controller.command(DISABLE)
        controller.wait_for((OFF, BOOT), BOOT_S)
    controller.command(RESET)
    controller.wait_for((OFF,), wait_s)


def reset(controller: Controller, wait_s: float = BOOT_S) -> bool:
    """Resets the present fault; False: there is none. Returns when the drives are configured again.

    Waits while a fault still brakes. Raises RunError: the fault comes back. Raises BusError: drives are missing.
    """
    if controller.state() != FAULT_STATE:
        return False
    deadline = controller.clock.now_s() + wait_s
    asked = False
    while controller.state() == FAULT_STATE:
        if controller.clock.now_s() > deadline:
            raise RunError(f"{controller.who()} is still in fault: {controller.fault_text()}")
        asked = asked or _accepted(controller)
        controller.clock.sleep(POLL_S)
    try:
        controller.wait_for((OFF, READY), max(BOOT_S, deadline - controller.clock.now_s()))
    except BusError as error:
        raise BusError(f"the fault is reset, but {error}") from error
    return True


def _accepted(controller: Controller) -> bool:
    try:
        controller.command(RESET)
    except CommandRefusedError as error:
        if error.reason != REFUSED_MOVING:
            raise
        return False
    return True
