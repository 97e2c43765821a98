# SPDX-License-Identifier: MIT
"""Searches for the servo loop (gains and feedforward) whose contour error on the given paths is least in the worst of
the plants in `CASES`, among loops with enough stability margins; docs/theory/drives.md section 17. Used by
cli/tune_command and tune/tuning. Runs simulations in this process; no I/O.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import PlanError
from .cases import CASES, NOMINAL, Case, Drives, Forward, outcome
from .design import Poles, feedforward_of, pole_for_stiffness, with_poles
from .loop import Margins, loop_of, margins

DAMPINGS = (0.6, 0.7, 0.85, 1.0, 1.2)
"""Dampings of the closed loop that are tried."""
BANDWIDTHS = 7
"""Number of bandwidths tried for each damping, in equal ratios up to the greatest that keeps the margins."""
SPAN = 8.0
"""Ratio of the least to the greatest bandwidth."""
ENOUGH = 1.02
"""Loops whose error is at most this factor times the least error are equally good: the slowest of them is taken."""
_HALVINGS = 30
"""Halvings of the bracket of the frequency."""


@dataclass(frozen=True)
class Wanted:
    """Margins that a loop must have with `delay_s` added to the dead time of the model."""

    modulus: float = 0.5
    phase_deg: float = 45.0
    gain: float = 2.0
    delay_s: float = 125e-6

    def met(self, found: Margins) -> bool:
        """Whether margins are enough."""
        return (
            found.modulus >= self.modulus
            and found.phase_deg >= self.phase_deg
            and found.gain_up >= self.gain
            and found.gain_down <= 1 / self.gain
        )


Program = tuple[bytes, int]
"""Image, counts per mm."""


@dataclass(frozen=True)
class Tried:
    """One point of the search: poles, worst contour error of the cases that the voltage allows."""

    poles: Poles
    worst_um: float


def best_poles(
    drives: Drives,
    programs: Sequence[Program],
    wanted: Wanted,
    velocity: str,
    progress: Callable[[int], None] = lambda done: None,
) -> tuple[Poles, list[Tried]]:
    """The poles with the least contour error in the worst case, and all that were tried.

    Cases that reach the voltage limit with any gains are left out. Raises PlanError: no loop keeps the margins, or even
    the nominal run reaches the limit.
    """
    tried: list[Tried] = []
    cases: list[list[Case]] | None = None
    for damping in DAMPINGS:
        top = greatest_bandwidth(drives, damping, wanted)
        if top is None:
            continue
        for natural in np.geomspace(top / SPAN, top, BANDWIDTHS)[::-1].tolist():
            poles = poles_for(drives, natural, damping)
            if poles is None:
                continue
            if cases is None:
                cases = _possible(drives, programs, poles, velocity)
            tried.append(Tried(poles, _worst(drives, programs, cases, poles, velocity)))
            progress(len(tried))
    if not tried:
        raise PlanError(
            f"no gains leave a modulus margin of {wanted.modulus:g} with {1e6 * wanted.delay_s:.0f} us of dead time: "
            "ask for less (--margin, --delay-us) or use a drive with a faster loop"
        )
    least = min(t.worst_um for t in tried)
    good = [t for t in tried if t.worst_um <= ENOUGH * least]
    return min(good, key=lambda t: t.poles.natural_rad_s).poles, tried


def poles_for(drives: Drives, natural_rad_s: float, damping: float) -> Poles | None:
    """The stiffest poles of this bandwidth and damping; None: slower than a plant alone."""
    if any(2 * damping * natural_rad_s * drive.time_constant_s <= 1 for drive in drives):
        return None
    return Poles(natural_rad_s, damping, pole_for_stiffness(drives, natural_rad_s, damping, None))


def greatest_bandwidth(drives: Drives, damping: float, wanted: Wanted) -> float | None:
    """The greatest natural frequency, rad/s, that keeps the margins on all axes; None: there is none."""

    def kept(natural: float) -> bool:
        poles = poles_for(drives, natural, damping)
        if poles is None:
            return False
        loops = [loop_of(with_poles(drive, poles)) for drive in drives]
        return all(loop.stable and wanted.met(margins(loop, wanted.delay_s)) for loop in loops)

    top = min(loop_of(drive).nyquist_rad_s for drive in drives)
    grid: list[float] = np.geomspace(top / 10_000, top, 40).tolist()
    good = [kept(w) for w in grid]
    if True not in good:
        return None
    # After the first failure margins have no meaning: the loop may be unstable there.
    first = good.index(True)
    last = [*good, False].index(False, first) - 1
    low, high = grid[last], grid[min(last + 1, len(grid) - 1)]
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if kept(middle) else (low, middle)
    return low


def _possible(
    drives: Drives, programs: Sequence[Program], poles: Poles, velocity: str
) -> list[list[Case]]:
    """For each program, the cases in which the stiffest loop does not reach the voltage limit."""
    tuned, forward = _tuned(drives, poles, velocity)
    found = []
    for image, counts_per_mm in programs:
        cases = [
            case
            for case in CASES
            if not outcome(image, counts_per_mm, tuned, forward, case).saturated
        ]
        if NOMINAL not in cases:
            raise PlanError(
                "the path needs more than the drives' voltage even as modelled: lower its feed or its limits"
            )
        found.append(cases)
    return found


def _worst(
    drives: Drives,
    programs: Sequence[Program],
    cases: list[list[Case]],
    poles: Poles,
    velocity: str,
) -> float:
    tuned, forward = _tuned(drives, poles, velocity)
    return max(
        outcome(image, counts_per_mm, tuned, forward, case).contour_error_um
        for (image, counts_per_mm), own in zip(programs, cases, strict=True)
        for case in own
    )


def _tuned(drives: Drives, poles: Poles, velocity: str) -> tuple[Drives, Forward]:
    (x, fx), (y, fy) = (feedforward_of(with_poles(drive, poles), velocity) for drive in drives)
    return (x, y), (fx, fy)
