#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks EDS files against CiA 306, 301 and 402, and against how python canopen reads them.

    check_eds.py FILE.eds...

A line for each fault, with file and section; exit status 1 when there is one, 2 for a file that cannot be read.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen

from eds_form import form
from eds_model import NUMBERS, VAR, EdsError, Entry, Value
from eds_read import Reader
from eds_rules import rules

_NODES = (1, 127)


def check(path: Path) -> list[str]:
    """What is wrong with an EDS file, a line each. Raises EdsError when it cannot be read."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"cannot be read: {error}") from error
    found: list[str] = []
    try:
        reader = Reader(text)
        found.extend(form(reader, path.name))
        entries = reader.entries()
        found.extend(rules(reader, entries))
        for node in _NODES:
            found.extend(loaded(path, entries, node))
    except EdsError as error:  # nothing behind it can be looked at
        found.append(str(error))
    return found


def loaded(path: Path, entries: list[Entry], node: int) -> Iterator[str]:
    """Where python canopen reads something else than we do."""
    try:
        dictionary = canopen.import_od(str(path), node)
    except Exception as error:
        yield f"python canopen does not load it: {type(error).__name__}: {error}"
        return
    ours = {entry.index for entry in entries}
    for index in sorted(ours ^ set(dictionary)):
        yield f"[{index:04X}] is seen by one of python canopen and us only"
    for entry in entries:
        if entry.index not in dictionary:
            continue
        theirs: Any = dictionary[entry.index]
        for value in entry.values:
            try:
                variable = theirs if entry.kind == VAR else theirs.subindices[value.sub]
            except KeyError:
                yield f"[{entry.index:04X}sub{value.sub:X}] is unknown to python canopen"
                continue
            yield from differences(value, variable, node)


def differences(value: Value, variable: Any, node: int) -> Iterator[str]:
    """What python canopen says otherwise of one value."""
    where = f"[{value.index:04X}sub{value.sub:X}]"
    ours: dict[str, object] = {
        "data type": value.data_type,
        "PDO mapping": value.mappable,
        "readable": "OD_READ" in value.access,
        "writable": "OD_WRITE" in value.access,
    }
    theirs: dict[str, object] = {
        "data type": variable.data_type,
        "PDO mapping": variable.pdo_mappable,
        "readable": variable.readable,
        "writable": variable.writable,
    }
    if value.data_type in NUMBERS and isinstance(value.default, int):
        ours["default"] = value.default + (node if value.uses_node_id else 0)
        ours["limits"] = (value.low, value.high)
        theirs["default"] = variable.default
        theirs["limits"] = (variable.min, variable.max)
    for what, our in ours.items():
        if our != theirs[what]:
            yield f"{where} {what}: {our!r}, python canopen has {theirs[what]!r}"


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    if not arguments:
        print("usage: check_eds.py FILE.eds...", file=sys.stderr)
        return 2
    status = 0
    for name in arguments:
        try:
            faults = check(Path(name))
        except EdsError as error:
            print(f"check_eds: {name}: {error}", file=sys.stderr)
            return 2
        for fault in faults:
            print(f"{name}: {fault}")
            status = 1
    return status


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
