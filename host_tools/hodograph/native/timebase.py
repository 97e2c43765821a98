# SPDX-License-Identifier: MIT
"""The controller's program time under hold, resume, override and stop (core/timebase.h)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from .library import library
from .program import NativeProgram


class State(IntEnum):
    """What the rate of program time is doing: enum timebase_state."""

    RUNNING = 0
    STOPPING = 1
    STOPPED = 2
    ENDED = 3
    HOLDING = 4
    HELD = 5


@dataclass(frozen=True)
class Step:
    """A tick: program time, the rate lambda, and its slope per second."""

    time_s: float
    rate: float
    slope_per_s: float


class Timebase:
    """Program time of one program, from its start, tick by tick. Commands take effect from the next step."""

    def __init__(self, program: NativeProgram) -> None:
        """Raises InputError: a program that does not pass the controller's check."""
        ffi, self._lib = library()
        program.require()
        self._program = program  # keeps the image alive
        self._period_s = 1e-6 * program.period_us
        self._timebase = ffi.new("struct timebase *")
        self._lib.timebase_begin(self._timebase, program.pointer, program.period_us)

    def step(self) -> Step:
        """The next tick."""
        time = self._lib.timebase_step_q42(self._timebase)
        now = self._timebase.now
        return Step(
            time * 2.0**-42, now.rate_q57 * 2.0**-57, now.slope_q56 * 2.0**-56 / self._period_s
        )

    @property
    def state(self) -> State:
        """After the last step."""
        return State(self._lib.timebase_state(self._timebase))

    def hold(self) -> None:
        """To rest, until resumed."""
        self._lib.timebase_hold(self._timebase)

    def resume(self) -> None:
        """Back to the override."""
        self._lib.timebase_resume(self._timebase)

    def override(self, percent: int) -> None:
        """The rate wanted, 0 to 200."""
        self._lib.timebase_override(self._timebase, percent)

    def stop(self) -> None:
        """To rest, for good."""
        self._lib.timebase_stop(self._timebase)
