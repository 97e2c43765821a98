# SPDX-License-Identifier: MIT
"""Worst-case response times on CAN: fixed priorities, no preemption; docs/reference/bus-time.md section 2. Used by
bustime/model. No I/O.

R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien, "Controller Area Network (CAN) schedulability analysis: refuted,
revisited and revised", Real-Time Systems 35 (2007), equations 7 to 13. All times are integers of one unit of the
caller's choice, so that the ceilings are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Task:
    """A frame: time on the wire, period, and the jitter of its release."""

    length: int
    period: int
    jitter: int


def response_time(task: Task, urgent: Sequence[Task], blocking: int, bit: int) -> int | None:
    """From the event that releases `task` to the end of its frame, at worst; None: there is no bound.

    Releases keep their order: no jitter is longer than its period.

    urgent    all frames of higher priority
    blocking  the longest frame of lower priority, which may have begun just before
    bit       one bit time
    """
    if sum(_share(t) for t in (task, *urgent)) >= 1:
        return None
    busy = _fixed_point(blocking, 0, (task, *urgent), task.length)
    worst = 0
    for instance in range(_ceil(busy + task.jitter, task.period)):
        own = blocking + instance * task.length
        wait = _fixed_point(own, bit, urgent, own)
        worst = max(worst, task.jitter + wait - instance * task.period + task.length)
    return worst


def _fixed_point(constant: int, ahead: int, tasks: Sequence[Task], start: int) -> int:
    """The least t with t = constant + the time of the frames that `tasks` release within t + ahead."""
    now, following = -1, start
    while following != now:
        now = following
        following = constant + sum(
            _ceil(now + t.jitter + ahead, t.period) * t.length for t in tasks
        )
    return now


def _share(task: Task) -> float:
    return task.length / task.period


def _ceil(value: int, unit: int) -> int:
    return -(-value // unit)
