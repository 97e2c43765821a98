# SPDX-License-Identifier: MIT
"""A planned feed: what was asked, what came out, and its pieces; docs/theory/numerics.md sections 5 and 6."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .headroom import Room
from .kinematics import PathBounds, Pieces
from .limits import ControllerLimits, FeedCap, Limits
from .override import override_bounds
from .pattern_search import SearchStep
from .pieces import FeedPieces, derivative_peaks
from .quantise import RawPieces, quantise
from .ramp import ACCELERATION, JERK
from .request import FeedRequest
from .timeline import Timeline, timeline

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Excess:
    """A limit of the path file that the plan breaks under policy "report"."""

    quantity: str
    limit: float
    value: float

    def __str__(self) -> str:
        over = 100.0 * (self.value / self.limit - 1.0)
        return f"{self.quantity} {self.value:.6g} is above its limit {self.limit:g} by {over:.1f} %"


class Plan(Protocol):
    """What every planned feed can say, whatever its profile.

    notes, excesses   as in FeedPlan; `n_c` and `ramp_time_s` are None, and `history` empty, where a profile has none
    """

    @property
    def request(self) -> FeedRequest:
        """What was asked."""
        ...

    @property
    def limits(self) -> Limits:
        """Limits of the path file."""
        ...

    @property
    def controller(self) -> ControllerLimits:
        """Limits of the controller."""
        ...

    @property
    def period_us(self) -> int:
        """Of the program."""
        ...

    @property
    def history(self) -> tuple[SearchStep, ...]:
        """Steps of a pattern search."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """One line for each thing the user should know."""
        ...

    @property
    def excesses(self) -> tuple[Excess, ...]:
        """Limits broken under policy "report"."""
        ...

    @property
    def profile(self) -> str:
        """Name of the profile."""
        ...

    @property
    def n_c(self) -> float | None:
        """Slope coefficient."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the peak jerk that a search took."""
        ...

    @property
    def length_mm(self) -> float:
        """Length of the path."""
        ...

    @property
    def feed_mm_s(self) -> float:
        """Peak feed."""
        ...

    @property
    def ramp_time_s(self) -> float | None:
        """Time of each ramp."""
        ...

    @property
    def duration_s(self) -> float:
        """Time of the whole."""
        ...

    @property
    def peak_acceleration_mm_s2(self) -> float:
        """Greatest |F''|."""
        ...

    @property
    def peak_jerk_mm_s3(self) -> float:
        """Greatest |F'''|."""
        ...

    def arc_length(self, t_s: ArrayLike) -> Real:
        """F at times; mm."""
        ...

    def feed(self, t_s: ArrayLike) -> Real:
        """F'; mm/s."""
        ...

    def acceleration(self, t_s: ArrayLike) -> Real:
        """F''; mm/s^2."""
        ...

    def jerk(self, t_s: ArrayLike) -> Real:
        """F'''; mm/s^3."""
        ...

    @property
    def raw(self) -> RawPieces:
        """The plan in integers, without bounds for the override."""
        ...

    @property
    def pieces(self) -> FeedPieces:
        """The plan in integers."""
        ...

    def pieces_over(
        self, length_q40: int, joints_q40: NDArray[np.int64] | None = None
    ) -> FeedPieces:
        """The same over exactly this length, which may differ a little (rounding), as the joints may."""
        ...

    def slowed(self, caps: Sequence[FeedCap], reason: str) -> Plan:
        """Planned again with the feed capped on stretches of the path; `reason` goes to the notes."""
        ...


@dataclass(frozen=True, eq=False)
class FeedPlan:
    """A feed over time: what was asked, what came out, and the exact curve.

    history   steps of the pattern search for the feed really used; empty without a search
    notes     one line for each thing the user should know (what lowered the feed, and so on)
    excesses  limits broken under policy "report"
    path      the path, where limits depend on it
    """

    request: FeedRequest
    limits: Limits
    controller: ControllerLimits
    period_us: int
    line: Timeline
    history: tuple[SearchStep, ...]
    notes: tuple[str, ...]
    excesses: tuple[Excess, ...]
    path: PathBounds | None = None
    machine: PathBounds | None = None

    @property
    def profile(self) -> str:
        """Name of the profile."""
        return self.request.profile

    @property
    def n_c(self) -> float | None:
        """Slope coefficient used; None for profiles without."""
        return self.line.ramp.n_c

    @property
    def evaluations(self) -> int:
        """Evaluations of the peak jerk that the search took; 0 without one."""
        return self.history[-1].evaluations if self.history else 0

    @property
    def length_mm(self) -> float:
        """Length of the path."""
        return float(self.line.length_mm)

    @property
    def feed_mm_s(self) -> float:
        """Peak feed."""
        return self.line.ramp.feed_mm_s

    @property
    def ramp_time_s(self) -> float:
        """Time of each ramp."""
        return self.line.ramp.time_s

    @property
    def duration_s(self) -> float:
        """Time of the whole."""
        return float(self.line.duration_s)

    @cached_property
    def peak_acceleration_mm_s2(self) -> float:
        """Greatest |F''|."""
        return self.line.ramp.peak(ACCELERATION)

    @cached_property
    def peak_jerk_mm_s3(self) -> float:
        """Greatest |F'''|."""
        return self.line.ramp.peak(JERK)

    def arc_length(self, t_s: ArrayLike) -> Real:
        """F at times 0 … duration_s (clipped); mm."""
        return self.line.arc_length(t_s)

    def feed(self, t_s: ArrayLike) -> Real:
        """F'; mm/s."""
        return self.line.feed(t_s)

    def acceleration(self, t_s: ArrayLike) -> Real:
        """F''; mm/s^2."""
        return self.line.acceleration(t_s)

    def jerk(self, t_s: ArrayLike) -> Real:
        """F'''; mm/s^3."""
        return self.line.jerk(t_s)

    @cached_property
    def raw(self) -> RawPieces:
        """The curve in integers, over the length rounded to 2^-40 mm."""
        return quantise(self.line, self._length_q40, self.period_us)

    @cached_property
    def pieces(self) -> FeedPieces:
        """`raw` with the override bounds of each piece."""
        return with_override(self.raw, self.controller, self.limits, self.path, self.machine)

    def pieces_over(
        self, length_q40: int, joints_q40: NDArray[np.int64] | None = None
    ) -> FeedPieces:
        """The plan in integers over exactly `length_q40`, which may differ a little (rounding)."""
        if length_q40 == self._length_q40:
            return self.pieces
        length = Fraction(length_q40, 2**40)
        ramp = self.line.ramp
        if not self.line.constant_s:
            ramp = replace(ramp, feed_mm_s=float(length / Fraction(ramp.time_s)))
        raw = quantise(timeline(ramp, length), length_q40, self.period_us)
        return with_override(raw, self.controller, self.limits, self.path, self.machine)

    def slowed(self, caps: Sequence[FeedCap], reason: str) -> FeedPlan:
        """Planned again with the feed nowhere above the least of the caps; `reason` goes to the notes."""
        from .planning import plan_again  # which makes plans, and so knows this module

        return plan_again(self, min(cap.feed_mm_s for cap in caps), reason)

    @property
    def _length_q40(self) -> int:
        return round(self.line.length_mm * 2**40)


def with_override(
    raw: Pieces, controller: ControllerLimits, limits: Limits, *paths: PathBounds | None
) -> FeedPieces:
    """Pieces with bounds of the override: of the controller's limits, and of those along a path."""
    peaks = derivative_peaks(raw.duration_q32_s, raw.c_q40)
    rooms = [Room(path, raw) for path in paths if path is not None and path.bind]
    override = override_bounds(*peaks, controller, limits, rooms)
    return FeedPieces(
        raw.duration_q32_s,
        raw.start_q40,
        raw.c_q40,
        override.factor_q14,
        override.rate_codes,
        override.second_codes,
    )
