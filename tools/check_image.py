#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_image.py [--soft-float] IMAGE: checks that a linked image keeps the rules of docs/reference/architecture.md.

Run by make after each link. Starts the binary utilities, writes nothing. An image has no heap, no double arithmetic, no
64-bit division of the compiler's library, no float without an FPU, with one no instruction on floats outside the float
kernel, and its worst stack fits the stack of its linker script. A line for each breach; exit status 1 then.
--soft-float is for images that compare.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from analysis.effects import StackError
from analysis.forbidden import CLASSES, FLOAT, WHY_FLOAT, floats, forbidden
from analysis.image import Image
from analysis.stack import Rules, Stack

RULES = Path(__file__).resolve().parent.parent / "firmware" / "targets" / "stack.toml"


def breaches(image: Image, rules: Rules, allowed: Sequence[str] = ()) -> Iterator[str]:
    """One line each; `allowed` are classes of forbidden.CLASSES, and FLOAT."""
    for kind, names in forbidden(image).items():
        if kind in allowed:
            continue
        yield f"{kind}: {', '.join(names)} ({CLASSES[kind][0]})"
    computing = [] if FLOAT in allowed else floats(image)
    if computing:
        yield f"{FLOAT}: {', '.join(computing)} ({WHY_FLOAT})"
    try:
        stack = Stack(image, rules)
        if stack.bytes > stack.room:
            paths = "; ".join(
                f"{name} {need.bytes}: {' -> '.join(need.path)}"
                for name, need in stack.parts.items()
            )
            yield f"stack: {stack.bytes} bytes needed, {stack.room} there ({paths})"
    except StackError as error:
        yield f"stack: {error}"


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--soft-float", action="store_true")
    parser.add_argument("image", type=Path)
    arguments = parser.parse_args()
    allowed = ["soft float", FLOAT] if arguments.soft_float else []
    found = list(breaches(Image(arguments.image), Rules.read(RULES), allowed))
    for breach in found:
        print(f"{arguments.image}: {breach}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
