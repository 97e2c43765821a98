#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_image.py IMAGE: whether a linked image keeps what docs/target.md promises; run after each link.

It has no heap, no double arithmetic, no 64-bit division, no float without an FPU, and its worst stack fits the
stack of its linker script. A line for each breach; exit status 1 then.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from target.effects import StackError
from target.forbidden import CLASSES, forbidden
from target.image import Image
from target.stack import Rules, Stack

RULES = Path(__file__).resolve().parent.parent / "firmware" / "targets" / "stack.toml"


def breaches(image: Image, rules: Rules) -> Iterator[str]:
    """One line each."""
    for kind, names in forbidden(image).items():
        yield f"{kind}: {', '.join(names)} ({CLASSES[kind][0]})"
    try:
        stack = Stack(image, rules)
        if stack.bytes > stack.room:
            ways = "; ".join(
                f"{name} {need.bytes}: {' -> '.join(need.way)}"
                for name, need in stack.parts.items()
            )
            yield f"stack: {stack.bytes} bytes needed, {stack.room} there ({ways})"
    except StackError as error:
        yield f"stack: {error}"


def main(arguments: list[str]) -> int:
    """Exit status."""
    if len(arguments) != 1:
        print("usage: check_image.py IMAGE", file=sys.stderr)
        return 2
    found = list(breaches(Image(Path(arguments[0])), Rules.read(RULES)))
    for breach in found:
        print(f"{arguments[0]}: {breach}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
