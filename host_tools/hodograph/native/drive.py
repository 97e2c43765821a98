# SPDX-License-Identifier: MIT
"""One simulated axis (sim/plant/drive.h, docs/theory/drives.md section 13). Used by native/axis_run and native/offline.
No I/O.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..names import INTEGRALS, INTERPOLATIONS, SPEEDS
from .library import library, text

if TYPE_CHECKING:
    from ..config.drive_file import Drive

_PLANT = ("gain_rad_s_v", "time_constant_s", "screw_mm_rad", "torque_to_volts", "volts_limit")
_PDFF = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")


def drive_config(drive: Drive, counts_per_mm: int, period_us: int) -> dict[str, Any]:
    """The struct drive_config of a drive file, as cffi takes it."""
    return {
        "plant": {name: getattr(drive, name) for name in _PLANT},
        "pdff": {name: getattr(drive, name) for name in _PDFF},
        "encoder_counts_per_rev": drive.encoder_counts_per_rev,
        "loop_rate_hz": drive.loop_rate_hz,
        "counts_per_mm": counts_per_mm,
        "period_us": period_us,
        "interpolation": INTERPOLATIONS.index(drive.interpolation),
        "speed": SPEEDS.index(drive.speed),
        "delay_samples": drive.delay_samples,
        "integral": INTEGRALS.index(drive.integral),
    }


class DriveModel:
    """An axis that follows targets, one bus period each."""

    def __init__(
        self, drive: Drive, *, counts_per_mm: int = 1_000_000, period_us: int = 1000
    ) -> None:
        """The axis stands at 0, in standstill lock. Raises InputError: figures are out of range."""
        ffi, lib = library()
        config = ffi.new("struct drive_config *", drive_config(drive, counts_per_mm, period_us))
        self._drive = ffi.new("struct drive *")
        error = lib.drive_init(self._drive, config)
        if error != 0:
            raise InputError(f"drive: {text(lib.drive_error_text(error))}: correct the drive file")

    def place(self, target_counts: int) -> None:
        """Puts the axis at a target, counts, in standstill lock."""
        _, lib = library()
        lib.drive_place(self._drive, target_counts)

    @property
    def parked(self) -> bool:
        """Whether it stands exactly at its target (docs/reference/protocol.md section 3)."""
        _, lib = library()
        return bool(lib.drive_parked(self._drive))

    def follow(
        self, targets_counts: NDArray[np.int32]
    ) -> tuple[NDArray[np.int32], NDArray[np.int16]]:
        """Encoder positions in counts and volts in mV, (n,) each, at the end of each target's period."""
        _, lib = library()
        positions = np.empty(len(targets_counts), dtype=np.int32)
        volts_mv = np.empty(len(targets_counts), dtype=np.int16)
        for i, target in enumerate(targets_counts.tolist()):
            lib.drive_period(self._drive, target)
            positions[i] = lib.drive_position_counts(self._drive)
            volts_mv[i] = lib.drive_volts_mv(self._drive)
        return positions, volts_mv
