# SPDX-License-Identifier: MIT
"""Gains and feedforward from the requested properties, by placing the poles of the known plant (drives.md section 17).
Used by tune/result, tune/search and tune/tuning. No I/O.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..errors import PlanError
from .loop import loop_of

VELOCITIES = ("drive", "bus")
"""Source of the velocity feedforward: k_pf in the drive, or 0x60B1 over the bus."""
_SLOWEST = 1e-3
"""Range of the real pole in the search, as a part of the fastest."""
_OFFSET_MAX = 32767.0
"""Greatest coefficient of the torque offset that the controller accepts, per mille of the rated torque."""


@dataclass(frozen=True)
class Poles:
    """Poles of the closed loop: a pair of natural frequency and damping, and a real one; rad/s."""

    natural_rad_s: float
    damping: float
    real_rad_s: float


def fastest_real_pole(drive: Drive, natural_rad_s: float, damping: float) -> float:
    """The fastest real pole that a PDFF loop with k_vf = 1 can have together with a pair."""
    m = damping * natural_rad_s - 1 / drive.time_constant_s
    square = m * m - (damping * damping - 1) * natural_rad_s**2
    if m <= 0 or square < 0:
        return natural_rad_s
    return min(natural_rad_s, natural_rad_s**2 / (2 * (m + math.sqrt(square))))


def with_poles(drive: Drive, poles: Poles) -> Drive:
    """The drive with the feedback gains that place its poles, k_vf = 1. Raises PlanError: the plant itself is
    faster.
    """
    w, z, p = poles.natural_rad_s, poles.damping, poles.real_rad_s
    t = drive.time_constant_s
    stiff = t * (p + 2 * z * w) - 1
    if stiff <= 0:
        raise PlanError(
            f"bandwidth {w / (2 * math.pi):.4g} Hz with damping {z:g}: a plant with a time constant of {t:g} s "
            f"is quicker without feedback: ask for more than {1 / (2 * z * t) / (2 * math.pi):.3g} Hz"
        )
    total = t * (w * w + 2 * z * w * p) / stiff
    product = t * w * w * p / stiff
    outer = 2 * product / (total + math.sqrt(max(0.0, total * total - 4 * product)))
    return replace(
        drive,
        k_pp_rad_s_mm=outer / drive.screw_mm_rad,
        k_pv_nm_s_rad=stiff / (drive.gain_rad_s_v * drive.torque_to_volts),
        k_iv_per_s=product / outer,
        k_vf=1.0,
    )


def stiffness_n_um(drive: Drive) -> float:
    """The least force at the table that moves it by 1 um, over all frequencies."""
    loop = loop_of(drive)
    return 1.0 / float(np.max(loop.compliance(loop.grid())))


def pole_for_stiffness(
    drives: tuple[Drive, ...], natural_rad_s: float, damping: float, wanted_n_um: float | None
) -> float:
    """The real pole, common to all axes, with which the least stiff axis has a given stiffness; None: the greatest
    possible.

    Raises PlanError: no real pole gives this stiffness.
    """
    fastest = min(fastest_real_pole(drive, natural_rad_s, damping) for drive in drives)

    def stiffness(pole: float) -> float:
        poles = Poles(natural_rad_s, damping, pole)
        return min(stiffness_n_um(with_poles(drive, poles)) for drive in drives)

    if wanted_n_um is None:
        return fastest
    least, most = stiffness(_SLOWEST * fastest), stiffness(fastest)
    if wanted_n_um > most:
        raise PlanError(
            f"stiffness {wanted_n_um:g} N/um: at this bandwidth and damping at most {most:.4g}: raise the bandwidth"
        )
    if wanted_n_um <= least:
        return _SLOWEST * fastest
    return _root(lambda pole: stiffness(pole) - wanted_n_um, _SLOWEST * fastest, fastest)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-9 * high))


def feedforward_of(drive: Drive, velocity: str = "drive") -> tuple[Drive, Feedforward]:
    """The inverse of the plant: the drive with its k_pf, and the feedforward of the controller.

    Raises PlanError: a torque offset does not fit its object.
    """
    k, g = drive.gain_rad_s_v, drive.screw_mm_rad
    permille = 1e6 / (drive.rated_torque_nm * drive.torque_to_volts * g)
    # Speed by differences is that of half a sample ago; the effect of this in the loop is compensated.
    late_s = 0.0 if drive.speed == "exact" else 0.5 / drive.loop_rate_hz
    by_lag = drive.torque_to_volts * drive.k_pv_nm_s_rad * late_s
    found = Feedforward(
        velocity=1.0 if velocity == "bus" else 0.0,
        torque_permille_s2_m=(drive.time_constant_s / k - by_lag) * permille,
        torque_permille_s_m=(1 / k - by_lag * drive.k_iv_per_s) * permille,
    )
    if max(abs(found.torque_permille_s2_m), abs(found.torque_permille_s_m)) > _OFFSET_MAX:
        raise PlanError(
            f"feedforward: 1 m/s^2 or 1 m/s takes more than {_OFFSET_MAX:.0f} per mille of the rated torque "
            f"{drive.rated_torque_nm:g} N m: is [equipment] rated_torque_nm right?"
        )
    return replace(drive, k_pf_rad_mm=0.0 if velocity == "bus" else 1 / g), found
