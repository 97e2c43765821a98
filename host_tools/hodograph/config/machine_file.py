# SPDX-License-Identifier: MIT
"""Machine files: bus, controller limits, work offset, axes and their drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..names import KERNELS
from .axis_table import Axis, Feedforward, read_axes
from .drive_file import Drive
from .table import Table, read_toml

PLANE_AXES = 2
"""The first two axes follow the path, the rest hold their position."""


@dataclass(frozen=True)
class Supervision:
    """When answers or setpoints that stay away become a fault (docs/reference/protocol.md section 3, object 0x2004)."""

    answer_wait_ms: int = 100
    missed_max: int = 1
    setpoint_timeout_ms: int = 200


@dataclass(frozen=True)
class Machine:
    """What a machine file says. The limits are the controller's own: they always bind.

    stop_time_ms  a program whose fault stop may take longer is refused
    """

    file: Path
    bitrate: int
    period_us: int
    node: int
    kernel: str
    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    reserve: float
    stop_time_ms: int
    start_tolerance_mm: float
    offset_mm: complex
    counts_per_mm: int
    supervision: Supervision
    axes: tuple[Axis, ...]
    program_bytes: int | None = None
    """Room for a program in the controller's memory (0x2041 sub 1), for `compile`'s warning; None: not known."""

    @property
    def start_tolerance_counts(self) -> int:
        """Tolerance at the start point, in bus counts."""
        return round(self.start_tolerance_mm * self.counts_per_mm)

    @property
    def nodes(self) -> tuple[int, ...]:
        """Node numbers of the drives, by axis."""
        return tuple(axis.node for axis in self.axes)

    @property
    def torque_feedforward(self) -> bool:
        """Whether setpoints carry a torque offset: where one axis needs it, all have room for it."""
        return any(axis.feedforward.has_torque for axis in self.axes)

    @property
    def velocity_feedforward(self) -> bool:
        """Whether a second frame with a velocity offset goes with the setpoints, for all axes alike."""
        return any(axis.feedforward.velocity for axis in self.axes)

    @property
    def plane(self) -> tuple[Axis, Axis]:
        """The axes that follow a path, x and y. Raises InputError: there is only one axis."""
        if len(self.axes) < PLANE_AXES:
            raise InputError(
                f"{self.file}: has one axis ({self.axes[0].name}), a path needs two: add a second [[axis]]"
            )
        return self.axes[0], self.axes[1]

    @property
    def plane_feedforward(self) -> tuple[Feedforward, Feedforward] | None:
        """The feedforward of the axes that follow a path; None: they have none."""
        x, y = (axis.feedforward for axis in self.plane)
        return (x, y) if any(f.velocity or f.has_torque for f in (x, y)) else None

    def models(self, axes: Sequence[Axis]) -> tuple[Drive, ...]:
        """The drives of these axes as simulated. Raises InputError: one has no drive file."""
        for axis in axes:
            if axis.drive is None:
                raise InputError(
                    f"{self.file}: axis {axis.name} cannot be simulated without a model: "
                    'add drive = "FILE" to its [[axis]]'
                )
        return tuple(axis.drive for axis in axes if axis.drive is not None)


_SECTIONS = ("bus", "controller", "supervision", "work", "axis")
_CONTROLLER = (
    "node",
    "kernel",
    "feed_mm_s",
    "acceleration_mm_s2",
    "jerk_mm_s3",
    "reserve",
    "stop_time_ms",
    "start_tolerance_mm",
    "program_bytes",
)
_SUPERVISION = ("answer_wait_ms", "missed_max", "setpoint_timeout_ms")


def load_machine(file: Path) -> Machine:
    """The machine that a TOML file describes, with the drive files it names; raises InputError."""
    root = Table(file, "", read_toml(file), _SECTIONS)
    bus = root.table("bus", ("bitrate", "period_us"), required=False)
    controller = root.table("controller", _CONTROLLER)
    work = root.table("work", ("offset_mm",), required=False)
    node = controller.integer("node", 1, low=1, high=127)
    acceleration_mm_s2 = controller.number("acceleration_mm_s2", low=0.1, high=4e6)
    axes, counts_per_mm = read_axes(root, node, acceleration_mm_s2)
    return Machine(
        file=file,
        bitrate=bus.integer("bitrate", 1_000_000, low=10_000, high=1_000_000),
        period_us=_period(bus),
        node=node,
        kernel=controller.choice("kernel", KERNELS, "fixed"),
        feed_mm_s=controller.number("feed_mm_s", low=0.01, high=4000),
        acceleration_mm_s2=acceleration_mm_s2,
        jerk_mm_s3=controller.number("jerk_mm_s3", low=1, high=4e9),
        reserve=controller.number("reserve", 0.1, low=0, high=0.9),
        stop_time_ms=controller.integer("stop_time_ms", 250, low=1, high=60_000),
        start_tolerance_mm=controller.number("start_tolerance_mm", 0.005, low=1e-6, high=10),
        offset_mm=complex(*work.pair("offset_mm", (0.0, 0.0), low=-4096, high=4096)),
        counts_per_mm=counts_per_mm,
        supervision=_supervision(root),
        axes=axes,
        program_bytes=controller.integer("program_bytes", 0, low=0, high=2**32 - 1) or None,
    )


def _period(bus: Table) -> int:
    period_us = bus.integer("period_us", 1000, low=1000, high=8000)
    if period_us not in (1000, 2000, 4000, 8000):
        raise bus.error("period_us", f"must be 1000, 2000, 4000 or 8000, but is {period_us}")
    return period_us


def _supervision(root: Table) -> Supervision:
    table, usual = root.table("supervision", _SUPERVISION, required=False), Supervision()
    wait_ms = table.integer("answer_wait_ms", usual.answer_wait_ms, low=0, high=10_000)
    timeout_ms = table.integer(
        "setpoint_timeout_ms", usual.setpoint_timeout_ms, low=10, high=60_000
    )
    if timeout_ms <= wait_ms:
        raise table.error(
            "setpoint_timeout_ms",
            f"is {timeout_ms}: must be above answer_wait_ms = {wait_ms}, or drives stop while one is waited for",
        )
    return Supervision(
        answer_wait_ms=wait_ms,
        missed_max=table.integer("missed_max", usual.missed_max, low=0, high=255),
        setpoint_timeout_ms=timeout_ms,
    )
