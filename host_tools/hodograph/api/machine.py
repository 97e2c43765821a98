# SPDX-License-Identifier: MIT
"""The machine that programs are made for. Used by api/, and by programs of users. Reads machine files and the drive
files that they name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..config import Machine as MachineFile
from ..config import is_there, load_machine, machine_of
from ..data import EXAMPLES
from ..errors import InputError

Real = NDArray[np.float64]


def example_file(name: str) -> FilePath:
    """A path file of the package, such as "alpha" or "star". Raises InputError for an unknown name."""
    return _example(EXAMPLES, name)


def _example(folder: FilePath, name: str) -> FilePath:
    file = folder / f"{name}.toml"
    if not is_there(file):
        known = ", ".join(sorted(one.stem for one in folder.glob("*.toml")))
        raise InputError(f'there is no example "{name}"; use one of: {known}')
    return file


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine as its file describes it (docs/reference/files.md section 2); made by `load`, `of` or `example`.

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
    def of(
        cls,
        contents: Mapping[str, Any],
        *,
        name: str = "machine",
        folder: str | PathLike[str] = ".",
    ) -> Machine:
        """The machine of a mapping with the keys of a machine file; only drive files that it names are read.

        contents  as from `tomllib.load`: tables are mappings, [[axis]] is a sequence of them. Numbers and arrays may be
                  NumPy's. `drive` of an axis is the name of a drive file, or a mapping with its contents
        name      for messages
        folder    that drive files are relative to

        Raises InputError.

        >>> axis = {"travel_mm": (-100, 100), "velocity_mm_s": 200, "acceleration_mm_s2": 2000, "jerk_mm_s3": 5e4}
        >>> machine = Machine.of({
        ...     "bus": {"period_us": 2000},
        ...     "controller": {"feed_mm_s": 200, "acceleration_mm_s2": 2000, "jerk_mm_s3": 5e4},
        ...     "axis": [axis | {"name": "x", "node": 2}, axis | {"name": "y", "node": 3}],
        ... })
        >>> machine.axis_names, machine.period_us
        (('x', 'y'), 2000)
        """
        plain = _plain(contents, name)
        if not isinstance(plain, dict):
            raise InputError(f"{name}: must be a mapping with the keys of a machine file")
        return cls(machine_of(FilePath(folder, name), plain))

    @classmethod
    def example(cls, name: str = "paper_alpha") -> Machine:
        """A machine of the package, with simulated drives. Raises InputError for an unknown name."""
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


def _plain(value: Any, name: str) -> Any:
    """A value in a type of TOML. Raises InputError: TOML cannot express it."""
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputError(f"{name}: key {key!r} must be a text")
        return {key: _plain(one, f"{name}: {key}") for key, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist(), name)
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, PathLike):
        return str(value)
    if isinstance(value, Sequence):
        return [_plain(one, name) for one in value]
    raise InputError(
        f"{name}: {value!r} is neither text, number, sequence nor mapping: leave it out"
    )
