# SPDX-License-Identifier: MIT
"""The settings of a run from its number: all combinations, in the order of the campaign file's sections. Used by the
other modules of campaign. No I/O.

Of path, profile, feed, gains, fault, grid and sample the last changes fastest. So the runs of a program are
consecutive, and among them those of a group, which differ in grid and sample only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Any

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..native import OfflineFault
from .fault_rules import Fault
from .variation import Variation, figure

Varied = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Plant:
    """The simulated machine that a path runs on: models, feedforward, nodes and counts of the axes of the path."""

    drives: tuple[Drive, ...]
    feedforward: tuple[Feedforward, ...]
    nodes: tuple[int, ...]
    kernel: str
    counts_per_unit: tuple[int, ...]
    period_us: int


@dataclass(frozen=True)
class Gains:
    """Gains and feedforward that replace those of the path's machine; the others stay.

    changes        figure of a drive, and its value for each axis
    feed           the same for fields of Feedforward
    interpolation  how the drive of each axis goes from setpoint to setpoint
    """

    name: str
    changes: tuple[tuple[str, tuple[float, ...]], ...] = ()
    feed: tuple[tuple[str, tuple[float, ...]], ...] = ()
    interpolation: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Case:
    """The common settings of a group's runs: indices in the lists of the design."""

    path: int
    profile: int
    feed: int
    gains: int
    fault: int


@dataclass(frozen=True)
class Run:
    """The settings of one run. `varied`: the figures that differ from run to run, by column."""

    number: int
    case: Case
    sample: int
    plant: Plant
    faults: tuple[OfflineFault, ...]
    varied: Varied


@dataclass(frozen=True)
class Design:
    """The design of a campaign: all settings of runs. None as profile or feed: that of the path file.

    axes  names of the axes of each path, the same for all
    """

    names: tuple[str, ...]
    axes: tuple[str, ...]
    plants: tuple[Plant, ...]
    profiles: tuple[str | None, ...]
    feeds_mm_s: tuple[float | None, ...]
    gains: tuple[Gains, ...]
    faults: tuple[Fault, ...]
    variations: tuple[Variation, ...]
    samples: int
    seed: int

    @cached_property
    def grids(self) -> tuple[Variation, ...]:
        """The variations whose numbers are all tried."""
        return tuple(variation for variation in self.variations if variation.is_grid)

    @property
    def group_size(self) -> int:
        """Runs of a group."""
        return prod(len(grid.numbers) for grid in self.grids) * self.samples

    @property
    def program_count(self) -> int:
        """Programs, each for a path, a profile and a feed."""
        return len(self.names) * len(self.profiles) * len(self.feeds_mm_s)

    @property
    def program_size(self) -> int:
        """Runs of a program."""
        return len(self.gains) * len(self.faults) * self.group_size

    @property
    def total(self) -> int:
        """Runs in all."""
        return self.program_count * self.program_size

    def case(self, group: int) -> Case:
        """The common settings of a group's runs."""
        lists = (self.names, self.profiles, self.feeds_mm_s, self.gains, self.faults)
        return Case(*_places(group, [len(each) for each in lists]))

    def run(self, number: int) -> Run:
        """The settings of a run. Raises InputError: the machine cannot have a fault."""
        case, grid, sample = self._parts(number)
        plant = _with_gains(self.plants[case.path], self.gains[case.gains])
        plant, varied = self._vary(plant, grid, sample)
        fault = self.faults[case.fault]
        faults = fault.rules(self.seed, sample, plant.nodes, plant.period_us)
        return Run(number, case, sample, plant, tuple(faults), varied)

    def varied(self, number: int) -> tuple[int, Varied]:
        """The sample of a run, and the figures that differ from run to run."""
        case, grid, sample = self._parts(number)
        plant = _with_gains(self.plants[case.path], self.gains[case.gains])
        return sample, self._vary(plant, grid, sample)[1]

    def rules(self, number: int) -> str:
        """The fault rules of a run, as text."""
        case, _, sample = self._parts(number)
        return "; ".join(self.faults[case.fault].lines(self.seed, sample))

    def _parts(self, number: int) -> tuple[Case, dict[Variation, int], int]:
        group, within = divmod(number, self.group_size)
        *grid, sample = _places(within, [*(len(v.numbers) for v in self.grids), self.samples])
        return self.case(group), dict(zip(self.grids, grid, strict=True)), sample

    @property
    def varied_columns(self) -> tuple[str, ...]:
        """The names in `Run.varied`."""
        return tuple(f"{axis}.{v.figure}" for v in self.variations for axis in v.axes(self.axes))

    def _vary(self, plant: Plant, grid: dict[Variation, int], sample: int) -> tuple[Plant, Varied]:
        drives = list(plant.drives)
        varied = []
        for variation in self.variations:
            for axis in variation.axes(self.axes):
                number = variation.number(axis, self.seed, sample, grid.get(variation, 0))
                place = self.axes.index(axis)
                value = variation.value(drives[place], number)
                drives[place] = with_figure(drives[place], variation.figure, value)
                varied.append((f"{axis}.{variation.figure}", value))
        return replace(plant, drives=tuple(drives)), tuple(varied)


def _places(number: int, sizes: list[int]) -> list[int]:
    """A number in the mixed base `sizes`, the last digit the fastest."""
    places = []
    for size in reversed(sizes):
        number, place = divmod(number, size)
        places.append(place)
    return places[::-1]


def with_figure(drive: Drive, name: str, value: float) -> Drive:
    """A drive with one figure changed."""
    if name == "friction_volts":
        return replace(drive, equipment=replace(drive.equipment, friction_volts=value))
    changed: Any = {name: value}
    return replace(drive, **changed)


def gains_of(
    drives: Sequence[Drive], names: tuple[str, ...]
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """These figures of the drives, as `Gains.changes` has them."""
    return tuple((name, tuple(figure(drive, name) for drive in drives)) for name in names)


def _with_gains(plant: Plant, gains: Gains) -> Plant:
    drives, feed = list(plant.drives), list(plant.feedforward)
    for axis in range(len(drives)):
        for name, values in gains.changes:
            drives[axis] = with_figure(drives[axis], name, values[axis])
        if gains.interpolation is not None:
            drives[axis] = replace(drives[axis], interpolation=gains.interpolation[axis])
        for name, values in gains.feed:
            feed[axis] = replace(feed[axis], **{name: values[axis]})
    return replace(plant, drives=tuple(drives), feedforward=tuple(feed))
