# SPDX-License-Identifier: MIT
"""Drive files: plant, PDFF gains and encoder of one simulated axis (paper section 5)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .table import Table, read_toml


@dataclass(frozen=True)
class Drive:
    """One axis drive: motor and screw, control loop, encoder.

    Speed follows volts by gain / (1 + time_constant s); the screw turns it into `screw_mm_rad` per
    radian. Gains are those of the paper's Table 2.
    """

    gain_rad_s_v: float
    time_constant_s: float
    screw_mm_rad: float
    torque_to_volts: float
    volts_limit: float
    k_pp_rad_s_mm: float
    k_pv_nm_s_rad: float
    k_iv_per_s: float
    k_pf_rad_mm: float
    k_vf: float
    encoder_counts_per_rev: int
    loop_rate_hz: int


_SECTIONS = ("plant", "pdff", "encoder", "servo")
_PLANT = ("gain_rad_s_v", "time_constant_s", "screw_mm_rad", "torque_to_volts", "volts_limit")
_PDFF = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")


def load_drive(file: Path) -> Drive:
    """The drive that a TOML file describes; raises InputError."""
    root = Table(file, "", read_toml(file), _SECTIONS)
    plant = root.table("plant", _PLANT)
    pdff = root.table("pdff", _PDFF)
    encoder = root.table("encoder", ("counts_per_rev",), required=False)
    servo = root.table("servo", ("loop_rate_hz",), required=False)
    return Drive(
        gain_rad_s_v=plant.number("gain_rad_s_v", low=1e-3, high=1e6),
        time_constant_s=plant.number("time_constant_s", low=1e-5, high=1e3),
        screw_mm_rad=plant.number("screw_mm_rad", low=1e-4, high=1e3),
        torque_to_volts=plant.number("torque_to_volts", low=1e-6, high=1e6),
        volts_limit=plant.number("volts_limit", low=1e-3, high=32.767),
        k_pp_rad_s_mm=pdff.number("k_pp_rad_s_mm", low=0, high=1e6),
        k_pv_nm_s_rad=pdff.number("k_pv_nm_s_rad", low=0, high=1e6),
        k_iv_per_s=pdff.number("k_iv_per_s", low=0, high=1e6),
        k_pf_rad_mm=pdff.number("k_pf_rad_mm", low=0, high=1e6),
        k_vf=pdff.number("k_vf", low=0, high=1e3),
        encoder_counts_per_rev=encoder.integer("counts_per_rev", 2**20, low=16, high=2**26),
        loop_rate_hz=_loop_rate(servo),
    )


def _loop_rate(servo: Table) -> int:
    rate = servo.integer("loop_rate_hz", 16000, low=1000, high=64000)
    if rate % 1000:
        raise servo.error("loop_rate_hz", f"must be a multiple of 1000, but is {rate}")
    return rate
