#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_test_names.py [ROOT]: finds test modules whose names collide in Python. Run by `make lint`.

pytest imports a test file by its base name, unless its folder is a package. So two files of one name in two folders
cannot be collected together, and a module that tests import (tests/support, or beside the test) must not have the name
of another one, of a module or package in tools/, or of the standard library. Prints FILE: the reason for each; exit
status 1 then. Reads names only, writes nothing.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

_LOADED_BY_FOLDER = {"conftest.py", "__init__.py"}
"""pytest and Python keep these apart by their folders."""


def imported_as(file: Path, tests: Path) -> str:
    """The name by which a file of the tests is imported: with its packages before it, when it is in one."""
    parts = [file.stem]
    folder = file.parent
    while folder != tests and (folder / "__init__.py").exists():
        parts.insert(0, folder.name)
        folder = folder.parent
    return ".".join(parts)


def tool_names(root: Path) -> dict[str, str]:
    """Modules and packages of tools/, by the name that an import gives them."""
    names = {}
    for entry in sorted((root / "tools").iterdir()):
        if entry.suffix == ".py" or (entry.is_dir() and any(entry.glob("*.py"))):
            names[entry.stem] = f"tools/{entry.name}"
    return names


def breaches(root: Path) -> Iterator[str]:
    """One line for each file whose name is taken."""
    tests = root / "tests"
    files = defaultdict(list)
    for file in sorted(tests.rglob("*.py")):
        if file.name not in _LOADED_BY_FOLDER:
            files[imported_as(file, tests)].append(file.relative_to(root).as_posix())
    tools = tool_names(root)
    for name, same in files.items():
        for other in same[1:]:
            yield f"{other}: imported as {name}, like {same[0]}: rename one of them"
        if name in tools:
            yield f"{same[0]}: imported as {name}, like {tools[name]}: rename one of them"
        if name in sys.stdlib_module_names:
            yield f"{same[0]}: imported as {name}, a module of the standard library: rename it"


def main() -> int:
    """Prints the breaches."""
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1]
    found = list(breaches(root))
    for line in found:
        print(line, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
