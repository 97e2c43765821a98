# SPDX-License-Identifier: MIT
"""The result of a run from a recording of the bus, for `hodograph run` and `replay`. Used by bus/analysis. No I/O; its
arguments are the recorded setpoints and reports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..config.outputs import Outputs
from ..errors import RunError
from ..names import AXES
from ..native import ROW, Contour, NativeProgram
from ..native.program import Counts
from .motion import Motion, settling_ticks
from .simulation import make_totals


def analyse(
    image: bytes,
    set_counts: NDArray[np.int32],
    act_counts: NDArray[np.int32],
    volts_mv: NDArray[np.int16],
    *,
    kernel: str,
    counts_per_mm: Counts = 1_000_000,
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
    outputs: Outputs | None = None,
    latched: NDArray[np.void] | None = None,
) -> Motion:
    """The `Motion` of a recording, as `simulate` gives it.

    All three arrays are (n, A), by axis (`names` and `units`, default x, y, … in mm); row k holds setpoint k and the
    reports of the drives for SYNC k+2; n is the program's ticks and 0.2 s of settling (`settling_ticks`). The commanded
    points are computed again by the kernel that the controller used, and compared with the setpoints.

    outputs  of the machine; `latched`: outputs of its I/O module at SYNC k+2, records with "digital", "analogue"

    Raises RunError: rows are missing, or an output or setpoint differs from the program. Raises InputError: the image
    cannot be read.
    """
    program = NativeProgram(image)
    wanted = program.ticks + settling_ticks(program.period_us)
    least = min(len(set_counts), len(act_counts), len(volts_mv))
    if least < wanted:
        raise RunError(f"recording: holds {least} of {wanted} ticks: run again")
    points, expected = program.setpoints(kernel, counts_per_mm, 0, wanted)
    _compare(set_counts[:wanted], expected)
    rows = _rows(
        program, points, set_counts[:wanted], act_counts[:wanted], volts_mv[:wanted], counts_per_mm
    )
    if outputs is not None and latched is not None:
        _put_outputs(rows, program, outputs, latched)
    names = tuple(names or AXES[: program.axis_count])
    totals = make_totals(program, counts_per_mm, names, units)
    totals.add(rows)
    motion = totals.motion(
        kernel=kernel,
        period_us=program.period_us,
        ticks=program.ticks,
        rows=rows,
    )
    return replace(motion, outputs=outputs)


def _rows(
    program: NativeProgram,
    points: NDArray[np.void],
    set_counts: NDArray[np.int32],
    act_counts: NDArray[np.int32],
    volts_mv: NDArray[np.int16],
    counts_per_mm: Counts,
) -> NDArray[np.void]:
    """A row (n,) for each tick: its point by the kernel, the setpoint, the reports of the drives, and the contour
    error.
    """
    rows = np.zeros(len(points), dtype=ROW)
    axes = program.axis_count
    rows["tick"] = np.arange(len(points))
    rows["arc_length_q40_mm"] = points["arc_length_q40_mm"]
    rows["feed_q32_mm_s"] = points["feed_q32_mm_s"]
    rows["cmd_q40_mm"][:, :axes] = points["position_q40"][:, :axes]
    rows["set_counts"][:, :axes] = set_counts
    rows["act_counts"][:, :axes] = act_counts
    rows["volts_mv"][:, :axes] = volts_mv
    rows["contour_error_um"] = Contour(program).errors_um(
        rows["arc_length_q40_mm"], act_counts, counts_per_mm
    )
    return rows


def _put_outputs(
    rows: NDArray[np.void], program: NativeProgram, outputs: Outputs, latched: NDArray[np.void]
) -> None:
    """Puts the outputs into the rows. Raises RunError: they differ from those of the program, delayed as in the machine
    file.

    An output that is delayed by one tick is latched when its setpoint is reached, which is row k.
    """
    if len(latched) < len(rows):
        raise RunError(f"recording: holds {len(latched)} of {len(rows)} ticks: run again")
    rows["digital"], rows["analogue"] = (
        latched["digital"][: len(rows)],
        latched["analogue"][: len(rows)],
    )
    digital, analogue = program.outputs(rows["arc_length_q40_mm"], rows["feed_q32_mm_s"])
    ticks = program.ticks
    shift = outputs.delay_ticks - 1
    # Before the first tick the outputs may be those of the last program; after the last tick they may go off.
    found = slice(max(shift, 0), ticks - 1 + min(shift, 0))
    wanted = slice(max(-shift, 0), max(-shift, 0) + found.stop - found.start)
    wrong = (rows["digital"][found] != digital[wanted]) | np.any(
        rows["analogue"][found] != analogue[wanted], axis=1
    )
    if wrong.any():
        tick = found.start + int(wrong.argmax())
        raise RunError(
            f"recording: the outputs at tick {tick} are {rows['digital'][tick]:#x} {rows['analogue'][tick].tolist()}, "
            "not those of the program: was it stopped or overridden?"
        )


def _compare(recorded: NDArray[np.int32], expected: NDArray[np.int32]) -> None:
    wrong = np.flatnonzero(np.any(recorded != expected, axis=1))
    if wrong.size:
        k = int(wrong[0])
        raise RunError(
            f"recording: setpoint {k} on the bus is {tuple(recorded[k].tolist())} counts, the kernel gives "
            f"{tuple(expected[k].tolist())} ({wrong.size} differ): is it this program and this kernel?"
        )
