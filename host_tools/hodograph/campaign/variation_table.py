# SPDX-License-Identifier: MIT
"""The tables [vary.FIGURE] of a campaign file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..config.table import Table
from .variation import AXES, FIGURES, GRIDS, KINDS, Variation


def read_variations(root: Table, raw: Mapping[str, Any]) -> tuple[Variation, ...]:
    """In the order of the file; raises InputError."""
    vary = root.table("vary", FIGURES, required=False)
    return tuple(
        _variation(vary.table(name, (*KINDS, "axis")), name) for name in raw.get("vary", {})
    )


def _variation(table: Table, name: str) -> Variation:
    kinds = [kind for kind in KINDS if table.has(kind)]
    if len(kinds) != 1:
        given = " and ".join(kinds) or "nothing"
        raise table.error(
            kinds[0] if kinds else KINDS[0], f"needs one of {', '.join(KINDS)}, but has {given}"
        )
    kind = kinds[0]
    axis = table.choice("axis", AXES, "both" if kind in GRIDS else "each")
    if kind in GRIDS:
        if axis == "each":
            raise table.error("axis", 'cannot be "each" for a grid: use "both", "x" or "y"')
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
