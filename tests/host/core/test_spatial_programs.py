# SPDX-License-Identifier: MIT
"""Spatial programs as the controller reads, checks and runs them. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hodograph.feed import ControllerLimits
from hodograph.names import KERNELS
from hodograph.native.feed_override import FeedOverride
from hodograph.native.library import library
from hodograph.native.program import NativeLimits, NativeProgram, kernel_code
from hodograph.native.stop_bounds import stop_bounds
from hodograph.native.stop_search import SearchHints, StopLimits, StopSearch
from hodograph.native.stop_trial import run_trials
from hodograph.program import Program, decode
from hodograph.program.image import RECORD_BYTES, memory_bytes
from hodograph.program.stops import Stops, mantissas, no_stops
from spatial_image import (
    Q40,
    Q44,
    Segment,
    add_extra,
    chain,
    embedded,
    feed_along,
    image,
    length_mm,
    wandering,
)

PROGRAMS = Path(__file__).resolve().parents[2] / "data" / "programs"
CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)
NAMES = ("velocity", "acceleration", "jerk")
AXIS_CODES = (-70, -71, -72)


@dataclass(frozen=True)
class Case:
    """Segments and the feed along them."""

    segments: list[Segment]
    feed: Program

    def image(self, change: Callable[[list[Segment]], object] | None = None) -> bytes:
        segments = copy.deepcopy(self.segments)
        if change is not None:
            change(segments)
        return image(segments, self.feed)


def case(axes: int, count: int = 12, segment_mm: float = 8.0, feed_mm_s: float = 80.0) -> Case:
    segments = chain(wandering(count, segment_mm), [30 * Q40, -20 * Q40, 5 * Q40])
    for k in range(axes - 3):
        add_extra(segments, 40.0 + 10 * k, 25.0 - 5 * k, 0.3 + k)
    return Case(segments, feed_along(segments, feed_mm_s, 0.1, CONTROLLER))


@pytest.fixture(scope="module", params=[3, 4, 6])
def some(request: pytest.FixtureRequest) -> Case:
    return case(request.param)


@pytest.fixture(scope="module")
def six() -> Case:
    return case(6)


def test_a_spatial_program_is_accepted(some: Case) -> None:
    program = NativeProgram(some.image())
    axes = 3 + len(some.segments[0].extras)
    assert program.axis_count == axes
    assert program.check() is None
    assert program.check(NativeLimits(axis_count=axes)) is None
    other = program.check(NativeLimits(axis_count=2))
    assert other is not None
    assert other.code == -13


def test_truncated_or_of_another_size_it_is_refused(some: Case) -> None:
    whole = some.image()
    for size in (len(whole) - 1, 128, 131, 0):
        with pytest.raises(Exception, match="truncated"):
            NativeProgram(whole[:size])
    for axes in (0, 1, 7, 65535):
        with pytest.raises(Exception, match="axis count"):
            NativeProgram(whole[:30] + axes.to_bytes(2, "little") + whole[32:])
    with pytest.raises(Exception, match="header size"):
        NativeProgram(whole[:6] + (128).to_bytes(2, "little") + whole[8:])


@pytest.mark.parametrize("kernel", ["fixed", "float"])
def test_the_whole_run_is_on_the_curve(some: Case, kernel: str) -> None:
    program = NativeProgram(some.image())
    times = program.tick_times_q42_s()
    exact = program.points("double", times)["position_q40"] / Q40
    found = program.points(kernel, times)["position_q40"] / Q40
    bound = {"fixed": 1e-6, "float": 1e-5}[kernel]
    assert np.abs(found - exact).max() <= bound
    axes = program.axis_count
    assert not found[:, axes:].any()
    assert np.ptp(found[:, :axes], axis=0).min() > 1.0


def test_the_points_are_those_of_the_segments(some: Case) -> None:
    """By the segments' own polynomials in floats: near enough to find a wrong axis or sign."""
    program = NativeProgram(some.image())
    points = program.points("double", program.tick_times_q42_s())
    arc = points["arc_length_q40_mm"]
    starts = np.array([one.start for one in some.segments])
    for row in range(0, len(points), 97):
        which = int(np.searchsorted(starts, arc[row], side="right")) - 1
        one = some.segments[which]
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            if float(one.at(middle)[-1]) < (arc[row] - one.start) / Q40:
                low = middle
            else:
                high = middle
        expected = [float(v) for v in one.at(low)[:-1]]
        found = points["position_q40"][row, : program.axis_count] / Q40
        assert np.abs(found - expected).max() < 1e-9


def limits_of(axes: dict[str, list[int]]) -> NativeLimits:
    """Limits of the axes by field, one for each path axis."""
    fields: dict[str, Any] = {name: tuple(values) for name, values in axes.items()}
    return NativeLimits(**fields)


def nudge(segment: int, axis: int, by: int) -> Callable[[list[Segment]], object]:
    def change(segments: list[Segment]) -> None:
        one = segments[segment]
        if axis < 3:
            one.point[axis] += by
        else:
            one.extras[axis - 3].start += by

    return change


def turned(segments: list[Segment]) -> None:
    """A tangent across by 2e-6 rad, in space: A (1 + e j) at the start of a segment."""
    e = 1e-6
    u, v, p, q = (row[0] for row in segments[4].a)
    for row, change in zip(segments[4].a, (-p, -q, u, v), strict=True):
        row[0] += round(e * change)


BROKEN: dict[str, tuple[Callable[[list[Segment]], object], int, int]] = {
    "z gap": (nudge(5, 2, 200), -27, 5),
    "x gap": (nudge(5, 0, -200), -27, 5),
    "extra gap": (nudge(6, 4, 200), -27, 6),
    "z range": (nudge(2, 2, 1 << 52), -21, 2),
    "extra range": (nudge(2, 5, -(1 << 53)), -21, 2),
    "arc gap": (lambda s: setattr(s[7], "start", s[7].start + 200), -28, 7),
    "first": (lambda s: setattr(s[0], "start", 1), -26, 0),
    "ratio": (lambda s: s[3].a[2].__setitem__(1, 5 * Q44), -24, 3),
    "slope": (lambda s: s[8].extras[1].b.__setitem__(0, s[8].extras[1].b[0] + (1 << 30)), -29, 8),
    "slope at the end": (
        lambda s: s[8].extras[2].b.__setitem__(3, s[8].extras[2].b[3] + (1 << 30)),
        -29,
        9,
    ),
    "direction": (turned, -29, 4),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_segment_is_refused(six: Case, name: str) -> None:
    change, code, index = BROKEN[name]
    fault = NativeProgram(six.image(change)).check()
    assert fault is not None
    if name == "direction":  # the end point moves as well: both are refused, the point first
        assert fault.code in (-27, -29)
        assert fault.index in (4, 5)
        return
    assert (fault.code, fault.index) == (code, index)


def joint(angle_rad: float, axis: int) -> bytes:
    """Two straight segments with an angle between them, about y (0) or z (1) of the machine."""
    a = [2 * Q44, 0, 0, 0]
    half = 0.5 * angle_rad
    other = [round(2 * Q44 * math.cos(half)), 0, 0, 0]
    other[2 + axis] = round(2 * Q44 * math.sin(half))
    segments = chain([[[c] * 3 for c in a], [[c] * 3 for c in other]], [0, 0, 0])
    return image(segments, feed_along(segments, 20.0, 0.1, CONTROLLER))


@pytest.mark.parametrize("axis", [0, 1])
def test_directions_are_compared_in_space(axis: int) -> None:
    assert NativeProgram(joint(0.999 * 2.0**-20, axis)).check() is None
    assert NativeProgram(joint(-0.999 * 2.0**-20, axis)).check() is None
    for angle in (1.001 * 2.0**-20, -1.001 * 2.0**-20, 0.5, math.pi):
        fault = NativeProgram(joint(angle, axis)).check()
        assert fault is not None, angle
        assert (fault.code, fault.index) == (-29, 1), angle


def test_a_rotation_about_the_tangent_is_no_turn() -> None:
    """The quaternion of a tangent is free about it: A (cos t + i sin t) is the same direction."""
    t = 1.234
    a = [[2 * Q44] * 3, [0] * 3, [0] * 3, [0] * 3]
    b = [[round(2 * Q44 * math.cos(t))] * 3, [round(2 * Q44 * math.sin(t))] * 3, [0] * 3, [0] * 3]
    segments = chain([a, b], [0, 0, 0])
    program = NativeProgram(image(segments, feed_along(segments, 20.0, 0.1, CONTROLLER)))
    assert program.check() is None


@pytest.mark.parametrize("axis", range(6))
def test_travel_of_every_axis(six: Case, axis: int) -> None:
    program = NativeProgram(six.image())
    reached = program.points("double", program.tick_times_q42_s())["position_q40"][:, axis]
    for side, name in ((1, "max_q40_mm"), (-1, "min_q40_mm")):
        limit = int(reached.max() if side > 0 else reached.min())
        wide = [side << 52] * 6
        for by, passes in ((side * 2 * Q40, True), (-side * Q40 // 100, False)):
            own = list(wide)
            own[axis] = limit + by
            fault = program.check(limits_of({name: own}))
            assert (fault is None) == passes
            assert passes or (fault is not None and fault.code == -33)


def derivatives(case: Case, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Velocity, acceleration and jerk (3, n, axes) at rate 1 at instants of all pieces, and their pieces (n,).

    By Taylor series: that of s(xi) is reversed, put into the curve, and F(t) into that.
    """
    series = [PowerSeries.of(one) for one in case.segments]
    starts = np.array([one.start for one in case.segments]) / Q40
    rows, which = [], []
    pieces = case.feed.pieces
    for i in range(case.feed.piece_count):
        duration = int(pieces.duration_q32_s[i]) / 2**32
        scale = 2.0 ** math.ceil(math.log2(duration))
        f = np.polynomial.Polynomial([0, *(pieces.c_q40[i] / Q40)])
        grid = np.linspace(0.0, duration / scale, samples)
        inside = starts[(starts > int(pieces.start_q40[i]) / Q40)] - int(pieces.start_q40[i]) / Q40
        joints = [reached(f, way, duration / scale) for way in inside if way < f(duration / scale)]
        for tau in (*grid, *joints):
            s = int(pieces.start_q40[i]) / Q40 + f(tau)
            speeds = [f.deriv(k)(tau) / scale**k for k in (1, 2, 3)]
            for nudged in (s - 1e-9, s + 1e-9):  # both sides of a joint
                k = int(np.clip(np.searchsorted(starts, nudged, side="right") - 1, 0, None))
                rows.append(motion(series[k], s - starts[k], speeds))
                which.append(i)
    return np.moveaxis(np.array(rows), 1, 0), np.array(which)


def reached(f: np.polynomial.Polynomial, way: float, end: float) -> float:
    """tau at which a piece has come to this way, by bisection."""
    low, high = 0.0, end
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(middle) < way else (low, middle)
    return low


@dataclass(frozen=True)
class PowerSeries:
    """Derivatives of order 0 to 3 of the axes, (4, axes, 6) coefficients, and of the arc length, (4, 6), by xi."""

    axes: np.ndarray
    arc: np.ndarray

    @classmethod
    def of(cls, one: Segment) -> PowerSeries:
        rows = np.array([one.at_powers(k) for k in range(3 + len(one.extras) + 1)])
        orders = [rows]
        for _ in range(3):
            orders.append(np.pad(orders[-1][:, 1:] * np.arange(1, 6), ((0, 0), (0, 1))))
        stacked = np.array(orders)
        return cls(stacked[:, :-1], stacked[:, -1])


def motion(series: PowerSeries, s: float, speeds: list[float]) -> np.ndarray:
    """Velocity, acceleration and jerk (3, axes) at an arc length that changes with these derivatives by time."""
    xi = s / series.arc[0].sum()
    for _ in range(8):
        value, slope = series.arc[:2] @ xi ** np.arange(6)
        xi -= (value - s) / slope
    c1, c2, c3 = series.arc[1:] @ xi ** np.arange(6) / (1, 2, 6)
    back = (1 / c1, -c2 / c1**3, (2 * c2**2 - c1 * c3) / c1**5)
    by_time = composed(np.array(back), np.array(speeds) / (1, 2, 6))
    along = series.axes[1:] @ xi ** np.arange(6) / np.array([[1], [2], [6]])
    return composed(along, by_time) * np.array([[1], [2], [6]])


def composed(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Coefficients of orders 1 to 3 of a power series whose variable is another one, both without constants."""
    p1, p2, p3 = outer
    q1, q2, q3 = inner
    return np.array([p1 * q1, p1 * q2 + p2 * q1**2, p1 * q3 + 2 * p2 * q1 * q2 + p3 * q1**3])


def at_all_rates(case: Case, at_one: np.ndarray, which: np.ndarray) -> np.ndarray:
    """The greatest at every rate that the pieces allow, (3, n, axes): docs/reference/protocol.md 1.3."""
    v, a, j = np.abs(at_one)
    out = np.zeros_like(at_one)
    pieces = case.feed.pieces
    levels = np.array([320, 448, 488, 504, 509, 511, 0]) / 512
    for level, value in enumerate(levels):
        f = (value or pieces.override_factor_q14[which] / 2**14) * np.ones(len(which))
        rate = mantissas(pieces.override_rate_codes[which, level]) * 2.0**-32
        second = mantissas(pieces.override_second_codes[which, level]) * 2.0**-24
        f, rate, second = f[:, None], rate[:, None], second[:, None]
        out = np.maximum(
            out, [f * v, f**2 * a + rate * v, f**3 * j + 3 * f * rate * a + second * v]
        )
    return out


@pytest.fixture(scope="module")
def at_one(six: Case) -> tuple[np.ndarray, np.ndarray]:
    """`derivatives` of the program of six axes."""
    return derivatives(six, 60)


@pytest.fixture(scope="module")
def peaks(six: Case, at_one: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The greatest velocity, acceleration and jerk (3, 6) of the axes, at every rate."""
    return np.asarray(at_all_rates(six, *at_one).max(axis=1))


@pytest.mark.parametrize("quantity", range(3))
@pytest.mark.parametrize("axis", range(6))
def test_a_limit_that_is_passed_by_a_percent_is_found(
    six: Case, peaks: np.ndarray, quantity: int, axis: int
) -> None:
    program = NativeProgram(six.image())
    field = ("axis_velocity_um_s", "axis_acceleration_um_s2", "axis_jerk_mm_s3")[quantity]
    scale = (1e3, 1e3, 1.0)[quantity]
    for share, passes in ((1.01, True), (0.99, False)):
        limits = [0] * 6
        limits[axis] = math.ceil(peaks[quantity, axis] * scale * share)
        fault = program.check(limits_of({field: limits}))
        assert (fault is None) == passes, (NAMES[quantity], axis, share, fault)
        if fault is not None:
            assert fault.code in (AXIS_CODES[quantity], -73)


def test_a_planar_program_gets_the_same_verdicts_in_space() -> None:
    """At z = 0, with the limits of the axes from far too wide to far too narrow."""
    planar = golden("alpha_minimax")
    flat, space = (
        NativeProgram(planar),
        NativeProgram(image(embedded(decode(planar)), decode(planar))),
    )
    assert flat.check() is None
    assert space.check() is None
    times = flat.tick_times_q42_s()
    for kernel in ("fixed", "float"):
        a, b = (p.points(kernel, times)["position_q40"] for p in (flat, space))
        assert np.abs(a - b).max() <= (0 if kernel == "fixed" else Q40 * 1e-5)
    verdicts = set()
    for factor in np.geomspace(0.5, 2.5, 25):
        limits = {
            "axis_velocity_um_s": round(100e3 * factor),
            "axis_acceleration_um_s2": round(2000e3 * factor**2),
            "axis_jerk_mm_s3": round(50000 * factor**3),
        }
        given = limits_of({name: [value] * 3 for name, value in limits.items()})
        found = [program.check(given) for program in (flat, space)]
        assert (found[0] is None) == (found[1] is None), factor
        verdicts.add(found[0] is None)
    assert verdicts == {True, False}


def golden(name: str) -> bytes:
    folder = Path(__file__).resolve().parents[2] / "data/programs"
    return (folder / f"{name}.hdgp").read_bytes()


def test_override_hold_and_stops_keep_to_the_curve(some: Case) -> None:
    """Tick by tick with commands: every setpoint is the point at its arc length."""
    program = NativeProgram(some.image())
    run = FeedOverride(program)
    commands: dict[int, Callable[[], None]] = {
        100: lambda: run.override(60),
        400: run.hold,
        900: run.resume,
        1100: lambda: run.override(150),
        1300: run.stop,
    }
    feeds, arcs, positions = [], [], []
    for tick in range(1700):
        commands.get(tick, lambda: None)()
        step = run.step()
        feeds.append(step.feed_mm_s)
        arcs.append(step.arc_mm)
        positions.append(step.position)
    assert feeds[899] == 0.0
    assert feeds[1299] > 1.0
    assert feeds[-1] == 0.0
    assert arcs[-1] < 0.98 * length_mm(some.segments)
    assert np.all(np.diff(arcs) >= 0.0)
    nominal = program.points("double", program.tick_times_q42_s())
    along = nominal["arc_length_q40_mm"] / Q40
    found = np.array(positions)
    assert found.shape == (1700, program.axis_count)
    for axis in range(program.axis_count):
        curve = nominal["position_q40"][:, axis] / Q40
        # a chord of a tick of 0.08 mm where the curve bends and the extra axes swing
        assert np.abs(np.interp(arcs, along, curve) - found[:, axis]).max() < 3e-4


def test_the_end_is_that_of_the_last_segment(some: Case) -> None:
    """The last setpoint has all axes at the end of the last segment, to the unit of the image."""
    program = NativeProgram(some.image())
    last = some.segments[-1]
    exact = [round(float(v) * Q40) for v in last.at(Fraction(1))[:-1]]
    for kernel in ("fixed", "float", "double"):
        points = program.points(kernel, program.tick_times_q42_s())
        found = points["position_q40"][-1, : program.axis_count]
        assert np.abs(found - exact).max() <= 1
        step = np.abs(np.diff(points["position_q40"][-3:], axis=0)).max()
        assert step < 1e-3 * Q40  # it is come to at rest


@pytest.mark.parametrize("at", [0.0, 0.3, 0.77, 1.0])
def test_a_fault_stop_anywhere_is_on_the_curve(six: Case, at: float) -> None:
    program = NativeProgram(six.image())
    run = FeedOverride(program)
    ticks = program.ticks
    for tick in range(ticks + 400):
        if tick == int(at * ticks):
            run.fault_stop()
        last = run.step()
    again = run.step()
    assert again == last
    assert last.feed_mm_s == 0.0
    assert len(last.position) == 6


def with_stops(case: Case, hold: StopLimits, fault: StopLimits) -> bytes:
    """The image with a stop table found for its own curve."""
    count = case.feed.piece_count
    search = StopSearch(NativeProgram(case.image()))
    none, nothing = np.zeros((count, 3), np.uint8), np.zeros(count, np.bool_)
    own = search.codes(hold, none, nothing)
    codes = np.stack([own, search.codes(fault, none, nothing, SearchHints(before=own))], axis=1)
    feed = replace(case.feed, stops=replace(no_stops(count), codes=codes))
    program = NativeProgram(image(case.segments, feed))
    (hold_us, hold_um), (fault_us, fault_um) = (stop_bounds(program, kind) for kind in (0, 1))
    stops = Stops(
        codes,
        np.stack((hold_us, fault_us), axis=1),
        (int(hold_us.max()), int(fault_us.max())),
        (int(hold_um.max()), int(fault_um.max())),
    )
    return image(case.segments, replace(feed, stops=stops))


def test_stops_of_a_spatial_program_keep_the_limits_of_all_axes(
    six: Case, peaks: np.ndarray
) -> None:
    """Random holds, stops and fault stops, beside limits that the search of the numbers was given."""
    velocity, acceleration, jerk = (tuple(1.15 * row) for row in peaks)
    hold = StopLimits(
        acceleration=2000.0,
        jerk=50000.0,
        axis_velocity=velocity,
        axis_acceleration=acceleration,
        axis_jerk=jerk,
        rise_is_cut=True,
    )
    fault = replace(
        hold,
        acceleration=4000.0,
        jerk=150000.0,
        axis_acceleration=tuple(2 * a for a in acceleration),
        axis_jerk=tuple(2.5 * j for j in jerk),
        rise_is_cut=False,
    )
    program = NativeProgram(with_stops(six, hold, fault))
    assert program.check() is None
    found = run_trials(program, hold, fault, 400, seed=3)
    assert found.kept, found
    assert min(found.measured) > 50
    assert found.of_hold["jerk"] > 0.7
    assert found.of_fault["path_jerk"] > 0.8
    for axis in range(6):
        narrow = tuple(0.1 * j if k == axis else j for k, j in enumerate(jerk))
        assert not run_trials(program, replace(hold, axis_jerk=narrow), fault, 100, seed=3).kept


def test_what_a_spatial_program_uses_is_what_its_axes_do(
    six: Case, at_one: tuple[np.ndarray, np.ndarray]
) -> None:
    program = NativeProgram(six.image())
    used = StopSearch(program).used(StopLimits(acceleration=1.0, jerk=1.0))
    for found, rows in zip(
        (used.axis_velocity, used.axis_acceleration, used.axis_jerk), at_one[0], strict=True
    ):
        assert np.array(found) == pytest.approx(np.abs(rows).max(axis=0), rel=0.02)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", ["alpha_quintic", "space3", "space6"])
def test_the_memory_that_the_host_expects_is_what_the_core_takes(name: str, kernel: str) -> None:
    """A controller keeps the records of core/coefficients.h beside the image."""
    data = (PROGRAMS / f"{name}.hdgp").read_bytes()
    _, lib = library()
    program = NativeProgram(data)
    records = lib.coefficients_size(program.pointer, lib.kernel_find(kernel_code(kernel)))
    assert memory_bytes(data, RECORD_BYTES[kernel]) == len(data) + records
