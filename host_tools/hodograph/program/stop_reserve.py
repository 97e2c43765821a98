# SPDX-License-Identifier: MIT
"""Places at which a plan has to leave more of its limits free, so that stops may begin soon enough;
docs/theory/toolpath-fitting.md section 8. Used by late_stops.py and section_pipeline.

If a plan uses the axis limits fully all along a winding path, no brake may begin. Short stretches with a reserve, some
tenths of a second apart, cost little and bound the stop delay. The feed override may not use the reserve
(feed/override.py).

No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..feed import ReserveZone
from ..fixed_point import MM_PER_Q40
from .check_stops import WINDOW, WINDOW_TICKS, own_bounds
from .image import Program
from .stops import DECELERATION, FAULT

Real = NDArray[np.float64]

EVERYWHERE = (0.16, 0.25, 0.4, 0.6)
"""Shares of all limits that are left free, tried one after the other: everywhere in a plan that shows where stops may
begin, and around such places in the plan that is used.
"""

SPREADS = (1.0, 3.0)
"""Factor of the length of zones around places at which shorter ones were not enough."""

_BEFORE_S, _BEHIND_S = 0.03, 0.015
"""Time from the start of a zone to its place, and from there to its end, in the time of the lowered plan."""

_USED_SHARE = 0.96
"""Share of the longest stop for the wait for a place and the stop from there."""

_OWN_SHARE = 0.4
"""Share of that time: places that need no zone are used if they are this far from the next one."""

_SAME_S = 1e-4
"""Places that are this close count as one."""

_MOST_LATE = 0.3
"""Share of the time: if stops are late for more of it, the plan shows too few places where stops may begin."""


def late_too_often(program: Program, stop_time_s: float) -> bool:
    """Whether fault stops may take longer than `stop_time_s` for more than _MOST_LATE of the time."""
    return late_share(program, stop_time_s) > _MOST_LATE


def late_share(program: Program, stop_time_s: float, pieces: slice = slice(None)) -> float:
    """Share of the time of these pieces in which fault stops may take longer than `stop_time_s`."""
    seconds = program.pieces.duration_s[pieces]
    late = program.stops.late(FAULT, stop_time_s)[pieces]
    return float(seconds[late].sum()) / float(seconds.sum())


@dataclass(frozen=True, eq=False)
class StopPlaces:
    """Places of a program where a fault stop that has waited begins at once, in their order.

    begin_s, end_s    program times (n,): the first piece that has stop parameters, and the end of the last one that
                      the controller may choose then; both ascend
    begin_mm, end_mm  the same in arc length
    bound_s           longest stop from there
    """

    begin_s: Real
    end_s: Real
    begin_mm: Real
    end_mm: Real
    bound_s: Real


def stop_places(program: Program) -> StopPlaces:
    """Pieces that have stop parameters, and so have all that may be chosen in their place (check_stops.WINDOW)."""
    own_s, _, waits = own_bounds(program, FAULT)
    given = (program.stops.codes[:, FAULT, DECELERATION] > 0) & (waits == 0.0)
    time_s, place_mm = _piece_ends(program)
    count = own_s.size
    # Pieces that begin within the window after the end of the first one count.
    after_s = time_s[1:] + WINDOW_TICKS * program.period_us * 1e-6
    last = np.minimum(np.searchsorted(time_s[:-1], after_s), np.arange(count) + 1 + WINDOW)
    lacking = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(~given)))
    first = np.flatnonzero(lacking[last] == lacking[:-1])
    last = last[first]
    worst_s = np.array(
        [own_s[i:k].max() for i, k in zip(first.tolist(), last.tolist(), strict=True)]
    )
    return StopPlaces(time_s[first], time_s[last], place_mm[first], place_mm[last], worst_s)


def zones_at_places(
    program: Program, lowered: Program, stop_time_s: float, share: float, spread: float
) -> list[ReserveZone]:
    """Zones around places at which stops may begin in `lowered`, a program with all limits lower by `share`: one soon
    enough after each place of `program`. Places at which stops may begin in `program` need no zone. Empty, if there are
    no such places.
    """
    own, other = stop_places(program), stop_places(lowered)
    own_time, own_place = _piece_ends(program)
    begin_s = np.interp(other.begin_mm, own_place, own_time)
    end_s = np.interp(other.end_mm, own_place, own_time)
    zones: list[ReserveZone] = []
    next_s, longest_s = float(own_time[-1]), _USED_SHARE * stop_time_s
    bound_s = 0.0
    while next_s > longest_s - bound_s:
        room_s = max(longest_s - bound_s, 0.0)
        k = int(np.searchsorted(own.end_s, next_s - room_s))
        if k < own.end_s.size and own.begin_s[k] < next_s - _OWN_SHARE * room_s:
            next_s, bound_s = float(own.begin_s[k]), float(own.bound_s[k])
            continue
        k = int(np.searchsorted(end_s, next_s - room_s))
        if k < end_s.size and begin_s[k] < next_s - _SAME_S:
            next_s, bound_s = float(begin_s[k]), float(other.bound_s[k])
            zones.append(_zone_around(lowered, other, k, share, spread))
            continue
        # Stops are late in any case: continue with the nearest place before.
        near = [
            (float(at_s[n - 1]), float(places.bound_s[n - 1]))
            for at_s, places in ((own.begin_s, own), (begin_s, other))
            if (n := int(np.searchsorted(at_s, next_s - _SAME_S))) > 0
        ]
        if not near:
            break
        next_s, bound_s = max(near)
    return zones


def _piece_ends(program: Program) -> tuple[Real, Real]:
    """Program times and arc lengths (M + 1,) of the ends of pieces."""
    seconds = program.pieces.duration_s
    ends = np.append(program.pieces.start_q40, program.length_q40).astype(np.float64) * MM_PER_Q40
    return np.concatenate((np.zeros(1), np.cumsum(seconds))), ends


def _zone_around(
    lowered: Program, places: StopPlaces, k: int, share: float, spread: float
) -> ReserveZone:
    time_s, place_mm = _piece_ends(lowered)
    ends_s = (places.begin_s[k] - spread * _BEFORE_S, places.end_s[k] + spread * _BEHIND_S)
    low_mm, high_mm = np.interp(ends_s, time_s, place_mm).tolist()
    return ReserveZone(low_mm, high_mm, share)
