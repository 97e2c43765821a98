# SPDX-License-Identifier: MIT
"""The machine that programs are made for."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from ..config import Machine as MachineFile
from ..config import is_there, load_machine
from ..data import EXAMPLES
from ..errors import InputError

Real = NDArray[np.float64]


def example_file(name: str) -> FilePath:
    """A path file that the package brings, such as "alpha" or "star". Raises InputError for an unknown name."""
    return _example(EXAMPLES, name)


def _example(folder: FilePath, name: str) -> FilePath:
    file = folder / f"{name}.toml"
    if not is_there(file):
        known = ", ".join(sorted(one.stem for one in folder.glob("*.toml")))
        raise InputError(f'there is no example "{name}"; use one of: {known}')
    return file


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine as its file describes it (docs/reference/files.md section 2); made by `load` or `example`.

    >>> machine = Machine.example("paper_alpha")
    >>> machine.axis_names, machine.period_us
    (('x', 'y'), 1000)
    """

    _file: MachineFile

    @classmethod
    def load(cls, file: str | PathLike[str]) -> Machine:
        """The machine of a file (TOML). Raises InputError."""
        return cls(load_machine(FilePath(file)))

    @classmethod
    def example(cls, name: str = "paper_alpha") -> Machine:
        """A machine that the package brings, with simulated drives. Raises InputError for an unknown name."""
        return cls.load(_example(EXAMPLES / "machines", name))

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the axes, in the order of the file. The path axes come first."""
        return tuple(axis.name for axis in self._file.axes)

    @property
    def nodes(self) -> tuple[int, ...]:
        """CANopen node numbers of the drives, by axis."""
        return self._file.nodes

    @property
    def period_us(self) -> int:
        """Period of the setpoints."""
        return self._file.period_us

    @property
    def counts_per_mm(self) -> int:
        """Unit of positions on the bus."""
        return self._file.counts_per_mm

    @property
    def travel_mm(self) -> Real:
        """Least and greatest position of each axis, (axes, 2)."""
        return np.array([(axis.travel_min_mm, axis.travel_max_mm) for axis in self._file.axes])

    @property
    def velocity_mm_s(self) -> Real:
        """Greatest velocity of each axis, (axes,)."""
        return np.array([axis.velocity_mm_s for axis in self._file.axes])

    @property
    def acceleration_mm_s2(self) -> Real:
        """Greatest acceleration of each axis, (axes,)."""
        return np.array([axis.acceleration_mm_s2 for axis in self._file.axes])

    @property
    def jerk_mm_s3(self) -> Real:
        """Greatest jerk of each axis, (axes,)."""
        return np.array([axis.jerk_mm_s3 for axis in self._file.axes])

    def __repr__(self) -> str:
        return f"Machine({str(self._file.file)!r})"
