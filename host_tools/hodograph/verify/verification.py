# SPDX-License-Identifier: MIT
"""What a program does to the limits of its path file: peaks, and every place beyond a limit;
docs/theory/numerics.md 16."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..config import Drive
from ..feed import Limits
from ..program import Program
from .cells import Cells, cut
from .motion import motion_at
from .peaks import CellPeaks, cell_peaks, refine, scales
from .quantities import Quantity, quantities

Real = NDArray[np.float64]

TOLERANCE = 1e-3
"""A limit is kept when nothing is above it by more than this share."""

_HAIR = 1e-6


@dataclass(frozen=True)
class Peak:
    """A greatest magnitude, found at an arc length and program time; it is nowhere above `at_most`."""

    quantity: str
    unit: str
    value: float
    at_most: float
    limit: float | None
    s_mm: float
    t_s: float

    @property
    def ratio(self) -> float | None:
        """Value over limit; None where there is none."""
        return None if self.limit is None else self.value / self.limit

    @property
    def kept(self) -> bool:
        """Certainly not above the limit by more than TOLERANCE."""
        return self.limit is None or self.at_most <= self.limit * (1.0 + TOLERANCE)


@dataclass(frozen=True)
class Verification:
    """Peaks of all quantities (limited or not), and each stretch of path on which one is above its limit.

    `excesses` holds the worst place of every stretch, worst ratio first, also of those within TOLERANCE.
    """

    duration_s: float
    length_mm: float
    peaks: tuple[Peak, ...]
    excesses: tuple[Peak, ...]
    samples: int

    @property
    def kept(self) -> bool:
        """Whether every limit is kept."""
        return all(peak.kept for peak in self.peaks)


def verify_program(program: Program, limits: Limits, drives: Sequence[Drive] = ()) -> Verification:
    """Looks at every instant of a program that passes `program.check`; the machine's limits count where they are lower.

    `drives` of x and y turn motion into volts. Raises InputError: volts are limited, and there are no drives.
    """
    cells = cut(program, [end for cap in limits.caps for end in (cap.from_mm, cap.to_mm)])
    rows = quantities(cells, limits, drives)
    scale = scales(cells, rows)
    cells, bend = refine(cells, rows, scale)
    rows = quantities(cells, limits, drives)
    found = cell_peaks(cells, bend, rows, scale)
    peaks = [_peak(cells, row, found, k) for k, row in enumerate(rows)]
    excesses = [peak for k, row in enumerate(rows) for peak in _beyond(cells, row, found, k)]
    step = _step(cells, limits)
    if step.limit is not None and step.value > step.limit:
        excesses.append(step)
    excesses.sort(key=lambda peak: -(peak.ratio or 0.0))
    return Verification(
        program.duration_s, program.length_mm, (*peaks, step), tuple(excesses), found.samples
    )


def _peak(cells: Cells, row: Quantity, found: CellPeaks, k: int) -> Peak:
    """The peak of a quantity: where it comes nearest to its limit, or is greatest where it has none."""
    limit = np.ones(len(cells)) if row.limit is None else row.limit
    worst = int((found.found[k] / limit).argmax())
    at_most = float((found.at_most[k] / limit).max() * limit[worst])
    peak = _at(cells, row, found, k, worst)
    return replace(peak, at_most=at_most) if np.isfinite(at_most) else peak


def _at(cells: Cells, row: Quantity, found: CellPeaks, k: int, cell: int) -> Peak:
    one, u = np.array([cell]), found.at[k, [cell]]
    limit = None if row.limit is None else float(row.limit[cell])
    return Peak(
        row.name,
        row.unit,
        float(found.found[k, cell]),
        float(found.at_most[k, cell]),
        limit if limit is not None and np.isfinite(limit) else None,
        float(cells.arc_length_mm(one, u)[0]),
        float(cells.time_s(one, u)[0]),
    )


def _beyond(cells: Cells, row: Quantity, found: CellPeaks, k: int) -> Iterator[Peak]:
    """The worst place of each run of neighbouring cells in which the limit is passed."""
    if row.limit is None:
        return
    share = found.found[k] / row.limit
    over = np.flatnonzero(share > 1.0 + _HAIR)
    for stretch in np.split(over, np.flatnonzero(np.diff(over) > 1) + 1):
        if stretch.size:
            yield _at(cells, row, found, k, int(stretch[share[stretch].argmax()]))


def _step(cells: Cells, limits: Limits) -> Peak:
    """The greatest jump of an axis' acceleration, rest before and after included.

    Nothing is smooth across joints by itself. To a drive a jump is a jerk of jump / period; it may be TOLERANCE of the
    least limit of a jerk.
    """
    every = np.arange(len(cells))
    first, last = (motion_at(cells, every, np.full(every.size, u)) for u in (0.0, 1.0))
    jump = np.zeros(len(cells) + 1)
    for before, after in zip(last.axis_acceleration, first.axis_acceleration, strict=True):
        jump = np.maximum(jump, np.abs(np.append(after, 0.0) - np.insert(before, 0, 0.0)))
    worst = int(jump.argmax())
    cell, u = np.array([min(worst, len(cells) - 1)]), np.array([float(worst == len(cells))])
    jerks = [limits.jerk_mm_s3, *(limits.axes_whole.jerk_mm_s3 or ())]
    given = [jerk for jerk in jerks if jerk is not None]
    return Peak(
        "acceleration_step_mm_s2",
        "mm/s^2",
        float(jump[worst]),
        float(jump[worst]),
        TOLERANCE * 1e-6 * cells.program.period_us * min(given) if given else None,
        float(cells.arc_length_mm(cell, u)[0]),
        float(cells.time_s(cell, u)[0]),
    )
