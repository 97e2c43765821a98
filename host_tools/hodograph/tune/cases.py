# SPDX-License-Identifier: MIT
"""Contour errors of a tuned loop with plants that differ from the model: friction, load, gain, time constant, late
sensing. Used by tune/. Runs simulations in this process; no I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..native import FOR_EVER, OfflineFault
from ..simulate import simulate

Drives = tuple[Drive, Drive]
Forward = tuple[Feedforward, Feedforward] | None
Pair = tuple[float, float]
_MV = 1e-3

COULOMB, LOAD = 0.05, 0.10
"""Shares of the voltage limit: Coulomb friction, and a load from the start on."""
VISCOUS = 0.2
"""Additional viscous friction, as a share of the motor's damping: it lowers gain and time constant alike."""


@dataclass(frozen=True)
class Case:
    """A plant: gain and time constant of both axes over the nominal ones, friction and load over the voltage limit."""

    name: str
    gain: Pair = (1.0, 1.0)
    time: Pair = (1.0, 1.0)
    coulomb: float = 0.0
    load: float = 0.0
    sensed: bool = False
    """Speed by differences of the encoder, and a servo sample of computing: what real drives have."""

    def drives(self, drives: Drives) -> Drives:
        """The drives with this plant; their gains stay."""
        return self._drive(drives[0], 0), self._drive(drives[1], 1)

    def _drive(self, drive: Drive, axis: int) -> Drive:
        own = drive.equipment.friction_volts or 0.0
        friction = own + self.coulomb * drive.volts_limit
        return replace(
            drive,
            gain_rad_s_v=drive.gain_rad_s_v * self.gain[axis],
            time_constant_s=drive.time_constant_s * self.time[axis],
            equipment=replace(drive.equipment, friction_volts=friction or None),
            speed="differences" if self.sensed else drive.speed,
            delay_samples=1 if self.sensed else drive.delay_samples,
        )

    def faults(self, drives: Drives) -> tuple[OfflineFault, ...]:
        """The load on both axes."""
        if self.load == 0:
            return ()
        return tuple(
            OfflineFault("load", axis, 0, FOR_EVER, self.load * drive.volts_limit)
            for axis, drive in enumerate(drives)
        )


def _viscous(name: str, more: float, coulomb: float = 0.0, load: float = 0.0) -> Case:
    both = (1 / (1 + more), 1 / (1 + more))
    return Case(name, both, both, coulomb, load)


NOMINAL = Case("as modelled")
CASES = (
    NOMINAL,
    Case("gain -20 %", gain=(0.8, 0.8)),
    Case("gain +20 %", gain=(1.2, 1.2)),
    Case("time constant -20 %", time=(0.8, 0.8)),
    Case("time constant +20 %", time=(1.2, 1.2)),
    Case("gain -20 %, time constant +20 %", (0.8, 0.8), (1.2, 1.2)),
    Case("gain +20 %, time constant -20 %", (1.2, 1.2), (0.8, 0.8)),
    Case("gain of x -20 %, of y +20 %", gain=(0.8, 1.2)),
    Case("gain of x +20 %, of y -20 %", gain=(1.2, 0.8)),
    Case(f"Coulomb friction, {100 * COULOMB:.0f} % of the limit", coulomb=COULOMB),
    _viscous(f"viscous friction, {100 * VISCOUS:.0f} % more", VISCOUS),
    Case(f"load torque, {100 * LOAD:.0f} % of the limit, from the start on", load=LOAD),
    _viscous("both frictions and the load", VISCOUS, COULOMB, LOAD),
    Case("speed by encoder differences, a servo sample late", sensed=True),
)


@dataclass(frozen=True)
class Outcome:
    """The result of one run: the greatest contour error, the greatest voltage at a SYNC, and whether it reached the
    limit.
    """

    contour_error_um: float
    volts: float
    saturated: bool


def outcome(
    image: bytes, counts_per_mm: int, drives: Drives, forward: Forward, case: Case
) -> Outcome:
    """A run of a program with this plant."""
    limits = [drive.volts_limit for drive in drives]
    alike = len(set(limits)) == 1
    motion = simulate(
        image,
        case.drives(drives),
        kernel="double",
        counts_per_mm=counts_per_mm,
        feedforward=forward,
        faults=case.faults(drives),
        keep_rows=not alike,
    )
    volts = motion.max_volts or 0.0  # a simulation reports them
    if alike:
        saturated = volts > limits[0] - _MV
    else:
        saturated = bool(np.any(np.abs(motion.volts).max(axis=0) > np.array(limits) - _MV))
    return Outcome(motion.max_contour_error_um, volts, saturated)


def outcomes(
    image: bytes,
    counts_per_mm: int,
    drives: Drives,
    forward: Forward,
    cases: Sequence[Case] = CASES,
) -> list[Outcome]:
    """The results of all cases."""
    return [outcome(image, counts_per_mm, drives, forward, case) for case in cases]
