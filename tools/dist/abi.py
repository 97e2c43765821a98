#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""abi.py: compares a built libhodograph with packaging/library/abi.txt: `make abi`.

    abi.py LIBRARY [--update]

Run by `make abi`. Starts the C compiler and the binary utilities; writes temporary files.

LIBRARY is the folder that `make library` makes. Compared are what the shared library exports, its SONAME, and the bytes
of each public struct; --update writes the bytes anew. Exit status 1 where something differs.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dist.library import PARTS, PREFIX, Abi, version


def exported(shared: Path) -> list[str]:
    """Names that a shared library gives to others, without the prefix."""
    lines = _output("nm", "-D", "--defined-only", str(shared)).splitlines()
    return sorted(line.split()[2].removeprefix(PREFIX) for line in lines)


def soname(shared: Path) -> str:
    """Under which programs ask for it."""
    (found,) = re.findall(r"SONAME\s+(\S+)", _output("objdump", "-p", str(shared)))
    return str(found)


def struct_sizes(include: Path, names: list[str]) -> dict[str, int]:
    """Bytes of structs of the public header, by the compiler of this computer."""
    prints = "".join(f'printf("{name} %zu\\n", sizeof(struct {name}));\n' for name in names)
    source = (
        f"#include <stdio.h>\n#include <hodograph.h>\nint main(void)\n{{\n{prints}return 0;\n}}\n"
    )
    with tempfile.TemporaryDirectory(prefix="hodograph-abi-") as folder:
        program = Path(folder, "sizes")
        compile_it = ["cc", "-std=c99", f"-I{include}", "-x", "c", "-", "-o", str(program)]
        subprocess.run(compile_it, input=source, text=True, check=True)
        lines = _output(str(program)).splitlines()
    return {name: int(size) for name, size in (line.split() for line in lines)}


def differences(library: Path, abi: Abi) -> list[str]:
    """One line each; empty when the library is what the list says."""
    shared = library / f"libhodograph.so.{version()}"
    found = exported(shared)
    wanted = f"libhodograph.so.{abi.number}"
    sizes = struct_sizes(library / "tree/src", sorted(abi.sizes))
    return [
        *([f"SONAME is {soname(shared)}, not {wanted}"] if soname(shared) != wanted else []),
        *(f"exported, not in the list: {name}" for name in found if name not in abi.functions),
        *(f"in the list, not exported: {name}" for name in abi.functions if name not in found),
        *(
            f"struct {name} has {sizes[name]} bytes, not {size}"
            for name, size in abi.sizes.items()
            if sizes[name] != size
        ),
    ]


def update(library: Path, file: Path) -> None:
    """Writes the bytes of the structs into the list."""
    sizes = struct_sizes(library / "tree/src", sorted(Abi.read(file).sizes))
    text = file.read_text(encoding="utf-8")
    for name, size in sizes.items():
        text = re.sub(rf"^struct {name} \d+$", f"struct {name} {size}", text, flags=re.MULTILINE)
    file.write_text(text, encoding="utf-8")


def _output(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("library", type=Path)
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    if options.update:
        update(options.library, PARTS / "abi.txt")
    found = differences(options.library, Abi.read())
    for line in found:
        print(f"packaging/library/abi.txt: {line}", file=sys.stderr)
    if found:
        print(
            "a change for callers: raise the number there (docs/guides/embed.md)", file=sys.stderr
        )
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
