# SPDX-License-Identifier: MIT
"""The controller's motion under hold, resume, override, stop and fault stop (core/feed_override.h). Used by
native/stream and stream/simulation. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from ..fixed_point import MM_PER_Q40
from .library import library
from .program import NativeProgram


class State(IntEnum):
    """The commanded motion, and whether it is reached: enum feed_state."""

    RUNNING = 0
    STOPPING = 1
    STOPPED = 2
    ENDED = 3
    HOLDING = 4
    HELD = 5


@dataclass(frozen=True)
class PlanStep:
    """The origin of a setpoint of the plan: program time, override (1: 100 %), override rate per second."""

    time_s: float
    override: float
    slope_per_s: float


@dataclass(frozen=True)
class Step:
    """A tick: arc length of the setpoint (mm), position of each path axis (mm, or degrees), feed along the path (mm/s),
    override (1: 100 %).
    """

    arc_mm: float
    position: tuple[float, ...]
    feed_mm_s: float
    override: float


class FeedCommands:
    """Queries and commands of a motion: a struct feed_override. Commands act from the next tick."""

    _lib: Any
    _feed: Any

    @property
    def state(self) -> State:
        """The state after the last tick."""
        return State(self._lib.feed_override_state(self._feed))

    @property
    def late(self) -> bool:
        """Whether a stop has taken longer than its bound and a fifth."""
        return bool(self._lib.feed_override_late(self._feed))

    @property
    def time_s(self) -> float:
        """Program time of the last tick (of a job: in the executed chunk); in a path stop that of its start."""
        return float(self._lib.feed_override_time_q42(self._feed)) * 2.0**-42

    def hold(self) -> None:
        """Feed hold: to rest, until resumed."""
        self._lib.feed_override_hold(self._feed)

    def resume(self) -> None:
        """Resumes, up to the commanded override."""
        self._lib.feed_override_resume(self._feed)

    def override(self, percent: int) -> None:
        """Commands an override in percent, 0 to 200; before the last chunk of a job above 100 counts as 100."""
        self._lib.feed_override_set(self._feed, percent)

    def stop(self) -> None:
        """Controlled stop: to rest inside the program's limits; the program ends."""
        self._lib.feed_override_stop(self._feed)

    def fault_stop(self) -> None:
        """Fault stop: to rest inside the machine's limits; the program ends."""
        self._lib.feed_override_fault_stop(self._feed)


class FeedOverride(FeedCommands):
    """One program from its start, tick by tick. Commands take effect from the next step."""

    def __init__(self, program: NativeProgram, kernel: str = "fixed") -> None:
        """Raises InputError: the program does not pass the controller's check, or there is no such kernel."""
        ffi, self._lib = library()
        self._program = program  # keeps the image alive
        self._axes = program.axis_count
        self._period_s = 1e-6 * program.period_us
        self._interp = ffi.new("struct interpolator *")
        self._point = ffi.new("struct interpolator_point *")
        self._feed = ffi.new("struct feed_override *")
        precomputed = program.precomputed(kernel)
        self._lib.interpolator_begin(self._interp, precomputed)
        self._lib.feed_override_begin(self._feed, precomputed, program.period_us, 0)

    def step(self) -> Step:
        """The next tick."""
        self._lib.feed_override_next(self._feed, self._interp, self._point)
        own = self._point
        return Step(
            own.arc_length_q40_mm * MM_PER_Q40,
            tuple(own.position_q40[axis] * MM_PER_Q40 for axis in range(self._axes)),
            self._lib.feed_override_feed_q32(self._feed) * 2.0**-32,
            self._lib.feed_override_actual_q30(self._feed) * 2.0**-30,
        )

    @property
    def plan(self) -> PlanStep | None:
        """The origin of the setpoint of the last step; None: in a path stop, or at standstill."""
        if self._feed.phase != 0:
            return None
        now = self._feed.plan.now
        slope_per_s = now.slope_q56 * 2.0**-56 / self._period_s
        return PlanStep(self.time_s, now.override_q57 * 2.0**-57, slope_per_s)
