# SPDX-License-Identifier: MIT
"""Machine files: bus, controller limits, work offset, axes and their drives. Used by many modules of host_tools. Reads
the file that it is given, and the drive files that it names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..names import AXES, KERNELS
from .axis_table import MAX_AXES, Axis, Feedforward, read_axes
from .drive_file import Drive
from .outputs import Outputs, read_outputs
from .table import Table, read_toml

PLANE_AXES, SPACE_AXES = 2, 3
"""Axes that draw a path in the plane and in space. Further axes of a path follow it in the same parameter."""


@dataclass(frozen=True)
class Supervision:
    """Times after which missing answers or setpoints are a fault (docs/reference/protocol.md section 3, object
    0x2004).
    """

    answer_wait_ms: int = 100
    missed_max: int = 1
    setpoint_timeout_ms: int = 200


@dataclass(frozen=True)
class Machine:
    """The contents of a machine file. The limits are the controller's own and always apply.

    stop_time_ms  a program whose fault stop may take longer is refused
    offset_mm     machine position of position 0 of a path: one number for each axis of the path
    start_mm      where a toolpath starts, without offset_mm: one number for each axis of the path
    axes          first those that follow the path, in its order; then those that hold their position, as in the file
    path_count    how many of them follow the path
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
    offset_mm: tuple[float, ...]
    start_mm: tuple[float, ...]
    supervision: Supervision
    axes: tuple[Axis, ...]
    path_count: int
    program_bytes: int | None = None
    """Bytes for a program in the controller's memory (0x2041 sub 1), for the warning of `compile`; None: not known."""
    outputs: Outputs | None = None
    """The outputs that a path switches; None: there is no I/O module."""
    first_axis: int = 0
    """Number of the first axis that a program moves; above 0 only in `turning`."""

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
        """Whether setpoints have a torque offset: all have it if one axis needs it."""
        return any(axis.feedforward.has_torque for axis in self.axes)

    @property
    def velocity_feedforward(self) -> bool:
        """Whether a second frame with a velocity offset goes with the setpoints, for all axes alike."""
        return any(axis.feedforward.velocity for axis in self.axes)

    @property
    def counts_per_mm(self) -> int:
        """Counts of a mm, the same for all axes in mm; if all axes are rotary, counts of a degree of the first."""
        straight = [axis for axis in self.axes if not axis.turns]
        return (straight or self.axes)[0].counts_per_unit

    @property
    def path_axes(self) -> tuple[Axis, ...]:
        """The axes that follow a path, in its order: two in the plane; three in space, and up to three more.

        Raises InputError: there is only one axis, or one of those that draw the path is rotary.
        """
        if len(self.axes) < PLANE_AXES:
            raise InputError(
                f"{self.file}: has one axis ({self.axes[0].name}), a path needs two: add a second [[axis]]"
            )
        if self.first_axis:
            return self.axes[self.first_axis : self.first_axis + self.path_count]
        return _drawn(self.file, self.axes[: self.path_count])

    @property
    def turning(self) -> Machine:
        """This machine for programs that move rotary axes alone, while x and y stand. Its path axes are those after z,
        and also z if there is only one such axis. The unit of length of such a program is the degree.

        Asserts that the machine has extra axes.
        """
        assert self.path_count > SPACE_AXES, "no extra axes"
        first = min(SPACE_AXES, self.path_count - PLANE_AXES)
        return replace(
            self,
            first_axis=first,
            path_count=self.path_count - first,
            offset_mm=self.offset_mm[first:],
            start_mm=self.start_mm[first:],
        )

    @property
    def path_names(self) -> tuple[str, ...]:
        """Names of the axes that follow a path: x, y in the plane, their own names in space."""
        axes = self.path_axes
        plane = len(axes) == PLANE_AXES and not self.first_axis
        return AXES[:PLANE_AXES] if plane else tuple(axis.name for axis in axes)

    @property
    def path_counts(self) -> tuple[int, ...]:
        """Counts of a mm, or of a degree, of the axes that follow a path."""
        return tuple(axis.counts_per_unit for axis in self.path_axes)

    @property
    def path_units(self) -> tuple[str, ...]:
        """Units of the path axes, "mm" or "deg"."""
        return tuple(axis.unit for axis in self.path_axes)

    def require_plane(self, what: str) -> tuple[Axis, Axis]:
        """The two axes of a path, for a command that supports the plane only. Raises InputError: there are more, or
        one.
        """
        axes = self.path_axes
        if len(axes) > PLANE_AXES:
            names = ", ".join(axis.name for axis in axes)
            raise InputError(
                f"{self.file}: {what} takes two path axes, but these follow a path: {names}; name two in path = [...]"
            )
        return axes[0], axes[1]

    @property
    def path_feedforward(self) -> tuple[Feedforward, ...] | None:
        """The feedforward of the axes that follow a path; None: they have none."""
        forward = tuple(axis.feedforward for axis in self.path_axes)
        return forward if any(f.velocity or f.has_torque for f in forward) else None

    @property
    def plane_feedforward(self) -> tuple[Feedforward, Feedforward] | None:
        """The feedforward of the two axes of a path in the plane."""
        forward = self.path_feedforward
        return None if forward is None else (forward[0], forward[1])

    def models(self, axes: Sequence[Axis]) -> tuple[Drive, ...]:
        """The drives of these axes as simulated. Raises InputError: one has no drive file."""
        for axis in axes:
            if axis.drive is None:
                raise InputError(
                    f"{self.file}: axis {axis.name} cannot be simulated without a model: "
                    'add drive = "FILE" to its [[axis]]'
                )
        return tuple(axis.drive for axis in axes if axis.drive is not None)


_SECTIONS = ("path", "bus", "controller", "supervision", "work", "outputs", "axis")
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
    return machine_of(file, read_toml(file))


def machine_of(file: Path, contents: Mapping[str, Any]) -> Machine:
    """The machine that the contents of a machine file describe. Raises InputError.

    file  name in messages; drive files are relative to its folder
    """
    root = Table(file, "", contents, _SECTIONS)
    bus = root.table("bus", ("bitrate", "period_us"), required=False)
    controller = root.table("controller", _CONTROLLER)
    work = root.table("work", ("offset_mm", "start_mm"), required=False)
    node = controller.integer("node", 1, low=1, high=127)
    acceleration_mm_s2 = controller.number("acceleration_mm_s2", low=0.1, high=4e6)
    given = read_axes(root, node, acceleration_mm_s2)
    path = _path(root, given)
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
        offset_mm=_place(work, "offset_mm", max(len(path), PLANE_AXES)),
        start_mm=_start(work, path),
        supervision=_supervision(root),
        axes=path + tuple(axis for axis in given if axis not in path),
        path_count=len(path),
        program_bytes=controller.integer("program_bytes", 0, low=0, high=2**32 - 1) or None,
        outputs=read_outputs(root, (node, *(axis.node for axis in given))),
    )


def _path(root: Table, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """The axes that `path` names; without it the first two."""
    if not root.has("path"):
        return axes[:PLANE_AXES]
    names = root.texts("path")
    by_name = {axis.name: axis for axis in axes}
    for i, name in enumerate(names):
        if name not in by_name:
            raise root.error("path", f'names "{name}", but the axes are {", ".join(by_name)}')
        if sum(axis.name == name for axis in axes) > 1:
            raise root.error(
                "path", f'names "{name}", which two axes are called: give each its own'
            )
        if name in names[:i]:
            raise root.error("path", f'names "{name}" twice')
    if len(names) < PLANE_AXES:
        raise root.error("path", f"names one axis: it takes two, or three to {MAX_AXES}")
    return _drawn(root.file, tuple(by_name[name] for name in names))


def _drawn(file: Path, path: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """The same axes. Raises InputError: one of those that draw the path is rotary."""
    for axis in path[:SPACE_AXES]:
        if axis.turns:
            raise InputError(
                f"{file}: path: axis {axis.name} turns, but a path is drawn by the first "
                f"{'two' if len(path) == PLANE_AXES else 'three'} of its axes: name axes in mm there"
            )
    return path


def _place(work: Table, key: str, count: int) -> tuple[float, ...]:
    if not work.has(key):
        return (0.0,) * count
    return work.vector(key, count, low=-4096, high=4096)


def _start(work: Table, path: tuple[Axis, ...]) -> tuple[float, ...]:
    """`start_mm`. Raises InputError: it is not 0 for an axis that no toolpath moves."""
    start = _place(work, "start_mm", max(len(path), PLANE_AXES))
    for axis, number in zip(path[SPACE_AXES:], start[SPACE_AXES:], strict=False):
        if number and axis.name.lower() not in AXES[SPACE_AXES:]:
            raise work.error(
                "start_mm",
                f"is {number:g} for axis {axis.name}: toolpaths move only a, b and c after z, give 0 for others",
            )
    return start


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
