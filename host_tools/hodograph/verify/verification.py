# SPDX-License-Identifier: MIT
"""Checks a program against the limits of its path file: peaks, and each place beyond a limit; docs/theory/proofs.md 16.
Used by cli/verify_command. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..config import Drive
from ..feed import Limit, Limits, Peak
from ..program import Program
from .cells import Cells, cut
from .instants import motion_at
from .peaks import CellMaxima, cell_peaks, refine, scales
from .quantities import Quantity, quantities

Real = NDArray[np.float64]

TOLERANCE = 1e-3
"""A limit counts as kept if its quantity exceeds it by at most this share."""

_HAIR = 1e-6
"""Limit usage above 1 that counts as rounding."""


@dataclass(frozen=True)
class Verification:
    """Peaks of all quantities (limited or not), and each stretch of path in which one is above its limit.

    `excesses` holds the worst place of each stretch, greatest usage first, including those within TOLERANCE.
    """

    duration_s: float
    length_mm: float
    peaks: tuple[Peak, ...]
    excesses: tuple[Peak, ...]
    samples: int

    @property
    def kept(self) -> bool:
        """Whether every limit is kept."""
        return not self.exceeded

    @property
    def exceeded(self) -> tuple[Peak, ...]:
        """Peaks that may be above their limit by more than TOLERANCE."""
        return tuple(peak for peak in self.peaks if not peak.within(TOLERANCE))


def verify_program(program: Program, limits: Limits, drives: Sequence[Drive] = ()) -> Verification:
    """Checks every instant of a program that passes `program.check`; the machine's limits count where they are lower.

    `drives` of the axes turn motion into volts. Raises InputError: volts are limited, and there are no drives.
    """
    limits = limits.of_axes(program.axis_count)
    cells = cut(program, [end for zone in limits.zones for end in (zone.from_mm, zone.to_mm)])
    rows = quantities(cells, limits, drives)
    scale = scales(cells, rows)
    cells, bend = refine(cells, rows, scale)
    rows = quantities(cells, limits, drives)
    found = cell_peaks(cells, bend, rows, scale)
    peaks = [_peak(cells, row, found, k) for k, row in enumerate(rows)]
    excesses = [peak for k, row in enumerate(rows) for peak in _beyond(cells, row, found, k)]
    step = _step(cells, limits)
    if step.usage > 1.0:
        excesses.append(step)
    excesses.sort(key=lambda peak: -peak.usage)
    return Verification(
        program.duration_s, program.length_mm, (*peaks, step), tuple(excesses), found.samples
    )


def _peak(cells: Cells, row: Quantity, found: CellMaxima, k: int) -> Peak:
    """The peak of a quantity: the place of its greatest limit usage, or of its greatest magnitude if it has no
    limit.
    """
    limit = np.ones(len(cells)) if row.limits is None else row.limits
    worst = int((found.found[k] / limit).argmax())
    at_most = float((found.at_most[k] / limit).max() * limit[worst])
    peak = _at(cells, row, found, k, worst)
    return replace(peak, at_most=at_most) if np.isfinite(at_most) else peak


def _at(cells: Cells, row: Quantity, found: CellMaxima, k: int, cell: int) -> Peak:
    one, u = np.array([cell]), found.at[k, [cell]]
    limit = inf if row.limits is None else float(row.limits[cell])
    return Peak(
        replace(row.limit, value=limit),
        float(found.found[k, cell]),
        float(cells.arc_length_mm(one, u)[0]),
        float(cells.time_s(one, u)[0]),
        float(found.at_most[k, cell]),
    )


def _beyond(cells: Cells, row: Quantity, found: CellMaxima, k: int) -> Iterator[Peak]:
    """The worst place of each run of consecutive cells in which the limit is exceeded."""
    if row.limits is None:
        return
    usage = found.found[k] / row.limits
    over = np.flatnonzero(usage > 1.0 + _HAIR)
    for stretch in np.split(over, np.flatnonzero(np.diff(over) > 1) + 1):
        if stretch.size:
            yield _at(cells, row, found, k, int(stretch[usage[stretch].argmax()]))


def _step(cells: Cells, limits: Limits) -> Peak:
    """The greatest jump of an axis' acceleration, rest before and after included.

    No rule makes the acceleration continuous at joints. For a drive a jump is a jerk of jump / period; it may be
    TOLERANCE of the least limit of a jerk.
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
    most = TOLERANCE * 1e-6 * cells.program.period_us * min(given) if given else inf
    return Peak(
        Limit("acceleration_step_mm_s2", most),
        float(jump[worst]),
        float(cells.arc_length_mm(cell, u)[0]),
        float(cells.time_s(cell, u)[0]),
        float(jump[worst]),
    )
