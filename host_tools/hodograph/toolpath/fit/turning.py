# SPDX-License-Identifier: MIT
"""Rotary axes that move with a curve: smooth functions of its arc length within a tolerance. Used by job. No I/O.

docs/theory/toolpath-fitting.md section 9. A programmed axis is linear over each chord of the reference. It becomes a C2
function that differs from it by at most the tolerance at each place of the path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline.spatial import SpatialPHSpline
from ...spline.spatial.extra import quintics_by_arc_length
from ...spline.splitting import cut_segments
from .certificate import Certificate
from .fitting import FittedPath

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_SHARES = (0.8, 0.5, 0.25)
"""Deviations of the smooth function as shares of the tolerance, tried in order until the axes are within the
tolerance.
"""

_PEAK = 1.0 / 6.0
"""Deviation at a change of the rate by 1 that is spread over 1 on either side."""

_BESIDE = 24
"""A change of the rate is spread over at most this number of places on each side."""
_ROUNDS = 60
"""Greatest number of rounds in which changes that deviate too far are spread less."""
_LEAST_SHRINK = 0.5
"""Least factor of the width of a change in one round."""
_SURE = 1.0 - 1e-9
"""Greatest factor of such a width in one round."""
_PARTS = 8
"""Parts of a segment for which the difference is bounded one by one."""
_HALVINGS = 16
"""How often segments are halved until their quintics are within the tolerance."""
_EDGE = 1e-6
"""A segment is not cut nearer than this to its ends, in its parameter."""

_SAME_RATE = 1e-6
"""Rates that differ by less are equal, degrees per mm."""


def with_turning(
    fitted: FittedPath,
    columns: Sequence[int | None],
    tolerance_deg: float,
    tied: tuple[bool, bool] = (False, False),
) -> FittedPath:
    """The path with extra axes.

    columns        of the reference's angles, one for each extra axis; None: the axis stands at 0
    tolerance_deg  greatest deviation from the programmed angles at any place
    tied           whether start and end are in the middle of a chord of a longer path: the axes then have the rate of
                   the chord there, and no second derivative, so that both halves join C2
    Raises PlanError, naming the line: no smooth function is within the tolerance.
    """
    reference = fitted.reference
    given = reference.turn_deg
    if given is None or not columns:
        return fitted
    value = np.stack([np.zeros(len(given)) if k is None else given[:, k] for k in columns], axis=1)
    if not np.ptp(value, axis=0).any():
        still = np.repeat(value[:1, :, None], 6, axis=2)
        extra = np.repeat(still, fitted.curve.segment_count, axis=0)
        return replace(fitted, curve=replace(fitted.curve, extra=extra), turning_deg=0.0)
    target = Angles.of(fitted.arc_length_at(reference.place_mm), value)
    rates = _rates_at_ends(reference.place_mm, value, tied)
    joined = target.with_rates(*rates)
    for share in _SHARES:
        smooth = joined.smoothed(share * tolerance_deg)
        found = _followed(_cut_at_changes(fitted, smooth), target, smooth, rates, tolerance_deg)
        if found is not None:
            return found
    line = int(reference.line[0])
    raise PlanError(f"line {line}: no smooth turn of A, B and C is within {tolerance_deg:g} deg")


def _rates_at_ends(
    place_mm: Real, value: Real, tied: tuple[bool, bool]
) -> tuple[Real | None, Real | None]:
    """Programmed rates (E,) at start and end per length of the chord there; None: that end is not tied."""
    first, last = ((value[k + 1] - value[k]) / (place_mm[k + 1] - place_mm[k]) for k in (0, -2))
    return first if tied[0] else None, last if tied[1] else None


@dataclass(frozen=True, eq=False)
class Angles:
    """Angles that are linear between places of a path.

    at     (n + 1,) rising arc lengths, mm
    value  (n + 1, E) angles there, degrees
    rate   (n, E) rates between them, degrees per mm
    """

    at: Real
    value: Real
    rate: Real

    @classmethod
    def of(cls, at: Real, value: Real) -> Angles:
        """Angles at places, of which those at the same arc length count once."""
        kept = np.append(True, np.diff(at) > 0.0)
        at, value = at[kept], value[kept]
        return cls(at, value, np.diff(value, axis=0) / np.diff(at)[:, None])

    def with_rates(self, first: Real | None, last: Real | None) -> Angles:
        """The angles with these rates (E,) at start and end, up to the middle of the leg there; None: with their own
        rates.

        The curves of the two halves of a chord differ a little in length, so their rates by arc length differ too. The
        given rates are equal on both sides.
        """
        at, value = self.at, self.value
        if last is not None and np.abs(last - self.rate[-1]).max() > _SAME_RATE:
            middle = 0.5 * (at[-2] + at[-1])
            at = np.insert(at, -1, middle)
            value = np.insert(value, -1, value[-1] - last * (at[-1] - middle), axis=0)
        if first is not None and np.abs(first - self.rate[0]).max() > _SAME_RATE:
            middle = 0.5 * (at[0] + at[1])
            at = np.insert(at, 1, middle)
            value = np.insert(value, 1, value[0] + first * (middle - at[0]), axis=0)
        return Angles.of(at, value)

    @property
    def change(self) -> Real:
        """Change of the rate (n - 1, E) at the inner places."""
        return np.asarray(np.diff(self.rate, axis=0))

    def __call__(self, s_mm: Real) -> Real:
        """Angles (m, E) at arc lengths (m,)."""
        return np.stack([np.interp(s_mm, self.at, column) for column in self.value.T], axis=1)

    def rate_at(self, s_mm: Real) -> Real:
        """Rates (m, E) just after arc lengths (m,)."""
        leg = np.searchsorted(self.at, s_mm, side="right") - 1
        return np.asarray(self.rate[np.clip(leg, 0, len(self.rate) - 1)])

    def smoothed(self, tolerance_deg: float) -> SmoothAngles:
        """The smooth angles: each change of the rate is spread as far as the deviation stays within `tolerance_deg`."""
        inner, size = self.at[1:-1], np.linalg.norm(self.change, axis=1)
        own = np.flatnonzero(size > 0.0)
        at = inner[own]
        if not own.size:
            return SmoothAngles(self, at, np.zeros(0), self.change)
        first = self.at[np.maximum(own + 1 - _BESIDE, 0)]
        last = self.at[np.minimum(own + 1 + _BESIDE, self.at.size - 1)]
        width = np.minimum(tolerance_deg / (_PEAK * size[own]), np.minimum(at - first, last - at))
        smooth = SmoothAngles(self, at, _even(width, at), self.change[own])
        asked = np.sort(np.concatenate((at, 0.5 * (at[1:] + at[:-1]))))
        for _ in range(_ROUNDS):
            off = np.linalg.norm(smooth.correction(asked, 0), axis=1)
            if off.max() <= tolerance_deg:
                break
            change, query, _ = smooth.near(asked)
            shrink = np.ones(at.size)
            share = np.clip(np.sqrt(tolerance_deg / np.maximum(off, 1e-300)), _LEAST_SHRINK, _SURE)
            np.minimum.at(shrink, change, np.where(off > tolerance_deg, share, 1.0)[query])
            smooth = replace(smooth, width=_even(smooth.width * shrink, at))
        return smooth


@dataclass(frozen=True, eq=False)
class SmoothAngles:
    """Angles whose changes of rate are spread: the second derivative is a triangle around each.

    at      (m,) arc lengths of the changes
    width   (m,) mm on either side
    change  (m, E) of the rate
    """

    angles: Angles
    at: Real
    width: Real
    change: Real

    def near(self, s_mm: Real) -> tuple[Index, Index, Real]:
        """Pairs of a change and an arc length within its width, for rising arc lengths, with their distance in
        widths.
        """
        low = np.searchsorted(s_mm, self.at - self.width, side="left")
        count = np.searchsorted(s_mm, self.at + self.width, side="right") - low
        change = np.repeat(np.arange(self.at.size), count)
        inner = np.arange(change.size) - np.repeat(np.cumsum(count) - count, count)
        query = low[change] + inner
        apart = (s_mm[query] - self.at[change]) / self.width[change]
        return change, query, np.clip(apart, -1.0, 1.0)

    def correction(self, s_mm: Real, order: int) -> Real:
        """What smoothing adds (n, E) to the angles, their rates or second derivatives, at rising arc lengths (n,)."""
        change, query, apart = self.near(s_mm)
        left, width = 1.0 - np.abs(apart), self.width[change]
        if order == 0:
            factor = width * left**3 * _PEAK
        elif order == 1:
            factor = np.where(apart < 0.0, 0.5, -0.5) * left**2
        else:
            factor = left / width
        out = np.zeros((s_mm.size, self.change.shape[1]))
        np.add.at(out, query, factor[:, None] * self.change[change])
        return out


def _even(width: Real, at: Real) -> Real:
    """The widths, lowered so that none exceeds the next one plus the distance between them."""
    width = np.minimum.accumulate(width - at) + at
    return np.asarray(np.minimum.accumulate((width + at)[::-1])[::-1] - at)


def _cut_at_changes(fitted: FittedPath, smooth: SmoothAngles) -> FittedPath:
    """The path with more joints: where an isolated change of the rate begins, is greatest, and ends."""
    at, width = smooth.at, smooth.width
    if not at.size:
        return fitted
    apart = np.diff(at)
    free = np.minimum(np.append(np.inf, apart), np.append(apart, np.inf)) >= 2.0 * width
    places = np.concatenate((at[free], (at - width)[free], (at + width)[free]))
    own = fitted.curve.segment_starts_mm
    segment, xi = fitted.curve.locate(np.sort(places[(places > 0.0) & (places < own[-1])]))
    inside = (xi > _EDGE) & (xi < 1.0 - _EDGE)
    return _cut(fitted, segment[inside], xi[inside])


def _followed(
    fitted: FittedPath,
    target: Angles,
    smooth: SmoothAngles,
    rates: tuple[Real | None, Real | None],
    tolerance_deg: float,
) -> FittedPath | None:
    """The path with the smooth angles as quintics of its segments, which are halved until the quintics are within the
    tolerance of the target; None: they never are. `rates`: those of tied ends.
    """
    for _ in range(_HALVINGS):
        joint = fitted.curve.segment_starts_mm
        rate = smooth.angles.rate_at(joint) + smooth.correction(joint, 1)
        for end, own in zip((0, -1), rates, strict=True):
            rate[end] = rate[end] if own is None else own
        extra = quintics_by_arc_length(
            fitted.curve,
            smooth.angles(joint) + smooth.correction(joint, 0),
            rate,
            smooth.correction(joint, 2),
        )
        found = replace(fitted, curve=replace(fitted.curve, extra=extra))
        bound = turning_bound_deg(found.curve, target)
        wide = np.flatnonzero(bound > tolerance_deg)
        if not wide.size:
            return replace(found, turning_deg=float(bound.max()))
        fitted = _cut(fitted, wide, np.full(wide.size, 0.5))
    return None


def turning_bound_deg(curve: SpatialPHSpline, target: Angles) -> Real:
    """Bound (segments,) of the difference between the extra axes and the angles at the same arc length.

    Between places where the programmed rate changes, the difference deviates from linear interpolation by at most an
    eighth of its greatest second derivative times the square of the step.
    """
    start, length = curve.segment_starts_mm, curve.segment_lengths_mm
    parts = start[:-1, None] + length[:, None] * np.linspace(0.0, 1.0, _PARTS + 1)[None, 1:-1]
    cut = np.unique(np.concatenate((start, parts.ravel(), target.at)))
    cut = cut[(cut >= 0.0) & (cut <= start[-1])]
    segment = np.clip(np.searchsorted(start, cut[:-1], side="right") - 1, 0, length.size - 1)
    ends = []
    for edge in (cut[:-1], cut[1:]):
        found, xi = curve.locate(edge)
        # The end of a segment is located as the start of the next one.
        xi = np.where(found > segment, 1.0, np.where(found < segment, 0.0, xi))
        off = curve.extra_position(segment, xi) - target(edge)
        ends.append((xi, np.linalg.norm(off, axis=1)))
    (low, before), (high, after) = ends
    rate = np.abs(target.rate_at(0.5 * (cut[1:] + cut[:-1])))
    bend = 20.0 * np.abs(np.diff(curve.extra, n=2, axis=2)).max(axis=2)[segment]
    growth = 4.0 * np.abs(np.diff(curve.speed_coefficients, axis=1)).max(axis=1)[segment]
    second = np.linalg.norm(bend + rate * growth[:, None], axis=1)
    bound = np.zeros(curve.segment_count)
    np.maximum.at(bound, segment, np.maximum(before, after) + (high - low) ** 2 / 8.0 * second)
    return bound


def _cut(fitted: FittedPath, segment: Index, xi: Real) -> FittedPath:
    """The path with more joints, at these rising places; xi inside 0 … 1."""
    curve = fitted.curve
    owner, begin, preimage = cut_segments(curve.preimage, segment, xi)
    inside = begin[:, None] > 0.0
    origin = np.where(inside, curve.position(owner, begin), curve.origin[owner])
    passed = curve.arc_length(owner, begin) / curve.segment_lengths_mm[owner]
    place = fitted.place_mm[owner] + np.diff(fitted.place_mm)[owner] * passed
    return FittedPath(
        fitted.reference,
        SpatialPHSpline(origin, preimage, curve.closed),
        np.append(place, fitted.place_mm[-1]),
        Certificate(fitted.certificate.curve[owner], fitted.certificate.reference),
    )
