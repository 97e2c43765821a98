# SPDX-License-Identifier: MIT
"""How far pieces are above the limits along a path that their plan has to keep; docs/numerics.md 5.5."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .along import PathBounds, Pieces, Samples, per_axis, raised, sample

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Strain:
    """A limit, the peak beside it, and the share of the limit that a plan may use."""

    name: str
    limit: float
    peak: float
    share: float = 1.0

    @property
    def ratio(self) -> float:
        """Peak over what may be used."""
        return self.peak / (self.share * self.limit)

    @property
    def reason(self) -> str:
        """The limit in words, for notes."""
        less = " less its reserve" if self.share < 1.0 else ""
        return f"limits {self.name} = {self.limit:g}{less}"


def strains(bounds: PathBounds, pieces: Pieces) -> list[Strain]:
    """All limits along the path; those of axis acceleration, axis jerk and volts less the reserve."""
    return list(_strains(bounds, sample(bounds, pieces)))


def _strains(bounds: PathBounds, samples: Samples) -> Iterator[Strain]:
    limits = bounds.limits
    kept = 1.0 - limits.reserve
    for cap in limits.caps:
        inside = (samples.arc_mm > cap.from_mm) & (samples.arc_mm < cap.to_mm)
        peak = float(np.abs(samples.feed[inside]).max(initial=0.0))
        yield Strain(f"cap of {cap.from_mm:g} to {cap.to_mm:g} mm, feed_mm_s", cap.feed_mm_s, peak)
    if limits.centripetal_mm_s2 is not None:
        yield Strain("centripetal_mm_s2", limits.centripetal_mm_s2, _peak(samples.centripetal))
    for name, given, values, share in (
        ("velocity_mm_s", limits.axis.velocity_mm_s, samples.velocity, 1.0),
        ("acceleration_mm_s2", limits.axis.acceleration_mm_s2, samples.acceleration, kept),
        ("jerk_mm_s3", limits.axis.jerk_mm_s3, samples.jerk, kept),
    ):
        for axis, limit, one in zip("xy", given or (), per_axis(values), strict=False):
            yield Strain(f"axis {axis} {name}", limit, _peak(one), share)
    for axis, plant, v, a in zip(
        "xy",
        bounds.plants or (),
        per_axis(samples.velocity),
        per_axis(samples.acceleration),
        strict=False,
    ):
        peak = _peak(v + plant.time_constant_s * a) / plant.gain_mm_s_v
        yield Strain(f"axis {axis} volts", plant.reach_mm_s / plant.gain_mm_s_v, peak, kept)


def _peak(values: Real) -> float:
    return float(raised(values).max(initial=0.0))
