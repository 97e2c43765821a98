# SPDX-License-Identifier: MIT
"""Figures of a drive that differ from run to run (tables [vary.FIGURE]): grids, which are tried in full, and random
draws. Used by campaign/definition, campaign/run_settings and schemas/campaign_file. No I/O.

A draw is a pure function of seed, sample, figure and axis. It does not depend on the other variations, nor on the order
or the worker of runs. Sample k is the same machine on all paths and with all gains.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

from ..config.drive_file import Drive
from ..config.table import Table

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
"""Figures that can vary, by their names in the drive file."""

KINDS = ("values", "factors", "uniform", "normal", "factor_uniform", "factor_normal")
GRIDS = ("values", "factors")
ALL, EACH = "all", "each"


@dataclass(frozen=True)
class Variation:
    """A variation of one figure.

    kind     values, factors: each of `numbers` in turn; uniform: from numbers[0] to numbers[1]; normal: mean
             numbers[0], standard deviation numbers[1]. "factor": times the drive file's figure, else instead of it
    axis     the name of one axis; "all": the same draw for all axes; "each": each axis has a draw of its own
    """

    figure: str
    kind: str
    numbers: tuple[float, ...]
    axis: str

    @property
    def is_grid(self) -> bool:
        """Whether every number is tried, and nothing drawn."""
        return self.kind in GRIDS

    def axes(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """The path axes that it applies to."""
        return names if self.axis in (ALL, EACH) else (self.axis,)

    def number(self, axis: str, seed: int, sample: int, grid_place: int) -> float:
        """What is drawn for an axis: a factor or a value."""
        if self.is_grid:
            return self.numbers[grid_place]
        drawn_for = ALL if self.axis == ALL else axis
        share = unit(f"{seed} {sample} {self.figure} {drawn_for}")
        first, second = self.numbers
        if self.kind.endswith("uniform"):
            return first + share * (second - first)
        return first + second * NormalDist().inv_cdf(share)

    def value(self, drive: Drive, number: float) -> float:
        """The figure after a draw."""
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


def read_variations(
    root: Table, raw: Mapping[str, Any], names: tuple[str, ...]
) -> tuple[Variation, ...]:
    """In the order of the file, for machines with these axes on the path; raises InputError."""
    vary = root.table("vary", FIGURES, required=False)
    return tuple(
        _variation(vary.table(name, (*KINDS, "axis")), name, names) for name in raw.get("vary", {})
    )


def _variation(table: Table, name: str, names: tuple[str, ...]) -> Variation:
    kinds = [kind for kind in KINDS if table.has(kind)]
    if len(kinds) != 1:
        given = " and ".join(kinds) or "nothing"
        raise table.error(
            kinds[0] if kinds else KINDS[0], f"needs one of {', '.join(KINDS)}, but has {given}"
        )
    kind = kinds[0]
    axis = table.choice("axis", (*names, ALL, EACH), ALL if kind in GRIDS else EACH)
    if kind in GRIDS:
        if axis == EACH:
            raise table.error("axis", 'cannot be "each" for a grid: use "all", or an axis')
        return Variation(name, kind, table.numbers(kind), axis)
    return Variation(name, kind, _two(table, kind), axis)


def _two(table: Table, kind: str) -> tuple[float, float]:
    first, second = table.pair(kind, low=-1e9, high=1e9)
    if kind.endswith("uniform") and not first < second:
        raise table.error(kind, f"must be [least, greatest], but is [{first:g}, {second:g}]")
    if kind.endswith("normal") and second <= 0:
        raise table.error(
            kind, f"must be [mean, standard deviation above 0], but is [{first:g}, {second:g}]"
        )
    return first, second
