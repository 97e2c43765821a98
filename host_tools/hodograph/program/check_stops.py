# SPDX-License-Identifier: MIT
"""Rules of docs/reference/protocol.md 1.4: the longest time of a stop, and its bound in the table;
docs/theory/feed.md section 7.

Computed in floating point, without the rounding up of the controller's integers (firmware/core/stop_check.c). A bound
that the controller accepts is never below the one computed here, and at most about 20 us above it.

Used by check, stop_planning and stop_reserve. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..feed.override_levels import FULL, LEVEL_OVERRIDES, LEVELS
from ..feed.pieces import part_bounds
from ..fixed_point import MM_PER_Q40
from .codes import ProgramError
from .image import Program, ProgramLimits
from .stops import DECELERATION, FAULT, HOLD, JERK_DOWN, JERK_UP, numbers

Real = NDArray[np.float64]
Bool = NDArray[np.bool_]

STOP_TICKS = 9
"""Ticks of a stop that are not in the continuous curve."""
END_TICKS = 2
"""Ticks until a command takes effect, and until the end of the program is a setpoint."""
WINDOW_TICKS = 6
"""Periods of program time in which the piece whose stop parameters apply may still change,"""
WINDOW = 8
"""and the number of pieces that may begin in them."""
HALVINGS = 3
"""Each eighth of a piece is checked by itself."""
LITTLE = 0.25
"""Share of the deceleration that a rising override may add when the path stop of a hold begins."""
_ROUNDING = 1e-12
"""Share of a bound that rounding may change here."""
_MOST_US = 2.0**32 - 1.0
"""Greatest time of the format."""


def stop_fault(
    program: Program, limits: ProgramLimits | None, reserved: Bool | None = None
) -> tuple[ProgramError, int] | None:
    """The first rule broken, in the order of the controller: entries from the first piece on, then the bounds of
    holds and those of fault stops, each from the last piece on.
    """
    entries = list(_entry_faults(program, limits, reserved))
    if entries:
        index, _, code = min(entries)
        return code, index
    return _bound_fault(program, HOLD, 0) or _bound_fault(
        program, FAULT, 0 if limits is None else limits.stop_time_ms
    )


def _entry_faults(
    program: Program, limits: ProgramLimits | None, reserved: Bool | None
) -> Iterator[tuple[int, int, ProgramError]]:
    codes = program.stops.codes
    some, whole = (codes > 0).any(axis=2), (codes > 0).all(axis=2)
    broken = some != whole
    if reserved is not None:
        broken = broken | reserved[:, None]
    above = np.zeros_like(broken)
    if limits is not None:
        own = numbers(codes)
        most = np.array([limits.jerk_mm_s3, limits.acceleration_um_s2 * 1e-3, limits.jerk_mm_s3])
        # The controller compares whole um/s^2, rounded down.
        own[..., DECELERATION] = np.floor(own[..., DECELERATION] * 1e3) / 1e3
        above = ((own > most * (1.0 + 1e-12)) & (most > 0.0)).any(axis=2) & whole
    for rank, (mask, code) in enumerate(
        ((broken, ProgramError.STOP_ENTRY), (above, ProgramError.STOP_NUMBERS))
    ):
        if mask.any():
            piece, kind = np.argwhere(mask)[0]
            yield int(piece), 2 * int(kind) + rank, code


def _bound_fault(program: Program, kind: int, most_ms: int) -> tuple[ProgramError, int] | None:
    least_us, least_um = bounds(program, kind)
    said = program.stops.bound_us[:, kind].astype(np.float64)
    brief = said < np.minimum(least_us, _MOST_US) * (1.0 - _ROUNDING)
    too_long = (said > most_ms * 1000.0) & (most_ms > 0)
    hits = np.flatnonzero(brief | too_long)
    if hits.size:
        index = int(hits[-1])
        return (ProgramError.STOP_BOUND if brief[index] else ProgramError.STOP_LONG), index
    worst_us, worst_um = program.stops.worst_us[kind], program.stops.worst_um[kind]
    if worst_us != int(said.max()) or worst_um < min(float(least_um.max()), _MOST_US) * (
        1.0 - _ROUNDING
    ):
        return ProgramError.STOP_WORST, 0
    return None


def bounds(program: Program, kind: int) -> tuple[Real, Real]:
    """Least allowed bounds (M,) of the time in us and of the distance in um, from the command to rest."""
    own_s, own_mm, waits = (one.tolist() for one in own_bounds(program, kind))
    duration = program.pieces.duration_s.tolist()
    start = np.append(program.pieces.start_q40, program.length_q40).astype(np.float64) * MM_PER_Q40
    distance = np.maximum(np.diff(start), 0.0).tolist()
    window_s = WINDOW_TICKS * program.period_us * 1e-6
    count = len(duration)
    out_s, out_mm = [0.0] * (count + 1), [0.0] * (count + 1)
    out_s[count] = END_TICKS * program.period_us * 1e-6
    for i in range(count - 1, -1, -1):
        if waits[i] > 0.0:
            own_s[i] = max(own_s[i], waits[i] * duration[i] + out_s[i + 1])
            own_mm[i] = max(own_mm[i], distance[i] + out_mm[i + 1])
        last, ahead = i + 1, 0.0
        while last < min(count, i + 1 + WINDOW) and ahead < window_s:
            ahead += duration[last]
            last += 1
        out_s[i], out_mm[i] = max(own_s[i:last]), max(own_mm[i:last])
    return np.array(out_s[:-1]) * 1e6, np.array(out_mm[:-1]) * 1e3


def own_bounds(program: Program, kind: int) -> tuple[Real, Real, Real]:
    """Time in s and distance in mm (M,) of a stop that brakes in the piece in which it was requested (0: none may); and
    the share of the piece, before its end, from which a stop may continue into the next piece.
    """
    pieces, codes = program.pieces, program.stops.codes[:, kind]
    period_s = program.period_us * 1e-6
    feed, acceleration = (
        part_bounds(pieces.duration_q32_s, pieces.c_q40, order, HALVINGS) for order in (1, 2)
    )
    given = codes[:, DECELERATION] > 0
    number = np.where(given[:, None], numbers(codes), 1.0)
    settled = _settled(program, feed.min(axis=2), acceleration.min(axis=2), number[:, JERK_UP])
    longest, last = _runs(~settled)
    wait_s = longest * pieces.duration_s
    speed = np.maximum(feed.max(axis=(1, 2)), 0.0)
    rising = np.maximum(acceleration.max(axis=(1, 2)), 0.0)
    time_s, distance_mm = np.zeros(speed.size), np.zeros(speed.size)
    for level in range(LEVELS):
        rate = (
            pieces.override_factor if level == FULL else np.full_like(speed, LEVEL_OVERRIDES[level])
        )
        second = pieces.override_second_per_s2(level)
        # It rises from 0 and falls to 0 again while the override changes by at most the level.
        steepest = np.minimum(pieces.override_rate_per_s(level), np.sqrt(rate * second))
        own_s, own_mm = _level(
            _Start(speed * rate, rising * rate**2, steepest * speed, steepest / second),
            number,
            kind,
            period_s,
        )
        time_s, distance_mm = np.maximum(time_s, own_s), np.maximum(distance_mm, own_mm)
    time_s, distance_mm = time_s + wait_s, distance_mm + speed * pieces.override_factor * wait_s
    return (
        np.where(given, time_s, 0.0),
        np.where(given, distance_mm, 0.0),
        np.where(given, last, 1.0),
    )


@dataclass(frozen=True, eq=False)
class _Start:
    """At the start of path stops (M,): greatest speed, acceleration at constant override, the part that a changing
    override adds, and the time in which this part decays.
    """

    speed: Real
    rising: Real
    slope: Real
    cut_s: Real


def _level(start: _Start, number: Real, kind: int, period_s: float) -> tuple[Real, Real]:
    """Time and distance (M,) of stops that begin in one override level, without the stop delay."""
    speed, rising, slope, cut_s = start.speed, start.rising, start.slope, start.cut_s
    more_s = np.full(speed.size, STOP_TICKS * period_s)
    if kind == HOLD:
        little = LITTLE * number[:, DECELERATION]
        more_s = np.where(slope > little, more_s + cut_s, more_s)
        cut_s = np.where(slope > little, cut_s * little / np.maximum(slope, 1e-300), cut_s)
        slope = np.minimum(slope, little)
    speed = speed + 0.5 * (rising + slope) * period_s
    lead_s, slope_s = rising / number[:, JERK_DOWN], slope / number[:, JERK_DOWN]
    # An override that still rises is below the greatest by its rise while its rate decays.
    peak = (
        speed + rising * (0.5 * lead_s + slope_s) + 0.5 * slope * np.maximum(slope_s - cut_s, 0.0)
    )
    time_s, distance_mm = _curve(peak, lead_s + slope_s, number)
    return time_s + more_s, distance_mm + speed * more_s


def _settled(program: Program, feed: Real, acceleration: Real, jerk_up: Real) -> Bool:
    """Whether a path stop may begin everywhere in each eighth (M, 8), with their lowest feed and acceleration."""
    factor = program.pieces.override_factor[:, None]
    falling = np.maximum(-acceleration, 0.0) * factor**2
    settle_s = 0.5 * falling / jerk_up[:, None] + 3e-6 * program.period_us
    return np.asarray((falling == 0.0) | (np.maximum(feed, 0.0) >= falling * settle_s))


def _runs(mask: Bool) -> tuple[Real, Real]:
    """Longest runs in each row, and those at the ends of the rows, as shares of the row."""
    run = np.zeros(mask.shape[0])
    longest = run
    for column in mask.T:
        run = np.where(column, run + 1.0, 0.0)
        longest = np.maximum(longest, run)
    return longest / mask.shape[1], run / mask.shape[1]


def _curve(peak: Real, lead_s: Real, number: Real) -> tuple[Real, Real]:
    """Time and distance of the S-curve to rest in continuous time, from the greatest speed `peak`, which is reached
    after `lead_s`.
    """
    down, most, up = number[:, JERK_DOWN], number[:, DECELERATION], number[:, JERK_UP]
    depth = np.minimum(np.sqrt(peak * 2.0 * down * up / (down + up)), most)
    first_s, last_s = depth / down, depth / up
    even_s = peak / np.maximum(depth, 1e-300)
    curve_s = even_s + 0.5 * (first_s + last_s)
    centre_s = lead_s + 0.5 * curve_s + np.maximum(first_s - last_s, 0.0) / 6.0
    return lead_s + curve_s, peak * centre_s
