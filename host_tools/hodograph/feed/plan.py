# SPDX-License-Identifier: MIT
"""Planning a feed for a path length inside limits; docs/numerics.md 5.4 and 5.5."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import exp, isfinite, log

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, PlanError
from .override import override_bounds
from .pattern_search import SearchStep, pattern_search
from .pieces import FeedPieces, derivative_bounds
from .quantise import LONGEST_PIECE_MM, RawPieces, quantise
from .ramp import ACCELERATION, JERK, Ramp, exponential_ramp, minimax_ramp, quintic_ramp
from .request import ControllerLimits, FeedRequest, Limits, check_period
from .timeline import Timeline, timeline

Real = NDArray[np.float64]

N_C_START, N_C_LOW, N_C_HIGH = 5.0, 2.0, 12.0
REVERSE_MM_S = -(2.0**-11)
"""Feed below this counts as reverse motion (the format refuses 2^-10 mm/s)."""

SHORTEST_MM, LONGEST_MM = 2.0**-10, 2.0**22 - 1.0
LONGEST_S = 2.0**22
_FLAT = 1.0 - 1e-9
_CLOSE = 1e-6


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
    evaluations: int
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
    def pieces(self) -> FeedPieces:
        """The plan in integers, over the length rounded to 2^-40 mm."""
        return self.pieces_over(round(self.line.length_mm * 2**40))

    def pieces_over(self, length_q40: int) -> FeedPieces:
        """The plan in integers over exactly `length_q40`, which may differ a little (rounding)."""
        length = Fraction(length_q40, 2**40)
        ramp = self.line.ramp
        if not self.line.constant_s:
            ramp = replace(ramp, feed_mm_s=float(length / Fraction(ramp.time_s)))
        line = self.line if length == self.line.length_mm else timeline(ramp, length)
        raw = quantise(line, length_q40, self.period_us)
        return _with_override(raw, self.controller, self.limits)

    def with_feed_cap(self, feed_mm_s: float, reason: str) -> FeedPlan:
        """The same request planned again with the feed at most `feed_mm_s`; `reason` goes to the notes."""
        return _plan(
            self.line.length_mm,
            self.request,
            self.limits,
            self.controller,
            self.period_us,
            (_Cap(feed_mm_s, reason),),
        )


@dataclass(frozen=True)
class _Cap:
    feed_mm_s: float
    reason: str


@dataclass(frozen=True)
class _Bound:
    order: int
    limit: float
    reason: str


@dataclass(frozen=True, eq=False)
class _Shape:
    ramp: Ramp
    history: tuple[SearchStep, ...] = ()
    note: str | None = None


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
    reserve. Without a controller (no machine file) twice what the plan needs is assumed. Raises InputError for
    a length out of range and PlanError where no feed will do.
    """
    check_period(period_us)
    if not (isfinite(length_mm) and SHORTEST_MM <= length_mm <= LONGEST_MM):
        raise InputError(
            f"path: length {length_mm:g} mm is not in {SHORTEST_MM:.3g} … {LONGEST_MM:.7g} mm"
        )
    return _plan(Fraction(length_mm), request, limits or Limits(), controller, period_us, ())


def _plan(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    caps: tuple[_Cap, ...],
) -> FeedPlan:
    least_constant_s = 1e-6 * period_us * (1.0 + 1e-3)
    for _ in range(20):
        shape, evaluations, reasons = _choose(
            length, request, limits, controller, period_us, least_constant_s, caps
        )
        line = timeline(shape.ramp, length)
        if line.duration_s >= LONGEST_S:
            raise PlanError(
                f"feed: {float(length):g} mm at {shape.ramp.feed_mm_s:g} mm/s take longer than "
                f"{LONGEST_S:g} s: ask for a higher feed or a shorter path"
            )
        owned = controller or _assumed(shape.ramp)
        notes = (*reasons, *((shape.note,) if shape.note else ()))
        plan = FeedPlan(
            request,
            limits,
            owned,
            period_us,
            line,
            shape.history,
            evaluations,
            notes,
            _excesses(shape.ramp, limits),
        )
        excess = _piece_excess(plan)
        if excess <= 1.0:
            return plan
        caps = (
            *caps,
            _Cap(
                shape.ramp.feed_mm_s / excess * (1.0 - 1e-6),
                "the controller bounds each piece by its Bernstein coefficients",
            ),
        )
    raise PlanError(
        "feed: no feed keeps the pieces inside the limits of the controller: raise them"
    )


def _choose(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    least_constant_s: float,
    extra: tuple[_Cap, ...],
) -> tuple[_Shape, int, tuple[str, ...]]:
    """The ramp with the highest feed that all caps and bounds allow, evaluations, and what lowered it."""
    counted = _Counter(request)
    caps = [
        _Cap(float(request.nominal_mm_s), ""),
        *_feed_caps(limits, controller, period_us),
        *extra,
    ]
    only_ramps = float(length / Fraction(request.ramp_time_s))
    short = _Cap(
        only_ramps,
        f"the path of {float(length):.6g} mm is too short for two ramps of {request.ramp_time_s:g} s",
    )
    cap = min((*caps, short), key=lambda c: c.feed_mm_s)
    with_constant = float(length / (Fraction(request.ramp_time_s) + Fraction(least_constant_s)))
    too_brief = _Cap(with_constant, "the stretch of constant feed would be shorter than a period")
    if with_constant < cap.feed_mm_s < only_ramps:
        cap = too_brief
    shape, bound = _lowered(counted, cap.feed_mm_s, _bounds(limits, controller))
    if bound is not None and with_constant < shape.ramp.feed_mm_s < only_ramps:
        shape, bound, cap = counted(with_constant), None, too_brief
    reasons = []
    if shape.ramp.feed_mm_s < request.nominal_mm_s:
        why = bound.reason if bound is not None else cap.reason
        reasons.append(
            f"feed lowered from {request.nominal_mm_s:g} to {shape.ramp.feed_mm_s:.6g} mm/s: {why}"
        )
    return shape, counted.evaluations, tuple(reasons)


class _Counter:
    """Makes ramps for a request, and counts evaluations of the search of the last one made."""

    def __init__(self, request: FeedRequest) -> None:
        self._request = request
        self.evaluations = 0

    def __call__(self, feed_mm_s: float) -> _Shape:
        request = self._request
        time_s = request.ramp_time_s
        if request.profile == "quintic":
            return _Shape(quintic_ramp(feed_mm_s, time_s))
        if request.profile == "minimax":
            return _Shape(minimax_ramp(feed_mm_s, time_s, request.degree))
        if isinstance(request.n_c, str):
            shape = optimise_n_c(feed_mm_s, time_s)
            self.evaluations = shape.history[-1].evaluations
            return shape
        ramp = exponential_ramp(feed_mm_s, time_s, request.n_c)
        lowest = ramp.lowest_feed()
        if lowest < REVERSE_MM_S:
            raise PlanError(
                f"feed: n_c = {request.n_c:g} asks for reverse motion at {feed_mm_s:.6g} mm/s within "
                f'{time_s:g} s (the feed falls to {lowest:.3g} mm/s): give n_c = "optimise"'
            )
        return _Shape(ramp)


def optimise_n_c(feed_mm_s: float, time_s: float) -> _Shape:
    """The exponential ramp of least peak jerk, by the paper's search; plain where none is better."""

    def objective(n_c: float) -> float:
        ramp = exponential_ramp(feed_mm_s, time_s, n_c)
        return ramp.peak(JERK) if ramp.lowest_feed() >= REVERSE_MM_S else float("inf")

    history = pattern_search(objective, N_C_START, N_C_LOW, N_C_HIGH)
    best = history[-1]
    plain = exponential_ramp(feed_mm_s, time_s, 0.0)
    if not best.value < plain.peak(JERK):
        note = (
            f"n_c = 0 (the plain quintic ramp): at {feed_mm_s:.6g} mm/s within {time_s:g} s no n_c in "
            f"{N_C_LOW:g} … {N_C_HIGH:g} lowers the peak jerk"
        )
        return _Shape(plain, history, note)
    ramp = exponential_ramp(feed_mm_s, time_s, best.best)
    if min(best.best - N_C_LOW, N_C_HIGH - best.best) < 1e-5:
        return _Shape(ramp, history, f"n_c = {best.best:g} is at a bound of the search")
    return _Shape(ramp, history)


def _feed_caps(limits: Limits, controller: ControllerLimits | None, period_us: int) -> list[_Cap]:
    period_s = 1e-6 * period_us
    caps = [
        _Cap(
            0.99 * LONGEST_PIECE_MM / period_s,
            f"pieces of the format end within 32 mm, more than a period of {period_us} us",
        )
    ]
    if limits.policy == "respect" and limits.feed_mm_s is not None:
        caps.append(_Cap(limits.feed_mm_s, f"limits feed_mm_s = {limits.feed_mm_s:g}"))
    if controller is not None:
        caps.append(
            _Cap(
                controller.feed_mm_s * (1.0 - controller.reserve),
                f"controller feed_mm_s = {controller.feed_mm_s:g} less its reserve",
            )
        )
    return caps


def _bounds(limits: Limits, controller: ControllerLimits | None) -> list[_Bound]:
    names = ((ACCELERATION, "acceleration_mm_s2"), (JERK, "jerk_mm_s3"))
    out = []
    for order, name in names:
        own = getattr(limits, name)
        if limits.policy == "respect" and own is not None:
            out.append(_Bound(order, own, f"limits {name} = {own:g}"))
        if controller is not None:
            limit = getattr(controller, name)
            kept = limit * (1.0 - controller.reserve)
            out.append(_Bound(order, kept, f"controller {name} = {limit:g} less its reserve"))
    return out


def _lowered(
    make: Callable[[float], _Shape], feed_mm_s: float, bounds: list[_Bound]
) -> tuple[_Shape, _Bound | None]:
    """The shape at `feed_mm_s`, or at the highest feed below where no bound is broken."""

    def judge(shape: _Shape) -> tuple[float, _Bound | None]:
        if not bounds:
            return 0.0, None
        return max(((shape.ramp.peak(b.order) / b.limit, b) for b in bounds), key=lambda e: e[0])

    shape = make(feed_mm_s)
    high = log(feed_mm_s)
    excess, bound = judge(shape)
    if excess <= 1.0:
        return shape, None
    high_excess = log(excess)
    best: _Shape | None = None
    low = low_excess = 0.0
    for _ in range(40):
        # Peaks go about with the feed: first a step in proportion, then the secant in logarithms.
        if best is None:
            trial = high - high_excess + log(_FLAT)
        else:
            trial = low + (high - low) * max(
                0.05, min(0.95, -low_excess / (high_excess - low_excess))
            )
        shape = make(exp(trial))
        found, reason = judge(shape)
        if found > 1.0:
            high, high_excess = trial, log(found)
            continue
        best, low, low_excess, bound = shape, trial, log(found), reason
        if found > 1.0 - _CLOSE or high - low < _CLOSE:
            break
    if best is None:
        raise PlanError(f"feed: no feed obeys {bound.reason if bound else 'the limits'}: raise it")
    return best, bound


def _assumed(ramp: Ramp) -> ControllerLimits:
    return ControllerLimits(
        2.0 * ramp.feed_mm_s, 2.0 * ramp.peak(ACCELERATION), 2.0 * ramp.peak(JERK)
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
    """Greatest bound of a piece over the controller's limit less half its reserve (a hair at least)."""
    pieces = plan.pieces
    bounds = derivative_bounds(pieces.duration_q32_s, pieces.c_q40)
    c = plan.controller
    keep = 1.0 - max(0.5 * c.reserve, 1e-3)
    limits = (c.feed_mm_s, c.acceleration_mm_s2, c.jerk_mm_s3)
    return max(float(np.abs(b).max()) / (keep * x) for b, x in zip(bounds, limits, strict=True))


def _with_override(raw: RawPieces, controller: ControllerLimits, limits: Limits) -> FeedPieces:
    bounds = derivative_bounds(raw.duration_q32_s, raw.c_q40)
    v, a, j = (np.abs(b).max(axis=1) for b in bounds)
    override = override_bounds(v, a, j, controller, limits)
    return FeedPieces(
        raw.duration_q32_s,
        raw.start_q40,
        raw.c_q40,
        override.factor_q24,
        override.rate_q16_per_s,
        override.second_q8_per_s2,
    )
