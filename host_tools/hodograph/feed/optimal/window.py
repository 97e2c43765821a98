# SPDX-License-Identifier: MIT
"""The fastest feed over one planning window (a part of a path), from a given state to rest; docs/theory/feed.md 5.6.
Used by feed/optimal/ and stream/. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...spline.frames import Curve
from ..limits import FeedZone, ReserveZone
from .constraints import GridKinematics, make_points
from .grid import GAUSS_W, GAUSS_X, Grid, corners, make_grid, squared_feed
from .knots import FEWEST_INTERVALS, FirstEstimate, choose_knots, first_estimate, refined
from .plan_limits import PlanLimits
from .rows import JERK_ROW, About, Rows, Selection, make_rows
from .solver import TOLERANCE, Problem, solve

Real = NDArray[np.float64]
_Zone = TypeVar("_Zone", FeedZone, ReserveZone)
Index = NDArray[np.intp]

US = (0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
"""Places of each interval, as shares of its length, at which limits are evaluated."""
GRADED_US = (0.03125, 0.0625, 0.1875, 0.3125, 0.4375, 0.5625, 0.6875, 0.8125, 0.9375, 0.96875)
"""Further places of an interval that is graded next to rest."""
BASIC_US = (0.0, 0.5, 1.0)
"""Those places of US that make rows when they are near a limit; the others only once they exceed it."""
ALLOWED = 5e-4
"""Greatest excess of a plan over a limit, as a share of it."""

_MOST_ROUNDS = 9
"""Greatest number of quadratic programs on one grid, without their repetitions with exceeded limits."""
_HURRIED_GAIN = 0.1
"""Share of the time that a further round has to gain if the first feed inside the limits will do."""
_BESIDE = 1e-7
"""Distance of the two samples on both sides of a joint of segments from it, as a share of the interval."""
_LEAST_Q = 1e-14
"""Least q between knots, as a share of the greatest q of the window."""
_LEAST_TYPICAL = 1e-12
"""Least scale of an unknown q, as a share of the greatest."""
_LEAST_P = 1e-300
"""Least p of a known solution, to avoid a division by 0."""
_LEAST_FALL = 0.1
"""Share of its last value to which q and p may fall in one round."""
_LEAST_DIP = 1e-3
"""Least q between two knots in an estimate, as a share of the lesser q at the knots."""
_MOST_TRIALS = 3
"""Greatest number of choices of the knots."""
_TRUSTED = 2
"""Rounds after which the durations of intervals show whether knots have to move."""
_TOLERABLE = 5e-3
"""Excess below which a feed is taken if the solver finds no better one, as a share of the limit."""
_LEAST_ESTIMATED = 1e-3
"""As _LEAST_FALL, in the first round, whose feed is only estimated."""
_BRIEF = 2.01
"""Least duration of two consecutive intervals in periods, a little more than a program needs."""
_MOST_JOINED, _LEAST_KNOTS = 4, 4
"""How often brief intervals are joined to others, and the least number of knots that stay."""
_PENALTY = 30.0
"""Cost of an excess of 100 % on one interval, in times of the window."""

Feed = Callable[[Real], Real]
"""q at arc lengths."""


@dataclass(frozen=True)
class Effort:
    """The effort for a plan.

    gain       share of the time that a further round has to gain
    patience   rounds before all points have rows, which takes about ten times as long
    tolerance  of the quadratic programs; a solution stays below its limits by about as much
    spacing    length of intervals, as a multiple of that in a plan of highest effort
    fewest     least number of intervals, if the time is enough
    """

    gain: float = 1e-4
    patience: int = 6
    tolerance: float = TOLERANCE
    spacing: float = 1.0
    fewest: int = FEWEST_INTERVALS


_WHOLE = Effort()


@dataclass(frozen=True)
class State:
    """A moving start: q = feed^2 and its derivative by arc length."""

    q: float
    slope: float


@dataclass(frozen=True, eq=False)
class Solution:
    """A feed over a grid.

    excess  greatest share by which it exceeds a limit
    rounds  number of quadratic programs that were solved"""

    grid: Grid
    q: Real
    slope: Real
    times: Real
    excess: float
    rounds: int
    setting: _Setting

    @property
    def duration_s(self) -> float:
        """Time of the window."""
        return float(self.times.sum())

    def squared_feed(self, s: Real) -> Real:
        """q at arc lengths, above 0 by at least 1e-14 of the greatest."""
        return np.maximum(
            squared_feed(self.grid, self.q, self.slope, s), _LEAST_Q * float(self.q.max())
        )

    def estimate(self, s: Real) -> Real:
        """q as estimate for further programs. An early round may leave q below 0 between two knots; there the estimate
        is a share of q at the knots, since programs about a q near 0 take tens of rounds to leave it.
        """
        interval = np.clip(np.searchsorted(self.grid.s, s, side="right") - 1, 0, self.grid.size - 1)
        beside = np.minimum(self.q[interval], self.q[interval + 1])
        return np.maximum(self.squared_feed(s), _LEAST_DIP * beside)


@dataclass(frozen=True, eq=False)
class _Setting:
    """The data of one grid that stay the same in all rounds."""

    limits: PlanLimits
    grid: Grid
    start: State | None
    points: GridKinematics
    basic: NDArray[np.bool_]
    estimated: NDArray[np.bool_]
    once: NDArray[np.bool_]
    most_q: Real  # (n + 1,)
    gauss: tuple[
        Index, Real, Real
    ]  # interval, arc length and basis of p at the points of quadrature
    effort: Effort
    tight: Real | None = None  # (n,): factors by which the limits of each interval are divided,
    reserved: Real | None = None  # (n,): and for reserve zones alone


def plan_window(
    spline: Curve,
    limits: PlanLimits,
    low: float,
    high: float,
    start: State | None,
    period_s: float,
    known: Solution | None = None,
    known_to: float = 0.0,
    *,
    hurried: bool = False,
    before_s: float | None = None,
    effort: Effort = _WHOLE,
) -> Solution | None:
    """The fastest feed from `low` to rest at `high`; None: the quadratic programs have no solution (only if the start
    is moving).

    known     an earlier solution that serves as estimate up to arc length known_to
    hurried   take the first feed inside the limits, on the knots of the first estimate; it is a few per cent slower
    effort    for the improvement of the feed
    before_s  duration of the interval before `low`, if intervals also follow after the end; None: the window is a whole
              program
    """
    guess = first_estimate(spline, limits, low, high, None if start is None else start.q, period_s)
    guess = replace(
        guess, step_s=guess.step_s * effort.spacing, fine_s=guess.fine_s * effort.spacing
    )
    s, t, step = guess.s, guess.t, guess.step_s
    best: Solution | None = None
    about: Feed = guess.squared_feed
    if known is not None:
        about = _blend(known, known_to, guess)
    for trial in range(_MOST_TRIALS):
        knots = choose_knots(spline, limits, s, t, step, period_s, effort.fewest)
        if known is not None:
            knots = _same_knots(knots, known, known_to)
        last = hurried or trial == _MOST_TRIALS - 1
        even = partial(_even, guess, known_to, period_s)
        setting = _setting(spline, limits, knots, start, effort)
        gain = _HURRIED_GAIN if hurried else effort.gain
        best = _Rounds(setting, about).run(None if last else even, gain)
        if best is None or last or even(best):
            break
        about = best.estimate
        guess = _refined(guess, best)
        s, t, step = _retimed(best, guess, period_s)
    return best if best is None else _without_brief(spline, best, before_s, period_s, gain)


def _without_brief(
    spline: Curve, found: Solution, before_s: float | None, period_s: float, gain: float
) -> Solution:
    """A solution whose brief intervals are joined to the next or the last one, since no knots were found at which all
    last long enough.
    """
    for _ in range(_MOST_JOINED):
        keep = _long_enough(found.times, before_s, _BRIEF * period_s)
        if keep.all():
            break
        setting = found.setting
        joined = _setting(spline, setting.limits, found.grid.s[keep], setting.start, setting.effort)
        again = _Rounds(joined, found.squared_feed).run(None, gain)
        if again is None:
            break
        found = again
    return found


def _long_enough(times: Real, before_s: float | None, least_s: float) -> NDArray[np.bool_]:
    """Which knots (n + 1,) stay: a knot between two intervals that are too brief together is removed."""
    pairs = times[1:] + times[:-1]
    if not pairs.size:
        return np.ones(times.size + 1, dtype=np.bool_)
    if before_s is None:
        pairs[[0, -1]] = np.inf
    elif before_s + times[0] < least_s:
        pairs[0] = 0.0
    keep = np.ones(times.size + 1, dtype=np.bool_)
    for k in np.flatnonzero(pairs < least_s).tolist():
        if keep[k] and np.count_nonzero(keep) > _LEAST_KNOTS:
            keep[k + 1] = False
    return keep


def tightened(found: Solution, tight: Real) -> Solution | None:
    """The window on the same knots with the limits of each interval divided by `tight` (n,); None: no solution."""
    reserved = found.setting.reserved
    if reserved is not None:
        tight = tight * reserved
    setting = replace(found.setting, tight=tight)
    return _Rounds(setting, found.squared_feed, found).run(None, setting.effort.gain)


def _same_knots(knots: Real, known: Solution, known_to: float) -> Real:
    """The knots, equal to those of the known solution up to `known_to`, so that it is a solution on this grid too."""
    same = known.grid.s[(known.grid.s >= knots[0]) & (known.grid.s <= known_to)]
    gap = 0.6 * (same[-1] - same[-2]) if same.size > 1 else 0.0
    return np.concatenate((same, knots[knots > same[-1] + gap])) if same.size > 1 else knots


def _blend(known: Solution, known_to: float, guess: FirstEstimate) -> Feed:
    """The known feed up to a place, and the first estimate after it."""

    def feed(s: Real) -> Real:
        old = known.squared_feed(np.minimum(s, known_to))
        return np.asarray(np.where(s < known_to, old, guess.squared_feed(s)))

    return feed


def _even(guess: FirstEstimate, known_to: float, period_s: float, found: Solution) -> bool:
    """Whether intervals after the given knots last about as long as intended; otherwise knots have to move."""
    steps, s = _refined(guess, found), found.grid.s
    wanted = np.interp(0.5 * (s[1:] + s[:-1]), steps.s, steps.step_s)
    wanted[s[1:] <= known_to] = np.inf
    inner = found.times[1:-1]
    brief = inner.size > 1 and bool((inner[1:] + inner[:-1]).min() < 2.05 * period_s)
    return not brief and not (found.times > 2.2 * wanted).any()


def _refined(guess: FirstEstimate, found: Solution) -> FirstEstimate:
    """The intended durations of intervals, from the changes of the acceleration in a solution."""
    acceleration = 0.5 * found.slope
    acceleration[-1] = 0.0
    if found.grid.grade[0] > 0:
        acceleration[0] = 0.0
    t = np.concatenate((np.zeros(1), np.cumsum(found.times)))
    return refined(guess, found.grid.s, t, acceleration)


def _retimed(found: Solution, guess: FirstEstimate, period_s: float) -> tuple[Real, Real, Real]:
    grid = found.grid
    u = np.linspace(0.0, 1.0, 9)[1:]
    interval = np.repeat(np.arange(grid.size), u.size)
    s = grid.sigma(interval, np.tile(u, grid.size))[0]
    s = np.concatenate((grid.s[:1], s))
    s[-1] = grid.s[-1]
    feed = np.sqrt(found.estimate(s))
    part = 2.0 * np.diff(s) / (feed[1:] + feed[:-1])
    part = part.reshape(grid.size, u.size)
    part *= (found.times / part.sum(axis=1))[:, None]
    t = np.concatenate((np.zeros(1), np.cumsum(part.ravel())))
    step = np.interp(s, guess.s, guess.step_s)
    return s, t, np.maximum(step, 1.7 * period_s)


def _setting(
    spline: Curve, limits: PlanLimits, knots: Real, start: State | None, effort: Effort
) -> _Setting:
    grid = make_grid(knots, start is None)
    zones = _interval_zones(limits, knots)
    joints = spline.segment_starts_mm
    joints = joints[(joints > knots[0]) & (joints < knots[-1])]
    crossing, u = _inside(grid, joints)
    graded = np.flatnonzero(grid.grade)
    interval = np.concatenate(
        (
            np.repeat(np.arange(grid.size), len(US)),
            np.repeat(crossing, 2),
            np.repeat(graded, len(GRADED_US)),
        )
    )
    sides = np.column_stack((u - _BESIDE, u + _BESIDE)).ravel()
    us = np.concatenate((np.tile(US, grid.size), sides, np.tile(GRADED_US, graded.size)))
    points = make_points(spline, limits, grid, interval, us, zones)
    basic = np.isin(us, BASIC_US) | (np.arange(us.size) >= grid.size * len(US))
    estimated = basic & ((us != 0.5) | (grid.grade[interval] != 0))
    most = np.full(knots.size, np.inf)
    at_start, at_end = points.interval[us == 0.0], points.interval[us == 1.0] + 1
    moving = points.sigma[0] > 0.0
    limit = np.where(moving, points.most_p, np.inf) * np.where(moving, points.sigma[0], 1.0) ** 2
    np.minimum.at(most, at_start, limit[us == 0.0])
    np.minimum.at(most, at_end, limit[us == 1.0])
    reserved = _interval_reserve(limits, knots)
    return _Setting(
        limits,
        grid,
        start,
        points,
        basic,
        estimated,
        us < 1.0,
        most,
        _gauss(grid),
        effort,
        reserved,
        reserved,
    )


def _gauss(grid: Grid) -> tuple[Index, Real, Real]:
    interval = np.repeat(np.arange(grid.size), GAUSS_X.size)
    u = np.tile(GAUSS_X, grid.size)
    return interval, grid.sigma(interval, u)[0], grid.basis(interval, u)[0]


def _inside(grid: Grid, joints: Real) -> tuple[Index, Real]:
    """Joints that are no knots: interval and u."""
    interval = np.clip(np.searchsorted(grid.s, joints, side="right") - 1, 0, grid.size - 1)
    near = np.minimum(joints - grid.s[interval], grid.s[interval + 1] - joints)
    keep = near > 1e-9 * (grid.s[interval + 1] - grid.s[interval])
    interval, joints = interval[keep], joints[keep]
    grade = grid.grade[interval]
    x = np.where(
        grade > 0,
        np.cbrt(joints - grid.s[0]),
        np.where(grade < 0, -np.cbrt(grid.s[-1] - joints), joints),
    )
    return interval, (x - grid.x0[interval]) / grid.h[interval]


def _interval_zones(limits: PlanLimits, knots: Real) -> Real:
    """The limit of the feed (n,) by the zones that meet each interval."""
    most = np.full(knots.size - 1, np.inf)
    for zone, part in _touched(knots, limits.zones):
        most[part] = np.minimum(most[part], zone.feed_mm_s)
    return most


def _interval_reserve(limits: PlanLimits, knots: Real) -> Real | None:
    """Factors (n,) by which limits are divided on intervals that reserve zones meet; None: there is no such zone."""
    tight = np.ones(knots.size - 1)
    for zone, part in _touched(knots, limits.reserve_zones):
        if zone.to_mm > knots[0] and zone.from_mm < knots[-1]:
            tight[part] = np.maximum(tight[part], JERK_ROW / (JERK_ROW - zone.share))
    return tight if (tight > 1.0).any() else None


def _touched(knots: Real, zones: Sequence[_Zone]) -> Iterator[tuple[_Zone, slice]]:
    """Each zone with the intervals that it meets."""
    slack = 1e-9 * (knots[-1] - knots[0])
    low = np.array([zone.from_mm for zone in zones]) + slack
    high = np.array([zone.to_mm for zone in zones]) - slack
    firsts = np.searchsorted(knots, low, side="right") - 1
    lasts = np.searchsorted(knots, high, side="left")
    for zone, first, last in zip(zones, firsts.tolist(), lasts.tolist(), strict=True):
        yield zone, slice(max(first, 0), max(last, 0))


class _Rounds:
    """The rounds of quadratic programs on one grid, each about the last feed, with more rows where that exceeded a
    limit.

    A program without a solution is solved with limits that may be exceeded. The next program, about its feed, usually
    has a solution.
    """

    def __init__(self, setting: _Setting, estimate: Feed, known: Solution | None = None) -> None:
        """Begins about an estimated feed. known  a solution of nearly the same problem on the same knots"""
        self.setting = setting
        reserved = setting.reserved
        by_point = None if reserved is None else reserved[setting.points.interval]
        self.select = Selection(setting.basic, setting.estimated, by_point)
        self.about = About(_p_of(estimate, setting.points.interval, setting.points.s, setting))
        self.inner_p = _p_of(estimate, setting.gauss[0], setting.gauss[1], setting)
        self.typical_q = estimate(setting.grid.s)
        self.duration_s = np.inf
        self.best: Solution | None = None
        self.exceeded = False
        if known is not None:
            p, d, dd = setting.points.cubic(setting.grid, known.q, known.slope)
            self.about = About(np.maximum(p, _LEAST_P), (d, dd))
            self.typical_q, self.duration_s = known.q, known.duration_s

    def run(self, even: Callable[[Solution], bool] | None, least_gain: float) -> Solution | None:
        """The last solution; None: there is none, or it exceeds the limits.

        even        whether the intervals of a solution last long enough; if not after _TRUSTED rounds, further rounds
                    on these knots are useless
        least_gain  share of the time that a further round has to gain
        """
        for rounds in range(1, _MOST_ROUNDS + 1):
            unknowns = self._solved()
            if unknowns is None:
                return self.best if self._tolerable else None
            gain = self._take(unknowns[0::2], unknowns[1::2], rounds)
            assert self.best is not None
            if rounds == _TRUSTED and even is not None and not even(self.best):
                return self.best
            self.select.everything = rounds >= self.setting.effort.patience
            if self.best.excess <= ALLOWED and abs(gain) < least_gain * self.duration_s:
                break
        moving = self.setting.start is not None
        return None if self.exceeded and moving and not self._tolerable else self.best

    @property
    def _tolerable(self) -> bool:
        return self.best is not None and self.best.excess < _TOLERABLE

    def _solved(self) -> Real | None:
        """The unknowns of the next program; None: it has no solution within the limits, and a feed within them is known
        already.
        """
        problem = _problem(
            self.setting,
            make_rows(self.setting.points, self.about, self.select, self.setting.once),
            self.inner_p,
            self.typical_q,
            _LEAST_FALL if np.isfinite(self.duration_s) else _LEAST_ESTIMATED,
        )
        tolerance = self.setting.effort.tolerance
        found = solve(problem, None, tolerance)
        if found is None and not self._tolerable:
            self.exceeded = True
            times = _times(self.setting, self.inner_p)
            found = solve(problem, _PENALTY * float(times.sum()), tolerance)
        return found

    def _take(self, q: Real, slope: Real, rounds: int) -> float:
        """Makes a feed the last one. Returns the time that it gains over the one before; s."""
        setting, grid = self.setting, self.setting.grid
        p, d, dd = setting.points.cubic(grid, q, slope)
        excess = _excess(setting, p, d, dd)
        self.about = About(np.maximum(p, _LEAST_FALL * self.about.p), (d, dd))
        p = np.sum(setting.gauss[2] * corners(grid, setting.gauss[0], q, slope), axis=-1)
        self.inner_p = np.maximum(p, _LEAST_FALL * self.inner_p)
        times = _times(setting, self.inner_p)
        self.typical_q = q
        before, self.duration_s = self.duration_s, float(times.sum())
        self.best = Solution(grid, q, slope, times, excess, rounds, setting)
        return before - self.duration_s


def _p_of(feed: Feed, interval: Index, s: Real, setting: _Setting) -> Real:
    """p of a feed given as q; at rest that of the middle of the interval."""
    grid = setting.grid
    middle, slope, _, _ = grid.sigma(interval, np.full(interval.size, 0.5))
    x = np.where(grid.grade[interval] > 0, np.cbrt(s - grid.s[0]), np.cbrt(grid.s[-1] - s))
    s1 = np.where(grid.grade[interval] == 0, 1.0, 3.0 * x * x)
    at_rest = s1 <= 0.0
    return np.asarray(feed(np.where(at_rest, middle, s)) / np.where(at_rest, slope, s1) ** 2)


def _times(setting: _Setting, p: Real) -> Real:
    """Time (n,) of each interval from p at the Gauss points."""
    parts = (1.0 / np.sqrt(p)).reshape(-1, GAUSS_W.size) @ GAUSS_W
    return np.asarray(parts * setting.grid.h)


def _problem(setting: _Setting, rows: Rows, p: Real, typical: Real, least: float) -> Problem:
    """The quadratic program: least time to second order about a feed, p at the Gauss points, q at the knots."""
    grid = setting.grid
    typical = np.maximum(typical, _LEAST_TYPICAL * np.max(typical))
    scale = np.empty(2 * grid.size + 2)
    scale[0::2] = typical
    width = np.diff(grid.s)
    scale[1::2] = typical / np.minimum(np.append(width, width[-1]), np.append(width[0], width))
    low, high = np.full(scale.size, -np.inf), np.full(scale.size, np.inf)
    low[0::2], high[0::2] = least * scale[0::2], setting.most_q
    if setting.start is None:
        scale[0], scale[1] = _rest_scale(grid, 0, typical[1])
        low[0] = least * scale[0]
    else:
        low[0] = high[0] = setting.start.q
        low[1] = high[1] = setting.start.slope
    scale[-2], scale[-1] = _rest_scale(grid, grid.size - 1, typical[-2])
    low[-2] = least * scale[-2]
    bounded = np.isfinite(high)
    high[bounded] = np.maximum(high[bounded], low[bounded])
    if setting.start is not None:
        # The state at the end of the window before may exceed its limits by the tolerance.
        rows.high[rows.interval < 2] += 2.0 * ALLOWED
        rows.low[rows.interval < 2] -= 2.0 * ALLOWED
    if setting.tight is not None:
        rows.high[:] /= setting.tight[rows.interval]
        rows.low[:] /= setting.tight[rows.interval]
    return Problem(*_cost(setting, p), scale, low, high, rows)


def _rest_scale(grid: Grid, interval: int, q: float) -> tuple[float, float]:
    """Scales of p and dp/dx at rest, from q at the other end of the interval."""
    far = grid.sigma(np.array([interval]), np.array([1.0 if interval == 0 else 0.0]))[1][0]
    p = q / far**2
    return p, p / grid.h[interval]


def _cost(setting: _Setting, p: Real) -> tuple[Real, Real]:
    """Time to second order about p at the Gauss points: gradient by the unknowns, and Hessian (n, 4, 4) by interval."""
    grid = setting.grid
    basis = setting.gauss[2].reshape(grid.size, -1, 4)
    weights = (np.tile(GAUSS_W, grid.size) * np.repeat(grid.h, GAUSS_W.size)).reshape(grid.size, -1)
    p = p.reshape(grid.size, -1)
    second = 0.75 * weights * p**-2.5
    first = np.einsum("ng,ngk->nk", -0.5 * weights * p**-1.5 - second * p, basis)
    gradient = np.zeros(2 * grid.size + 2)
    for k in range(4):
        gradient[k : k + 2 * grid.size : 2] += first[:, k]
    return gradient, np.einsum("ng,ngk,ngl->nkl", second, basis, basis, optimize=True)


def _excess(setting: _Setting, p: Real, d: Real, dd: Real) -> float:
    """Greatest share by which a feed exceeds a limit."""
    if p.min() <= 0.0:
        return 1.0
    worst = 0.0
    inherited = (setting.points.interval < 2) & (setting.start is not None)
    for value, limit in setting.points.values(p, d, dd).values():
        ratio = value / limit - 2.0 * ALLOWED * inherited
        worst = max(worst, float(ratio.max()) - 1.0)
    return worst
