# SPDX-License-Identifier: MIT
"""Machine and drive files with tuned figures: everything else in them stays, comments and order too."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import tomlkit

from ..config import Machine
from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from ..errors import InputError

_GAINS = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")
_FORWARD = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")


def tuned_files(
    machine: Machine,
    drives: tuple[Drive, Drive],
    feedforward: tuple[Feedforward, Feedforward],
    output: Path,
) -> dict[Path, str]:
    """The texts of the machine file `output` and of the drive files beside it, by path; nothing is written."""
    document = _parsed(machine.file)
    tables: Any = document["axis"]
    texts: dict[Path, str] = {}
    for index, axis in enumerate(machine.axes):
        table = tables[index]
        if "drive" not in table:
            continue
        source = machine.file.parent / Path(str(table["drive"])).expanduser()
        if index >= len(drives):
            table["drive"] = os.path.relpath(source, output.parent)
            continue
        name = f"{output.stem}_{re.sub(r'[^A-Za-z0-9_-]+', '-', axis.name)}.toml"
        texts[output.with_name(name)] = _drive_text(source, drives[index])
        table["drive"] = name
        _feedforward(table, feedforward[index])
    return {output: tomlkit.dumps(document).rstrip("\n") + "\n", **texts}


def refuse_existing(files: dict[Path, str], force: bool) -> None:
    """Raises InputError when one is there already and that was not allowed."""
    there = [str(file) for file in files if file.exists()]
    if there and not force:
        raise InputError(
            f"{', '.join(there)}: there already: name another --output, or add --force"
        )


def _parsed(file: Path) -> tomlkit.TOMLDocument:
    return tomlkit.parse(file.read_text(encoding="utf-8"))


def _drive_text(source: Path, drive: Drive) -> str:
    document = _parsed(source)
    pdff: Any = document["pdff"]
    for name in _GAINS:
        pdff[name] = getattr(drive, name)
    servo: Any = document.setdefault("servo", tomlkit.table())
    if "interpolation" in servo or drive.interpolation != "linear":
        servo["interpolation"] = drive.interpolation
    return f"# Gains by `hodograph tune`, everything else from {source.name}.\n{tomlkit.dumps(document)}"


def _feedforward(axis: Any, forward: Feedforward) -> None:
    table = axis.get("feedforward")
    if table is None:
        table = tomlkit.table()
        for name in _FORWARD:
            table[name] = getattr(forward, name)
        table.add(tomlkit.nl())
        axis["feedforward"] = table
        return
    for name in _FORWARD:
        table[name] = getattr(forward, name)
