# SPDX-License-Identifier: MIT
"""The requested feed: section [feed] of a path file as frozen data, with the ranges of its values. Used by all modules
that plan a feed. No I/O.

Made by config/path_file.py, read by the planners in this package.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Literal

from ..errors import InputError

OPTIMAL = "optimal"
"""The profile that depends on the place."""
PROFILES = ("quintic", "exponential", "minimax", OPTIMAL)
"""All feed profiles."""
PERIODS_US = (1000, 2000, 4000, 8000)
"""Periods of the controller."""
LEAST_FEED_MM_S, GREATEST_FEED_MM_S = 1e-3, 4000.0
"""Range of the nominal feed."""
LEAST_RAMP_S, GREATEST_RAMP_S = 2e-3, 1000.0
"""Range of the time of a feed ramp."""
LEAST_DEGREE, GREATEST_DEGREE = 3, 12
"""Range of the degree of profile minimax."""
GREATEST_N_C = 50.0
"""Greatest slope coefficient of profile exponential."""
SHORTEST_MM, LONGEST_MM = 2.0**-10, 2.0**22 - 1.0
"""Shortest and longest path: the longest that arc lengths of the format hold."""
LONGEST_S = 2.0**22 - 1.0
"""Longest program time of the format."""


@dataclass(frozen=True)
class FeedRequest:
    """The requested feed: accelerate for `ramp_time_s`, constant `nominal_mm_s`, decelerate; or profile "optimal".

    profile  "quintic": paper (17); "exponential": (17) with (18); "minimax": least peak jerk; "optimal": least time
             inside the limits over the whole path. `nominal_mm_s` is then one more limit of the feed (inf: none), and
             the other fields are not used
    n_c      slope coefficient of "exponential", or "optimise" (pattern search, 2 … 12)
    degree   of "minimax", as a polynomial of feed in time

    Raises InputError: a value is out of its range.
    """

    profile: str
    nominal_mm_s: float = inf
    ramp_time_s: float = 0.0
    n_c: float | Literal["optimise"] = "optimise"
    degree: int = 5

    def __post_init__(self) -> None:
        if self.profile not in PROFILES:
            raise InputError(f"feed: profile {self.profile!r} is not one of {', '.join(PROFILES)}")
        if not (self.optimal and self.nominal_mm_s == inf):
            _in_range("feed: nominal_mm_s", self.nominal_mm_s, LEAST_FEED_MM_S, GREATEST_FEED_MM_S)
        if not self.optimal:
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

    @property
    def optimal(self) -> bool:
        """Whether the feed is planned over the whole path, not by two ramps."""
        return self.profile == OPTIMAL


def check_period(period_us: int) -> None:
    """Raises InputError: the program format does not allow this period."""
    if period_us not in PERIODS_US:
        known = ", ".join(str(p) for p in PERIODS_US)
        raise InputError(f"period_us {period_us} is not one of {known}")


def check_length(length_mm: float) -> None:
    """Raises InputError: the program format does not allow this length."""
    if not (isfinite(length_mm) and SHORTEST_MM <= length_mm <= LONGEST_MM):
        raise InputError(
            f"path: its length {length_mm:g} mm must be from {SHORTEST_MM:.3g} to {LONGEST_MM:.7g} mm: "
            "scale its points (they are in mm)"
        )


def _in_range(name: str, value: float, low: float, high: float) -> None:
    if not (isfinite(value) and low <= value <= high):
        raise InputError(f"{name} {value:g} is not in {low:g} … {high:g}")
