# SPDX-License-Identifier: MIT
"""How far pieces are above the limits along a path that their plan has to keep; docs/theory/numerics.md 5.5."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .kinematics import PathBounds, Pieces, Samples, per_axis, raised, sample
from .limits import MACHINE_SHARE

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Strain:
    """A limit, the peak beside it and its place, the share of the limit that a plan may use, and whose limit it is."""

    name: str
    limit: float
    peak: float
    share: float = 1.0
    source: str = "limits"
    s_mm: float = 0.0
    curvature_per_mm: float = 0.0

    @property
    def ratio(self) -> float:
        """Peak over what may be used."""
        return self.peak / (self.share * self.limit)

    @property
    def reason(self) -> str:
        """The limit in words, for notes."""
        less = " less its reserve" if self.share < 1.0 else ""
        limit = self.limit / MACHINE_SHARE if self.source == "machine" else self.limit
        return f"{self.source} {self.name} = {limit:g}{less}"

    @property
    def place(self) -> str:
        """Where, in words."""
        radius = f" (radius {1.0 / self.curvature_per_mm:.3g} mm)" if self.curvature_per_mm else ""
        return f"at {self.s_mm:.6g} mm, where the curvature is {self.curvature_per_mm:.3g} 1/mm{radius}"


def strains(bounds: PathBounds, pieces: Pieces) -> list[Strain]:
    """All limits along the path; those of axis acceleration, axis jerk and volts less the reserve."""
    return list(_strains(bounds, sample(bounds, pieces)))


def _strains(bounds: PathBounds, samples: Samples) -> Iterator[Strain]:
    limits = bounds.limits
    kept = 1.0 - limits.reserve
    for cap in limits.caps:
        inside = (samples.arc_mm > cap.from_mm) & (samples.arc_mm < cap.to_mm)
        name = f"cap of {cap.from_mm:g} to {cap.to_mm:g} mm, feed_mm_s"
        yield _strain(samples, np.where(inside, np.abs(samples.feed), 0.0), name, cap.feed_mm_s)
    if limits.centripetal_mm_s2 is not None:
        bend = raised(samples.centripetal)
        yield _strain(samples, bend, "centripetal_mm_s2", limits.centripetal_mm_s2)
    for name, given, values, share in (
        ("velocity_mm_s", limits.axes.velocity_mm_s, samples.velocity, 1.0),
        ("acceleration_mm_s2", limits.axes.acceleration_mm_s2, samples.acceleration, kept),
        ("jerk_mm_s3", limits.axes.jerk_mm_s3, samples.jerk, kept),
    ):
        for k, (limit, one) in enumerate(zip(given or (), per_axis(values), strict=False)):
            axis = "xy"[k]
            source = limits.source(name, k)
            yield _strain(samples, raised(one), f"axis {axis} {name}", limit, share, source)
    axes = zip(per_axis(samples.velocity), per_axis(samples.acceleration), strict=True)
    for k, (plant, (v, a)) in enumerate(zip(bounds.plants or (), axes, strict=False)):
        volts = raised(v + plant.time_constant_s * a) / plant.gain_mm_s_v
        most = plant.reach_mm_s / plant.gain_mm_s_v
        source = limits.source("volts", k)
        yield _strain(samples, volts, f"axis {'xy'[k]} volts", most, kept, source)


def _strain(
    samples: Samples,
    values: Real,
    name: str,
    limit: float,
    share: float = 1.0,
    source: str = "limits",
) -> Strain:
    """`values` are the magnitudes (C, K) beside the limit."""
    worst = np.unravel_index(int(values.argmax()), values.shape)
    feed = max(float(abs(samples.feed[worst])), 1e-12)
    curvature = float(abs(samples.centripetal[worst])) / feed**2
    return Strain(
        name, limit, float(values[worst]), share, source, float(samples.arc_mm[worst]), curvature
    )
