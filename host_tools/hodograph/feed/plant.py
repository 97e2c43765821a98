# SPDX-License-Identifier: MIT
"""An axis as far as its volts go; docs/theory/numerics.md 13."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf


@dataclass(frozen=True)
class Plant:
    """volts * gain = velocity + time constant * acceleration.

    gain_mm_s_v     steady speed for one volt
    volts           greatest voltage that may be used, of which friction takes `friction_volts`
    volts_limit     of the drive itself; never below `volts`
    """

    gain_mm_s_v: float
    time_constant_s: float
    volts: float
    friction_volts: float = 0.0
    volts_limit: float = inf

    @property
    def reach_mm_s(self) -> float:
        """Bound of |velocity + time constant * acceleration|."""
        return self.gain_mm_s_v * (self.volts - self.friction_volts)


Plants = tuple[Plant, Plant]
"""Of x and y."""


def as_drives_limit(plants: Plants | None) -> Plants | None:
    """The same with all volts that the drives have; None: these are not known."""
    if plants is None or any(plant.volts_limit == inf for plant in plants):
        return None
    x, y = (replace(plant, volts=plant.volts_limit) for plant in plants)
    return x, y
