# SPDX-License-Identifier: MIT
"""The profile `optimal`: least time along a path inside all its limits; docs/theory/numerics.md 5.6."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError, PlanError
from ...spline import PHSpline
from ..kinematics import PathBounds
from ..limits import ControllerLimits, FeedCap, Limits
from ..pattern_search import SearchStep
from ..pieces import FeedPieces, derivative_peaks
from ..plan import Excess, with_override
from ..planning import LONGEST_S, check_length
from ..plant import Plants
from ..quantise import RawPieces, round_pieces
from ..request import FeedRequest, check_period
from .bounds import Bounds, gather
from .feasible import binding_most, check_feasible, least_time_s, rounded_up, within_reach
from .peaks import Peak, find_peaks
from .track import Ends, Track, joined, make_track
from .windows import NothingFoundError, plan_windows

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_ABOVE = 3e-4
"""A plan may be above a limit by this share; what is more is taken out by running it slower."""

_DRIFT_Q40 = 1024
"""Joints of a program are within so many 2^-40 mm (1e-9 mm) of those of its path."""

_CAP_SHARE, _BESIDE_MM = 0.998, 2.0**-12

_EASED = (1e-5, 1e-4, 1e-3)
_POOR = 1.02
_MANY_PERIODS = 100.0

_POWER = {"acceleration": 2, "jerk": 3, "centripetal": 2}


@dataclass(frozen=True, eq=False)
class OptimalPlan:
    """A feed over the whole path; like FeedPlan, but its pieces are the plan.

    bounds  all that was obeyed; `stretch` what the plan was slowed by in the end, 1.0003 being 0.03 %
    """

    request: FeedRequest
    limits: Limits
    controller: ControllerLimits
    period_us: int
    spline: PHSpline
    given_controller: ControllerLimits | None
    plants: Plants | None
    bounds: Bounds
    track: Track
    stretch: float
    notes: tuple[str, ...]

    history: tuple[SearchStep, ...] = ()
    excesses: tuple[Excess, ...] = ()
    n_c: float | None = None
    evaluations: int = 0
    ramp_time_s: float | None = None

    @property
    def profile(self) -> str:
        """Name of the profile."""
        return self.request.profile

    @property
    def length_mm(self) -> float:
        """Length of the path."""
        return self.spline.length_mm

    @property
    def duration_s(self) -> float:
        """Time of the whole."""
        return self.track.duration_s

    @cached_property
    def _derivative_peaks(self) -> tuple[float, float, float]:
        v, a, j = (
            float(p.max()) for p in derivative_peaks(self.raw.duration_q32_s, self.raw.c_q40)
        )
        return v, a, j

    @property
    def feed_mm_s(self) -> float:
        """Peak feed."""
        return self._derivative_peaks[0]

    @property
    def peak_acceleration_mm_s2(self) -> float:
        """Greatest |F''|."""
        return self._derivative_peaks[1]

    @property
    def peak_jerk_mm_s3(self) -> float:
        """Greatest |F'''|."""
        return self._derivative_peaks[2]

    @cached_property
    def peaks(self) -> dict[str, Peak]:
        """Where every limited quantity comes nearest to its limit."""
        return find_peaks(self.spline, self.bounds, self.track)

    def arc_length(self, t_s: ArrayLike) -> Real:
        """F at times 0 … duration_s (clipped); mm."""
        return self.track.value(0, t_s)

    def feed(self, t_s: ArrayLike) -> Real:
        """F'; mm/s."""
        return self.track.value(1, t_s)

    def acceleration(self, t_s: ArrayLike) -> Real:
        """F''; mm/s^2."""
        return self.track.value(2, t_s)

    def jerk(self, t_s: ArrayLike) -> Real:
        """F'''; mm/s^3."""
        return self.track.value(3, t_s)

    @cached_property
    def raw(self) -> RawPieces:
        """The curve in integers, over the length rounded to 2^-40 mm."""
        return _raw(self.track, round(self.length_mm * 2**40))

    @property
    def pieces(self) -> FeedPieces:
        """`raw` with the override bounds of each piece."""
        return with_override(self.raw, self.controller, self.limits, self._path)

    def pieces_over(self, length_q40: int, joints_q40: Int | None = None) -> FeedPieces:
        """The plan in integers over exactly `length_q40`, which may differ a little (rounding).

        joints_q40  (segments + 1,) of the program: pieces that begin at a joint begin there, since limited quantities
                    jump at joints
        """
        raw = _raw(self.track, length_q40, self.spline.segment_starts_mm, joints_q40)
        return with_override(raw, self.controller, self.limits, self._path)

    def _widened(self, cap: FeedCap) -> FeedCap:
        s = self.track.s
        first = int(np.searchsorted(s, cap.from_mm - _BESIDE_MM, side="right")) - 1
        last = int(np.searchsorted(s, cap.to_mm + _BESIDE_MM, side="left"))
        return FeedCap(
            float(s[max(first, 0)]), float(s[min(last, s.size - 1)]), cap.feed_mm_s * _CAP_SHARE
        )

    @cached_property
    def _path(self) -> PathBounds:
        return PathBounds(self.spline, self.limits, self.plants)

    def slowed(self, caps: Sequence[FeedCap], reason: str) -> OptimalPlan:
        """Planned again with further caps; `reason` goes to the notes.

        A cap counts for whole pieces: each is widened to those that it touches, and kept with room to spare.
        """
        limits = replace(self.limits, caps=(*self.limits.caps, *map(self._widened, caps)))
        again = plan_optimal(
            self.spline,
            self.request,
            limits,
            self.given_controller,
            self.plants,
            period_us=self.period_us,
        )
        return replace(again, limits=limits, notes=(*again.notes, f"feed capped: {reason}"))


def plan_optimal(
    spline: PHSpline,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None = None,
    plants: Plants | None = None,
    *,
    period_us: int = 1000,
) -> OptimalPlan:
    """The fastest feed along `spline` from rest to rest.

    plants  of the axes, where `limits.volts` is given
    Raises InputError (length, period) and PlanError: limits that no useful feed obeys (which, where, and what
    would do).
    """
    check_period(period_us)
    check_length(spline.length_mm)
    if not limits.bind:
        raise InputError(
            'feed: profile "optimal" has no limit to obey: name a machine, or add one to [limits]'
        )
    bounds = gather(request, limits, controller, plants, period_us)
    check_feasible(spline, bounds, LONGEST_S)
    track, stretch = _run(spline, bounds, 1e-6 * period_us)
    if track.duration_s >= LONGEST_S:
        raise PlanError(_too_long(spline, bounds, track.duration_s))
    return OptimalPlan(
        request,
        limits,
        controller or _assumed(track),
        period_us,
        spline,
        controller,
        plants,
        bounds,
        track,
        stretch,
        bounds.notes,
    )


def _run(spline: PHSpline, bounds: Bounds, period_s: float) -> tuple[Track, float]:
    """Pieces of the plan, and by how much they were slowed.

    Where limits are so far apart that no feed is found, or a poor one, with jerks that let the acceleration build up
    within a small share of the time that three segments take on average.
    """
    near = within_reach(spline, bounds)
    tries = [near]
    if near.least_acceleration < inf:
        time_s = 3.0 * least_time_s(spline, bounds) / spline.segment_count
        # Where that costs nothing to speak of it comes first: numbers far apart also take long to fail.
        slow = _EASED[1] * time_s > _MANY_PERIODS * period_s
        eased = [near.eased(max(period_s, share * time_s)) for share in _EASED]
        tries = eased[1:] if slow else [near, *eased]
    best: tuple[Track, float] | None = None
    for one in tries:
        with suppress(NothingFoundError):
            found = _track(spline, bounds, joined(list(plan_windows(spline, one, period_s))))
            if best is None or found[0].duration_s < best[0].duration_s:
                best = found
        if best is not None and best[1] < _POOR:
            return best
    if best is None:
        raise PlanError(
            "feed: the planner found no feed at all: please report this path and its limits"
        )
    return best


def _track(spline: PHSpline, bounds: Bounds, ends: Ends) -> tuple[Track, float]:
    track = make_track(ends, 1.0, spline.segment_starts_mm)
    stretch = _needed_stretch(find_peaks(spline, bounds, track))
    if stretch > 1.0:
        track = make_track(ends, stretch, spline.segment_starts_mm)
    return track, stretch


def _too_long(spline: PHSpline, bounds: Bounds, duration_s: float) -> str:
    """Several limits together make the path take too long: raised alike, all let it be so much faster exactly."""
    one, s_mm = binding_most(spline, bounds)
    k = 1.05 * duration_s / LONGEST_S
    return (
        f"{one.name}, lowest at arc length {s_mm:.6g} mm, takes most of {duration_s:.4g} s, longer than the "
        f"{LONGEST_S:.7g} s of a program: with all limits it has to be raised, feeds and velocities by "
        f"{rounded_up(k)}, accelerations and volts by {rounded_up(k**2)}, jerks by {rounded_up(k**3)}"
    )


def _needed_stretch(peaks: dict[str, Peak]) -> float:
    """By how much to slow down so that no limit is exceeded by more than is allowed."""
    stretch = 1.0
    for name, peak in peaks.items():
        power = next((n for word, n in _POWER.items() if word in name), 1)
        stretch = max(stretch, (peak.strain / (1.0 + _ABOVE)) ** (1.0 / power))
    return stretch


def _raw(
    track: Track, length_q40: int, joints: Real | None = None, joints_q40: Int | None = None
) -> RawPieces:
    starts = np.rint(track.s * 2.0**40).astype(np.int64)
    if joints is not None and joints_q40 is not None:
        near = joints_q40[
            np.clip(np.searchsorted(joints_q40, starts - _DRIFT_Q40), 0, joints_q40.size - 1)
        ]
        moved = np.isin(track.s, joints) & (np.abs(near - starts) <= _DRIFT_Q40)
        starts = np.where(moved, near, starts)
    starts[-1] = length_q40
    c = round_pieces(track.t_q32, starts, track.shape)
    return RawPieces(np.diff(track.t_q32), starts[:-1], c, 0.0, 0.0)


def _assumed(track: Track) -> ControllerLimits:
    """Limits of a controller that nobody named: roomy ones, so that they never bind."""
    raw = _raw(track, round(float(track.s[-1]) * 2**40))
    v, a, j = (float(p.max()) for p in derivative_peaks(raw.duration_q32_s, raw.c_q40))
    return ControllerLimits(2.0 * v, 8.0 * a + 10.0 * v, 16.0 * j + 100.0 * v)
