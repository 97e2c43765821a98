# SPDX-License-Identifier: MIT
"""The figures of the plots, from samples and the curve of the program (sim/offline/contour, docs/theory/numerics.md).

Feed, tangential acceleration and jerk are those of the setpoints: derivatives of the distance along them, by a
polynomial fitted to a window of some 21 ms around each tick (Savitzky and Golay), since third differences of counts of
1 nm would have noise of 4000 mm/s^3; after the fit it is about 2 mm/s^3. A setpoint k is compared with the reports of
the drives for SYNC k+2 (docs/reference/protocol.md section 2).

Used by monitor/ and cli/monitor_command. No I/O.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..config import SPACE_AXES
from ..errors import InputError
from ..fixed_point import MM_PER_Q40, to_q40
from ..native import Contour, NativeProgram
from .decoder import Floats, Samples

DRAWN_POINTS = 3000
"""Greatest number of points of a drawn path."""
_TABLE_POINTS = 20000
"""Greatest number of ticks at which arc lengths are tabulated."""
_ON_PATH_UM = 1.0
"""Greatest distance of setpoints from the curve, which are rounded to counts; beyond it they belong to another
motion.
"""


class ProgramPath:
    """Computes the arc length of each setpoint along the curve.

    The arc length is not on the bus. It is the distance along the setpoints, corrected by the projection on the curve.
    After setpoints that are not on the curve, for example in a move to the start, the place is searched again. Raises
    InputError for an image that is not a program.
    """

    def __init__(self, image: bytes, counts_per_mm: int) -> None:
        program = NativeProgram(image)
        if program.first_axis:
            raise InputError("the program moves rotary axes alone: there is no path to draw")
        self._contour = Contour(program)
        self._counts_per_mm = counts_per_mm
        self.crc32 = zlib.crc32(image[16:])
        self.period_us = program.period_us
        self.name = image[80:112].rstrip(b"\0").decode("utf-8", "replace")
        self.events = program.events
        """Outputs that switch on the path."""
        self.length_mm = int(program.pointer.header.length_q40_mm) * MM_PER_Q40
        self.duration_s = program.duration_q32_s / 2**32
        self._arc_mm, places = _table(program)
        self._points_mm, self._extra = places[:, :SPACE_AXES], places[:, SPACE_AXES:]
        self._tangents = _tangents(self._arc_mm, self._points_mm)
        self.axes = self._points_mm.shape[1]
        """Number of axes that draw the curve: 2 in the plane, 3 in space."""
        self._last_mm: float | None = None
        self._last_counts: Floats | None = None

    def drawing(self) -> Floats:
        """Points of the curve in mm, (n, 2) or in space (n, 3), at equal distances, the last one included."""
        arcs = np.linspace(0.0, self.length_mm, min(DRAWN_POINTS, self._arc_mm.size))
        return self._at(arcs, self._points_mm)

    def points_mm(self, arc_mm: Floats) -> Floats:
        """Points (n, 2) or (n, 3) of the curve at arc lengths (n,)."""
        return self._at(arc_mm, self._points_mm)

    def extra_drawing(self) -> tuple[Floats, Floats]:
        """Arc lengths (n,) in mm and the axes after x, y, z there (n, A - 3), in mm or degrees."""
        arcs = np.linspace(0.0, self.length_mm, min(DRAWN_POINTS, self._arc_mm.size))
        extra = self._at(arcs, self._extra) if self._extra.shape[1] else np.zeros((arcs.size, 0))
        return arcs, extra

    def contour_errors_um(self, targets: Floats, actual: Floats) -> tuple[Floats, Floats]:
        """Distances of positions (n, A) from the curve, in um, near their setpoints (n, A), all in counts; and the arc
        lengths of the setpoints, in mm. A is at least `axes`; later axes are not used.

        NaN: the setpoint is not on the curve, or a frame is missing.
        """
        errors, places = (np.full(targets.shape[0], np.nan) for _ in range(2))
        if targets.shape[1] < self.axes:
            return errors, places
        targets, actual = targets[:, : self.axes], actual[:, : self.axes]
        there = np.flatnonzero(np.isfinite(targets).all(axis=1) & np.isfinite(actual).all(axis=1))
        if there.size == 0:
            return errors, places
        set_counts, act_counts = targets[there], actual[there]
        arcs, on_path = self._follow(set_counts)
        self._last_counts = set_counts[-1]
        self._last_mm = float(arcs[-1]) if on_path[-1] else None
        found = self._errors(arcs, act_counts)
        found[~on_path] = np.nan
        errors[there], places[there] = found, np.where(on_path, arcs, np.nan)
        return errors, places

    @property
    def arc_length_mm(self) -> float | None:
        """Arc length of the last setpoint; None: it was not on the path."""
        return self._last_mm

    def _follow(self, counts: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Arc lengths of setpoints, and whether they are on the curve."""
        if self._last_mm is not None and self._last_counts is not None:
            distance = self._distance(np.vstack([self._last_counts, counts]))[1:]
            arcs, on_path = self._refine(self._last_mm + distance, counts)
            if on_path.all():
                return arcs, on_path
        else:
            arcs, on_path = np.zeros(len(counts)), np.zeros(len(counts), dtype=bool)
        for here in (len(counts) - 1, 0):
            distance = self._distance(counts)
            again, good = self._refine(
                self._nearest(counts[here]) + distance - distance[here], counts
            )
            better = good & ~on_path
            arcs[better], on_path[better] = again[better], True
        return arcs, on_path

    def _distance(self, counts: Floats) -> Floats:
        steps = np.hypot.reduce(np.diff(counts, axis=0), axis=1) / self._counts_per_mm
        return np.concatenate([[0.0], np.cumsum(steps)])

    def _refine(self, arcs: Floats, counts: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        points = counts / self._counts_per_mm
        arcs = np.clip(arcs, 0.0, self.length_mm)
        for _ in range(3):
            tangents = self._at(arcs, self._tangents)
            away = points - self._at(arcs, self._points_mm)
            arcs = np.clip(arcs + np.sum(away * tangents, axis=1), 0.0, self.length_mm)
        return arcs, self._errors(arcs, counts) < _ON_PATH_UM

    def _nearest(self, counts: Floats) -> float:
        away = self._points_mm - counts / self._counts_per_mm
        return float(self._arc_mm[np.argmin(np.sum(away * away, axis=1))])

    def _errors(self, arcs: Floats, counts: Floats) -> Floats:
        arcs_q40 = to_q40(arcs)
        return self._contour.errors_um(
            arcs_q40, np.rint(counts).astype(np.int32), self._counts_per_mm
        )

    def _at(self, arcs: Floats, table: Floats) -> Floats:
        return np.stack([np.interp(arcs, self._arc_mm, column) for column in table.T], axis=1)


def _table(program: NativeProgram) -> tuple[Floats, Floats]:
    """Rising arc lengths, and all path axes of a program, at equal steps of time."""
    count = min(program.ticks, _TABLE_POINTS)
    end_q42 = program.duration_q32_s << 10
    times = np.array([end_q42 * i // (count - 1) for i in range(count)], dtype=np.uint64)
    points = program.points("double", times)
    arcs = points["arc_length_q40_mm"] * MM_PER_Q40
    fresh = np.concatenate([[True], np.diff(arcs) > 0])
    places = points["position_q40"][:, : program.axis_count] * MM_PER_Q40
    return np.asarray(arcs[fresh]), np.asarray(places[fresh])


def _tangents(arcs: Floats, points: Floats) -> Floats:
    steps = np.gradient(points, arcs, axis=0)
    return np.asarray(steps / np.maximum(np.hypot.reduce(steps, axis=1), 1e-12)[:, None])


class FollowedPath(Protocol):
    """A path on which setpoints are located."""

    def contour_errors_um(self, targets: Floats, actual: Floats) -> tuple[Floats, Floats]:
        """See ProgramPath."""
        ...


REACHED_AFTER = 2
"""Ticks until an axis has reached a setpoint, without the lag of its drive."""
_HALF_WINDOW_S = 0.010
"""Half of the time over which derivatives are fitted."""
_LEAST_HALF = 3
"""Least number of ticks of that half."""
_ORDER = 4
"""Degree of the fitted polynomial."""
_LONGEST_GAP = 1000
"""Most lost SYNCs that are filled with NaN; after more the filters restart."""


@dataclass(frozen=True, eq=False)
class Rows:
    """One row for each tick: time since the first SYNC, positions in mm, and figures in the units of their names.

    A rotary axis has degrees for mm, and thousandths of a degree for um.
    """

    t_s: Floats
    cmd_mm: Floats  # (n, axes)
    act_mm: Floats
    feed_mm_s: Floats
    acceleration_mm_s2: Floats
    jerk_mm_s3: Floats
    contour_um: Floats  # NaN off the program's path
    following_um: Floats  # (n, axes)
    arc_mm: Floats  # of the setpoint, NaN off the program's path

    @property
    def count(self) -> int:
        """Number of ticks."""
        return int(self.t_s.size)


def derivative_weights(half: int, order: int, derivative: int) -> Floats:
    """Weights of 2 half + 1 equidistant values for the derivative at the middle one, per step."""
    steps = np.arange(-half, half + 1)
    fit = np.linalg.pinv(np.vander(steps, order + 1, increasing=True).astype(float))
    return np.asarray(math.factorial(derivative) * fit[derivative])


class Derivation:
    """Derives rows from samples; between two calls of `feed` it keeps rows that still need later ticks."""

    def __init__(self, counts_per_unit: Sequence[int], drawn: int, period_us: int) -> None:
        """`counts_per_unit`: of a mm or a degree, by axis; `drawn`: how many of the axes draw the path."""
        axes = len(counts_per_unit)
        self._counts_per_unit = np.asarray(counts_per_unit, dtype=np.float64)
        self._drawn = min(drawn, axes)
        self._dt_s = period_us / 1e6
        self._half = max(_LEAST_HALF, round(_HALF_WINDOW_S / self._dt_s))
        self._weights = [derivative_weights(self._half, _ORDER, d) for d in (1, 2, 3)]
        self._axes = axes
        self._sync: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self._targets: Floats = np.empty((0, axes))
        self._actual: Floats = np.empty((0, axes))

    def feed(self, samples: Samples, path: FollowedPath | None) -> Rows:
        """The rows that are complete with these samples."""
        self._append(samples)
        first, last = self._half, self._sync.size - max(self._half, REACHED_AFTER)
        if last <= first:
            return self._rows(0, 0, None)
        rows = self._rows(first, last, path)
        self._forget(last - self._half)
        return rows

    def _forget(self, count: int) -> None:
        self._sync = self._sync[count:]
        self._targets, self._actual = self._targets[count:], self._actual[count:]

    def _append(self, samples: Samples) -> None:
        if samples.count == 0:
            return
        if self._sync.size and samples.sync[0] - self._sync[-1] > _LONGEST_GAP:
            self._forget(self._sync.size)
        first = self._sync[-1] + 1 if self._sync.size else samples.sync[0]
        if samples.sync[-1] - first >= samples.count + _LONGEST_GAP:
            first = samples.sync[-1] - samples.count - _LONGEST_GAP
        fresh = np.arange(first, samples.sync[-1] + 1)
        there = samples.sync >= first
        at = samples.sync[there] - first
        targets, actual = (np.full((fresh.size, self._axes), np.nan) for _ in range(2))
        targets[at], actual[at] = samples.targets[there], samples.actual[there]
        self._sync = np.concatenate([self._sync, fresh])
        self._targets = np.concatenate([self._targets, targets])
        self._actual = np.concatenate([self._actual, actual])

    def _rows(self, first: int, last: int, path: FollowedPath | None) -> Rows:
        targets = self._targets[first:last]
        actual = self._actual[first + REACHED_AFTER : last + REACHED_AFTER]
        contour, arc_mm = (np.full(last - first, np.nan) for _ in range(2))
        if path is not None and last > first:
            contour, arc_mm = path.contour_errors_um(targets, actual)
        feed, acceleration, jerk = self._motion(first, last)
        return Rows(
            t_s=np.asarray(self._sync[first:last] * self._dt_s, dtype=np.float64),
            cmd_mm=targets / self._counts_per_unit,
            act_mm=actual / self._counts_per_unit,
            feed_mm_s=feed,
            acceleration_mm_s2=acceleration,
            jerk_mm_s3=jerk,
            contour_um=contour,
            following_um=(targets - actual) * (1000.0 / self._counts_per_unit),
            arc_mm=arc_mm,
        )

    def _motion(self, first: int, last: int) -> tuple[Floats, Floats, Floats]:
        """Derivatives of the distance along the setpoints, of the ticks from `first` to before `last`."""
        none = np.empty(0)
        if last <= first:
            return none, none, none
        drawn = np.s_[first - self._half : last + self._half, : self._drawn]
        window = self._targets[drawn] / self._counts_per_unit[: self._drawn]
        chords = np.hypot.reduce(np.diff(window, axis=0), axis=1)
        missing = np.isnan(chords)
        distance = _windows(np.nancumsum(chords), self._half)
        centred = distance - distance[:, [self._half]]
        centred[np.ptp(_windows(np.cumsum(missing), self._half), axis=1) > 0] = np.nan
        feed, acceleration, jerk = (
            centred @ weights / self._dt_s**power
            for power, weights in enumerate(self._weights, start=1)
        )
        return feed, acceleration, jerk


def _windows(sums: NDArray[Any], half: int) -> Floats:
    """The sums from 0 on, as rows of 2 half + 1."""
    whole = np.concatenate([[0.0], sums])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(whole, 2 * half + 1))
