# SPDX-License-Identifier: MIT
"""The quantities that limits are about, and the limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config import Drive
from ..errors import InputError
from ..feed import FeedCap, Limits
from .cells import Cells
from .motion import Motion

Real = NDArray[np.float64]

AXES = ("x", "y")


@dataclass(frozen=True, eq=False)
class Quantity:
    """One quantity of the motion, and the limit of its magnitude in each cell, (C,); None: no limit anywhere.

    `of` takes it from a motion. It is linear, without negative coefficients, so it takes a bound from bounds too.
    """

    name: str
    unit: str
    of: Callable[[Motion], Real]
    limit: Real | None


def quantities(cells: Cells, limits: Limits, drives: Sequence[Drive]) -> list[Quantity]:
    """All that can be limited; volts only with the `drives` of both axes. Raises InputError: limited without."""
    if limits.volts is not None and len(drives) != len(AXES):
        raise InputError("limits: volts needs a machine whose axes x and y have drive files")
    count, whole = len(cells), limits.axes_whole

    def row(name: str, unit: str, limit: float | None, of: Callable[[Motion], Real]) -> Quantity:
        return Quantity(name, unit, of, None if limit is None else np.full(count, limit))

    out = [
        row("feed_mm_s", "mm/s", limits.feed_mm_s, lambda m: m.feed),
        row("acceleration_mm_s2", "mm/s^2", limits.acceleration_mm_s2, lambda m: m.acceleration),
        row("jerk_mm_s3", "mm/s^3", limits.jerk_mm_s3, lambda m: m.jerk),
        row("centripetal_mm_s2", "mm/s^2", limits.centripetal_mm_s2, lambda m: m.centripetal),
    ]
    for k, axis in enumerate(AXES):
        out += [
            row(f"{axis}_{name}", unit, None if both is None else both[k], _of_axis(field, k))
            for name, unit, field, both in (
                ("velocity_mm_s", "mm/s", "axis_velocity", whole.velocity_mm_s),
                (
                    "acceleration_mm_s2",
                    "mm/s^2",
                    "axis_acceleration",
                    whole.acceleration_mm_s2,
                ),
                ("jerk_mm_s3", "mm/s^3", "axis_jerk", whole.jerk_mm_s3),
            )
        ]
    for k, (axis, drive) in enumerate(zip(AXES, drives, strict=False)):
        volts = None if limits.volts is None else _volts_left(drive, limits.volts)
        out.append(row(f"{axis}_volts", "V", volts, _volts(drive, k)))
    if limits.caps:
        out.append(Quantity("cap_mm_s", "mm/s", lambda m: m.feed, _caps(cells, limits.caps)))
    return out


def _of_axis(field: str, axis: int) -> Callable[[Motion], Real]:
    return lambda m: np.asarray(getattr(m, field)[axis])


def _volts(drive: Drive, axis: int) -> Callable[[Motion], Real]:
    """What holds the axis on its way by the plant alone: (v + T a) / (K g), docs/theory/numerics.md 13."""
    per_speed = 1.0 / (drive.gain_rad_s_v * drive.screw_mm_rad)
    per_acceleration = drive.time_constant_s * per_speed
    return lambda m: (
        per_speed * m.axis_velocity[axis] + per_acceleration * m.axis_acceleration[axis]
    )


def _volts_left(drive: Drive, volts: float) -> float:
    """What motion may take of the volts: friction takes the rest, in whatever direction."""
    return max(min(volts, drive.volts_limit) - (drive.equipment.friction_volts or 0.0), 1e-9)


def _caps(cells: Cells, caps: Sequence[FeedCap]) -> Real:
    """The least cap over the middle of each cell; cells end where caps do."""
    every = np.arange(len(cells))
    middle = cells.arc_length_mm(every, np.full(len(cells), 0.5))
    out = np.full(len(cells), np.inf)
    for cap in caps:
        inside = (middle > cap.from_mm) & (middle < cap.to_mm)
        out[inside] = np.minimum(out[inside], cap.feed_mm_s)
    return out
