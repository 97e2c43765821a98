# SPDX-License-Identifier: MIT
"""hodograph record: records the bus into a file, with the setpoint step check. Started by cli/main. Receives frames,
reads objects of the controller by SDO, writes the file, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from ..bus.address import BusAddress, check_raw
from ..bus.capture.bus_recording import BusRecording
from ..bus.capture.recordings import check_suffix
from ..bus.capture.setpoint_check import Jump, limits_at, step_limits
from ..bus.capture.setpoint_watch import jumps
from ..bus.clock import REAL_CLOCK, Clock, VirtualClock
from ..bus.own_bus import bus_address
from ..bus.processes import virtual_clock
from ..bus.sdo.configuration import (
    configured_axis_limits,
    configured_counts,
    configured_limits,
    configured_nodes,
)
from ..bus.sdo.controller import connect
from ..bus.sdo.objects import PROGRAM
from ..config import PLANE_AXES
from ..errors import BusError, HodographError, RunError
from .output import note, print_json
from .targets import DEFAULT_BITRATE

if TYPE_CHECKING:
    from ..config import Machine

_WRITE_EVERY_S = 0.5
"""Time between two writes of received frames."""
_ANSWER_S = 1.0
"""Longest time until the controller answers."""


def record(options: Namespace) -> None:
    """Records the bus. Raises RunError: frames are missing, or a setpoint jumps."""
    check_suffix(options.file)
    address = bus_address(options.bus)
    if not address.is_raw:
        raise BusError(f"{address}: record takes SocketCAN: use socketcan:CHANNEL")
    check_raw(address)
    machine = _machine(options)
    with _Recording(address, options, machine) as under_way:
        under_way.go_on()
    recording = under_way.made
    if recording.dropped:
        raise RunError(recording.dropped_text())
    found = _jumps(recording, address, options, machine)
    _print(options, recording, under_way.seconds, found)
    for jump in (found or [])[1:]:
        note(str(jump))
    if found:
        raise RunError(f"{options.file}: {found[0]}; the file is complete")


def _machine(options: Namespace) -> Machine | None:
    if options.machine is None:
        return None
    from ..config import load_machine

    return load_machine(options.machine)


class _Recording:
    """A recording until the time is over or Ctrl-C, on the clock of its bus."""

    def __init__(self, address: BusAddress, options: Namespace, machine: Machine | None) -> None:
        self._options = options
        self._virtual: VirtualClock | None = virtual_clock(address)
        try:
            nodes = None if machine is None else machine.nodes
            self.made = BusRecording(address, options.file, nodes)
        except BaseException:
            self._release()
            raise
        self._clock: Clock = self._virtual or REAL_CLOCK

    def __enter__(self) -> _Recording:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.made.close()
        finally:
            self._release()

    def _release(self) -> None:
        if self._virtual is not None:
            self._virtual.release()
            self._virtual = None

    def go_on(self) -> None:
        """Waits until the time is over, or until Ctrl-C, which is a normal end."""
        clock, seconds = self._clock, self._options.seconds
        begun = clock.now_s()
        try:
            while seconds is None or clock.now_s() - begun < seconds:
                left_s = _WRITE_EVERY_S
                if seconds is not None:
                    left_s = min(left_s, begun + seconds - clock.now_s())
                clock.sleep(left_s)
                self.made.keep()
        except KeyboardInterrupt as error:
            if type(error) is not KeyboardInterrupt:  # SIGTERM ends it as well, with its own status
                raise
        finally:
            self.made.close()
            self.seconds = clock.now_s() - begun


def _jumps(
    recording: BusRecording, address: BusAddress, options: Namespace, machine: Machine | None
) -> list[Jump] | None:
    """Steps beyond the limits of the machine file, else of the controller; None: neither gives its limits."""
    if not recording.steps:
        return []
    if machine is not None:
        return jumps(recording.steps, step_limits(machine))
    try:
        with connect(address, options.node or 1, DEFAULT_BITRATE) as controller:
            controller.require(_ANSWER_S)
            nodes = configured_nodes(controller)
            of_axes = configured_axis_limits(controller, len(nodes))
            counts = configured_counts(controller, len(nodes))
            seen = [axis for axis, node in enumerate(nodes) if node in recording.nodes]
            limits = limits_at(
                *configured_limits(controller),
                axes=[of_axes[axis] for axis in seen],
                axis_counts=[counts[axis] for axis in seen],
                path=controller.read(PROGRAM, 24) or PLANE_AXES,
            )
    except HodographError as error:
        note(f"setpoints were not checked, --machine FILE says what is allowed: {error}")
        return None
    if tuple(node for node in nodes if node in recording.nodes) != recording.nodes:
        note(
            f"setpoints were not checked, --machine FILE says what is allowed: nodes {recording.nodes} got some, "
            f"the controller's axes are now {nodes}"
        )
        return None
    return jumps(recording.steps, limits)


def _print(
    options: Namespace, recording: BusRecording, seconds: float, found: list[Jump] | None
) -> None:
    frames = recording.frame_count
    if options.json:
        jumps = None if found is None else [str(jump) for jump in found]
        print_json(
            {
                "file": str(options.file),
                "frames": frames,
                "seconds": seconds,
                "jumps": jumps,
                "unhomed_starts": recording.unhomed_starts,
            }
        )
    else:
        print(f"{options.file}: {frames} frames in {seconds:.1f} s")
    if recording.unhomed_starts:
        note(f"{options.file}: starts that were allowed without homing: {recording.unhomed_starts}")


COMMANDS = {"record": record}
