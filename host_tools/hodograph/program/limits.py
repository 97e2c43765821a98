# SPDX-License-Identifier: MIT
"""What a program may ask of a machine."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ProgramLimits:
    """What a controller allows, in the units of the protocol; 0 for all but the travel: any.

    stop_time_ms  greatest bound of a fault stop

    Those of the axes, (x, y), are proved by the controller's own check only (firmware/core/limit_check.h).
    """

    period_us: int
    feed_um_s: int
    acceleration_um_s2: int
    jerk_mm_s3: int
    min_q40_mm: tuple[int, int]
    max_q40_mm: tuple[int, int]
    stop_time_ms: int = 0
    axis_velocity_um_s: tuple[int, int] = (0, 0)
    axis_acceleration_um_s2: tuple[int, int] = (0, 0)
    axis_jerk_mm_s3: tuple[int, int] = (0, 0)
