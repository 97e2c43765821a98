# SPDX-License-Identifier: MIT
"""Pages of the manual that a script writes: written, or compared with what is there.

Used by tools/list_api and tools/list_options, which call `write_or_check` from `main`. Reads the options of the command
line; writes the page, or reads it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

REFERENCE = Path(__file__).resolve().parents[1] / "docs" / "reference"


def cell(text: str) -> str:
    """Text that stays in its cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")


def write_or_check(page: Path, text: str, description: str | None) -> int:
    """Writes the page; with option --check it writes nothing, and the exit status is 1 when the page is not current."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--check", action="store_true", help="compare, write nothing")
    if not options.parse_args().check:
        page.write_text(text, encoding="utf-8")
        return 0
    if page.exists() and page.read_text(encoding="utf-8") == text:
        return 0
    print(f"{page.name} is not current: run make options", file=sys.stderr)
    return 1
