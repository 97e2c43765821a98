# SPDX-License-Identifier: MIT
"""Drive files: plant, PDFF gains and encoder of one simulated axis (paper section 5). Used by many modules of
host_tools: machine files, simulation, tuning, campaigns, verification. Reads the file that it is given.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ..names import INTEGRALS, INTERPOLATIONS, SPEEDS
from .table import Table, read_toml


@dataclass(frozen=True)
class Equipment:
    """The equipment of a simulated motor (sim/node/equipment.h). None: no switch, or the default of the motor."""

    limit_negative_mm: float | None = None
    limit_positive_mm: float | None = None
    home_from_mm: float | None = None
    home_to_mm: float | None = None
    rated_torque_nm: float | None = None
    rated_current_a: float | None = None
    overload_s: float | None = None
    friction_volts: float | None = None
    brake_volts: float | None = None

    def given(self) -> dict[str, float]:
        """The contents of the file, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


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
    interpolation: str = "linear"
    """Interpolation between setpoints: "linear", "cubic", or "none": the setpoint takes effect at once
    (docs/theory/drives.md section 13)."""
    speed: str = "exact"
    """Source of the loop's speed: "exact", or "differences" of the encoder between two servo samples."""
    delay_samples: int = 0
    """Servo samples from the encoder to the volts, 0 or 1."""
    integral: str = "backward"
    """Euler's method of the loop's integral: "backward", with the present sample, or "forward", without it."""
    equipment: Equipment = Equipment()

    @property
    def rated_torque_nm(self) -> float:
        """The torque to which torque offsets in per mille refer: given, or half of that at the voltage limit."""
        if self.equipment.rated_torque_nm is not None:
            return self.equipment.rated_torque_nm
        return 0.5 * self.volts_limit / self.torque_to_volts


_SECTIONS = ("plant", "pdff", "encoder", "servo", "equipment")
_PLANT = ("gain_rad_s_v", "time_constant_s", "screw_mm_rad", "torque_to_volts", "volts_limit")
_PDFF = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf", "integral")
MOTOR_GAINS = {"k_pp_rad_s_mm": "k_pp_per_s", "k_pf_rad_mm": "k_pf"}
"""Gains that a drive file may give in radians of the motor instead: there they are larger by `screw_mm_rad`."""


def load_drive(file: Path) -> Drive:
    """The drive that a TOML file describes; raises InputError."""
    return drive_of(file, read_toml(file))


def drive_of(file: Path, contents: Mapping[str, Any]) -> Drive:
    """The drive that the contents of a drive file describe; `file` is its name in messages. Raises InputError."""
    root = Table(file, "", contents, _SECTIONS)
    plant = root.table("plant", _PLANT)
    pdff = root.table("pdff", (*_PDFF, *MOTOR_GAINS.values()))
    screw_mm_rad = plant.number("screw_mm_rad", low=1e-4, high=1e3)
    encoder = root.table("encoder", ("counts_per_rev", "speed"), required=False)
    servo = root.table("servo", ("loop_rate_hz", "interpolation", "delay_samples"), required=False)
    return Drive(
        gain_rad_s_v=plant.number("gain_rad_s_v", low=1e-3, high=1e6),
        time_constant_s=plant.number("time_constant_s", low=1e-5, high=1e3),
        screw_mm_rad=screw_mm_rad,
        torque_to_volts=plant.number("torque_to_volts", low=1e-6, high=1e6),
        volts_limit=plant.number("volts_limit", low=1e-3, high=32.767),
        k_pp_rad_s_mm=_by_distance(pdff, "k_pp_rad_s_mm", screw_mm_rad),
        k_pv_nm_s_rad=pdff.number("k_pv_nm_s_rad", low=0, high=1e6),
        k_iv_per_s=pdff.number("k_iv_per_s", low=0, high=1e6),
        k_pf_rad_mm=_by_distance(pdff, "k_pf_rad_mm", screw_mm_rad),
        k_vf=pdff.number("k_vf", low=0, high=1e3),
        encoder_counts_per_rev=encoder.integer("counts_per_rev", 2**20, low=16, high=2**26),
        loop_rate_hz=_loop_rate(servo),
        interpolation=servo.choice("interpolation", INTERPOLATIONS, "linear"),
        speed=encoder.choice("speed", SPEEDS, "exact"),
        delay_samples=servo.integer("delay_samples", 0, low=0, high=1),
        integral=pdff.choice("integral", INTEGRALS, "backward"),
        equipment=_equipment(root),
    )


def _by_distance(pdff: Table, name: str, screw_mm_rad: float) -> float:
    """A gain per mm, given in this unit or in radians of the motor."""
    by_motor = MOTOR_GAINS[name]
    if not pdff.has(by_motor):
        return pdff.number(name, low=0, high=1e6)
    if pdff.has(name):
        raise pdff.error(by_motor, f"and {name} are one gain in two units: give one of them")
    return pdff.number(by_motor, low=0, high=1e6) / screw_mm_rad


def _equipment(root: Table) -> Equipment:
    names = tuple(field.name for field in fields(Equipment))
    table = root.table("equipment", names, required=False)

    def place(key: str) -> float | None:
        return table.optional_number(key, low=-1e6, high=1e6)

    def amount(key: str, low: float) -> float | None:
        return table.optional_number(key, low=low, high=1e6)

    found = Equipment(
        limit_negative_mm=place("limit_negative_mm"),
        limit_positive_mm=place("limit_positive_mm"),
        home_from_mm=place("home_from_mm"),
        home_to_mm=place("home_to_mm"),
        rated_torque_nm=amount("rated_torque_nm", 1e-9),
        rated_current_a=amount("rated_current_a", 1e-9),
        overload_s=amount("overload_s", 0),
        friction_volts=amount("friction_volts", 0),
        brake_volts=amount("brake_volts", 1e-9),
    )
    for low, high in (("limit_negative_mm", "limit_positive_mm"), ("home_from_mm", "home_to_mm")):
        ends = getattr(found, low), getattr(found, high)
        if None not in ends and not ends[0] < ends[1]:
            raise table.error(low, f"is {ends[0]:g}: must be below {high} = {ends[1]:g}")
    if (found.home_from_mm is None) != (found.home_to_mm is None):
        raise table.error("home_from_mm", "and home_to_mm go together: give both or none")
    return found


def _loop_rate(servo: Table) -> int:
    rate = servo.integer("loop_rate_hz", 16000, low=1000, high=64000)
    if rate % 1000:
        raise servo.error("loop_rate_hz", f"must be a multiple of 1000, but is {rate}")
    return rate
