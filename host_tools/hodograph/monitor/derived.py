# SPDX-License-Identifier: MIT
"""From samples to what the plots show.

Feed, tangential acceleration and jerk are those of the setpoints: derivatives of the way along them, by a
polynomial fitted to a window of some 21 ms around each tick (Savitzky and Golay), since third differences of counts
of 1 nm would be noise of 4000 mm/s^3; the fit leaves some 2 mm/s^3 of it. A setpoint k is compared with what the drives
report for SYNC k+2 (docs/reference/protocol.md section 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .decoder import Floats, Samples
from .path import ProgramPath

REACHED_AFTER = 2
_HALF_WINDOW_S = 0.010
_LEAST_HALF = 3
_ORDER = 4
_LONGEST_GAP = 1000
"""Lost SYNCs that are filled with NaN; after more the filters begin anew."""


@dataclass(frozen=True, eq=False)
class Rows:
    """One row a tick: time since the first SYNC, positions in mm, and figures in the units of their names."""

    t_s: Floats
    cmd_mm: Floats  # (n, axes)
    act_mm: Floats
    feed_mm_s: Floats
    acceleration_mm_s2: Floats
    jerk_mm_s3: Floats
    contour_um: Floats  # NaN off the program's path
    following_um: Floats  # (n, axes)

    @property
    def count(self) -> int:
        """Number of ticks."""
        return int(self.t_s.size)


def derivative_weights(half: int, order: int, derivative: int) -> Floats:
    """Weights of 2 half + 1 equidistant values for the derivative in the middle, per step."""
    steps = np.arange(-half, half + 1)
    fit = np.linalg.pinv(np.vander(steps, order + 1, increasing=True).astype(float))
    return np.asarray(math.factorial(derivative) * fit[derivative])


class Derivation:
    """Keeps the rows that later ticks are still needed for between two calls of `feed`."""

    def __init__(self, axes: int, counts_per_mm: int, period_us: int) -> None:
        self._counts_per_mm = counts_per_mm
        self._dt_s = period_us / 1e6
        self._half = max(_LEAST_HALF, round(_HALF_WINDOW_S / self._dt_s))
        self._weights = [derivative_weights(self._half, _ORDER, d) for d in (1, 2, 3)]
        self._axes = axes
        self._sync: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self._targets: Floats = np.empty((0, axes))
        self._actual: Floats = np.empty((0, axes))

    def feed(self, samples: Samples, path: ProgramPath | None) -> Rows:
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

    def _rows(self, first: int, last: int, path: ProgramPath | None) -> Rows:
        targets = self._targets[first:last]
        actual = self._actual[first + REACHED_AFTER : last + REACHED_AFTER]
        contour = np.full(last - first, np.nan)
        if path is not None and last > first and self._axes >= 2:
            contour = path.contour_errors_um(targets[:, :2], actual[:, :2])
        feed, acceleration, jerk = self._motion(first, last)
        return Rows(
            t_s=np.asarray(self._sync[first:last] * self._dt_s, dtype=np.float64),
            cmd_mm=targets / self._counts_per_mm,
            act_mm=actual / self._counts_per_mm,
            feed_mm_s=feed,
            acceleration_mm_s2=acceleration,
            jerk_mm_s3=jerk,
            contour_um=contour,
            following_um=(targets - actual) * (1000.0 / self._counts_per_mm),
        )

    def _motion(self, first: int, last: int) -> tuple[Floats, Floats, Floats]:
        """Derivatives of the way along the setpoints, of the ticks from `first` to before `last`."""
        none = np.empty(0)
        if last <= first:
            return none, none, none
        window = self._targets[first - self._half : last + self._half, :2] / self._counts_per_mm
        chords = np.hypot.reduce(np.diff(window, axis=0), axis=1)
        missing = np.isnan(chords)
        way = _windows(np.nancumsum(chords), self._half)
        centred = way - way[:, [self._half]]
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
