# SPDX-License-Identifier: MIT
"""Commands about configuration and drives: configure, home, quick-stop, reset. Light on imports, as bus_commands.
Started by cli/main. Reads and writes objects of the controller by SDO, and prints to stdout and stderr.
"""

from __future__ import annotations

import math
from argparse import Namespace
from typing import TYPE_CHECKING

from ..bus.own_bus import bus_address
from ..bus.sdo import actions
from ..bus.sdo.objects import BOOT, OFF, QUICK_STOP, READY
from ..errors import InputError
from .bus_commands import commanded, reached, stopping
from .output import note
from .targets import target

if TYPE_CHECKING:
    from ..config import Machine


def configure(options: Namespace) -> None:
    """hodograph configure."""
    _check_configure(options)
    address = bus_address(options.bus)
    machine = _machine_of_file(options)
    to = target(options) if machine is None else machine
    node = options.node or to.node
    with reached(address, node, to.bitrate, options.wait) as controller:
        done = []
        if machine is not None:
            controller.configure(machine, options.kernel or machine.kernel)
            done.append(f"configured, CRC-32 {controller.configuration_crc():08x}")
        if options.forget:
            controller.restore_defaults()
            done.append("nothing is stored any more")
        if options.set_node is not None:
            controller.set_node_number(options.set_node)
        if options.store or options.set_node is not None:
            controller.store()
            done.append("stored")
    if options.set_node is not None:
        number = options.set_node or "the board's own"
        done.append(f"the node number is {number} after the next power-on")
    print("; ".join(done))


def _check_configure(options: Namespace) -> None:
    wanted = (options.file is not None, options.store, options.set_node is not None)
    if options.forget and any(wanted):
        raise InputError(
            "--forget: stands alone, since FILE, --store and --set-node store or change what it forgets"
        )
    if not options.forget and not any(wanted):
        raise InputError("configure: nothing to do: give a FILE, --store, --forget or --set-node")


def _machine_of_file(options: Namespace) -> Machine | None:
    """The machine of FILE, None without a FILE. Raises InputError: its traffic does not fit on its bus, for one."""
    if options.file is None:
        return None
    from ..bustime import require_fit
    from .motion_commands import machine_of

    machine = machine_of(options.file, options.machine)
    require_fit(machine)
    return machine


def home(options: Namespace) -> None:
    """hodograph home."""
    address = bus_address(options.bus)
    machine = _machine_of_file(options)
    to = target(options) if machine is None else machine
    with reached(address, to.node, to.bitrate, options.wait) as controller:
        controller.require_standing()
        if machine is not None:
            controller.configure(machine, machine.kernel)
            controller.wait_for((OFF, READY, BOOT), actions.BOOT_S)
        with stopping(controller):
            nodes = actions.home(controller, options.timeout or math.inf)
    print(f"homed: node{'s' if len(nodes) > 1 else ''} {', '.join(map(str, nodes))}; drives off")


def quick_stop(options: Namespace) -> None:
    """hodograph quick-stop."""
    address = bus_address(options.bus)
    to = target(options)
    with commanded(address, to.node, to.bitrate, options.wait, QUICK_STOP) as controller:
        actions.quick_stop_over(controller, options.timeout or actions.BOOT_S)
    print("stopped by the drives, drives off")


def reset(options: Namespace) -> None:
    """hodograph reset."""
    address = bus_address(options.bus)
    to = target(options)
    with reached(address, to.node, to.bitrate, options.wait) as controller:
        wait_s = options.timeout or actions.BOOT_S
        had_fault = actions.reset(controller, wait_s)
        if not had_fault:
            actions.configure_anew(controller, wait_s)
    if not had_fault:
        note("no fault was present: the drives have been configured anew")
    print("ready to be started")


COMMANDS = {"configure": configure, "home": home, "quick-stop": quick_stop, "reset": reset}
