# SPDX-License-Identifier: MIT
"""Machine files: bus, controller limits, work offset, axes and their drives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..names import KERNELS
from .drive_file import Drive, load_drive
from .table import Table, read_toml

COUNTS_LIMIT = 2**31 - 1


@dataclass(frozen=True)
class Axis:
    """One axis: CANopen node, travel limits in machine coordinates, bus resolution, drive."""

    name: str
    node: int
    travel_min_mm: float
    travel_max_mm: float
    drive: Drive
    drive_file: Path


@dataclass(frozen=True)
class Machine:
    """What a machine file says. The limits are the controller's own: they always bind."""

    file: Path
    bitrate: int
    period_us: int
    node: int
    kernel: str
    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    reserve: float
    start_tolerance_mm: float
    offset_mm: complex
    counts_per_mm: int
    axes: tuple[Axis, ...]

    @property
    def start_tolerance_counts(self) -> int:
        """Tolerance at the start point, in bus counts."""
        return round(self.start_tolerance_mm * self.counts_per_mm)


_SECTIONS = ("bus", "controller", "work", "axis")
_CONTROLLER = (
    "node",
    "kernel",
    "feed_mm_s",
    "acceleration_mm_s2",
    "jerk_mm_s3",
    "reserve",
    "start_tolerance_mm",
)
_AXIS = ("name", "node", "travel_mm", "counts_per_mm", "drive")


def load_machine(file: Path) -> Machine:
    """The machine that a TOML file describes, with the drive files it names; raises InputError."""
    root = Table(file, "", read_toml(file), _SECTIONS)
    bus = root.table("bus", ("bitrate", "period_us"), required=False)
    controller = root.table("controller", _CONTROLLER)
    work = root.table("work", ("offset_mm",), required=False)
    node = controller.integer("node", 1, low=1, high=127)
    axes, counts_per_mm = _axes(root, node)
    return Machine(
        file=file,
        bitrate=bus.integer("bitrate", 1_000_000, low=10_000, high=1_000_000),
        period_us=_period(bus),
        node=node,
        kernel=controller.choice("kernel", KERNELS, "fixed"),
        feed_mm_s=controller.number("feed_mm_s", low=0.01, high=4000),
        acceleration_mm_s2=controller.number("acceleration_mm_s2", low=0.1, high=4e6),
        jerk_mm_s3=controller.number("jerk_mm_s3", low=1, high=4e9),
        reserve=controller.number("reserve", 0.1, low=0, high=0.9),
        start_tolerance_mm=controller.number("start_tolerance_mm", 0.005, low=1e-6, high=10),
        offset_mm=complex(*work.pair("offset_mm", (0.0, 0.0), low=-4096, high=4096)),
        counts_per_mm=counts_per_mm,
        axes=axes,
    )


def _period(bus: Table) -> int:
    period_us = bus.integer("period_us", 1000, low=1000, high=8000)
    if period_us not in (1000, 2000, 4000, 8000):
        raise bus.error("period_us", f"must be 1000, 2000, 4000 or 8000, but is {period_us}")
    return period_us


def _axes(root: Table, controller_node: int) -> tuple[tuple[Axis, ...], int]:
    tables = root.tables("axis", _AXIS)
    if len(tables) != 2:
        raise tables[-1].error("name", f"makes {len(tables)} axes: a planar machine has exactly 2")
    counts = [t.integer("counts_per_mm", 1_000_000, low=1000, high=10_000_000) for t in tables]
    if len(set(counts)) != 1:
        raise tables[-1].error("counts_per_mm", "must be the same for all axes")
    axes = tuple(_axis(t, counts[0]) for t in tables)
    taken = {controller_node: "the controller"}
    for axis, table in zip(axes, tables, strict=True):
        if axis.node in taken:
            raise table.error("node", f"{axis.node} is taken by {taken[axis.node]}")
        taken[axis.node] = f"axis {axis.name}"
    return axes, counts[0]


def _axis(table: Table, counts_per_mm: int) -> Axis:
    low, high = table.pair("travel_mm", low=-4096, high=4096)
    if not low < high:
        raise table.error("travel_mm", f"must be [least, greatest], but is [{low:g}, {high:g}]")
    reach = COUNTS_LIMIT / counts_per_mm
    if max(abs(low), abs(high)) > reach:
        raise table.error("travel_mm", f"leaves the ±{reach:.1f} mm that i32 counts can express")
    drive_file = table.present("drive")
    return Axis(
        name=table.text("name"),
        node=table.integer("node", low=1, high=127),
        travel_min_mm=low,
        travel_max_mm=high,
        drive=load_drive(drive_file),
        drive_file=drive_file,
    )
