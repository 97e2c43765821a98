# SPDX-License-Identifier: MIT
"""Planning a feed for a path length inside limits; docs/numerics.md 5.4 and 5.5."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, PlanError
from .lowering import Cap, choose
from .override import override_bounds
from .pattern_search import SearchStep
from .pieces import FeedPieces, derivative_peaks
from .quantise import RawPieces, quantise
from .ramp import ACCELERATION, JERK, Ramp
from .request import ControllerLimits, FeedRequest, Limits, check_period
from .timeline import Timeline, timeline

Real = NDArray[np.float64]

SHORTEST_MM, LONGEST_MM = 2.0**-10, 2.0**22 - 1.0
LONGEST_S = 2.0**22 - 1.0


@dataclass(frozen=True)
class Excess:
    """A limit of the path file that the plan breaks under policy "report"."""

    quantity: str
    limit: float
    value: float

    def __str__(self) -> str:
        over = 100.0 * (self.value / self.limit - 1.0)
        return f"{self.quantity} {self.value:.6g} is above its limit {self.limit:g} by {over:.1f} %"


@dataclass(frozen=True, eq=False)
class FeedPlan:
    """A feed over time: what was asked, what came out, and the exact curve.

    history   steps of the pattern search for the feed really used; empty without a search
    notes     one line for each thing the user should know (what lowered the feed, and so on)
    excesses  limits broken under policy "report"
    """

    request: FeedRequest
    limits: Limits
    controller: ControllerLimits
    period_us: int
    line: Timeline
    history: tuple[SearchStep, ...]
    notes: tuple[str, ...]
    excesses: tuple[Excess, ...]

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
        return _with_override(self.raw, self.controller, self.limits)

    def pieces_over(self, length_q40: int) -> FeedPieces:
        """The plan in integers over exactly `length_q40`, which may differ a little (rounding)."""
        if length_q40 == self._length_q40:
            return self.pieces
        length = Fraction(length_q40, 2**40)
        ramp = self.line.ramp
        if not self.line.constant_s:
            ramp = replace(ramp, feed_mm_s=float(length / Fraction(ramp.time_s)))
        raw = quantise(timeline(ramp, length), length_q40, self.period_us)
        return _with_override(raw, self.controller, self.limits)

    @property
    def _length_q40(self) -> int:
        return round(self.line.length_mm * 2**40)

    def with_feed_cap(self, feed_mm_s: float, reason: str) -> FeedPlan:
        """The same request planned again with the feed at most `feed_mm_s`; `reason` goes to the notes."""
        return _plan(
            self.line.length_mm,
            self.request,
            self.limits,
            self.controller,
            self.period_us,
            (Cap(feed_mm_s, reason),),
        )


def plan_feed(
    length_mm: float,
    request: FeedRequest,
    limits: Limits | None = None,
    controller: ControllerLimits | None = None,
    *,
    period_us: int = 1000,
) -> FeedPlan:
    """Plans `request` over a path of `length_mm`.

    The feed is lowered, and n_c found again, where the path is too short for its ramps, where the limits
    of the path file bind (policy "respect") and where those of the controller do, less their
    reserve. Without a controller (no machine file) roomy limits are assumed. Raises InputError for a length out
    of range and PlanError where no feed will do.
    """
    check_period(period_us)
    if not (isfinite(length_mm) and SHORTEST_MM <= length_mm <= LONGEST_MM):
        raise InputError(
            f"path: its length {length_mm:g} mm must be from {SHORTEST_MM:.3g} to {LONGEST_MM:.7g} mm: "
            "scale its points (they are in mm)"
        )
    return _plan(Fraction(length_mm), request, limits or Limits(), controller, period_us, ())


def _plan(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    caps: tuple[Cap, ...],
) -> FeedPlan:
    least_constant_s = 1e-6 * period_us * (1.0 + 1e-3)
    for _ in range(20):
        shape, reasons = choose(
            length, request, limits, controller, period_us, least_constant_s, caps
        )
        line = timeline(shape.ramp, length)
        if line.duration_s >= LONGEST_S:
            raise PlanError(
                f"feed: {float(length):g} mm at {shape.ramp.feed_mm_s:.3g} mm/s would take longer than "
                f"{LONGEST_S:.7g} s ({'; '.join(reasons) or 'as asked'}): raise the feed, that limit or "
                "ramp_time_s"
            )
        plan = FeedPlan(
            request,
            limits,
            controller or _assumed(shape.ramp),
            period_us,
            line,
            shape.history,
            (*reasons, *((shape.note,) if shape.note else ())),
            _excesses(shape.ramp, limits),
        )
        excess = _piece_excess(plan)
        if excess <= 1.0:
            return replace(plan, notes=(*plan.notes, *_fit_notes(plan.raw, period_us)))
        reason = f"pieces of more than a period of {period_us} us exceed the limits"
        caps = (*caps, Cap(shape.ramp.feed_mm_s / excess * (1.0 - 1e-6), reason))
    raise PlanError("feed: no feed keeps the pieces inside the limits: raise them or ramp_time_s")


def _assumed(ramp: Ramp) -> ControllerLimits:
    """Limits of a controller that nobody named: roomy ones, so that they never bind."""
    feed = ramp.feed_mm_s
    acceleration, jerk = ramp.peak(ACCELERATION), ramp.peak(JERK)
    return ControllerLimits(
        2.0 * feed, 8.0 * acceleration + 10.0 * feed, 16.0 * jerk + 100.0 * feed
    )


def _fit_notes(raw: RawPieces, period_us: int) -> tuple[str, ...]:
    if raw.faithful:
        return ()
    return (
        f"the ramp has too few periods of {period_us} us for its profile: its pieces stay within "
        f"{raw.jerk_error_mm_s3:.3g} mm/s^3 of its jerk and {raw.length_error_mm:.2g} mm of its way "
        "(a longer ramp, or quintic, or minimax of degree 5 or 6, has none of this)",
    )


def _excesses(ramp: Ramp, limits: Limits) -> tuple[Excess, ...]:
    values = (
        ("feed_mm_s", ramp.feed_mm_s),
        ("acceleration_mm_s2", ramp.peak(ACCELERATION)),
        ("jerk_mm_s3", ramp.peak(JERK)),
    )
    return tuple(
        Excess(name, getattr(limits, name), value)
        for name, value in values
        if getattr(limits, name) is not None and value > getattr(limits, name) * (1.0 + 1e-9)
    )


def _piece_excess(plan: FeedPlan) -> float:
    """Greatest bound of a piece over the controller's limit less half of what a plan keeps free.

    Where the pieces are only near the profile, policy "respect" holds for them too; and where a bound on the
    override would round to zero, the feed has to fall.
    """
    pieces = plan.pieces
    peaks = [float(p.max()) for p in derivative_peaks(pieces.duration_q32_s, pieces.c_q40)]
    own = plan.controller
    keep = 1.0 - 0.5 * own.kept_free
    bounds = [own.feed_mm_s * keep, own.acceleration_mm_s2 * keep, own.jerk_mm_s3 * keep]
    if plan.limits.policy == "respect" and not plan.raw.faithful:
        asked = plan.limits.acceleration_mm_s2, plan.limits.jerk_mm_s3
        bounds[1:] = [min(b, x) if x else b for b, x in zip(bounds[1:], asked, strict=True)]
    excess = max(peak / bound for peak, bound in zip(peaks, bounds, strict=True))
    rates = min(pieces.override_rate_q16_per_s.min(), pieces.override_second_q8_per_s2.min())
    return excess if rates > 0 else max(excess, 2.0)


def _with_override(raw: RawPieces, controller: ControllerLimits, limits: Limits) -> FeedPieces:
    peaks = derivative_peaks(raw.duration_q32_s, raw.c_q40)
    override = override_bounds(*peaks, controller, limits)
    return FeedPieces(
        raw.duration_q32_s,
        raw.start_q40,
        raw.c_q40,
        override.factor_q24,
        override.rate_q16_per_s,
        override.second_q8_per_s2,
    )
