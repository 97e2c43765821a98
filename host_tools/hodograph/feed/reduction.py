# SPDX-License-Identifier: MIT
"""The highest feed that the path, the limits and the format allow; docs/theory/numerics.md 5.5."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import log

from ..errors import PlanError
from .bracket import highest
from .limits import ControllerLimits, Limits
from .quantise import LONGEST_PIECE_MM
from .ramp import ACCELERATION, JERK
from .request import FeedRequest
from .shapes import Shape, make_shape

_HAIR = 1e-9
_CLOSE = 1e-6
_MOST_TRIALS = 40


@dataclass(frozen=True)
class Cap:
    """A feed not to be exceeded, and why, in words for the user."""

    feed_mm_s: float
    reason: str


@dataclass(frozen=True)
class Bound:
    """A limit of the peak of a derivative (ACCELERATION or JERK), and whose it is."""

    order: int
    limit: float
    reason: str


def choose(
    length: Fraction,
    request: FeedRequest,
    limits: Limits,
    controller: ControllerLimits | None,
    period_us: int,
    least_constant_s: float,
    extra: tuple[Cap, ...],
) -> tuple[Shape, tuple[str, ...]]:
    """The ramp with the highest feed that all caps and bounds allow, and what lowered it.

    extra  further caps; the constant stretch, if any, lasts at least `least_constant_s`
    """
    make = partial(make_shape, request)
    caps = [
        Cap(float(request.nominal_mm_s), ""),
        *_feed_caps(limits, controller, period_us),
        *extra,
    ]
    only_ramps = float(length / Fraction(request.ramp_time_s))
    short = Cap(
        only_ramps,
        f"the path of {float(length):.6g} mm is too short for two ramps of {request.ramp_time_s:g} s",
    )
    cap = min((*caps, short), key=lambda c: c.feed_mm_s)
    with_constant = float(length / (Fraction(request.ramp_time_s) + Fraction(least_constant_s)))
    too_brief = Cap(with_constant, "the stretch of constant feed would be shorter than a period")
    if with_constant < cap.feed_mm_s < only_ramps:
        cap = too_brief
    shape, bound = _lowered(make, cap.feed_mm_s, _bounds(limits, controller))
    if bound is not None and with_constant < shape.ramp.feed_mm_s < only_ramps:
        shape, bound, cap = make(with_constant), None, too_brief
    reasons = []
    if shape.ramp.feed_mm_s < request.nominal_mm_s:
        why = bound.reason if bound is not None else cap.reason
        reasons.append(
            f"feed lowered from {request.nominal_mm_s:g} to {shape.ramp.feed_mm_s:.6g} mm/s: {why}"
        )
    return shape, tuple(reasons)


def _feed_caps(limits: Limits, controller: ControllerLimits | None, period_us: int) -> list[Cap]:
    period_s = 1e-6 * period_us
    caps = [
        Cap(
            0.99 * LONGEST_PIECE_MM / period_s,
            f"pieces of the format end within 32 mm, more than a period of {period_us} us",
        )
    ]
    if limits.policy == "respect" and limits.feed_mm_s is not None:
        caps.append(Cap(limits.feed_mm_s, f"limits feed_mm_s = {limits.feed_mm_s:g}"))
    if controller is not None:
        caps.append(
            Cap(
                controller.feed_mm_s * (1.0 - controller.kept_free),
                f"controller feed_mm_s = {controller.feed_mm_s:g} less its reserve",
            )
        )
    return caps


def _bounds(limits: Limits, controller: ControllerLimits | None) -> list[Bound]:
    names = ((ACCELERATION, "acceleration_mm_s2"), (JERK, "jerk_mm_s3"))
    out = []
    for order, name in names:
        own = getattr(limits, name)
        if limits.policy == "respect" and own is not None:
            out.append(Bound(order, own, f"limits {name} = {own:g}"))
        if controller is not None:
            limit = getattr(controller, name)
            kept = limit * (1.0 - controller.kept_free)
            out.append(Bound(order, kept, f"controller {name} = {limit:g} less its reserve"))
    return out


def _lowered(
    make: Callable[[float], Shape], feed_mm_s: float, bounds: list[Bound]
) -> tuple[Shape, Bound | None]:
    """The shape at `feed_mm_s`, or at the highest feed below where no bound is broken, with that bound."""
    shape = make(feed_mm_s)
    excess, bound = _excess(shape, bounds)
    if bound is None or excess <= 0.0:
        return shape, None

    def attempt(feed: float) -> tuple[tuple[Shape, Bound | None], float]:
        tried = make(feed)
        found, broken = _excess(tried, bounds)
        return (tried, broken), found

    best = highest(feed_mm_s, excess, attempt, _CLOSE, _HAIR, _MOST_TRIALS)
    if best is None:
        raise PlanError(f"feed: no feed obeys {bound.reason}: raise it")
    return best


def _excess(shape: Shape, bounds: list[Bound]) -> tuple[float, Bound | None]:
    """Logarithm of the greatest peak over its bound (above 0: broken), and that bound."""
    worst, worst_bound = -1.0, None
    for bound in bounds:
        excess = log(shape.ramp.peak(bound.order) / bound.limit)
        if worst_bound is None or excess > worst:
            worst, worst_bound = excess, bound
    return worst, worst_bound
