# SPDX-License-Identifier: MIT
"""The tables [[axis]] of a machine file, with what the controller writes to each drive
(docs/reference/protocol.md section 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .drive_file import Drive, load_drive
from .table import Table

MAX_AXES = 6
COUNTS_PER_MM_MAX = 2**23
"""The controller's own bound (firmware/app/machine/config.h)."""
I32_MAX, U32_MAX = 2**31 - 1, 2**32 - 1
HOMING_METHODS = (0, 17, 18, 19, 20, 21, 22, 35, 37)
"""Of CiA 402: 0 not homed, 17, 18 limit switches, 19 to 22 home switch, 35 and 37 here."""


@dataclass(frozen=True)
class Homing:
    """How `hodograph home` finds this axis' zero; method 0: not at all."""

    method: int = 0
    offset_mm: float = 0.0
    speed_mm_s: float = 10.0
    slow_mm_s: float = 1.0
    acceleration_mm_s2: float = 100.0


@dataclass(frozen=True)
class Feedforward:
    """What the controller sends beside the target: a share of its velocity, torque in per mille of the rated one."""

    velocity: float = 0.0
    torque_permille_s2_m: float = 0.0
    torque_permille_s_m: float = 0.0

    @property
    def velocity_permille(self) -> int:
        """As the controller has it: object 0x2018."""
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
    """What the drive has to say of itself in 0x1018 subs 1 to 3; 0: anything."""

    vendor: int = 0
    product: int = 0
    revision: int = 0


@dataclass(frozen=True)
class Axis:
    """One axis: CANopen node, travel limits in machine coordinates, limits of its motion, what is written to its
    drive, and its model.

    No program moves the axis beyond its velocity, acceleration and jerk: plans keep them, and the controller proves it
    before it accepts a program (docs/guides/limits.md).

    Without a drive file (`drive` None) the axis can be run, but not simulated. `following_window_mm` None: the drive
    keeps its own, and the controller looks for an axis that does not follow at all.
    """

    name: str
    node: int
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


_AXIS = (
    "name",
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
_HOMING = ("method", "offset_mm", "speed_mm_s", "slow_mm_s", "acceleration_mm_s2")
_FEEDFORWARD = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")
_IDENTITY = ("vendor", "product", "revision")
_SCALING = (
    "encoder_increments_per_rev",
    "feed_counts_per_rev",
    "gear_motor_revolutions",
    "gear_shaft_revolutions",
)


def read_axes(
    root: Table, controller_node: int, acceleration_mm_s2: float
) -> tuple[tuple[Axis, ...], int]:
    """The axes of a machine file and their common counts per mm.

    `acceleration_mm_s2`, the controller's limit, is what quick stops brake with where nothing else is said.
    """
    tables = root.tables("axis", _AXIS)
    if len(tables) > MAX_AXES:
        raise tables[-1].error("name", f"makes {len(tables)} axes: a machine has 1 to {MAX_AXES}")
    counts = [
        t.integer("counts_per_mm", 1_000_000, low=1000, high=COUNTS_PER_MM_MAX) for t in tables
    ]
    if len(set(counts)) != 1:
        raise tables[-1].error("counts_per_mm", "must be the same for all axes")
    axes = tuple(_axis(t, counts[0], acceleration_mm_s2) for t in tables)
    taken = {controller_node: "the controller"}
    for axis, table in zip(axes, tables, strict=True):
        if axis.node in taken:
            raise table.error("node", f"{axis.node} is taken by {taken[axis.node]}")
        taken[axis.node] = f"axis {axis.name}"
    return axes, counts[0]


def _axis(table: Table, counts_per_mm: int, acceleration_mm_s2: float) -> Axis:
    low, high = table.pair("travel_mm", low=-4096, high=4096)
    if not low < high:
        raise table.error("travel_mm", f"must be [least, greatest], but is [{low:g}, {high:g}]")
    reach = I32_MAX / counts_per_mm
    if max(abs(low), abs(high)) > reach:
        raise table.error("travel_mm", f"leaves the ±{reach:.1f} mm that i32 counts can express")
    drive = load_drive(table.present("drive")) if table.has("drive") else None
    steepest = math.floor(1000 * U32_MAX / counts_per_mm) / 1000
    window = None
    if table.has("following_window_mm"):
        window = _counted(table, "following_window_mm", 0, counts_per_mm)
    return Axis(
        name=table.text("name"),
        node=table.integer("node", low=1, high=127),
        travel_min_mm=low,
        travel_max_mm=high,
        velocity_mm_s=_motion_limit(table, "velocity_mm_s", 0.01, 4000),
        acceleration_mm_s2=_motion_limit(table, "acceleration_mm_s2", 0.1, 4e6),
        jerk_mm_s3=_motion_limit(table, "jerk_mm_s3", 1, 4e9),
        drive=drive,
        following_window_mm=window,
        following_timeout_ms=table.integer(
            "following_timeout_ms", 0 if window is None else 10, low=0, high=65535
        ),
        quick_stop_mm_s2=_counted(
            table, "quick_stop_mm_s2", min(acceleration_mm_s2, steepest), counts_per_mm
        ),
        homing=_homing(table, counts_per_mm, reach),
        feedforward=_feedforward(table),
        scaling=_scaling(table, drive, counts_per_mm),
        identity=_identity(table),
    )


def _motion_limit(table: Table, key: str, low: float, high: float) -> float:
    if not table.has(key):
        raise table.error(
            key,
            "is missing: add what the axis may do (velocity_mm_s, acceleration_mm_s2 and jerk_mm_s3)",
        )
    return table.number(key, low=low, high=high)


def _counted(table: Table, key: str, default: float, counts_per_mm: int) -> float:
    """A positive length, speed or acceleration that is sent as u32 in counts."""
    value = table.number(key, default, low=1e-6, high=1e9)
    if not 1 <= value * counts_per_mm <= U32_MAX:
        raise table.error(
            key,
            f"must be from {1 / counts_per_mm:g} to {U32_MAX / counts_per_mm:.1f} "
            f"(u32 in counts, {counts_per_mm} a mm), but is {value:g}",
        )
    return value


def _homing(axis: Table, counts_per_mm: int, reach_mm: float) -> Homing:
    if not axis.has("homing"):
        return Homing()
    table, usual = axis.table("homing", _HOMING), Homing()
    method = table.integer("method", low=-128, high=127)
    if method not in HOMING_METHODS:
        known = ", ".join(map(str, HOMING_METHODS))
        raise table.error("method", f"must be one of {known}, but is {method}")
    speed = _counted(table, "speed_mm_s", usual.speed_mm_s, counts_per_mm)
    slow = _counted(table, "slow_mm_s", min(usual.slow_mm_s, speed), counts_per_mm)
    if slow > speed:
        raise table.error("slow_mm_s", f"is {slow:g}, above speed_mm_s = {speed:g}")
    return Homing(
        method=method,
        offset_mm=table.number("offset_mm", usual.offset_mm, low=-reach_mm, high=reach_mm),
        speed_mm_s=speed,
        slow_mm_s=slow,
        acceleration_mm_s2=_counted(
            table, "acceleration_mm_s2", usual.acceleration_mm_s2, counts_per_mm
        ),
    )


def _feedforward(axis: Table) -> Feedforward:
    table = axis.table("feedforward", _FEEDFORWARD, required=False)
    return Feedforward(
        velocity=table.number("velocity", 0.0, low=0, high=2),
        torque_permille_s2_m=table.number("torque_permille_s2_m", 0.0, low=-32767, high=32767),
        torque_permille_s_m=table.number("torque_permille_s_m", 0.0, low=-32767, high=32767),
    )


def _identity(axis: Table) -> Identity:
    table = axis.table("identity", _IDENTITY, required=False)
    given = {key: table.integer(key, low=1, high=U32_MAX) for key in _IDENTITY if table.has(key)}
    return Identity(**given)


def _scaling(axis: Table, drive: Drive | None, counts_per_mm: int) -> Scaling:
    if not axis.has("scaling"):
        return Scaling()
    table = axis.table("scaling", _SCALING)

    def number(key: str, default: int) -> int:
        return table.integer(key, default, low=0, high=U32_MAX)

    feed = number("feed_counts_per_rev", _feed_of(drive, counts_per_mm))
    geared = table.has("gear_motor_revolutions") or table.has("gear_shaft_revolutions")
    motor = number("gear_motor_revolutions", int(geared))
    shaft = number("gear_shaft_revolutions", int(geared))
    if bool(motor) != bool(shaft):
        raise table.error(
            "gear_motor_revolutions", f"is {motor}, gear_shaft_revolutions {shaft}: both or none"
        )
    return Scaling(number("encoder_increments_per_rev", 0), feed, motor, shaft)


def _feed_of(drive: Drive | None, counts_per_mm: int) -> int:
    return 0 if drive is None else round(2 * math.pi * drive.screw_mm_rad * counts_per_mm)
