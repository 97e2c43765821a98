# SPDX-License-Identifier: MIT
"""What is asked of the feed, and the limits it has to keep."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal

from ..errors import InputError

PROFILES = ("quintic", "exponential", "minimax")
POLICIES = ("respect", "report")
PERIODS_US = (1000, 2000, 4000, 8000)
LEAST_FEED_MM_S, GREATEST_FEED_MM_S = 1e-3, 4000.0
LEAST_RAMP_S, GREATEST_RAMP_S = 2e-3, 1000.0
LEAST_DEGREE, GREATEST_DEGREE = 3, 12
GREATEST_N_C = 50.0
LEAST_RESERVE = 2e-3


@dataclass(frozen=True)
class FeedRequest:
    """The feed asked for: accelerate for `ramp_time_s`, constant `nominal_mm_s`, decelerate.

    profile  "quintic": paper (17); "exponential": (17) with (18); "minimax": least peak jerk
    n_c      slope coefficient of "exponential", or "optimise" (pattern search, 2 … 12)
    degree   of "minimax", as a polynomial of feed in time

    Raises InputError for values that make no sense.
    """

    profile: str
    nominal_mm_s: float
    ramp_time_s: float
    n_c: float | Literal["optimise"] = "optimise"
    degree: int = 5

    def __post_init__(self) -> None:
        if self.profile not in PROFILES:
            raise InputError(f"feed: profile {self.profile!r} is not one of {', '.join(PROFILES)}")
        _in_range("feed: nominal_mm_s", self.nominal_mm_s, LEAST_FEED_MM_S, GREATEST_FEED_MM_S)
        _in_range("feed: ramp_time_s", self.ramp_time_s, LEAST_RAMP_S, GREATEST_RAMP_S)
        if isinstance(self.n_c, str):
            if self.n_c != "optimise":
                raise InputError(f'feed: n_c must be a number or "optimise", not {self.n_c!r}')
        else:
            _in_range("feed: n_c", self.n_c, 0.0, GREATEST_N_C)
        if not LEAST_DEGREE <= self.degree <= GREATEST_DEGREE:
            raise InputError(
                f"feed: degree {self.degree} is not in {LEAST_DEGREE} … {GREATEST_DEGREE}"
            )


@dataclass(frozen=True)
class Limits:
    """Tangential limits of the path file; None: no limit.

    policy "respect": the feed is lowered until the profile obeys; "report": it runs as asked and what
    exceeds is listed. Raises InputError.
    """

    feed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    jerk_mm_s3: float | None = None
    policy: str = "respect"

    def __post_init__(self) -> None:
        for name in ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"):
            value = getattr(self, name)
            if value is not None:
                _above_zero(f"limits: {name}", value)
        if self.policy not in POLICIES:
            raise InputError(f"limits: policy {self.policy!r} is not one of {', '.join(POLICIES)}")


@dataclass(frozen=True)
class ControllerLimits:
    """Limits of the controller (machine file): they always bind.

    A plan keeps `reserve` (a fraction) of each free for hold and override, and at least LEAST_RESERVE, which
    the pieces need; docs/numerics.md 5.5 and section 7. Raises InputError.
    """

    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    reserve: float = 0.1

    def __post_init__(self) -> None:
        for name in ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"):
            _above_zero(f"controller: {name}", getattr(self, name))
        if not 0.0 <= self.reserve <= 0.9:
            raise InputError(f"controller: reserve {self.reserve:g} is not in 0 … 0.9")

    @property
    def kept_free(self) -> float:
        """The fraction of each limit that a plan really keeps free."""
        return max(self.reserve, LEAST_RESERVE)


def check_period(period_us: int) -> None:
    """Raises InputError unless `period_us` is one the program format knows."""
    if period_us not in PERIODS_US:
        known = ", ".join(str(p) for p in PERIODS_US)
        raise InputError(f"period_us {period_us} is not one of {known}")


def _in_range(name: str, value: float, low: float, high: float) -> None:
    if not (isfinite(value) and low <= value <= high):
        raise InputError(f"{name} {value:g} is not in {low:g} … {high:g}")


def _above_zero(name: str, value: float) -> None:
    if not (isfinite(value) and value > 0.0):
        raise InputError(f"{name} {value:g} must be above 0 and finite")
