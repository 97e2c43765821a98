# SPDX-License-Identifier: MIT
"""The least time to rest along a path from a state of motion, as a nonlinear program: the reference for stops. Used by
benchmarks/stops. No I/O.

The stop is one phase of unknown length, cut into equal intervals. Jerk is linear in each interval and free to jump
between them; speed and acceleration are 0 at the end. The path's tangent, curvature and change of curvature are cubic
splines over arc length through many places of each span; the change of curvature jumps between spans, and is smoothed
there over a few hundredths of a span. Limits are imposed at five points of each interval. CasADi transcribes, Ipopt
solves. The planned stops use nothing of this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hodograph.native.stop_search import StopLimits
from hodograph.spline import PHSpline
from hodograph.spline.frames import frames

Real = NDArray[np.float64]

INTERVALS = 40
"""Intervals of a stop in the discretised problem."""
_SPAN_PLACES = 48
"""Places of each span at which the splines of the path interpolate."""
_PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Points of an interval at which limits hold."""
_FEED, _ACCELERATION, _JERK, _TIME_S = 100.0, 2000.0, 50000.0, 0.1
"""Units of the variables, so that they are near one."""


@dataclass(frozen=True)
class State:
    """Arc length, speed and acceleration along the path: mm, s."""

    s_mm: float
    v_mm_s: float
    a_mm_s2: float


class LeastStop:
    """Least times to rest on one path.

    slack   share by which every limit is raised, since the state that a stop begins in may use its limits fully
    """

    def __init__(self, spline: PHSpline, limits: StopLimits, slack: float = 0.005) -> None:
        self._length_mm = spline.length_mm
        self._limits = limits
        self._raise = 1.0 + slack
        self._frame = _frame(spline)
        self._solver = self._build()

    def time_s(self, state: State, starts_s: tuple[float, ...]) -> float | None:
        """The best local optimum from starts of these durations; None where Ipopt finds none."""
        found = [self._solve(state, start_s) for start_s in starts_s]
        return min((time for time in found if time is not None), default=None)

    def _build(self) -> Any:
        n = INTERVALS
        time = ca.MX.sym("T")
        s, v, a = (ca.MX.sym(name, n + 1) for name in "sva")
        left, right = ca.MX.sym("left", n), ca.MX.sym("right", n)
        h = time * _TIME_S / n
        feed, acc, jl, jr = v * _FEED, a * _ACCELERATION, left * _JERK, right * _JERK
        equal = [
            (acc[1:] - acc[:-1] - h * (jl + jr) / 2) / _ACCELERATION,
            (feed[1:] - feed[:-1] - h * acc[:-1] - h**2 * (2 * jl + jr) / 6) / _FEED,
            s[1:] - s[:-1] - h * feed[:-1] - h**2 * acc[:-1] / 2 - h**3 * (3 * jl + jr) / 24,
        ]
        within: list[tuple[Any, float]] = []
        for part in _PARTS:
            u, slope = part * h, (jr - jl) / h
            s_u = s[:-1] + feed[:-1] * u + acc[:-1] * u**2 / 2 + jl * u**3 / 6 + slope * u**4 / 24
            v_u = feed[:-1] + acc[:-1] * u + jl * u**2 / 2 + slope * u**3 / 6
            a_u = acc[:-1] + jl * u + slope * u**2 / 2
            within += self._asked(s_u, v_u, a_u, jl + slope * u)
        self._equal_count = sum(row.shape[0] for row in equal)
        rows = equal + [row / (limit * self._raise) for row, limit in within]
        problem: dict[str, Any] = {
            "x": ca.vertcat(time, s, v, a, left, right),
            "f": time,
            "g": ca.vertcat(*rows),
        }
        self._row_count = problem["g"].shape[0]
        quiet: dict[str, Any] = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
        return ca.nlpsol(
            "stop", "ipopt", problem, quiet | {"ipopt.max_iter": 400, "ipopt.tol": 1e-6}
        )

    def _asked(self, s: Any, v: Any, a: Any, j: Any) -> list[tuple[Any, float]]:
        """Rows and what their magnitudes may be at most."""
        own = self._limits
        frame = ca.MX(self._frame(s.T))
        tx, ty, kappa, slope = (frame[k, :].T for k in range(4))
        normal = kappa * v**2
        along = j - kappa * normal * v
        across = (3 * kappa * a + slope * v**2) * v
        rows = [
            (v, own.feed),
            (a, own.acceleration),
            (j, own.jerk),
            (normal, own.centripetal),
        ]
        axes = (
            (tx, -ty, 0),
            (ty, tx, 1),
        )
        for t, n, k in axes:
            velocity, acceleration = v * t, a * t + normal * n
            rows += [
                (velocity, own.axis_velocity[k]),
                (acceleration, own.axis_acceleration[k]),
                (along * t + across * n, own.axis_jerk[k]),
                (velocity + own.time_constant[k] * acceleration, own.reach[k]),
            ]
        return [(row, limit) for row, limit in rows if isfinite(limit)]

    def _solve(self, state: State, start_s: float) -> float | None:
        n = INTERVALS
        share = np.linspace(0.0, 1.0, n + 1)
        v = state.v_mm_s * (1.0 - share) ** 2 * (1.0 + 2.0 * share)
        a = -6.0 * state.v_mm_s / start_s * share * (1.0 - share)
        distance = np.concatenate(([0.0], np.cumsum((v[1:] + v[:-1]) / 2.0 * start_s / n)))
        s = np.minimum(state.s_mm + distance, self._length_mm)
        zero = np.zeros(2 * n)
        guess = np.concatenate(([start_s / _TIME_S], s, v / _FEED, a / _ACCELERATION, zero))
        low, high = np.full(guess.size, -np.inf), np.full(guess.size, np.inf)
        low[0], high[0] = 1e-3, 100.0
        high[1 : n + 2] = self._length_mm
        low[n + 2 : 2 * n + 3] = 0.0
        for place, first in (
            (1, state.s_mm),
            (n + 2, state.v_mm_s / _FEED),
            (2 * n + 3, state.a_mm_s2 / _ACCELERATION),
        ):
            low[place] = high[place] = first
        for last in (2 * n + 2, 3 * n + 3):
            low[last] = high[last] = 0.0
        bound = np.ones(self._row_count)
        bound[: self._equal_count] = 0.0
        found = self._solver(x0=guess, lbx=low, ubx=high, lbg=-bound, ubg=bound)
        if not self._solver.stats()["success"]:
            return None
        return float(found["x"][0]) * _TIME_S


def _frame(spline: PHSpline) -> Any:
    """Tangent (2), curvature and its change by arc length, as a CasADi function of arc length."""
    share = (np.arange(_SPAN_PLACES) + 0.5) / _SPAN_PLACES
    starts = spline.segment_starts_mm
    places = np.concatenate([a + (b - a) * share for a, b in pairwise(starts)])
    places = np.concatenate(([0.0], places, [spline.length_mm]))
    frame = frames(spline, places)
    tx, ty = frame.r1
    slope = tx * frame.r3[1] - ty * frame.r3[0]
    values = np.stack((tx, ty, frame.curvature, slope))
    return ca.interpolant("frame", "bspline", [places.tolist()], values.ravel(order="F").tolist())
