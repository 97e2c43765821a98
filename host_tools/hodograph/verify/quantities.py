# SPDX-License-Identifier: MIT
"""The limited quantities of a motion (feed, axis jerks, volts …), each as a function of the motion, with its limit in
each cell. Used by verify/peaks and verify/verification. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..config import Drive
from ..errors import InputError
from ..feed import FeedZone, Limit, Limits
from ..feed.limits import least_in_zones
from .cells import Cells
from .instants import Motion

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Quantity:
    """One quantity of the motion, its limit (value inf: none), and the limit in each cell, (C,); None: none anywhere.

    `of` computes it from a motion. It is linear with coefficients >= 0, so it also computes a bound from bounds.
    """

    limit: Limit
    of: Callable[[Motion], Real]
    limits: Real | None


def quantities(cells: Cells, limits: Limits, drives: Sequence[Drive]) -> list[Quantity]:
    """All quantities that can be limited; volts only with the `drives` of all axes. Raises InputError: volts are
    limited, and there are no drives.
    """
    names = limits.names
    if limits.volts is not None and len(drives) != len(names):
        raise InputError(
            f"limits: volts needs a machine whose axes {_listed(names)} have drive files"
        )
    whole = limits.axes_whole

    def row(
        key: str, value: float | None, of: Callable[[Motion], Real], axis: int | None = None
    ) -> Quantity:
        name = None if axis is None else names[axis]
        unit = "mm" if axis is None else limits.unit(axis)
        limit = Limit(key, inf if value is None else value, axis=name, unit=unit)
        return Quantity(limit, of, None if value is None else np.full(len(cells), value))

    out = [
        row("feed_mm_s", limits.feed_mm_s, lambda m: m.feed),
        row("acceleration_mm_s2", limits.acceleration_mm_s2, lambda m: m.acceleration),
        row("jerk_mm_s3", limits.jerk_mm_s3, lambda m: m.jerk),
        row("centripetal_mm_s2", limits.centripetal_mm_s2, lambda m: m.centripetal),
    ]
    for k in range(len(names)):
        out += [
            row(key, None if both is None else both[k], _of_axis(field, k), k)
            for key, field, both in (
                ("velocity_mm_s", "axis_velocity", whole.velocity_mm_s),
                ("acceleration_mm_s2", "axis_acceleration", whole.acceleration_mm_s2),
                ("jerk_mm_s3", "axis_jerk", whole.jerk_mm_s3),
            )
        ]
    for k, drive in enumerate(drives):
        volts = None if limits.volts is None else _volts_left(drive, limits.volts)
        out.append(row("volts", volts, _volts(drive, k), k))
    if limits.zones:
        limit = Limit("feed_mm_s", inf, zone=limits.zones[0])
        out.append(Quantity(limit, lambda m: m.feed, _in_zones(cells, limits.zones)))
    return out


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _of_axis(field: str, axis: int) -> Callable[[Motion], Real]:
    return lambda m: np.asarray(getattr(m, field)[axis])


def _volts(drive: Drive, axis: int) -> Callable[[Motion], Real]:
    """The volts of the motion by the plant alone: (v + T a) / (K g), docs/theory/drives.md 13."""
    per_speed = 1.0 / (drive.gain_rad_s_v * drive.screw_mm_rad)
    per_acceleration = drive.time_constant_s * per_speed
    return lambda m: (
        per_speed * m.axis_velocity[axis] + per_acceleration * m.axis_acceleration[axis]
    )


def _volts_left(drive: Drive, volts: float) -> float:
    """The volts that motion may use. Friction uses the others, in any direction."""
    return max(min(volts, drive.volts_limit) - (drive.equipment.friction_volts or 0.0), 1e-9)


def _in_zones(cells: Cells, zones: Sequence[FeedZone]) -> Real:
    """The least feed limit of zones over the middle of each cell; cells end where zones do."""
    every = np.arange(len(cells))
    middle = cells.arc_length_mm(every, np.full(len(cells), 0.5))
    return least_in_zones(middle, zones, [zone.feed_mm_s for zone in zones], with_ends=False)
