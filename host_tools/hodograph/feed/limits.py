# SPDX-License-Identifier: MIT
"""The limits that a feed has to keep: those of the path file, and those of the controller."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import isfinite

from ..errors import InputError

POLICIES = ("respect", "report")
LEAST_RESERVE, GREATEST_RESERVE = 2e-3, 0.9

MACHINE_SHARE = 0.998
"""Of the machine's axis limits: what plans use. The rest is for rounding, and for the controller's bounds of what lies
between the places where it looks (docs/guides/limits.md)."""

PerAxis = tuple[float, float]
"""One value for x, one for y."""


@dataclass(frozen=True)
class AxisLimits:
    """Limits of the motion of each axis, of a path file ([limits.axis]) or a machine file ([[axis]]); None: no limit.

    Raises InputError.
    """

    velocity_mm_s: PerAxis | None = None
    acceleration_mm_s2: PerAxis | None = None
    jerk_mm_s3: PerAxis | None = None

    def __post_init__(self) -> None:
        for one in fields(self):
            for value in getattr(self, one.name) or ():
                _above_zero(f"limits.axis: {one.name}", value)

    @property
    def any(self) -> bool:
        """Whether one of them is given."""
        return any(getattr(self, one.name) is not None for one in fields(self))

    def scaled(self, share: float) -> AxisLimits:
        """The same limits times `share`."""
        return AxisLimits(*(_scaled(getattr(self, one.name), share) for one in fields(self)))

    def and_of(self, other: AxisLimits) -> AxisLimits:
        """What keeps both: the lower of each."""
        pairs = ((getattr(self, one.name), getattr(other, one.name)) for one in fields(self))
        return AxisLimits(*(_lower(a, b) for a, b in pairs))


def _scaled(both: PerAxis | None, share: float) -> PerAxis | None:
    return None if both is None else (both[0] * share, both[1] * share)


def _lower(a: PerAxis | None, b: PerAxis | None) -> PerAxis | None:
    if a is None or b is None:
        return b if a is None else a
    return min(a[0], b[0]), min(a[1], b[1])


@dataclass(frozen=True)
class FeedCap:
    """A greatest feed on the stretch of path from one arc length to another. Raises InputError."""

    from_mm: float
    to_mm: float
    feed_mm_s: float

    def __post_init__(self) -> None:
        _above_zero("limits.cap: feed_mm_s", self.feed_mm_s)
        if not (isfinite(self.to_mm) and 0.0 <= self.from_mm < self.to_mm):
            raise InputError(
                f"limits.cap: from_mm {self.from_mm:g} must be at least 0 and below to_mm {self.to_mm:g}"
            )


@dataclass(frozen=True)
class Limits:
    """Limits of the path file, and of the machine's axes; None: no limit.

    feed_mm_s, acceleration_mm_s2, jerk_mm_s3   of the motion along the path (F', F'', F''')
    centripetal_mm_s2   feed^2 times curvature
    volts               of each axis by the plant of its drive file (docs/theory/numerics.md 13), along the path;
                        the drive's own volts_limit where that is less
    axis                of the motion of x and y
    caps                of the feed on stretches of the path; where several meet, the least
    reserve             share of the axes' accelerations, jerks and volts that plans leave free, so that hold, resume
                        and override keep these limits too (docs/theory/numerics.md section 7)

    machine             of the motion of x and y by the machine file: they always bind

    policy "respect": the feed is lowered until the profile obeys; "report": it runs as asked and what
    exceeds is listed, but the machine's limits are kept. Profile "optimal" always obeys. Raises InputError.
    """

    feed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    jerk_mm_s3: float | None = None
    policy: str = "respect"
    centripetal_mm_s2: float | None = None
    volts: float | None = None
    axis: AxisLimits = field(default_factory=AxisLimits)
    caps: tuple[FeedCap, ...] = ()
    reserve: float = LEAST_RESERVE
    machine: AxisLimits = field(default_factory=AxisLimits)

    def __post_init__(self) -> None:
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

    @property
    def bind(self) -> bool:
        """Whether one of them bounds the motion everywhere; caps alone do not."""
        return self.axes.any or any(getattr(self, name) is not None for name in _SCALARS)

    @property
    def axes(self) -> AxisLimits:
        """What a plan obeys of x and y: the path file's, and MACHINE_SHARE of the machine's where that is less."""
        return self.axis.and_of(self.machine.scaled(MACHINE_SHARE))

    @property
    def axes_whole(self) -> AxisLimits:
        """What a motion has to keep of x and y: the same, with the whole of the machine's."""
        return self.axis.and_of(self.machine)

    @property
    def of_machine(self) -> Limits:
        """The machine's only."""
        return Limits(reserve=self.reserve, machine=self.machine)

    def source(self, name: str, axis: int) -> str:
        """Whose limit of an axis (0: x) binds: "limits" of the path file, "machine", or "drive" (volts)."""
        if name == "volts":
            return "drive" if self.volts is None else "limits"
        own, used = getattr(self.axis, name), getattr(self.axes, name)
        return "limits" if own is not None and own[axis] == used[axis] else "machine"


_SCALARS = ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3", "centripetal_mm_s2", "volts")


@dataclass(frozen=True)
class ControllerLimits:
    """Limits of the controller (machine file): they always bind.

    A plan keeps `reserve` (a fraction) of each free for hold and override, and at least LEAST_RESERVE, which
    the pieces need; docs/theory/numerics.md 5.5 and section 7. Raises InputError.
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
        """The fraction of each limit that a plan really keeps free."""
        return max(self.reserve, LEAST_RESERVE)


def _above_zero(name: str, value: float) -> None:
    if not (isfinite(value) and value > 0.0):
        raise InputError(f"{name} {value:g} must be above 0 and finite")
