# SPDX-License-Identifier: MIT
"""What a machine requires of plans and programs: its limits in the forms of feed/, program/ and native/, and what its
controller proves of a program with them. Used by many modules of host_tools: the pipelines, streaming, the checks of
programs, reports. No I/O.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from .config import Drive, Machine
from .errors import InputError
from .feed import AxisLimits, ControllerLimits, Limits, Plant, Plants
from .fixed_point import nearest_q40
from .native.brake_check import BrakeCheck
from .native.program import NativeFault, NativeLimits, NativeProgram
from .program import Program, ProgramLimits, StopTerms
from .program.stops import DECELERATION, FAULT, HOLD


def controller_limits(machine: Machine) -> ControllerLimits:
    """The limits that a plan for this machine has to keep."""
    return ControllerLimits(
        feed_mm_s=machine.feed_mm_s,
        acceleration_mm_s2=machine.acceleration_mm_s2,
        jerk_mm_s3=machine.jerk_mm_s3,
        reserve=machine.reserve,
    )


def axis_limits(machine: Machine) -> AxisLimits:
    """The limits of the axes that follow a path. Raises InputError: there is only one axis."""
    axes = machine.path_axes
    return AxisLimits(
        velocity_mm_s=tuple(axis.velocity_mm_s for axis in axes),
        acceleration_mm_s2=tuple(axis.acceleration_mm_s2 for axis in axes),
        jerk_mm_s3=tuple(axis.jerk_mm_s3 for axis in axes),
    )


def plants(machine: Machine | None, limits: Limits) -> Plants | None:
    """The plants of the axes, with the volts that `limits` gives or that their drives have; None: neither is known.

    Raises InputError: volts are limited and an axis has no drive file, or friction alone takes all volts of a drive.
    """
    known = machine is not None and all(axis.drive is not None for axis in machine.path_axes)
    if limits.volts is None and not known:
        return None
    if machine is None:
        raise InputError(
            '[limits] volts needs a machine: add [machine] file = "..." or use --machine FILE'
        )
    return tuple(_plant(drive, limits.volts) for drive in machine.models(machine.path_axes))


def drive_plants(machine: Machine) -> Plants | None:
    """The plants of the axes with all volts of their drives; None: an axis has no drive file, or friction alone takes
    all its volts.
    """
    known = [axis.drive for axis in machine.path_axes if axis.drive is not None]
    if len(known) < len(machine.path_axes) or any(
        drive.volts_limit <= (drive.equipment.friction_volts or 0.0) for drive in known
    ):
        return None
    return tuple(_plant(drive, drive.volts_limit) for drive in known)


def stop_terms(machine: Machine, limits: Limits) -> StopTerms:
    """What the stops of a program keep in addition to the limits of its plan, `limits`."""
    return StopTerms(
        plants=plants(machine, limits),
        drives=drive_plants(machine),
        axis=axis_limits(machine),
        stop_time_ms=machine.stop_time_ms,
    )


def _plant(drive: Drive, volts: float | None) -> Plant:
    plant = Plant(
        drive.gain_rad_s_v * drive.screw_mm_rad,
        drive.time_constant_s,
        drive.volts_limit if volts is None else min(volts, drive.volts_limit),
        drive.equipment.friction_volts or 0.0,
        drive.volts_limit,
    )
    if not plant.reach_mm_s > 0.0:
        raise InputError(
            f"{'drive file' if volts is None else f'[limits] volts {volts:g}'}: friction alone takes "
            f"{plant.friction_volts:g} V of a drive, which has {drive.volts_limit:g}: "
            "give more than that friction, or another drive"
        )
    return plant


def program_limits(machine: Machine) -> ProgramLimits:
    """The limits that the controller of this machine checks programs against. Raises InputError: it has one axis
    only.
    """
    axes = machine.path_axes
    return ProgramLimits(
        period_us=machine.period_us,
        feed_um_s=round(machine.feed_mm_s * 1000),
        acceleration_um_s2=round(machine.acceleration_mm_s2 * 1000),
        jerk_mm_s3=round(machine.jerk_mm_s3),
        min_q40_mm=tuple(nearest_q40(axis.travel_min_mm) for axis in axes),
        max_q40_mm=tuple(nearest_q40(axis.travel_max_mm) for axis in axes),
        stop_time_ms=machine.stop_time_ms,
        axis_velocity_um_s=tuple(round(axis.velocity_mm_s * 1000) for axis in axes),
        axis_acceleration_um_s2=tuple(round(axis.acceleration_mm_s2 * 1000) for axis in axes),
        axis_jerk_mm_s3=tuple(round(axis.jerk_mm_s3) for axis in axes),
        axis_count=0 if machine.first_axis else len(axes),
    )


def controller_verdict(program: NativeProgram, machine: Machine) -> NativeFault | None:
    """The first rule that a program breaks on the controller of this machine; None: it is accepted."""
    return program.check(NativeLimits(**asdict(program_limits(machine))))


@dataclass(frozen=True)
class ProvedStops:
    """What is proved of the stops of one kind. A piece is proved if all stops from it keep the axis limits until
    standstill.

    pieces      number of feed pieces in which a stop may begin
    open_mm     arc lengths of the starts of those that are not proved
    time_share  time of the proved pieces over that of all these pieces
    """

    kind: str
    pieces: int
    open_mm: tuple[float, ...]
    time_share: float

    @property
    def proved(self) -> int:
        """Pieces from which all stops are proved."""
        return self.pieces - len(self.open_mm)

    @property
    def name(self) -> str:
        """The kind in words."""
        return "feed hold and stop" if self.kind == "hold" else "fault stop"


def proved_stops(
    native: NativeProgram, program: Program, machine: Machine
) -> tuple[ProvedStops, ...]:
    """What is proved of the feed holds and of the fault stops of an accepted program (firmware/core/brake_check.h)."""
    check = BrakeCheck(native, NativeLimits(**asdict(program_limits(machine))))
    duration_s = program.pieces.duration_s
    out = []
    for kind, name in ((HOLD, "hold"), (FAULT, "fault")):
        codes = program.stops.codes[:, kind]
        pieces = np.flatnonzero(codes[:, DECELERATION])
        keeps = np.array([check.proves(i, kind, codes[i].tolist()) for i in pieces.tolist()], bool)
        whole_s = float(duration_s[pieces].sum())
        share = float(duration_s[pieces[keeps]].sum()) / whole_s if whole_s > 0.0 else 1.0
        places = tuple(program.piece_starts_mm[pieces[~keeps]].tolist())
        out.append(ProvedStops(name, pieces.size, places, share))
    return tuple(out)


def proved_limits(machine: Machine) -> str:
    """The limits that the controller of this machine has proved of each program that it accepts."""
    return ", ".join(
        f"{axis.name} {axis.velocity_mm_s:g} {axis.unit}/s {axis.acceleration_mm_s2:g} {axis.unit}/s^2 "
        f"{axis.jerk_mm_s3:g} {axis.unit}/s^3"
        for axis in machine.path_axes
    )
