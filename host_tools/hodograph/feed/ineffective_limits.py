# SPDX-License-Identifier: MIT
"""Limits of a path file that have no effect: the user meant something by them, and is told."""

from __future__ import annotations

from collections.abc import Iterator

from .limits import Limits
from .plant import Plants
from .request import FeedRequest


def ineffective_limits(
    limits: Limits, request: FeedRequest, length_mm: float, plants: Plants | None
) -> Iterator[str]:
    """One line for each part of `limits` that changes nothing on a path of `length_mm`.

    plants  of x and y with the volts that their drives allow; None: no volts are limited
    """
    if request.optimal and limits.policy == "report":
        yield (
            f'limits: policy "report" does nothing with profile "{request.profile}", which keeps every limit'
        )
    for number, cap in enumerate(limits.caps, start=1):
        if cap.from_mm >= length_mm:
            yield (
                f"limits: cap {number} begins at {cap.from_mm:g} mm, behind the end of the path at "
                f"{length_mm:.6g} mm: it does nothing"
            )
    for axis, plant in zip("xy", plants or (), strict=False):
        if limits.volts is not None and plant.volts < limits.volts:
            yield (
                f"limits: volts {limits.volts:g} is more than the drive of {axis} has: "
                f"its volts_limit of {plant.volts:g} V counts"
            )
