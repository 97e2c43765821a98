# SPDX-License-Identifier: MIT
"""Limits of a motion: one `Limit`, the tables of limits that files give, and the `Peak` of a limited quantity. Used by
all modules that plan or check a motion. No I/O.

Limits come from a path file ([limits], [feed]), a machine file (its axes and its controller) and drive files (volts).
docs/theory/feed.md 5.5.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..names import AXES, in_unit
from .request import FeedRequest

POLICIES = ("respect", "report")
LEAST_RESERVE, GREATEST_RESERVE = 2e-3, 0.9

MACHINE_SHARE = 0.998
"""Share of the machine's axis limits that plans use. The remainder is for rounding, and for the controller's bounds
between the places that it evaluates (docs/guides/limits.md).
"""

PerAxis = tuple[float, ...]
"""One value for each axis that follows the path, in the order of the path; inf: no limit."""


@dataclass(frozen=True)
class FeedZone:
    """A stretch of the path with its own feed limit (`[[limits.cap]]`). Raises InputError."""

    from_mm: float
    to_mm: float
    feed_mm_s: float

    def __post_init__(self) -> None:
        _above_zero("limits.cap: feed_mm_s", self.feed_mm_s)
        if not (isfinite(self.to_mm) and 0.0 <= self.from_mm < self.to_mm):
            raise InputError(
                f"limits.cap: from_mm {self.from_mm:g} must be at least 0 and below to_mm {self.to_mm:g}"
            )


def zones_after(zones: tuple[FeedZone, ...], base_mm: float) -> tuple[FeedZone, ...]:
    """The zones of the part of a path from `base_mm` on, as arc lengths of that part."""
    return tuple(
        FeedZone(max(zone.from_mm - base_mm, 0.0), zone.to_mm - base_mm, zone.feed_mm_s)
        for zone in zones
        if zone.to_mm > base_mm
    )


@dataclass(frozen=True)
class Limit:
    """One bound that a motion has to keep.

    key     the bounded quantity with its unit, as in files: "feed_mm_s", "velocity_mm_s", "volts" …
    value   the greatest magnitude, a reserve already taken off; inf: none
    source  section that gives it: "limits" or "feed" of the path file, "machine", "controller", "drive", "format"
    axis    name of the limited axis; None: along the path
    zone    the part of the path where it applies; None: everywhere
    share   `value` over the value given in the file; below 1 where a reserve is kept
    words   the reason for a limit that no file gives
    unit    of the axis: "deg" for a rotary axis
    """

    key: str
    value: float
    source: str = "limits"
    axis: str | None = None
    zone: FeedZone | None = None
    share: float = 1.0
    words: str = ""
    unit: str = "mm"

    @property
    def given(self) -> float:
        """The value without a reserve taken off."""
        return self.value / self.share

    @property
    def quantity(self) -> str:
        """The limited quantity: "feed_mm_s", "x_velocity_mm_s", "cap_mm_s" (the feed in a zone)."""
        if self.zone is not None:
            return "cap_mm_s"
        return self.key if self.axis is None else f"{self.axis}_{self.in_unit}"

    @property
    def in_unit(self) -> str:
        """The key in the unit of the axis."""
        return in_unit(self.key, self.unit)

    @property
    def dotted(self) -> str:
        """Name of the limited quantity in a plan's JSON: "feed_mm_s", "axis.velocity_mm_s.x", "volts.x"."""
        return self.quantity if self.axis is None else f"{self._table}{self.in_unit}.{self.axis}"

    @property
    def entry(self) -> str:
        """The key in its file: "axis.velocity_mm_s of x"."""
        if self.axis is not None:
            return f"{self._table}{self.in_unit} of {self.axis}"
        return self._zone + self.key

    @property
    def name(self) -> str:
        """Name of the limited quantity in notes: "axis x velocity_mm_s"."""
        return self._zone + self.key if self.axis is None else f"axis {self.axis} {self.in_unit}"

    @property
    def reason(self) -> str:
        """The limit in words, for notes."""
        given = self.given / MACHINE_SHARE if self.source == "machine" else self.given
        less = " less its reserve" if self.share < 1.0 else ""
        return self.words or f"{self.source} {self.name} = {given:g}{less}"

    @property
    def _table(self) -> str:
        return "" if self.key == "volts" else "axis."

    @property
    def _zone(self) -> str:
        zone = self.zone
        return "" if zone is None else f"cap of {zone.from_mm:g} to {zone.to_mm:g} mm, "


def least(limits: Iterable[Limit]) -> Limit:
    """The limit with the least value, the first of equal ones."""
    return min(limits, key=lambda one: one.value)


@dataclass(frozen=True)
class ReserveZone:
    """A stretch of the path on which a plan leaves `share` of accelerations and jerks free for stops."""

    from_mm: float
    to_mm: float
    share: float


def least_in_zones(
    arc_mm: NDArray[np.float64],
    zones: Sequence[FeedZone | ReserveZone],
    values: Iterable[float],
    *,
    with_ends: bool,
) -> NDArray[np.float64]:
    """The least of the zones' `values` at places of any shape and order; inf outside of all zones.

    with_ends  whether a zone contains its ends

    G-code may have a feed for each line. So places are sorted once, rather than compared with each zone.
    """
    if not zones:
        return np.full(arc_mm.shape, inf)
    order = np.argsort(arc_mm, axis=None, kind="stable")
    ordered = arc_mm.ravel()[order]
    firsts = np.searchsorted(
        ordered, [zone.from_mm for zone in zones], side="left" if with_ends else "right"
    )
    ends = np.searchsorted(
        ordered, [zone.to_mm for zone in zones], side="right" if with_ends else "left"
    )
    least = np.full(ordered.size, inf)
    for low, high, value in zip(firsts, ends, values, strict=True):
        np.minimum(least[low:high], value, out=least[low:high])
    found = np.empty_like(least)
    found[order] = least
    return found.reshape(arc_mm.shape)


@dataclass(frozen=True)
class Peak:
    """The largest value of a limited quantity, and its place.

    value    in the unit of `limit`; the value is nowhere above `at_most` (None: not proven)
    s_mm     arc length where it was found
    t_s      program time of that place; None: not known
    curvature_per_mm  of the path there
    """

    limit: Limit
    value: float
    s_mm: float = 0.0
    t_s: float | None = None
    at_most: float | None = None
    curvature_per_mm: float = 0.0

    @property
    def quantity(self) -> str:
        """See Limit."""
        return self.limit.quantity

    @property
    def usage(self) -> float:
        """Peak divided by limit: 1 is the limit itself; 0 where there is none."""
        return self.value / self.limit.value

    @property
    def most(self) -> float:
        """`at_most`, or the value itself."""
        return self.value if self.at_most is None else self.at_most

    def within(self, tolerance: float) -> bool:
        """Whether the value is certainly nowhere above its limit by more than this share."""
        return self.most <= self.limit.value * (1.0 + tolerance)

    @property
    def place(self) -> str:
        """The place in words."""
        radius = f" (radius {1.0 / self.curvature_per_mm:.3g} mm)" if self.curvature_per_mm else ""
        return f"at {self.s_mm:.6g} mm, where the curvature is {self.curvature_per_mm:.3g} 1/mm{radius}"

    @property
    def excess_text(self) -> str:
        """The excess over the given limit in words."""
        given = self.limit.given
        over = 100.0 * (self.value / given - 1.0)
        return f"{self.limit.name} {self.value:.6g} is above its limit {given:g} by {over:.1f} %"


@dataclass(frozen=True)
class Plant:
    """The voltage limit of an axis: volts * gain = velocity + time constant * acceleration; docs/theory/drives.md 13.

    gain_mm_s_v     steady speed for one volt
    volts           greatest voltage that may be used, including `friction_volts` for friction
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


Plants = tuple[Plant, ...]
"""The plant of each axis that follows the path."""


def as_drives_limit(plants: Plants | None) -> Plants | None:
    """The plants with all volts of their drives; None: not known."""
    if plants is None or any(plant.volts_limit == inf for plant in plants):
        return None
    return tuple(replace(plant, volts=plant.volts_limit) for plant in plants)


@dataclass(frozen=True)
class AxisLimits:
    """Limits of the motion of each axis, of a path file ([limits.axis]) or a machine file ([[axis]]); None: no limit.

    In the order in which the axes follow the path; inf: no limit of this axis. Raises InputError.
    """

    velocity_mm_s: PerAxis | None = None
    acceleration_mm_s2: PerAxis | None = None
    jerk_mm_s3: PerAxis | None = None

    def __post_init__(self) -> None:
        for one in fields(self):
            for value in getattr(self, one.name) or ():
                if value != inf:
                    _above_zero(f"limits.axis: {one.name}", value)

    @property
    def any(self) -> bool:
        """Whether one of them is given."""
        return any(getattr(self, one.name) is not None for one in fields(self))

    def scaled(self, share: float) -> AxisLimits:
        """These limits times `share`."""
        return AxisLimits(*(_scaled(getattr(self, one.name), share) for one in fields(self)))

    def from_axis(self, first: int) -> AxisLimits:
        """The limits of the axes from number `first` on."""
        each = (getattr(self, one.name) for one in fields(self))
        return AxisLimits(*(given and given[first:] for given in each))

    def and_of(self, other: AxisLimits) -> AxisLimits:
        """Limits that keep both: the lower one of each."""
        pairs = ((getattr(self, one.name), getattr(other, one.name)) for one in fields(self))
        return AxisLimits(*(_lower(a, b) for a, b in pairs))


def _scaled(both: PerAxis | None, share: float) -> PerAxis | None:
    return None if both is None else tuple(value * share for value in both)


def _lower(a: PerAxis | None, b: PerAxis | None) -> PerAxis | None:
    if a is None or b is None:
        return b if a is None else a
    return tuple(min(pair) for pair in zip(a, b, strict=True))


@dataclass(frozen=True)
class Limits:
    """The limits of a path file ([limits]), and those of the machine's axes; None: no limit.

    feed_mm_s, acceleration_mm_s2, jerk_mm_s3   of the motion along the path (F', F'', F''')
    centripetal_mm_s2   feed^2 times curvature
    volts               of each axis, by the plant of its drive file (docs/theory/drives.md 13); the drive's
                        volts_limit if that is less
    axis                of the motion of the axes
    zones               feed zones; where several meet, the least feed
    reserve             share of the axes' accelerations, jerks and volts that plans leave free for hold, resume and
                        override (docs/theory/feed.md section 7)

    machine             of the motion of the axes, from the machine file; they always apply
    names, units        of the axes that follow the path, in its order; a unit is "mm" or "deg", () stands for mm
    reserve_zones       places where profile "optimal" leaves more than `reserve` free

    Policy "respect": the feed is lowered until the profile keeps all limits. "report": the feed stays as requested, and
    excesses are listed; the machine's limits are kept. Profile "optimal" always keeps all limits. Raises InputError.
    """

    feed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    jerk_mm_s3: float | None = None
    policy: str = "respect"
    centripetal_mm_s2: float | None = None
    volts: float | None = None
    axis: AxisLimits = field(default_factory=AxisLimits)
    zones: tuple[FeedZone, ...] = ()
    reserve: float = LEAST_RESERVE
    machine: AxisLimits = field(default_factory=AxisLimits)
    names: tuple[str, ...] = AXES[:2]
    units: tuple[str, ...] = ()
    reserve_zones: tuple[ReserveZone, ...] = ()

    def __post_init__(self) -> None:
        for table in (self.axis, self.machine):
            self._check_count(table)
        for name in _SCALARS:
            value = getattr(self, name)
            if value is not None:
                _above_zero(f"limits: {name}", value)
        if self.policy not in POLICIES:
            raise InputError(f"limits: policy {self.policy!r} is not one of {', '.join(POLICIES)}")
        if not LEAST_RESERVE <= self.reserve <= GREATEST_RESERVE:
            raise InputError(
                f"limits: reserve {self.reserve:g} is not in {LEAST_RESERVE:g} … {GREATEST_RESERVE:g}"
            )

    def _check_count(self, table: AxisLimits) -> None:
        for one in fields(table):
            given = getattr(table, one.name)
            if given is not None and len(given) != len(self.names):
                raise InputError(
                    f"limits.axis: {one.name} has {len(given)} values, the path has the axes "
                    f"{', '.join(self.names)}: give one number for all, or one for each"
                )

    def of_axes(self, count: int) -> Limits:
        """These limits for a path that `count` axes follow. Raises InputError: they are for another number of axes."""
        if len(self.names) == count:
            return self
        if self.axis.any or self.machine.any or self.names != AXES[:2]:
            raise InputError(
                f"limits: are for the axes {', '.join(self.names)}, the path has {count} axes"
            )
        return replace(self, names=AXES[:count])

    def unit(self, axis: int) -> str:
        """Of axis number `axis`."""
        return self.units[axis] if self.units else "mm"

    def on_machine(
        self, names: tuple[str, ...], machine: AxisLimits, units: tuple[str, ...] = ()
    ) -> Limits:
        """The limits on a machine with path axes of these names and units. The path file does not limit axes that it
        does not have.
        """
        each = (getattr(self.axis, one.name) for one in fields(self.axis))
        own = AxisLimits(
            *(
                given and (given + (inf,) * (len(names) - len(given)))[: len(names)]
                for given in each
            )
        )
        return replace(self, axis=own, machine=machine, names=names, units=units)

    @property
    def bind(self) -> bool:
        """Whether one of the limits bounds the motion everywhere. Zones alone do not."""
        return self.axes.any or any(getattr(self, name) is not None for name in _SCALARS)

    @property
    def axes(self) -> AxisLimits:
        """The axis limits that a plan keeps: those of the path file, or MACHINE_SHARE of the machine's if that is
        less.
        """
        return self.axis.and_of(self.machine.scaled(MACHINE_SHARE))

    @property
    def axes_whole(self) -> AxisLimits:
        """The axis limits that a motion has to keep: those of the path file, or the machine's if these are less."""
        return self.axis.and_of(self.machine)

    @property
    def of_machine(self) -> Limits:
        """The limits of the machine only."""
        return Limits(
            reserve=self.reserve, machine=self.machine, names=self.names, units=self.units
        )

    def source(self, name: str, axis: int) -> str:
        """Source of the lowest limit of axis number `axis`: "limits" (path file), "machine", or "drive" (volts)."""
        if name == "volts":
            return "drive" if self.volts is None else "limits"
        own, used = getattr(self.axis, name), getattr(self.axes, name)
        return "limits" if own is not None and own[axis] == used[axis] else "machine"

    def axis_limits(self, key: str) -> tuple[Limit, ...]:
        """The axis limits that a plan keeps, with the reserve subtracted from accelerations and jerks; value inf:
        none.
        """
        each = getattr(self.axes, key) or (inf,) * len(self.names)
        share = 1.0 if key == "velocity_mm_s" else 1.0 - self.reserve
        return tuple(
            Limit(
                key,
                share * value,
                self.source(key, k) if value < inf else "",
                name,
                None,
                share,
                unit=self.unit(k),
            )
            for k, (name, value) in enumerate(zip(self.names, each, strict=True))
        )

    def volts_limits(self, plants: Plants) -> tuple[Limit, ...]:
        """The limits of the volts without friction that a plan keeps, with the reserve subtracted."""
        share = 1.0 - self.reserve
        return tuple(
            Limit(
                "volts",
                share * (plant.reach_mm_s / plant.gain_mm_s_v),
                self.source("volts", k),
                name,
                None,
                share,
            )
            for k, (name, plant) in enumerate(zip(self.names, plants, strict=True))
        )


_SCALARS = ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3", "centripetal_mm_s2", "volts")


@dataclass(frozen=True)
class ControllerLimits:
    """Limits of the controller (machine file); they always apply.

    A plan keeps the share `reserve` of each free for hold and override, and at least LEAST_RESERVE, which the pieces
    need; docs/theory/feed.md 5.5 and section 7. Raises InputError.
    """

    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    reserve: float = 0.1

    def __post_init__(self) -> None:
        for name in ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"):
            _above_zero(f"controller: {name}", getattr(self, name))
        if not 0.0 <= self.reserve <= GREATEST_RESERVE:
            raise InputError(
                f"controller: reserve {self.reserve:g} is not in 0 … {GREATEST_RESERVE:g}"
            )

    @property
    def kept_free(self) -> float:
        """The share of each limit that a plan keeps free: `reserve`, at least LEAST_RESERVE."""
        return max(self.reserve, LEAST_RESERVE)

    def limit(self, key: str) -> Limit:
        """One of these limits without its reserve, as a plan keeps it."""
        share = 1.0 - self.kept_free
        return Limit(key, float(getattr(self, key)) * share, "controller", share=share)


def ineffective_limits(
    limits: Limits, request: FeedRequest, length_mm: float, plants: Plants | None
) -> Iterator[str]:
    """One line for each ineffective limit of a path of `length_mm`.

    plants  of the axes with the volts that their drives allow; None: no volts are limited
    """
    if request.optimal and limits.policy == "report":
        yield (
            f'limits: policy "report" does nothing with profile "{request.profile}", which keeps every limit'
        )
    for number, zone in enumerate(limits.zones, start=1):
        if zone.from_mm >= length_mm:
            yield (
                f"limits: cap {number} begins at {zone.from_mm:g} mm, after the end of the path at "
                f"{length_mm:.6g} mm: it does nothing"
            )
    for axis, plant in zip(limits.names, plants or (), strict=False):
        if limits.volts is not None and plant.volts < limits.volts:
            yield (
                f"limits: volts {limits.volts:g} is more than the drive of {axis} has: "
                f"its volts_limit of {plant.volts:g} V counts"
            )


def _above_zero(name: str, value: float) -> None:
    if not (isfinite(value) and value > 0.0):
        raise InputError(f"{name} {value:g} must be above 0 and finite")
