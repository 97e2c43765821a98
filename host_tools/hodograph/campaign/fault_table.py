# SPDX-License-Identifier: MIT
"""The tables [[faults]] of a campaign file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..config.table import Table
from ..errors import InputError
from ..faults.scenario import inline_scenario, load_scenario
from .design import Plant
from .fault_rules import Fault

NO_FAULT = Fault("none")


def read_faults(root: Table, raw: Mapping[str, Any], plants: Sequence[Plant]) -> tuple[Fault, ...]:
    """In the order of the file; without any: none. Raises InputError, also where a machine cannot have a rule."""
    if not root.has("faults"):
        return (NO_FAULT,)
    found: list[Fault] = []
    tables = root.tables("faults", ("name", "scenario", "rules", "random"))
    for table, data in zip(tables, raw["faults"], strict=True):
        fault = _fault(table, data)
        if fault.name in [other.name for other in found]:
            raise table.error("name", f'"{fault.name}" is there twice')
        _try(table, fault, plants)
        found.append(fault)
    return tuple(found)


def _fault(table: Table, data: Mapping[str, Any]) -> Fault:
    name = table.text("name")
    if table.has("scenario"):
        if table.has("rules") or table.has("random"):
            raise table.error("scenario", "is given beside rules: keep one of the two")
        return Fault(name, load_scenario(table.present("scenario")))
    if table.has("random") and not table.has("rules"):
        raise table.error("random", "is given without rules that use it: add rules, or take it out")
    return Fault(name, inline_scenario(table, data, name)) if table.has("rules") else Fault(name)


def _try(table: Table, fault: Fault, plants: Sequence[Plant]) -> None:
    if fault.scenario is not None and fault.scenario.action != "none":
        raise table.error(
            "scenario", "has an action of the host, which needs a bus: use `hodograph faults`"
        )
    for plant in plants:
        try:
            fault.rules(0, 0, plant.nodes, plant.period_us)
        except InputError as error:
            key = "scenario" if table.has("scenario") else "rules"
            raise table.error(key, str(error).removeprefix("rule ")) from None
