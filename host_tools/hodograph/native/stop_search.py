# SPDX-License-Identifier: MIT
"""Searches the stop parameters of feed pieces: the jerk of onset, the deceleration and the jerk of release of a path
stop (docs/theory/feed.md section 7). Used by program/stop_planning and native/stop_trial. No I/O; the search is in C
(sim/offline/stop_search.h).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import zip_longest
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .library import library
from .program import AXES, NativeProgram

FREE: tuple[float, ...] = (inf, inf)
"""No limit of the first two axes."""


@dataclass(frozen=True)
class StopLimits:
    """The limits that a path stop keeps; inf: no limit. mm and s. A limit of axes has one number for each path axis. A
    missing number means no limit.

    feed, acceleration, jerk   along the path; stop parameters never exceed the last two
    centripetal                acceleration across the path
    axis_…                     velocity, acceleration and jerk of each axis
    reach                      limit of |velocity + time_constant * acceleration| of each axis, mm/s
    zones                      (from_mm, to_mm, feed_mm_s) each
    reach_at_rate_1            `reach` applies at a feed override of 100 % only
    rise_is_cut                a stop that is requested while the override rises begins only when the rise adds at most
                               a quarter of the deceleration of the stop to the acceleration along the path
    quick                      few stop parameters are tried: for long programs
    """

    feed: float = inf
    acceleration: float = inf
    jerk: float = inf
    centripetal: float = inf
    axis_velocity: tuple[float, ...] = FREE
    axis_acceleration: tuple[float, ...] = FREE
    axis_jerk: tuple[float, ...] = FREE
    reach: tuple[float, ...] = FREE
    time_constant: tuple[float, ...] = (0.0, 0.0)
    zones: tuple[tuple[float, float, float], ...] = ()
    reach_at_rate_1: bool = False
    rise_is_cut: bool = False
    quick: bool = False

    def raised(self, used: StopLimits) -> StopLimits:
        """The greater of each limit and the program's usage of it, with the margin of the search. Caps, constants, and
        the limits that numbers never exceed stay.
        """

        def greater(limit: Any, use: Any) -> Any:
            if isinstance(limit, tuple):
                return tuple(greater(*pair) for pair in zip_longest(limit, use, fillvalue=inf))
            return max(limit, use * _MARGIN)

        values = {name: greater(getattr(self, name), getattr(used, name)) for name in _RAISED}
        return replace(self, **values)


_RAISED = ("feed", "centripetal", "axis_velocity", "axis_acceleration", "axis_jerk", "reach")
"""Limits that are raised to what the program uses."""
_MARGIN = 1.0 / (1.0 - 0.003) + 1e-6
"""Undoes STOP_MARGIN of offline/stop_limits.h, so that the used values themselves are allowed."""


@dataclass(frozen=True, eq=False)
class SearchHints:
    """Codes that a search of each piece has to fit, keeps, or tries first.

    before  codes (M, 3) of a path stop out of which another may begin, 0: none
    kept    pieces (M,) whose codes keep the limits but for that; they stay if they keep them out of it too
    start   codes (M, 3) that the search tries first, 0: those of the next piece
    """

    before: NDArray[np.uint8] | None = None
    kept: NDArray[np.bool_] | None = None
    start: NDArray[np.uint8] | None = None


NO_HINTS = SearchHints()


class StopSearch:
    """A program whose stops are looked for; it has passed `program_open`, its stop table is not read."""

    def __init__(self, program: NativeProgram) -> None:
        self._program = program
        self._count = int(program.pointer.header.piece_count)

    def used(self, limits: StopLimits) -> StopLimits:
        """The program's own usage at an override of 1: the greatest value of each limited quantity."""
        ffi, lib = library()
        given = limits_struct(limits)
        found = ffi.new("struct stop_limits *")
        path = self._path(given)
        lib.stop_used(self._program.pointer, given[0], path[0], found)
        values: dict[str, Any] = {}
        for name in _RAISED:
            value = getattr(found, name)
            axes = self._program.axis_count
            values[name] = (
                float(value) if isinstance(value, float) else tuple(value[k] for k in range(axes))
            )
        return StopLimits(**values)

    def codes(
        self,
        limits: StopLimits,
        given: NDArray[np.uint8],
        known: NDArray[np.bool_],
        hints: SearchHints = NO_HINTS,
    ) -> NDArray[np.uint8]:
        """Codes (M, 3): `given` where they are `known` (M,), found elsewhere."""
        found = self._found(limits, given, known, hints)
        return np.array([tuple(one.codes) for one in found], dtype=np.uint8).reshape(-1, 3)

    def mean_s(self, limits: StopLimits, codes: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Mean time to rest (M,) of stops from the instants of each piece at an override of 1, with these codes (M,
        3).
        """
        found = self._found(limits, codes, np.ones(self._count, dtype=np.bool_), NO_HINTS)
        return np.array([one.mean_s for one in found])

    def _found(
        self,
        limits: StopLimits,
        given: NDArray[np.uint8],
        known: NDArray[np.bool_],
        hints: SearchHints,
    ) -> Any:
        """struct stop_found of each piece."""
        ffi, lib = library()
        own = limits_struct(limits)
        found = ffi.new("struct stop_found[]", self._count)
        for one, codes, is_known in zip(found, given.tolist(), known.tolist(), strict=True):
            one.known, one.codes = is_known, codes
        if hints.before is not None:
            for one, codes in zip(found, hints.before.tolist(), strict=True):
                one.before = codes
        if hints.start is not None:
            for one, codes in zip(found, hints.start.tolist(), strict=True):
                one.start = codes
        if hints.kept is not None:
            for one, is_kept in zip(found, hints.kept.tolist(), strict=True):
                one.kept = is_kept
        path = self._path(own)
        lib.stop_search(self._program.pointer, own[0], path[0], found)
        return found

    def _path(self, given: tuple[Any, Any]) -> tuple[Any, tuple[Any, ...]]:
        """The struct stop_path and what it points to, which must be kept as long."""
        ffi, lib = library()
        count = self._program.segment_count * lib.STOP_ROWS
        rows = ffi.new("struct stop_row[]", count)
        bends = ffi.new("struct stop_bend[]", count if self._program.axis_count > 2 else 0)
        groups = ffi.new("struct stop_stretch[]", lib.stop_groups(self._program.segment_count))
        path = ffi.new("struct stop_path *", (rows, bends, groups))
        lib.stop_rows(self._program.pointer, given[0], path)
        return path, (rows, bends, groups)


def limits_struct(limits: StopLimits) -> tuple[Any, Any]:
    """The struct stop_limits and what it points to, which must be kept as long."""
    ffi, _ = library()
    zones = ffi.new("struct stop_feed_zone[]", [tuple(cap) for cap in limits.zones])
    own = ffi.new("struct stop_limits *")
    for one in fields(limits):
        value = getattr(limits, one.name)
        if one.name == "zones":
            continue
        if isinstance(value, tuple):
            free = 0.0 if one.name == "time_constant" else inf
            value = (*value, *[free] * (AXES - len(value)))
        setattr(own, one.name, value)
    own.zones, own.zone_count = zones, len(limits.zones)
    return own, zones
