# SPDX-License-Identifier: MIT
"""Figures of a drive that differ from run to run: grids, which are tried in full, and random draws.

A draw is a pure function of seed, sample, figure and axis: it does not depend on the other variations, nor on the order
or the place in which runs are made; sample k is the same machine on every path and with all gains.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from statistics import NormalDist

from ..config.drive_file import Drive

FIGURES = (
    "gain_rad_s_v",
    "time_constant_s",
    "screw_mm_rad",
    "torque_to_volts",
    "volts_limit",
    "k_pp_rad_s_mm",
    "k_pv_nm_s_rad",
    "k_iv_per_s",
    "k_pf_rad_mm",
    "k_vf",
    "friction_volts",
)
"""What can vary: figures of the drive file, by the names they have there."""

KINDS = ("values", "factors", "uniform", "normal", "factor_uniform", "factor_normal")
GRIDS = ("values", "factors")
AXES = ("x", "y", "both", "each")


@dataclass(frozen=True)
class Variation:
    """One figure and what becomes of it.

    kind     values, factors: each of `numbers` in turn; uniform: from numbers[0] to numbers[1]; normal: mean
             numbers[0], standard deviation numbers[1]. "factor": times the drive file's figure, else instead of it
    axis     x or y alone; both: the same draw; each: one of its own
    """

    figure: str
    kind: str
    numbers: tuple[float, ...]
    axis: str

    @property
    def is_grid(self) -> bool:
        """Whether every number is tried, and nothing drawn."""
        return self.kind in GRIDS

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes that it is about."""
        return {"x": (0,), "y": (1,)}.get(self.axis, (0, 1))

    def number(self, axis: int, seed: int, sample: int, grid_place: int) -> float:
        """What is drawn for an axis: a factor or a value."""
        if self.is_grid:
            return self.numbers[grid_place]
        drawn_for = "xy"[axis] if self.axis != "both" else "both"
        share = unit(f"{seed} {sample} {self.figure} {drawn_for}")
        first, second = self.numbers
        if self.kind.endswith("uniform"):
            return first + share * (second - first)
        return first + second * NormalDist().inv_cdf(share)

    def value(self, drive: Drive, number: float) -> float:
        """The figure that comes of a draw."""
        return number * figure(drive, self.figure) if self.kind.startswith("factor") else number


def figure(drive: Drive, name: str) -> float:
    """A figure of a drive, by its name."""
    if name == "friction_volts":
        return drive.equipment.friction_volts or 0.0
    return float(getattr(drive, name))


def unit(text: str) -> float:
    """A number between 0 and 1, neither included, from a text: 52 bits of its hash."""
    bits = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big") >> 12
    return (bits + 0.5) * 2.0**-52
