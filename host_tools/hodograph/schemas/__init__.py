# SPDX-License-Identifier: MIT
"""JSON schemas (draft 7) of the input files, for editors and other tools: `hodograph schema`. Used by
cli/start_commands. No I/O.

A schema describes what one file may hold by itself: keys, types, ranges, and which keys go together. The readers in
config/, faults/ and campaign/ decide (docs/reference/files.md): they also compare numbers with one another and read the
files that are named.
"""

from __future__ import annotations

from collections.abc import Callable

from ..errors import InputError
from .campaign_file import campaign_file, scenario_file
from .machine_file import drive_file, machine_file
from .parts import Schema
from .path_file import path_file


def schema(name: str) -> Schema:
    """The schema of a kind of file, one of NAMES. Raises InputError."""
    if name not in NAMES:
        raise InputError(f'there is no schema "{name}"; use one of: {", ".join(NAMES)}')
    return {"$schema": "http://json-schema.org/draft-07/schema#", **_FILES[name]()}


_FILES: dict[str, Callable[[], Schema]] = {
    "path": path_file,
    "machine": machine_file,
    "drive": drive_file,
    "campaign": campaign_file,
    "scenario": scenario_file,
}
NAMES = tuple(_FILES)
"""Kinds of input files."""
