# SPDX-License-Identifier: MIT
"""Runs that are stopped in motion, without a bus: feed hold, stop and fault stop. Used by cli/path_commands and
benchmarks. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..errors import HodographError, InputError
from ..names import in_unit
from ..native import ROW, NativeProgram, OfflineSimulation
from ..native.offline import OfflineOrder
from ..native.program import Counts
from ..program import Program
from .motion import Motion, settling_ticks
from .simulation import make_totals, names_of_driven

STOP_ORDERS = {"hold": "hold", "stop": "stop", "fault": "fault-stop"}
"""Kinds of a stop, and of its OfflineOrder."""

_HISTORY = 3
"""Setpoints before and after a stop that its differences need: third differences."""


@dataclass(frozen=True, eq=False)
class StoppedRun:
    """A run that was stopped.

    kind          one of STOP_ORDERS
    at_s          time from the program's start at which it was commanded
    rest_after_s  time from then to the first setpoint at rest
    distance_mm   distance along the path in this time
    bound_s       longest time by the program's stop table
    peak          greatest magnitudes from then to rest: of the setpoints, by their differences over one, two and three
                  periods, along the path and by axis; of the axes, volts and contour error, settling included
    motion        the run, up to rest and settling
    """

    kind: str
    at_s: float
    rest_after_s: float
    distance_mm: float
    bound_s: float
    peak: dict[str, float]
    motion: Motion

    def summary(self) -> dict[str, Any]:
        """The keys that tools may rely on in `--json` output."""
        return {
            "kind": self.kind,
            "at_s": self.at_s,
            "rest_after_s": self.rest_after_s,
            "distance_mm": self.distance_mm,
            "bound_s": self.bound_s,
            "peak": self.peak,
        }


def last_tick_s(program: NativeProgram | Program) -> float:
    """Time of a program's last setpoint: the last instant at which a stop may be commanded."""
    return (program.ticks - 1) * program.period_us * 1e-6


def simulate_stop(
    program: NativeProgram,
    drives: Sequence[Drive],
    kind: str,
    at_s: float,
    *,
    kernel: str = "fixed",
    counts_per_mm: Counts = 1_000_000,
    feedforward: Sequence[Feedforward] | None = None,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
) -> StoppedRun:
    """A run, as by `simulate`, that is stopped `at_s` after its first setpoint: the setpoint at this time is the first
    of the stop. Raises InputError: the time is outside the program; and as `simulate`.
    """
    period_s = program.period_us * 1e-6
    names = names_of_driven(program, drives, names)
    end_s = last_tick_s(program)
    if not 0.0 <= at_s <= end_s * (1.0 + 1e-12):
        raise InputError(f"{kind} at {at_s:g} s: must be from 0 to {end_s:.9g} s")
    tick = ceil(at_s / period_s - 1e-9)
    simulation = OfflineSimulation(
        program,
        kernel,
        tuple(drives),
        counts_per_mm,
        feedforward,
        orders=(OfflineOrder(STOP_ORDERS[kind], tick),),
    )
    settling = settling_ticks(program.period_us)
    rows = np.empty(program.ticks + settling, dtype=ROW)
    simulation.run(rows)
    stop = simulation.stop
    if stop is None or stop.rest_tick is None:
        raise HodographError(f"simulation: {kind} at {at_s:g} s never came to rest: report a bug")
    rows = rows[: stop.rest_tick + 1 + settling]
    totals = make_totals(program, counts_per_mm, names, units, stop.rest_tick + 1)
    totals.add(rows)
    motion = totals.motion(
        kernel=kernel,
        period_us=program.period_us,
        ticks=stop.rest_tick + 1,
        rows=rows,
    )
    return StoppedRun(
        kind,
        at_s,
        (stop.rest_tick - tick + 1) * period_s,
        stop.rest_mm - stop.from_mm,
        stop.bound_s,
        _peaks(motion, tick, stop.rest_tick),
        motion,
    )


def _peaks(motion: Motion, tick: int, rest_tick: int) -> dict[str, float]:
    """Peaks of the differences that include one of tick … rest_tick + 3: from the last setpoint before the stop to
    rest.
    """
    begin = max(tick - _HISTORY, 0)
    rows = slice(begin, rest_tick + 1 + _HISTORY)
    period_s = motion.period_us * 1e-6
    columns = [("", "mm", motion.arc_length_mm[rows])]
    for k, (axis, unit) in enumerate(zip(motion.names, motion.units, strict=True)):
        columns.append((f"{axis}_", unit, motion.cmd_mm[rows, k]))
    peaks = {}
    for name, unit, values in columns:
        padded = np.concatenate((np.repeat(values[:1], _HISTORY if begin == 0 else 0), values))
        for order, quantity in enumerate(
            ("velocity_mm_s" if name else "feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"), start=1
        ):
            found = np.diff(padded, order) / period_s**order
            peaks[name + in_unit(quantity, unit)] = _greatest(found)
    after = slice(tick, None)
    for k, axis in enumerate(motion.names):
        peaks[f"{axis}_volts"] = _greatest(motion.volts[after, k])
    peaks["contour_error_um"] = _greatest(motion.contour_error_um[after])
    for k, (axis, unit) in enumerate(zip(motion.extra_names, motion.units[3:], strict=True)):
        peaks[f"{axis}_error_{unit}"] = _greatest(motion.orientation_error[after, k])
    return peaks


def _greatest(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max(initial=0.0))
