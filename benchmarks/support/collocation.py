# SPDX-License-Identifier: MIT
"""The fastest feed along a path as a nonlinear program, for comparison: transcribed in CasADi, solved by Ipopt. Used by
benchmarks/optimal. No I/O.

Each span of the path is a phase of its own length in time, cut into equal intervals. Arc length is a quartic in each
(jerk linear, free to jump at the ends of intervals); the curve's parameter xi is a variable at every node, tied to arc
length by s(xi) = s, so that the curve is exact. Limits hold at five points of every interval; how far they are passed
in between is reported. Nothing here is used by the planner or the verifier.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hodograph.feed import Limits, Plant
from hodograph.spline import PHSpline
from hodograph.spline.spatial import SpatialPHSpline

Real = NDArray[np.float64]
Start = tuple[Real, Real]
"""Arc lengths and the feeds there."""

_FEED, _ACCELERATION, _JERK = 100.0, 1000.0, 10000.0
"""Units of the variables, so that they are near one."""

_INNER = (0.25, 0.5, 0.75)
"""Where limits hold within intervals, besides at both ends."""


@dataclass(frozen=True)
class Task:
    """A path, its limits (controller's included; reserve not), and the plants when volts are limited."""

    spline: PHSpline | SpatialPHSpline
    limits: Limits
    plants: tuple[Plant, ...] | None


@dataclass(frozen=True)
class Optimum:
    """A local optimum: its time, how far limits are passed between nodes (share), and its nodes (t, feed)."""

    duration_s: float
    beyond: float
    intervals: int
    t_s: Real
    feed_mm_s: Real
    arc_mm: Real


def solve(task: Task, per_span: int, start: Start | None, feed_mm_s: float) -> Optimum | None:
    """From a start of constant feed (or the feeds given at arc lengths); None where Ipopt does not converge."""
    program = _Program(task, per_span)
    program.build()
    return program.solve(start, feed_mm_s)


class _Program:
    def __init__(self, task: Task, per_span: int) -> None:
        self.task = task
        self.n = per_span
        self.variables: list[Any] = []
        self.low: list[Real] = []
        self.high: list[Real] = []
        self.guess: list[Real] = []
        self.rows: list[Any] = []
        self.row_low: list[Real] = []
        self.row_high: list[Real] = []
        self.phases: list[dict[str, Any]] = []

    def build(self) -> None:
        """All phases, joined."""
        spline = self.task.spline
        for k in range(spline.segment_count):
            self._phase(k)
        for before, after in zip(self.phases[:-1], self.phases[1:], strict=True):
            for name in ("v", "a"):
                self._equal(before[name][-1] - after[name][0])
        for phase, at in ((self.phases[0], 0), (self.phases[-1], -1)):
            for name in ("v", "a"):
                self._equal(phase[name][at])

    def _variable(self, name: str, size: int, low: float, high: float) -> Any:
        symbol = ca.SX.sym(name, size)
        self.variables.append(symbol)
        self.low.append(np.full(size, low))
        self.high.append(np.full(size, high))
        return symbol

    def _equal(self, row: Any) -> None:
        size = row.shape[0]
        self.rows.append(row)
        self.row_low.append(np.zeros(size))
        self.row_high.append(np.zeros(size))

    def _within(self, row: Any, limit: float) -> None:
        """|row| <= limit."""
        size = row.shape[0]
        self.rows.append(row / limit)
        self.row_low.append(-np.ones(size))
        self.row_high.append(np.ones(size))

    def _phase(self, k: int) -> None:
        n, task = self.n, self.task
        length = float(task.spline.segment_lengths_mm[k])
        feed = task.limits.feed_mm_s or 1e4
        time = self._variable(f"T{k}", 1, 1e-4, 1e3)
        s = self._variable(f"s{k}", n + 1, -0.01 * length, 1.01 * length)
        v = self._variable(f"v{k}", n + 1, 0.0, feed / _FEED)
        a = self._variable(f"a{k}", n + 1, -np.inf, np.inf)
        xi = self._variable(f"x{k}", n + 1, -0.01, 1.01)
        jl = self._variable(f"l{k}", n, -np.inf, np.inf)
        jr = self._variable(f"r{k}", n, -np.inf, np.inf)
        self.phases.append({"T": time, "s": s, "v": v, "a": a, "xi": xi, "jl": jl, "jr": jr})
        h = time / n
        feed_now, acc, left, right = v * _FEED, a * _ACCELERATION, jl * _JERK, jr * _JERK
        self._equal((acc[1:] - acc[:-1] - h * (left + right) / 2) / _ACCELERATION)
        self._equal(
            (feed_now[1:] - feed_now[:-1] - h * acc[:-1] - h**2 * (2 * left + right) / 6) / _FEED
        )
        self._equal(
            s[1:]
            - s[:-1]
            - h * feed_now[:-1]
            - h**2 * acc[:-1] / 2
            - h**3 * (3 * left + right) / 24
        )
        self._equal(s[0])
        self._equal(s[-1] - length)
        curve = _curve(task.spline, k)
        self._equal(curve.arc(xi) - s)
        ends = (
            (xi[:-1], feed_now[:-1], acc[:-1], left),
            (xi[1:], feed_now[1:], acc[1:], right),
        )
        for one in ends:
            self._limits(curve, *one)
        for part in _INNER:
            u, slope = part * h, (right - left) / h
            inner = self._variable(f"i{k}_{part:.2f}", n, -0.01, 1.01)
            acc_u = acc[:-1] + left * u + slope * u**2 / 2
            feed_u = feed_now[:-1] + acc[:-1] * u + left * u**2 / 2 + slope * u**3 / 6
            distance = feed_now[:-1] * u + acc[:-1] * u**2 / 2 + left * u**3 / 6 + slope * u**4 / 24
            self._equal(curve.arc(inner) - s[:-1] - distance)
            self._limits(curve, inner, feed_u, acc_u, left + slope * u)

    def _limits(self, curve: _Curve | _SpaceCurve, xi: Any, feed: Any, acc: Any, jerk: Any) -> None:
        """All limits at points given by parameter and derivatives of arc length."""
        limits = self.task.limits
        if limits.feed_mm_s is not None:
            self._within(feed, limits.feed_mm_s)
        if limits.acceleration_mm_s2 is not None:
            self._within(acc, limits.acceleration_mm_s2)
        if limits.jerk_mm_s3 is not None:
            self._within(jerk, limits.jerk_mm_s3)
        point = curve.frame(xi)
        if limits.centripetal_mm_s2 is not None:
            self._within(point.kappa * feed**2, limits.centripetal_mm_s2)
        axis = limits.axis
        for k in range(self.task.spline.axes):
            velocity = feed * point.r1[k]
            acceleration = acc * point.r1[k] + feed**2 * point.r2[k]
            if axis.velocity_mm_s is not None:
                self._within(velocity, axis.velocity_mm_s[k])
            if axis.acceleration_mm_s2 is not None:
                self._within(acceleration, axis.acceleration_mm_s2[k])
            if axis.jerk_mm_s3 is not None:
                rest = 3 * feed * acc * point.r2[k] + feed**3 * point.r3[k]
                self._within(jerk * point.r1[k] + rest, axis.jerk_mm_s3[k])
            if self.task.plants is not None:
                plant = self.task.plants[k]
                self._within(velocity + plant.time_constant_s * acceleration, plant.reach_mm_s)

    def solve(self, start: Start | None, feed_mm_s: float) -> Optimum | None:
        """Ipopt from a start."""
        duration = sum(phase["T"] for phase in self.phases)
        problem = {"x": ca.vertcat(*self.variables), "f": duration, "g": ca.vertcat(*self.rows)}
        solver = ca.nlpsol(
            "feed",
            "ipopt",
            problem,
            {
                "print_time": False,
                "ipopt.print_level": 0,
                "ipopt.sb": "yes",
                "ipopt.max_iter": 1500,
                "ipopt.tol": 1e-7,
                "ipopt.mu_strategy": "adaptive",
            },
        )
        found = solver(
            x0=self._start(start, feed_mm_s),
            lbx=np.concatenate(self.low),
            ubx=np.concatenate(self.high),
            lbg=np.concatenate(self.row_low),
            ubg=np.concatenate(self.row_high),
        )
        if not solver.stats()["success"]:
            return None
        return self._optimum(np.asarray(found["x"]).ravel())

    def _start(self, start: Start | None, feed_mm_s: float) -> Real:
        spline, n = self.task.spline, self.n
        out: list[Real] = []
        for k in range(spline.segment_count):
            base, length = spline.segment_starts_mm[k], spline.segment_lengths_mm[k]
            s = np.linspace(0.0, length, n + 1)
            v = np.full(n + 1, feed_mm_s)
            if start is not None:
                v = np.maximum(np.interp(base + s, *start), 0.02 * feed_mm_s)
            time = float(np.sum(2.0 * np.diff(s) / (v[1:] + v[:-1])))
            _, xi = spline.locate(np.clip(base + s, base + 1e-12, base + length * (1 - 1e-12)))
            xi[0], xi[-1] = 0.0, 1.0
            out += [np.array([time]), s, v / _FEED, np.zeros(n + 1), xi, np.zeros(n), np.zeros(n)]
            out += [xi[:-1] + part * np.diff(xi) for part in _INNER]
        return np.concatenate(out)

    def _optimum(self, x: Real) -> Optimum:
        n, spline = self.n, self.task.spline
        sizes = (1, n + 1, n + 1, n + 1, n + 1, n, n, *(n for _ in _INNER))
        t0, worst, at = 0.0, 0.0, 0
        times, feeds, arcs = [], [], []
        share = np.linspace(0.0, 1.0, 9)
        for k in range(spline.segment_count):
            parts = []
            for size in sizes:
                parts.append(x[at : at + size])
                at += size
            time, s, v, a, _, jl, jr = parts[:7]
            h = float(time[0]) / n
            v, a, jl, jr = v * _FEED, a * _ACCELERATION, jl * _JERK, jr * _JERK
            u = share[None, :] * h
            slope = ((jr - jl) / h)[:, None]
            j_ = jl[:, None] + slope * u
            a_ = a[:-1, None] + jl[:, None] * u + slope * u**2 / 2
            v_ = v[:-1, None] + a[:-1, None] * u + jl[:, None] * u**2 / 2 + slope * u**3 / 6
            s_ = (
                s[:-1, None]
                + v[:-1, None] * u
                + a[:-1, None] * u**2 / 2
                + jl[:, None] * u**3 / 6
                + slope * u**4 / 24
            )
            worst = max(worst, self._beyond(k, s_, v_, a_, j_))
            times.append(t0 + h * np.arange(n + 1))
            feeds.append(v)
            arcs.append(spline.segment_starts_mm[k] + s)
            t0 += float(time[0])
        return Optimum(
            t0, worst, n * spline.segment_count, *(np.concatenate(p) for p in (times, feeds, arcs))
        )

    def _beyond(self, k: int, s: Real, v: Real, a: Real, j: Real) -> float:
        """Greatest share above a limit at instants of span k."""
        spline, limits = self.task.spline, self.task.limits
        base, length = spline.segment_starts_mm[k], spline.segment_lengths_mm[k]
        _, xi = spline.locate(base + np.clip(s, 1e-9 * length, (1 - 1e-9) * length))
        point = _curve(spline, k).frame(xi)
        pairs: list[tuple[Real, float | None]] = [
            (v, limits.feed_mm_s),
            (a, limits.acceleration_mm_s2),
            (j, limits.jerk_mm_s3),
            (point.kappa * v**2, limits.centripetal_mm_s2),
        ]
        axis = limits.axis
        for i in range(spline.axes):
            acceleration = a * point.r1[i] + v**2 * point.r2[i]
            jerk = j * point.r1[i] + 3 * v * a * point.r2[i] + v**3 * point.r3[i]
            pairs += [
                (v * point.r1[i], axis.velocity_mm_s[i] if axis.velocity_mm_s else None),
                (acceleration, axis.acceleration_mm_s2[i] if axis.acceleration_mm_s2 else None),
                (jerk, axis.jerk_mm_s3[i] if axis.jerk_mm_s3 else None),
            ]
            if self.task.plants is not None:
                plant = self.task.plants[i]
                pull = v * point.r1[i] + plant.time_constant_s * acceleration
                pairs.append((pull, plant.reach_mm_s))
        return max(float(np.abs(q).max()) / limit - 1.0 for q, limit in pairs if limit)


@dataclass(frozen=True)
class _Frame:
    """r_s, r_ss, r_sss by axis, and the curvature, at parameters."""

    r1: tuple[Any, ...]
    r2: tuple[Any, ...]
    r3: tuple[Any, ...]
    kappa: Any


def _curve(spline: PHSpline | SpatialPHSpline, k: int) -> _Curve | _SpaceCurve:
    """Span k."""
    return _Curve(spline, k) if isinstance(spline, PHSpline) else _SpaceCurve(spline, k)


class _Curve:
    """One span in real arithmetic that CasADi and numpy both understand."""

    def __init__(self, spline: PHSpline, k: int) -> None:
        w0, w1, w2 = (complex(c) for c in spline.w[k])
        self.u = np.array([w0.real, 2 * (w1 - w0).real, (w0 - 2 * w1 + w2).real])
        self.v = np.array([w0.imag, 2 * (w1 - w0).imag, (w0 - 2 * w1 + w2).imag])
        self.sigma = np.convolve(self.u, self.u) + np.convolve(self.v, self.v)

    def arc(self, xi: Any) -> Any:
        """Arc length from the start of the span."""
        return _horner([0.0, *(c / (i + 1) for i, c in enumerate(self.sigma))], xi)

    def frame(self, xi: Any) -> _Frame:
        """Derivatives of the point by arc length."""
        u, v = _horner(self.u, xi), _horner(self.v, xi)
        u1, v1 = self.u[1] + 2 * self.u[2] * xi, self.v[1] + 2 * self.v[2] * xi
        u2, v2 = 2 * self.u[2], 2 * self.v[2]
        sigma = u * u + v * v
        cross = u * v1 - v * u1
        kappa = 2 * cross / sigma**2
        slope = (2 * (u * v2 - v * u2) - 8 * cross * (u * u1 + v * v1) / sigma) / sigma**3
        tx, ty = (u * u - v * v) / sigma, 2 * u * v / sigma
        return _Frame(
            (tx, ty),
            (-kappa * ty, kappa * tx),
            (-slope * ty - kappa**2 * tx, slope * tx - kappa**2 * ty),
            kappa,
        )


class _SpaceCurve:
    """The same of a span in space, extra axes included."""

    def __init__(self, spline: SpatialPHSpline, k: int) -> None:
        self.sigma = _powers(spline.speed_coefficients[k])
        drawn = [_powers(row) for row in spline.hodograph_coefficients[k]]
        extra = spline.extra[k] if spline.extra_axes else np.zeros((0, 6))
        self.slopes = [*drawn, *(_powers(5.0 * np.diff(row)) for row in extra)]

    def arc(self, xi: Any) -> Any:
        """Arc length from the start of the span."""
        return _horner([0.0, *(c / (i + 1) for i, c in enumerate(self.sigma))], xi)

    def frame(self, xi: Any) -> _Frame:
        """Derivatives of the axes by arc length."""
        s0, s1, s2 = (_horner(_derived(self.sigma, n), xi) for n in range(3))
        first, second, third = [], [], []
        for own in self.slopes:
            p0, p1, p2 = (_horner(_derived(own, n), xi) for n in range(3))
            r1 = p0 / s0
            r2 = (p1 - s1 * r1) / s0**2
            first.append(r1)
            second.append(r2)
            third.append((p2 - s2 * r1) / s0**3 - 3 * s1 * r2 / s0**2)
        bend = sum(r2**2 for r2 in second[:3])
        return _Frame(tuple(first), tuple(second), tuple(third), (bend + 1e-18) ** 0.5)


def _powers(bernstein: Real) -> list[float]:
    """A polynomial in powers, from its Bernstein coefficients."""
    n = len(bernstein) - 1
    return [
        comb(n, k) * sum((-1) ** (k - i) * comb(k, i) * float(bernstein[i]) for i in range(k + 1))
        for k in range(n + 1)
    ]


def _derived(coefficients: list[float], order: int) -> list[float]:
    """The derivative of a polynomial in powers."""
    for _ in range(order):
        coefficients = [k * c for k, c in enumerate(coefficients)][1:]
    return coefficients


def _horner(coefficients: Any, x: Any) -> Any:
    out = 0.0
    for c in reversed(list(coefficients)):
        out = out * x + float(c)
    return out
