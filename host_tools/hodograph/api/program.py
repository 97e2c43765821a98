# SPDX-License-Identifier: MIT
"""Programs of a controller, and their runs with simulated drives or on a bus. Used by api/, and by programs of users.
Reads and writes files of program images.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..config import SPACE_AXES
from ..config import Machine as MachineFile
from ..errors import InputError
from ..machine_limits import controller_verdict
from ..native import NativeProgram
from ..pipeline import program_start_counts
from ..program.image import read_image
from ..simulate import Motion, simulate_on
from .machine import Machine

Real = NDArray[np.float64]
Kernel = Literal["fixed", "float", "double"]


@dataclass(frozen=True, eq=False)
class Run:
    """A run of a program: row k belongs to setpoint k, n rows in all, for A path axes. Maxima include 0.2 s of settling
    after the last setpoint.

    bus               where it ran; None: offline
    deadline_misses   ticks that the controller missed; None offline
    """

    _motion: Motion = field(repr=False)
    bus: str | None = None
    deadline_misses: int | None = None

    @property
    def t_s(self) -> Real:
        """Time of each setpoint (n,)."""
        return self._motion.t_s[: self._motion.ticks]

    @property
    def arc_length_mm(self) -> Real:
        """Commanded arc length (n,)."""
        return self._motion.arc_length_mm[: self._motion.ticks]

    @property
    def feed_mm_s(self) -> Real:
        """Commanded feed (n,)."""
        return self._motion.feed_mm_s[: self._motion.ticks]

    @property
    def commanded_mm(self) -> Real:
        """Point of the kernel, before it is rounded to counts (n, A)."""
        return self._motion.cmd_mm[: self._motion.ticks]

    @property
    def setpoints_counts(self) -> NDArray[np.int32]:
        """Setpoints as they go to the drives (n, A)."""
        return self._motion.set_counts[: self._motion.ticks].copy()

    @property
    def actual_mm(self) -> Real:
        """Encoder position at the time when setpoint k should be reached (n, A)."""
        return self._motion.act_mm[: self._motion.ticks]

    @property
    def following_error_um(self) -> Real:
        """Setpoint less position (n, A); thousandths of a degree of rotary axes."""
        return self._motion.following_error_um[: self._motion.ticks]

    @property
    def contour_error_um(self) -> Real:
        """Distance of the encoder position from the exact path (n,)."""
        return self._motion.contour_error_um[: self._motion.ticks]

    @property
    def orientation_error(self) -> Real:
        """Error of the axes after x, y, z (n, A - 3) against the exact path at its point nearest to the tool; degrees
        for rotary axes, else mm.
        """
        return self._motion.orientation_error[: self._motion.ticks]

    @property
    def greatest_contour_error_um(self) -> float:
        """Greatest contour error of the whole run, including settling."""
        return self._motion.max_contour_error_um

    @property
    def greatest_following_error_um(self) -> float:
        """Greatest following error of an axis in mm, including settling."""
        return self._motion.max_following_error_um

    @property
    def setpoints_sha256(self) -> str:
        """SHA-256 of all setpoints; equal offline and on each bus."""
        return self._motion.setpoints_sha256

    @property
    def encoders_sha256(self) -> str:
        """SHA-256 of all encoder positions; with simulated drives equal offline and on each bus."""
        return self._motion.encoders_sha256

    def __repr__(self) -> str:
        where = "offline" if self.bus is None else f"on {self.bus}"
        return f"Run({self._motion.ticks} setpoints, {where})"


@dataclass(frozen=True, eq=False)
class Program:
    """A program image for a machine; made by `Plan.program` or `load_program`.

    image     the bytes that the controller gets (docs/reference/protocol.md section 1)

    Raises InputError for an image that the machine's controller would refuse.

    >>> from hodograph import Limits, Machine, Path
    >>> path = Path.through([[0, 0], [20, 0], [35, 10], [35, 30]])
    >>> program = path.plan(Limits(feed_mm_s=100), machine=Machine.example()).program()
    >>> program.period_us
    1000
    >>> run = program.simulate()
    >>> run.setpoints_counts.shape == (program.ticks, 2)
    True
    """

    image: bytes = field(repr=False)
    machine: Machine
    _standing_mm: tuple[float, ...] = field(default=(), repr=False)
    """Positions of the path's axes before those of the program, if the program moves rotary axes alone."""

    def __post_init__(self) -> None:
        fault = controller_verdict(self._native, self._moved)
        if fault is not None:
            raise InputError(
                f"program image: {fault.text} (code {fault.code}, number {fault.index}): "
                "make it again for this machine"
            )

    @cached_property
    def _native(self) -> NativeProgram:
        return NativeProgram(self.image)

    @property
    def _moved(self) -> MachineFile:
        """The machine, with the axes that the program moves. Raises InputError: it cannot move rotary axes alone."""
        whole = self.machine._file
        if not self._native.first_axis:
            return whole
        if whole.path_count <= SPACE_AXES:
            raise InputError(
                "program image: moves rotary axes alone, which the machine does not have"
            )
        return whole.turning

    @property
    def ticks(self) -> int:
        """Number of setpoints."""
        return self._native.ticks

    @property
    def period_us(self) -> int:
        """Time between setpoints."""
        return self._native.period_us

    @property
    def duration_s(self) -> float:
        """Time of the motion; the last setpoint is at its end, or less than a period later."""
        return self._native.duration_q32_s * 2.0**-32

    def _start_counts(self) -> list[int]:
        """Positions of all axes of the machine's path at its start. Raises InputError: they are not known."""
        machine = self.machine._file
        return program_start_counts(self._native, machine, machine.kernel, self._standing_mm)

    def setpoints_counts(self, kernel: Kernel | None = None) -> NDArray[np.int32]:
        """All setpoints in counts (ticks, A), as the controller computes them. `kernel` None: the machine's."""
        machine = self._moved
        _, counts = self._native.setpoints(kernel or machine.kernel, machine.path_counts)
        return counts

    def simulate(self, kernel: Kernel | None = None) -> Run:
        """Runs it with simulated drives, without a bus or waiting. `kernel` None: the machine's.

        Raises InputError if an axis of the machine has no drive file.
        """
        return Run(simulate_on(self._moved, self._native, kernel))

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the image. Raises OSError."""
        FilePath(file).write_bytes(self.image)


def load_program(file: str | PathLike[str], machine: Machine) -> Program:
    """A program image from a file (.hdgp), for a machine. Raises InputError."""
    image = read_image(FilePath(file))
    if image is None:
        raise InputError(f"{file}: no program image: make one with hodograph compile")
    return Program(image, machine)
