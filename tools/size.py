#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""size.py [--build DIR] [--update]: code, data, RAM and worst stack of every image, beside the committed table.

Run by `make size`. Reads images by the binary utilities.

Prints what differs from firmware/targets/sizes.json; --update writes it there instead. Bytes: `code` is all that lies
in flash, `data` the part of it that is copied to RAM, `ram` variables without the stack, `stack` the worst case of
main loop and interrupts one upon the other (tools/analysis/stack.py), of the `room` that the linker script gives.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from analysis.image import Image
from analysis.stack import Rules, Stack

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "firmware" / "targets" / "sizes.json"
RULES = ROOT / "firmware" / "targets" / "stack.toml"
COLUMNS = ("code", "data", "ram", "stack", "room")
COMPILERS = ("arm-none-eabi-gcc", "riscv64-unknown-elf-gcc")

Row = dict[str, int]
Table = dict[str, dict[str, Row]]  # target, image


def compilers() -> dict[str, str]:
    """Versions of the compilers, as they report them."""
    return {
        name: subprocess.run(
            [name, "--version"], check=True, capture_output=True, text=True
        ).stdout.splitlines()[0]
        for name in COMPILERS
    }


def measure(image: Image, rules: Rules) -> Row:
    """One image."""
    sections = image.sections()
    data = sections.get(".data", 0)
    code = sum(size for name, size in sections.items() if name in (".text", ".ARM.exidx"))
    stack = Stack(image, rules)
    return {
        "code": code + data,
        "data": data,
        "ram": data + sections.get(".bss", 0),
        "stack": stack.bytes,
        "room": stack.room,
    }


def measure_all(build: Path, target: str = "*") -> Table:
    """All images that are built, or those of one target."""
    rules = Rules.read(RULES)
    files = sorted((build / "firmware").glob(f"{target}/*.elf"))
    with ThreadPoolExecutor(2) as pool:
        rows = pool.map(lambda file: measure(Image(file), rules), files)
    table: Table = {}
    for file, row in zip(files, rows, strict=True):
        table.setdefault(file.parent.name, {})[file.stem] = row
    return table


def committed() -> tuple[dict[str, str], Table]:
    """Compilers and figures of the table in the repository; nothing where there is none."""
    if not TABLE.exists():
        return {}, {}
    data = json.loads(TABLE.read_text(encoding="utf-8"))
    return data["compilers"], data["images"]


def differences(old: Table, new: Table) -> Iterator[str]:
    """A line for each figure, or image, that changed."""
    for target, image in sorted({(t, i) for table in (old, new) for t in table for i in table[t]}):
        before, after = old.get(target, {}).get(image), new.get(target, {}).get(image)
        if before is None or after is None:
            yield f"{target}/{image}: {'gone' if after is None else 'new'}"
            continue
        for column in COLUMNS:
            if before[column] != after[column]:
                change = after[column] - before[column]
                yield f"{target}/{image}: {column} {before[column]} -> {after[column]} ({change:+d})"


def text(table: Table) -> Iterator[str]:
    """The table to read."""
    yield f"{'target':16}{'image':18}" + "".join(f"{column:>8}" for column in COLUMNS)
    for target, images in table.items():
        for image, row in images.items():
            yield f"{target:16}{image:18}" + "".join(f"{row[column]:8}" for column in COLUMNS)


def main() -> None:
    """The table, and what changed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--update", action="store_true")
    arguments = parser.parse_args()
    table = measure_all(arguments.build)
    print("\n".join(text(table)))
    versions, before = committed()
    changes = list(differences(before, table))
    print("\n".join(changes) if changes else "as committed")
    if changes and versions != compilers():
        print(f"the committed table is of other compilers: {versions}")
    if arguments.update:
        data = {"compilers": compilers(), "images": table}
        TABLE.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
