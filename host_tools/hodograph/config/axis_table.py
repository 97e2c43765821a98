# SPDX-License-Identifier: MIT
"""The tables [[axis]] of a machine file, with what the controller writes to each drive (docs/reference/protocol.md
section 3). Used by many modules of host_tools: machine files, commissioning, tuning, simulation, bus load. Reads the
drive files that the tables name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..names import UNITS as UNITS
from ..names import in_unit as quantity_in_unit
from .drive_file import Drive, drive_of, load_drive
from .table import Table

MAX_AXES = 6
COUNTS_PER_UNIT_MAX = 2**23
"""The controller's own bound (firmware/app/machine/config.h)."""
I32_MAX, U32_MAX = 2**31 - 1, 2**32 - 1
HOMING_METHODS = (0, 17, 18, 19, 20, 21, 22, 35, 37)
"""Homing methods of CiA 402: 0 not homed, 17, 18 limit switches, 19 to 22 home switch, 35 and 37 at the present
position.
"""


@dataclass(frozen=True)
class Homing:
    """Homing of an axis (`hodograph home`); method 0: it is not homed. A rotary axis has degrees in place of mm.

    Axes home one after the other, from the lowest `sequence` on; axes of one number in the order of the controller.
    """

    method: int = 0
    offset_mm: float = 0.0
    speed_mm_s: float = 10.0
    slow_mm_s: float = 1.0
    acceleration_mm_s2: float = 100.0
    sequence: int = 0


@dataclass(frozen=True)
class Feedforward:
    """Feedforward that the controller sends with the target: a share of its velocity, torque in per mille of the rated
    one.

    Of a rotary axis, torque is for 1000 deg/s^2 and 1000 deg/s in place of m/s^2 and m/s.
    """

    velocity: float = 0.0
    torque_permille_s2_m: float = 0.0
    torque_permille_s_m: float = 0.0

    @property
    def velocity_permille(self) -> int:
        """Object 0x2018 of the controller."""
        return round(self.velocity * 1000)

    @property
    def torque_per_acceleration_q16(self) -> int:
        """Object 0x2019."""
        return round(self.torque_permille_s2_m * 2**16)

    @property
    def torque_per_velocity_q16(self) -> int:
        """Object 0x201A."""
        return round(self.torque_permille_s_m * 2**16)

    @property
    def has_torque(self) -> bool:
        """Whether RPDO1 carries a torque offset for this axis."""
        return bool(self.torque_permille_s2_m or self.torque_permille_s_m)


@dataclass(frozen=True)
class Scaling:
    """The drive's objects 0x608F, 0x6091 and 0x6092; 0: the drive's own value stays."""

    encoder_increments_per_rev: int = 0
    feed_counts_per_rev: int = 0
    gear_motor_revolutions: int = 0
    gear_shaft_revolutions: int = 0


@dataclass(frozen=True)
class Identity:
    """The identity that the drive has to report in 0x1018 subs 1 to 3; 0: any."""

    vendor: int = 0
    product: int = 0
    revision: int = 0


@dataclass(frozen=True)
class Axis:
    """One axis: CANopen node, travel in machine coordinates, limits of its motion, settings of its drive, and its
    model.

    A rotary axis (`unit` "deg") has degrees where names of its fields, and of its drive's model, have mm. No program
    moves the axis beyond its velocity, acceleration and jerk: plans keep them, and the controller proves it before it
    accepts a program (docs/guides/limits.md).

    Without a drive file (`drive` None) the axis can be run, but not simulated. `following_window_mm` None: the drive
    keeps its own, and the controller only detects an axis that does not follow at all.
    """

    name: str
    unit: str
    node: int
    counts_per_unit: int
    travel_min_mm: float
    travel_max_mm: float
    velocity_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    drive: Drive | None
    following_window_mm: float | None
    following_timeout_ms: int
    quick_stop_mm_s2: float
    homing: Homing
    feedforward: Feedforward
    scaling: Scaling
    identity: Identity

    @property
    def turns(self) -> bool:
        """Whether it is measured in degrees."""
        return self.unit == "deg"


_AXIS = (
    "name",
    "unit",
    "node",
    "travel_mm",
    "velocity_mm_s",
    "acceleration_mm_s2",
    "jerk_mm_s3",
    "counts_per_mm",
    "drive",
    "following_window_mm",
    "following_timeout_ms",
    "quick_stop_mm_s2",
    "homing",
    "feedforward",
    "scaling",
    "identity",
)
_HOMING = ("method", "sequence", "offset_mm", "speed_mm_s", "slow_mm_s", "acceleration_mm_s2")
_FEEDFORWARD = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")
_IDENTITY = ("vendor", "product", "revision")
_SCALING = (
    "encoder_increments_per_rev",
    "feed_counts_per_rev",
    "gear_motor_revolutions",
    "gear_shaft_revolutions",
)


class _AxisTable:
    """One [[axis]], or a table in it, of an axis in `unit`; its keys are read by their names in mm."""

    def __init__(self, table: Table, unit: str) -> None:
        """Raises InputError: the table has a key of the other unit."""
        self.table, self.unit = table, unit
        other = UNITS[1 - UNITS.index(unit)]
        for name in (*_AXIS, *_HOMING, *_FEEDFORWARD):
            wrong = in_unit(name, other)
            if wrong != self.key(name) and table.has(wrong):
                does = "turns" if unit == "deg" else "does not turn"
                raise table.error(
                    wrong, f'does not fit: the axis {does}, use {self.key(name)} or another "unit"'
                )

    def key(self, name: str) -> str:
        """A key as the file has it for this unit."""
        return in_unit(name, self.unit)

    def has(self, name: str) -> bool:
        """Whether the file gives this key."""
        return self.table.has(self.key(name))

    def number(self, name: str, default: float | None = None, *, low: float, high: float) -> float:
        """As Table.number."""
        if default is None:
            return self.table.number(self.key(name), low=low, high=high)
        return self.table.number(self.key(name), default, low=low, high=high)

    def error(self, name: str, message: str) -> InputError:
        """As Table.error."""
        return self.table.error(self.key(name), message)

    def inner(self, name: str, known: tuple[str, ...], *, required: bool = True) -> _AxisTable:
        """A table in this one."""
        return _AxisTable(self.table.table(name, _in_units(known), required=required), self.unit)


def in_unit(name: str, unit: str) -> str:
    """The key of an axis in this unit that is called `name` in mm."""
    if name.startswith("torque_permille"):
        return name if unit == "mm" else name.removesuffix("m") + "kdeg"
    return quantity_in_unit(name, unit)


def _in_units(names: tuple[str, ...]) -> tuple[str, ...]:
    """The keys in both units, each once; those in mm first, as near keys are looked for in this order."""
    return tuple(dict.fromkeys(in_unit(name, unit) for unit in UNITS for name in names))


def read_axes(root: Table, controller_node: int, acceleration_mm_s2: float) -> tuple[Axis, ...]:
    """The axes of a machine file, in its order.

    Quick stops brake with `acceleration_mm_s2`, the controller's limit, unless the file gives another value.
    """
    tables = root.tables("axis", _in_units(_AXIS))
    if len(tables) > MAX_AXES:
        raise tables[-1].error("name", f"makes {len(tables)} axes: a machine has 1 to {MAX_AXES}")
    keyed = [_AxisTable(table, table.choice("unit", UNITS, "mm")) for table in tables]
    counts = [
        table.table.integer(
            table.key("counts_per_mm"), 1_000_000, low=1000, high=COUNTS_PER_UNIT_MAX
        )
        for table in keyed
    ]
    straight = [(t, n) for t, n in zip(keyed, counts, strict=True) if t.unit == "mm"]
    if len({n for _, n in straight}) > 1:
        raise straight[-1][0].error("counts_per_mm", "must be the same for all axes")
    axes = tuple(_axis(t, n, acceleration_mm_s2) for t, n in zip(keyed, counts, strict=True))
    taken: dict[int, str] = {controller_node: "the controller"}
    for axis, table in zip(axes, tables, strict=True):
        if axis.node in taken:
            raise table.error("node", f"{axis.node} is taken by {taken[axis.node]}")
        taken[axis.node] = f"axis {axis.name}"
    return axes


def _axis(keyed: _AxisTable, counts_per_unit: int, acceleration_mm_s2: float) -> Axis:
    table, unit = keyed.table, keyed.unit
    travel = keyed.key("travel_mm")
    low, high = table.pair(travel, low=-4096, high=4096)
    if not low < high:
        raise table.error(travel, f"must be [least, greatest], but is [{low:g}, {high:g}]")
    reach = I32_MAX / counts_per_unit
    if max(abs(low), abs(high)) > reach:
        raise table.error(travel, f"leaves the ±{reach:.1f} {unit} that i32 counts can express")
    drive = _drive(table)
    acceleration = _motion_limit(keyed, "acceleration_mm_s2", 0.1, 4e6)
    steepest = math.floor(1000 * U32_MAX / counts_per_unit) / 1000
    window = None
    if keyed.has("following_window_mm"):
        window = _counted(keyed, "following_window_mm", 0, counts_per_unit)
    usual_stop = acceleration if keyed.unit == "deg" else acceleration_mm_s2
    return Axis(
        name=table.text("name"),
        unit=unit,
        node=table.integer("node", low=1, high=127),
        counts_per_unit=counts_per_unit,
        travel_min_mm=low,
        travel_max_mm=high,
        velocity_mm_s=_motion_limit(keyed, "velocity_mm_s", 0.01, 4000),
        acceleration_mm_s2=acceleration,
        jerk_mm_s3=_motion_limit(keyed, "jerk_mm_s3", 1, 4e9),
        drive=drive,
        following_window_mm=window,
        following_timeout_ms=table.integer(
            "following_timeout_ms", 0 if window is None else 10, low=0, high=65535
        ),
        quick_stop_mm_s2=_counted(
            keyed, "quick_stop_mm_s2", min(usual_stop, steepest), counts_per_unit
        ),
        homing=_homing(keyed, counts_per_unit, reach),
        feedforward=_feedforward(keyed),
        scaling=_scaling(table, drive, counts_per_unit),
        identity=_identity(table),
    )


def _drive(table: Table) -> Drive | None:
    """The drive of the file that `drive` names, or of the table `drive`."""
    if not table.has("drive"):
        return None
    if table.is_table("drive"):
        place = Path(f"{table.file}: drive of axis {table.text('name')}")
        return drive_of(place, table.contents("drive"))
    return load_drive(table.present("drive"))


def _motion_limit(table: _AxisTable, name: str, low: float, high: float) -> float:
    if not table.has(name):
        keys = [table.key(key) for key in ("velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3")]
        raise table.error(
            name,
            f"is missing: add what the axis may do ({keys[0]}, {keys[1]} and {keys[2]})",
        )
    return table.number(name, low=low, high=high)


def _counted(table: _AxisTable, name: str, default: float, counts_per_unit: int) -> float:
    """A positive length, speed or acceleration that is sent as u32 in counts."""
    value = table.number(name, default, low=1e-6, high=1e9)
    if not 1 <= value * counts_per_unit <= U32_MAX:
        raise table.error(
            name,
            f"must be from {1 / counts_per_unit:g} to {U32_MAX / counts_per_unit:.1f} "
            f"(u32 in counts, {counts_per_unit} a {table.unit}), but is {value:g}",
        )
    return value


def _homing(axis: _AxisTable, counts_per_unit: int, reach_mm: float) -> Homing:
    if not axis.has("homing"):
        return Homing()
    table, usual = axis.inner("homing", _HOMING), Homing()
    method = table.table.integer("method", low=-128, high=127)
    if method not in HOMING_METHODS:
        known = ", ".join(map(str, HOMING_METHODS))
        raise table.error("method", f"must be one of {known}, but is {method}")
    speed = _counted(table, "speed_mm_s", usual.speed_mm_s, counts_per_unit)
    slow = _counted(table, "slow_mm_s", min(usual.slow_mm_s, speed), counts_per_unit)
    if slow > speed:
        raise table.error("slow_mm_s", f"is {slow:g}, above {table.key('speed_mm_s')} = {speed:g}")
    first = axis.table.text("name").lower() == "z"  # so that the tool leaves the workpiece first
    return Homing(
        method=method,
        offset_mm=table.number("offset_mm", usual.offset_mm, low=-reach_mm, high=reach_mm),
        speed_mm_s=speed,
        slow_mm_s=slow,
        acceleration_mm_s2=_counted(
            table, "acceleration_mm_s2", usual.acceleration_mm_s2, counts_per_unit
        ),
        sequence=table.table.integer("sequence", 0 if first else 1, low=0, high=15),
    )


def _feedforward(axis: _AxisTable) -> Feedforward:
    table = axis.inner("feedforward", _FEEDFORWARD, required=False)
    return Feedforward(
        velocity=table.number("velocity", 0.0, low=0, high=2),
        torque_permille_s2_m=table.number("torque_permille_s2_m", 0.0, low=-32767, high=32767),
        torque_permille_s_m=table.number("torque_permille_s_m", 0.0, low=-32767, high=32767),
    )


def _identity(axis: Table) -> Identity:
    table = axis.table("identity", _IDENTITY, required=False)
    given = {key: table.integer(key, low=1, high=U32_MAX) for key in _IDENTITY if table.has(key)}
    return Identity(**given)


def _scaling(axis: Table, drive: Drive | None, counts_per_unit: int) -> Scaling:
    if not axis.has("scaling"):
        return Scaling()
    table = axis.table("scaling", _SCALING)

    def number(key: str, default: int) -> int:
        return table.integer(key, default, low=0, high=U32_MAX)

    feed = number("feed_counts_per_rev", _feed_of(drive, counts_per_unit))
    geared = table.has("gear_motor_revolutions") or table.has("gear_shaft_revolutions")
    motor = number("gear_motor_revolutions", int(geared))
    shaft = number("gear_shaft_revolutions", int(geared))
    if bool(motor) != bool(shaft):
        raise table.error(
            "gear_motor_revolutions", f"is {motor}, gear_shaft_revolutions {shaft}: both or none"
        )
    return Scaling(number("encoder_increments_per_rev", 0), feed, motor, shaft)


def _feed_of(drive: Drive | None, counts_per_unit: int) -> int:
    return 0 if drive is None else round(2 * math.pi * drive.screw_mm_rad * counts_per_unit)
