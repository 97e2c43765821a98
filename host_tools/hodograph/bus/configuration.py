# SPDX-License-Identifier: MIT
"""The controller's configuration, as a machine file asks for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..names import KERNELS
from .objects import (
    AXIS_NODE,
    CONFIGURATION,
    PERIOD,
    TRAVEL_MAXIMUM,
    TRAVEL_MINIMUM,
    Object,
)

if TYPE_CHECKING:
    from ..config import Machine


def configuration(machine: Machine, kernel: str) -> list[tuple[Object, int]]:
    """What the objects of the controller have to hold."""
    counts = machine.counts_per_mm
    wanted: list[tuple[Object, int]] = [
        ((PERIOD, None), machine.period_us),
        ((CONFIGURATION, 1), len(machine.axes)),
        ((CONFIGURATION, 2), round(machine.feed_mm_s * 1000)),
        ((CONFIGURATION, 3), round(machine.acceleration_mm_s2 * 1000)),
        ((CONFIGURATION, 4), round(machine.jerk_mm_s3)),
        ((CONFIGURATION, 5), KERNELS.index(kernel)),
        ((CONFIGURATION, 6), machine.start_tolerance_counts),
        ((CONFIGURATION, 7), counts),
    ]
    for i, axis in enumerate(machine.axes, start=1):
        wanted.append(((AXIS_NODE, i), axis.node))
        wanted.append(((TRAVEL_MINIMUM, i), round(axis.travel_min_mm * counts)))
        wanted.append(((TRAVEL_MAXIMUM, i), round(axis.travel_max_mm * counts)))
    return wanted
