# SPDX-License-Identifier: MIT
"""Makes the texts of changed machine and drive files: replaces values of drives, and the names of drive files; adds
missing keys, and a first comment line in drive files. All other text stays, with its comments and order. Used by
cli/tune_command and cli/identify_command. Reads these files, and writes none.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from .axis_table import Feedforward, in_unit
from .drive_file import MOTOR_GAINS, Drive
from .machine_file import Machine

_KEYS = {
    "plant": ("gain_rad_s_v", "time_constant_s", "screw_mm_rad", "torque_to_volts", "volts_limit"),
    "pdff": ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf"),
    "servo": ("interpolation",),
}
_FORWARD = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")


def rewritten(
    machine: Machine,
    drives: Mapping[int, Drive],
    feedforward: Mapping[int, Feedforward],
    output: Path,
    by: str,
) -> dict[Path, str]:
    """The texts of the machine file `output` and of drive files in its folder, by path; nothing is written. The machine
    file is the last one: written in this order, it never names a drive file that is not there yet.

    `drives` and `feedforward` are by axis, as in `machine.axes`; the other axes keep theirs. `by`: name of the command
    that makes the change, for a comment in the drive files.
    """
    document = _parsed(machine.file)
    tables: Any = {int(table["node"]): table for table in document["axis"]}
    texts: dict[Path, str] = {}
    taken: set[str] = set()
    for index, axis in enumerate(machine.axes):
        table = tables[axis.node]
        if index in feedforward:
            _feedforward(table, feedforward[index], axis.unit)
        if axis.drive is None:
            continue
        source = machine.file.parent / Path(str(table["drive"])).expanduser()
        if index not in drives:
            table["drive"] = os.path.relpath(source, output.parent)
            continue
        name = f"{output.stem}_{re.sub(r'[^A-Za-z0-9_-]+', '-', axis.name)}.toml"
        if name.lower() in taken:
            name = f"{output.stem}_node{axis.node}.toml"
        taken.add(name.lower())
        head = f"# Changed by `hodograph {by}`; it was {source.name}.\n"
        texts[output.with_name(name)] = head + drive_text(source, axis.drive, drives[index])
        table["drive"] = name
    texts[output] = tomlkit.dumps(document).rstrip("\n") + "\n"
    return texts


def drive_text(source: Path, given: Drive, wanted: Drive) -> str:
    """A drive file with the figures of `wanted` that differ from its own."""
    document = _parsed(source)
    for section, keys in _KEYS.items():
        for key in keys:
            if getattr(wanted, key) != getattr(given, key):
                _set_figure(_section(document, section), key, wanted)
    friction = wanted.equipment.friction_volts
    if friction != given.equipment.friction_volts:
        _section(document, "equipment")["friction_volts"] = friction or 0.0
    return tomlkit.dumps(document)


def _set_figure(section: Any, key: str, wanted: Drive) -> None:
    """A gain that the file gives in radians of the motor stays in that unit."""
    by_motor = MOTOR_GAINS.get(key)
    if by_motor is not None and by_motor in section:
        section[by_motor] = getattr(wanted, key) * wanted.screw_mm_rad
    else:
        section[key] = getattr(wanted, key)


def _parsed(file: Path) -> tomlkit.TOMLDocument:
    return tomlkit.parse(file.read_text(encoding="utf-8"))


def _section(document: tomlkit.TOMLDocument, name: str) -> Any:
    if name not in document:
        document.add(tomlkit.nl())
        document.add(name, tomlkit.table())
    return document[name]


def _feedforward(axis: Any, forward: Feedforward, unit: str) -> None:
    table = axis.get("feedforward")
    fresh = table is None
    if fresh:
        table = tomlkit.table()
    for name in _FORWARD:
        table[in_unit(name, unit)] = getattr(forward, name)
    if fresh:
        table.add(tomlkit.nl())
        axis["feedforward"] = table
