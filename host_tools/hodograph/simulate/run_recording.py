# SPDX-License-Identifier: MIT
"""The result of a run from what was recorded on the bus."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..names import AXES
from ..native import ROW, Contour, NativeProgram
from ..native.program import Counts, counts_by_axis
from .motion import Motion, settling_ticks
from .simulation import make_tally


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
) -> Motion:
    """The `Motion` of a recording, as `simulate` gives it.

    All three arrays are (n, A), by axis (`names` and `units`, default x, y, … in mm); row k holds setpoint k and what
    the drives reported for SYNC k+2, n being the program's ticks and 0.2 s of settling (`settling_ticks`). The
    commanded points are computed again by the kernel that the controller used, and compared with the setpoints.

    Raises RunError when rows are missing or a setpoint is not the kernel's, InputError for a bad image.
    """
    program = NativeProgram(image)
    wanted = program.ticks + settling_ticks(program.period_us)
    least = min(len(set_counts), len(act_counts), len(volts_mv))
    if least < wanted:
        raise RunError(f"recording: holds {least} of {wanted} ticks: run again")
    points, expected = program.setpoints(kernel, counts_per_mm, 0, wanted)
    _compare(set_counts[:wanted], expected)
    rows = np.zeros(wanted, dtype=ROW)
    rows["arc_length_q40_mm"] = points["arc_length_q40_mm"]
    rows["feed_q32_mm_s"] = points["feed_q32_mm_s"]
    axes = program.axis_count
    rows["cmd_q40_mm"][:, :axes] = points["position_q40"][:, :axes]
    rows["set_counts"][:, :axes] = set_counts[:wanted]
    rows["act_counts"][:, :axes] = act_counts[:wanted]
    rows["volts_mv"][:, :axes] = volts_mv[:wanted]
    rows["tick"] = np.arange(wanted)
    rows["contour_error_um"] = Contour(program).errors_um(
        rows["arc_length_q40_mm"], act_counts[:wanted], counts_by_axis(counts_per_mm, axes)[0]
    )
    tally = make_tally(program, counts_per_mm, tuple(names or AXES[:axes]), units)
    tally.add(rows)
    return tally.motion(
        kernel=kernel,
        period_us=program.period_us,
        ticks=program.ticks,
        rows=rows,
    )


def _compare(recorded: NDArray[np.int32], expected: NDArray[np.int32]) -> None:
    wrong = np.flatnonzero(np.any(recorded != expected, axis=1))
    if wrong.size:
        k = int(wrong[0])
        raise RunError(
            f"recording: setpoint {k} on the bus is {tuple(recorded[k].tolist())} counts, the kernel gives "
            f"{tuple(expected[k].tolist())} ({wrong.size} differ): is it this program and this kernel?"
        )
