#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_symbols.py ARCHIVE...: global names that two static libraries define. Prints them; the exit
status is 1 if there are any. Run by `make lint`. Starts nm, which reads the archives; writes nothing.

Programs and tests link several libraries at once. If two functions have one name, the linker takes the first without a
message. Only what port.h declares may be defined by each port: a program links one port.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

CONTRACT = Path(__file__).resolve().parent.parent / "firmware/port/port.h"
_DECLARED = re.compile(r"\b(\w+)\(")
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def contract(header: Path = CONTRACT) -> frozenset[str]:
    """The functions of the hardware contract."""
    return frozenset(_DECLARED.findall(_COMMENT.sub("", header.read_text(encoding="utf-8"))))


def definitions(archive: Path) -> Iterator[tuple[str, str]]:
    """Each global name that an archive defines, with `archive(object)`. Weak ones are meant to be replaced."""
    command = ["nm", "--print-file-name", "--extern-only", "--defined-only", str(archive)]
    listed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in listed.splitlines():
        place, _, symbol = line.rpartition(":")
        kind, name = symbol.split()[-2:]
        if kind not in "WwVv":
            yield name, f"{archive.name}({place.rpartition(':')[2]})"


def breaches(archives: Iterable[Path], exempt: frozenset[str]) -> list[str]:
    """A line for each name that has two definitions."""
    places: dict[str, list[str]] = {}
    for archive in archives:
        for name, place in definitions(archive):
            places.setdefault(name, []).append(place)
    return [
        f"{name}: defined in {' and '.join(found)}"
        for name, found in sorted(places.items())
        if len(found) > 1 and name not in exempt
    ]


def main(arguments: list[str]) -> int:
    """Exit status."""
    if not arguments:
        print("check_symbols.py: no archives", file=sys.stderr)
        return 2
    found = breaches([Path(name) for name in arguments], contract())
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
