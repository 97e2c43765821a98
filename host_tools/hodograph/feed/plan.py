# SPDX-License-Identifier: MIT
"""A feed plan: the feed along a whole path, with what was requested. Frozen data; docs/theory/feed.md 5 and 6. Used by
all modules that make a feed plan or handle one. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..fixed_point import nearest_q40
from .kinematics import PathBounds
from .limits import ControllerLimits, FeedZone, Limits, Peak
from .override import with_override
from .pieces import FeedPieces, RawPieces
from .ramp import Ramp, SearchStep
from .request import FeedRequest

Real = NDArray[np.float64]
Int = NDArray[np.int64]


class FeedCurve(Protocol):
    """Arc length over time: the timeline of a profile with ramps, or the track of profile "optimal"."""

    @property
    def length_mm(self) -> Fraction:
        """Length of the path, exactly."""

    @property
    def time_s(self) -> float:
        """Duration of the whole."""

    @property
    def ramp(self) -> Ramp | None:
        """The feed ramp; None for profile "optimal"."""

    @property
    def follows_joints(self) -> bool:
        """Whether pieces begin at joints of segments, where limited quantities may jump."""

    def value(self, order: int, t_s: ArrayLike) -> Real:
        """F (order 0) or a derivative of it, at times 0 … time_s (clipped); mm, s."""

    def peaks(self) -> tuple[float, float, float]:
        """Greatest feed, acceleration and jerk along the path; mm, s."""

    def raw_pieces(self, length_q40: int, period_us: int, joints_q40: Int | None) -> RawPieces:
        """The curve in integers over exactly this length, which may differ from its own by rounding."""


@dataclass(frozen=True, eq=False)
class FeedPlan:
    """The feed along a whole path.

    limits      of the path file and of the machine's axes
    controller  limits of the controller; `assumed`: no machine is named, and they are never reached
    curve       arc length over time
    notes       one line for each thing that the user should know, such as the limit that lowered the feed
    excesses    peaks above their limits under policy "report"
    history     steps of the pattern search for the feed that is used; empty without a search
    paths       the path with the limits that depend on it, from which pieces get their override bounds
    """

    request: FeedRequest
    limits: Limits
    controller: ControllerLimits
    period_us: int
    curve: FeedCurve
    notes: tuple[str, ...] = ()
    excesses: tuple[Peak, ...] = ()
    history: tuple[SearchStep, ...] = ()
    paths: tuple[PathBounds, ...] = ()
    assumed: bool = False

    @property
    def profile(self) -> str:
        """Name of the profile."""
        return self.request.profile

    @property
    def n_c(self) -> float | None:
        """Slope coefficient that is used; None: the profile has none."""
        return None if self.curve.ramp is None else self.curve.ramp.n_c

    @property
    def ramp_time_s(self) -> float | None:
        """Time of each ramp; None for profile "optimal"."""
        return None if self.curve.ramp is None else self.curve.ramp.time_s

    @property
    def evaluations(self) -> int:
        """Evaluations of the peak jerk that the search took; 0 without one."""
        return self.history[-1].evaluations if self.history else 0

    @property
    def length_mm(self) -> float:
        """Length of the path."""
        return float(self.curve.length_mm)

    @property
    def duration_s(self) -> float:
        """Time of the whole."""
        return self.curve.time_s

    @cached_property
    def _peaks(self) -> tuple[float, float, float]:
        return self.curve.peaks()

    @property
    def feed_mm_s(self) -> float:
        """Peak feed."""
        return self._peaks[0]

    @property
    def peak_acceleration_mm_s2(self) -> float:
        """Greatest |F''|."""
        return self._peaks[1]

    @property
    def peak_jerk_mm_s3(self) -> float:
        """Greatest |F'''|."""
        return self._peaks[2]

    def arc_length(self, t_s: ArrayLike) -> Real:
        """F at times 0 … duration_s (clipped); mm."""
        return self.curve.value(0, t_s)

    def feed(self, t_s: ArrayLike) -> Real:
        """F'; mm/s."""
        return self.curve.value(1, t_s)

    def acceleration(self, t_s: ArrayLike) -> Real:
        """F''; mm/s^2."""
        return self.curve.value(2, t_s)

    def jerk(self, t_s: ArrayLike) -> Real:
        """F'''; mm/s^3."""
        return self.curve.value(3, t_s)

    @cached_property
    def raw(self) -> RawPieces:
        """The plan in integers, over the length rounded to 2^-40 mm."""
        return self.curve.raw_pieces(self._length_q40, self.period_us, None)

    @cached_property
    def pieces(self) -> FeedPieces:
        """`raw` with the override bounds of each piece."""
        return with_override(self.raw, self.controller, self.limits, self.paths)

    def pieces_over(self, length_q40: int, joints_q40: Int | None = None) -> FeedPieces:
        """The plan in integers over exactly `length_q40`, which may differ from its own length by rounding.

        joints_q40  (segments + 1,) of the program: pieces that begin at a joint begin exactly there
        """
        own = length_q40 == self._length_q40
        if own and (joints_q40 is None or not self.curve.follows_joints):
            return self.pieces
        key = (length_q40, None if joints_q40 is None else joints_q40.tobytes())
        if key not in self._fitted:
            raw = self.curve.raw_pieces(length_q40, self.period_us, joints_q40)
            self._fitted.clear()
            self._fitted[key] = with_override(raw, self.controller, self.limits, self.paths)
        return self._fitted[key]

    @cached_property
    def _fitted(self) -> dict[tuple[int, bytes | None], FeedPieces]:
        """The last result of `pieces_over`: fitting and compiling a plan need the same pieces."""
        return {}

    @property
    def _length_q40(self) -> int:
        return nearest_q40(self.curve.length_mm)


Replan = Callable[[FeedPlan, Sequence[FeedZone], str], FeedPlan]
"""Plans a request again with further feed zones; the text is the reason, for the notes."""


def assumed_controller(feed_mm_s: float, acceleration: float, jerk: float) -> ControllerLimits:
    """Limits for a plan without a machine, from its peaks: so high that they are never reached."""
    return ControllerLimits(
        2.0 * feed_mm_s, 8.0 * acceleration + 10.0 * feed_mm_s, 16.0 * jerk + 100.0 * feed_mm_s
    )
