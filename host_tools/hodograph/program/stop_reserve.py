# SPDX-License-Identifier: MIT
"""Where a plan has to leave more of its limits free, so that stops may begin soon enough;
docs/theory/toolpath-fitting.md section 8.

A plan that uses the limits of the axes fully, all along a winding path, leaves a brake nothing to begin with. Short
stretches with a reserve, some tenths of a second apart, cost little and bound the time that a stop waits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..feed import ReserveZone
from .image import Program
from .stops import DECELERATION, FAULT

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SPACING_SHARE = 0.5
"""Of the longest stop: time between two zones."""

_BEHIND_SHARE = 0.5
"""Of the longest stop: how far a zone goes on behind a stretch, for the way of the brake."""

_NEAR_SHARE = 0.3
"""Of the time between two zones: how far one may be moved to where numbers are known already."""


@dataclass(frozen=True)
class ReserveStep:
    """How zones are made: how long they last (inf: all of a stretch), and the share that they leave free."""

    time_s: float
    share: float


STEPS = (
    ReserveStep(0.03, 0.25),
    ReserveStep(0.06, 0.4),
    ReserveStep(inf, 0.2),
    ReserveStep(inf, 0.4),
)
"""One round after the other, where stops are late in places."""

EVERYWHERE = (0.16, 0.25, 0.4, 0.6)
"""Shares of all limits that are left free, one after the other, where this does not help."""

_MOST_LATE = 0.3

_TOO_LATE = 2.0
"""Times the longest stop: short zones do not help where a stop may take longer."""


def late_pieces(program: Program, stop_time_s: float) -> Flags:
    """Pieces (M,) from which a fault stop may take longer than `stop_time_s`."""
    return np.asarray(program.stops.bound_us[:, FAULT] * 1e-6 > stop_time_s)


def late_mostly(program: Program, stop_time_s: float) -> bool:
    """Whether they take so much of the time that zones would be nearly everywhere."""
    seconds = program.pieces.duration_q32_s.astype(np.float64)
    late = late_pieces(program, stop_time_s)
    return bool(seconds[late].sum() > _MOST_LATE * seconds.sum())


def useful_steps(
    program: Program, stop_time_s: float, steps: Sequence[ReserveStep | float]
) -> list[ReserveStep | float]:
    """Which of the remaining steps to try next, chosen by how late the stops are."""
    if late_mostly(program, stop_time_s):
        return [step for step in steps if isinstance(step, float)]
    if program.stops.worst(FAULT).time_s > _TOO_LATE * stop_time_s:
        return [step for step in steps if isinstance(step, float) or step.time_s == inf]
    return list(steps)


def reserve_zones(program: Program, stop_time_s: float, step: ReserveStep) -> list[ReserveZone]:
    """Zones in all stretches of a program from which a fault stop may take longer than `stop_time_s`."""
    seconds = np.ldexp(program.pieces.duration_q32_s.astype(np.float64), -32)
    t = np.concatenate((np.zeros(1), np.cumsum(seconds)))
    s = np.append(program.pieces.start_q40, program.length_q40).astype(np.float64) * 2.0**-40
    late = late_pieces(program, stop_time_s)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], late, [False])).astype(np.int8)))
    begin, end = t[edges[0::2]], t[edges[1::2]]
    if step.time_s < inf:
        known = 0.5 * (t[1:] + t[:-1])[program.stops.codes[:, FAULT, DECELERATION] > 0]
        spacing_s = _SPACING_SHARE * stop_time_s
        rows = [
            np.arange(last, first - 0.5 * spacing_s, -spacing_s)
            for first, last in zip(begin.tolist(), end.tolist(), strict=True)
        ]
        centre = _moved(np.concatenate(rows), known, _NEAR_SHARE * spacing_s)
        begin, end = centre - 0.5 * step.time_s, centre + 0.5 * step.time_s
    else:
        end = end + _BEHIND_SHARE * stop_time_s
    low, high = np.interp(begin, t, s).tolist(), np.interp(end, t, s).tolist()
    return [
        ReserveZone(*zone, step.share) for zone in zip(low, high, strict=True) if zone[0] < zone[1]
    ]


def _moved(centre: Real, known: Real, most_s: float) -> Real:
    """Times (n,), each replaced by the nearest of the known ones that is at most `most_s` away."""
    if not known.size:
        return centre
    at = np.clip(np.searchsorted(known, centre), 1, max(known.size - 1, 1))
    before, after = known[at - 1], known[np.minimum(at, known.size - 1)]
    nearest = np.where(np.abs(before - centre) <= np.abs(after - centre), before, after)
    return np.asarray(np.where(np.abs(nearest - centre) <= most_s, nearest, centre))
