# SPDX-License-Identifier: MIT
"""Runs one simulated axis along given setpoints. Returns the positions of the motor before encoder and bus round them
(sim/offline/axis_run.h). Used by identify/. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .drive import drive_config
from .library import library, text

if TYPE_CHECKING:
    from ..config.drive_file import Drive


@dataclass(frozen=True, eq=False)
class AxisInputs:
    """What the drive receives in each of n bus periods, (n,) each: setpoints in counts, 0x60B1 in counts/s, 0x60B2 in
    per mille. The axis stands still at `start_counts` before the first period.
    """

    start_counts: int
    targets: NDArray[np.int32]
    speeds: NDArray[np.int32]
    torques: NDArray[np.int16]


def run_axis(
    drive: Drive, inputs: AxisInputs, counts_per_mm: int, period_us: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions in mm and volts, (n,) each, at the end of each period. Raises InputError for values of the drive file
    out of range, and HodographError if the compiled module is missing.
    """
    ffi, lib = library()
    count = len(inputs.targets)
    columns = (
        np.ascontiguousarray(inputs.targets, dtype=np.int32),
        np.ascontiguousarray(inputs.speeds, dtype=np.int32),
        np.ascontiguousarray(inputs.torques, dtype=np.int16),
    )
    position_mm, volts = np.empty(count), np.empty(count)
    run = ffi.new("struct axis_run *")
    run.rated_torque_nm = drive.rated_torque_nm
    run.friction_volts = drive.equipment.friction_volts or 0.0
    run.start_counts = inputs.start_counts
    run.count = count
    run.target_counts = ffi.from_buffer("int32_t[]", columns[0])
    run.speed_counts_s = ffi.from_buffer("int32_t[]", columns[1])
    run.torque_permille = ffi.from_buffer("int16_t[]", columns[2])
    error = lib.axis_run(
        ffi.new("struct drive_config *", drive_config(drive, counts_per_mm, period_us)),
        run,
        ffi.from_buffer("double[]", position_mm),
        ffi.from_buffer("double[]", volts),
    )
    if error != 0:
        raise InputError(f"drive: {text(lib.drive_error_text(error))}: correct the drive file")
    return position_mm, volts
