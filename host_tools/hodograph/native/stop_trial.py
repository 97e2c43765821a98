# SPDX-License-Identifier: MIT
"""Runs random sequences of commands that end in a stop, and compares them with limits and bounds
(sim/offline/stop_trial.h). Used by tests only. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from .library import library
from .program import NativeProgram
from .stop_search import StopLimits, limits_struct


@dataclass(frozen=True)
class StopTrials:
    """The results of trials: struct stop_trial. Greatest limit usage by quantity, and greatest share of the bound by
    kind (hold, fault).

    most, longest, failed  seed and first tick of the trials with the greatest share of a limit, of a bound, and of the
                           last that failed
    """

    of_hold: dict[str, float]
    of_fault: dict[str, float]
    of_bound: tuple[float, float]
    longest_s: tuple[float, float]
    measured: tuple[int, int]
    late: int
    failures: int
    most: tuple[int, int]
    longest: tuple[int, int]
    failed: tuple[int, int]

    @property
    def kept(self) -> bool:
        """Whether no limit and no bound was exceeded, no stop was late, and none failed."""
        return self.within(0.0)

    def within(self, share: float) -> bool:
        """As `kept`, but limits may be exceeded by this share."""
        uses = max(*self.of_hold.values(), *self.of_fault.values())
        return (
            uses <= 1.0 + share
            and max(self.of_bound) <= 1.0
            and not self.late
            and not self.failures
        )


def run_trials(
    program: NativeProgram,
    hold: StopLimits,
    fault: StopLimits,
    trials: int,
    *,
    seed: int = 0,
    tick: int | None = None,
    kernel: str = "fixed",
) -> StopTrials:
    """Runs trials at instants spread over the program; with `tick` only the one with this seed and first tick.

    Raises InputError: a program that is refused, no such kernel.
    """
    ffi, lib = library()
    precomputed = program.precomputed(kernel)
    trial = ffi.new("struct stop_trial *")
    trial.seed, trial.trials = seed, trials
    own = [limits_struct(limits) for limits in (hold, fault)]
    trial.hold, trial.fault = own[0][0][0], own[1][0][0]
    if tick is None:
        error = lib.stop_trial_run(precomputed, trial)
    else:
        error = lib.stop_trial_again(precomputed, trial, tick)
    if error != 0:
        raise InputError("stop trials: the interpolator refused the program")
    names = ("velocity", "acceleration", "jerk", "path_acceleration", "path_jerk")
    return StopTrials(
        {name: getattr(trial.of_hold, name) for name in names},
        {name: getattr(trial.of_fault, name) for name in names},
        (trial.of_bound[0], trial.of_bound[1]),
        (trial.longest_s[0], trial.longest_s[1]),
        (trial.measured[0], trial.measured[1]),
        trial.late,
        trial.failures,
        *((case.seed, case.tick) for case in (trial.most, trial.longest, trial.failed)),
    )
