# SPDX-License-Identifier: MIT
"""Offline simulation of one program: the controller's kernel and the simulated axes in this process, without a bus and
without waiting. Used by the host tools, except for streamed jobs and runs on a bus. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..config.machine_file import Machine
from ..errors import InputError
from ..names import AXES
from ..native import ROW, Contour, NativeProgram, OfflineFault, OfflineSimulation
from ..native.program import Counts
from .motion import Motion, MotionTotals, settling_ticks

CHUNK_TICKS = 16384
"""Ticks in one call of the C side: they fit the cache, and Ctrl-C is checked between calls."""


def names_of_driven(
    program: NativeProgram, drives: Sequence[Drive], names: Sequence[str] | None
) -> tuple[str, ...]:
    """The names of the axes of a program. Raises InputError: the number of drives is not that of its axes."""
    count = program.axis_count
    if len(drives) != count:
        raise InputError(f"simulate: needs the drives of {count} axes, not {len(drives)}")
    return AXES[:count] if names is None else tuple(names)


def make_totals(
    program: NativeProgram,
    counts_per_mm: Counts,
    names: tuple[str, ...],
    units: Sequence[str] | None,
    ticks: int | None = None,
) -> MotionTotals:
    """Empty totals for a run of a program, or of its first ticks."""
    contour = Contour(program) if program.axis_count > 3 else None
    own_ticks = program.ticks if ticks is None else ticks
    return MotionTotals(own_ticks, counts_per_mm, names, units, contour, program.events)


def simulate(
    image: bytes | NativeProgram,
    drives: Sequence[Drive],
    *,
    kernel: str = "fixed",
    counts_per_mm: Counts = 1_000_000,
    feedforward: Sequence[Feedforward] | None = None,
    faults: Sequence[OfflineFault] = (),
    keep_rows: bool = True,
    progress: Callable[[int, int], None] | None = None,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
) -> Motion:
    """Runs a program with the drives of its axes, which stand at its start point.

    Gives the same setpoints and encoder positions as a run on the bus, bit for bit.

    image          bytes, or an opened program (faster, if it is run often)
    drives         of the axes of the program, in their order
    counts_per_mm  of all axes, or of each
    faults         of the axes; no controller supervises them
    keep_rows      False: hashes and maxima only, which bounds the memory of very long runs
    progress       called with (ticks done, all ticks) after each chunk
    names, units   of the axes (default x, y, … in mm)

    Raises InputError: image, kernel or drive figures are not acceptable.
    """
    program = image if isinstance(image, NativeProgram) else NativeProgram(image)
    names = names_of_driven(program, drives, names)
    simulation = OfflineSimulation(program, kernel, drives, counts_per_mm, feedforward, faults)
    total = program.ticks + settling_ticks(program.period_us)
    totals = make_totals(program, counts_per_mm, names, units)
    rows = np.empty(total if keep_rows else min(total, CHUNK_TICKS), dtype=ROW)
    for first in range(0, total, CHUNK_TICKS):
        count = min(CHUNK_TICKS, total - first)
        chunk = rows[first : first + count] if keep_rows else rows[:count]
        simulation.run(chunk)
        totals.add(chunk)
        if progress is not None:
            progress(first + count, total)
    return totals.motion(
        kernel=kernel,
        period_us=program.period_us,
        ticks=program.ticks,
        rows=rows if keep_rows else rows[:0],
    )


def simulate_on(
    machine: Machine,
    image: bytes | NativeProgram,
    kernel: str | None = None,
    *,
    keep_rows: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Motion:
    """`simulate` with the drives, counts, feedforward and axis names of a machine; `kernel` None: the machine's.

    Raises InputError as `simulate` does, and for an axis without a drive file.
    """
    motion = simulate(
        image,
        machine.models(machine.path_axes),
        kernel=kernel or machine.kernel,
        counts_per_mm=machine.path_counts,
        feedforward=machine.path_feedforward,
        keep_rows=keep_rows,
        progress=progress,
        names=machine.path_names,
        units=machine.path_units,
    )
    return replace(motion, outputs=machine.outputs)
