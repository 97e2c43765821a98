# SPDX-License-Identifier: MIT
"""What a program may ask of a machine."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ProgramLimits:
    """What a controller allows, in the units of the protocol; 0 for any, but not for the travel.

    stop_time_ms  greatest bound of a fault stop
    """

    period_us: int
    feed_um_s: int
    acceleration_um_s2: int
    jerk_mm_s3: int
    min_q40_mm: tuple[int, int]
    max_q40_mm: tuple[int, int]
    stop_time_ms: int = 0
