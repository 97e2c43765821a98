# SPDX-License-Identifier: MIT
"""The tables [[gains]] of a campaign file."""

from __future__ import annotations

from dataclasses import fields

from ..config import load_machine
from ..config.axis_table import Feedforward
from ..config.table import Table
from ..names import INTERPOLATIONS
from .design import Gains, gains_of

_PDFF = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")
_FEED = tuple(field.name for field in fields(Feedforward))
AS_GIVEN = Gains("own")
"""Without [[gains]]: the machine's own."""


def read_gains(root: Table) -> tuple[Gains, ...]:
    """In the order of the file; raises InputError."""
    if not root.has("gains"):
        return (AS_GIVEN,)
    tables = root.tables("gains", ("name", "machine", *_PDFF, "feedforward", "interpolation"))
    found: list[Gains] = []
    for table in tables:
        gains = _gains(table)
        if gains.name in [other.name for other in found]:
            raise table.error("name", f'"{gains.name}" is there twice')
        found.append(gains)
    return tuple(found)


def _gains(table: Table) -> Gains:
    changes: dict[str, tuple[float, float]] = {}
    feed: dict[str, tuple[float, float]] = {}
    interpolation = None
    if table.has("machine"):
        machine = load_machine(table.present("machine"))
        drives = machine.models(machine.plane)
        changes |= gains_of((drives[0], drives[1]), _PDFF)
        interpolation = drives[0].interpolation, drives[1].interpolation
        x, y = (axis.feedforward for axis in machine.plane)
        feed |= {name: (getattr(x, name), getattr(y, name)) for name in _FEED}
    changes |= {name: _both(table, name, 1e6) for name in _PDFF if table.has(name)}
    forward = table.table("feedforward", _FEED, required=False)
    feed |= {name: _both(forward, name, 32767) for name in _FEED if forward.has(name)}
    if table.has("interpolation"):
        interpolation = (table.choice("interpolation", INTERPOLATIONS),) * 2
    return Gains(table.text("name"), tuple(changes.items()), tuple(feed.items()), interpolation)


def _both(table: Table, name: str, high: float) -> tuple[float, float]:
    """A number for both axes, or [x, y]."""
    if table.is_list(name):
        return table.pair(name, low=0, high=high)
    value = table.number(name, low=0, high=high)
    return value, value
