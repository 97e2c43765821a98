#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the C tables of an object dictionary from its EDS file (CiA 306).

    eds_to_c.py FILE.eds NAME OUTDIR    ->  OUTDIR/od_NAME.h and OUTDIR/od_NAME.c

They hold `struct od_NAME` (a typed field for each value), `od_NAME_defaults`, `od_NAME_table` (see
firmware/canopen/od.h), `od_NAME_set_node` (adds the node id where the EDS says $NODEID) and a macro
for each index and for each sub-index of a record. The output depends on the input only. A faulty EDS
gives one line on stderr and exit status 2, and no output.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from eds_model import EdsError
from eds_read import Reader
from eds_write import Writer


def generate(eds: Path, name: str) -> tuple[str, str]:
    """Header and source text for the dictionary in `eds`. Raises EdsError."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise EdsError(f"'{name}' cannot be part of a C name")
    try:
        text = eds.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"cannot be read: {error}") from error
    writer = Writer(name, eds.name, Reader(text).entries())
    return writer.header(), writer.source_text()


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    if len(arguments) != 3:
        print("usage: eds_to_c.py FILE.eds NAME OUTDIR", file=sys.stderr)
        return 2
    eds, name, out = Path(arguments[0]), arguments[1], Path(arguments[2])
    try:
        header, source = generate(eds, name)
    except EdsError as error:
        print(f"eds_to_c: {eds}: {error}", file=sys.stderr)
        return 2
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / f"od_{name}.h").write_text(header, encoding="utf-8")
        (out / f"od_{name}.c").write_text(source, encoding="utf-8")
    except OSError as error:
        print(f"eds_to_c: {out}: cannot be written: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
