#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""count.py: `make count`: instructions of the tick on all cores, compared with the committed ones.

Run by `make count`. Starts the emulator (analysis/campaign.py).

Prints the tables, writes them as JSON, and compares with tests/data/counts.json with no tolerance. Exit status 1 when a
count differs; `--update` takes the new ones over, there and into docs/validation/counts.md. A core is not counted again
while its images, the emulator and the programs are the same (testing/cache.py); `--no-stamps` counts all. Counts are
those of one compiler version: with another version nothing is compared, and a message is printed.
"""

from __future__ import annotations

import argparse
import difflib
import json
import re
import sys
from pathlib import Path
from typing import Any

from analysis import campaign, tables, taylor
from analysis.emulator import TARGETS
from testing.cache import Stamps

ROOT = Path(__file__).resolve().parents[1]
COMMITTED = ROOT / "tests/data/counts.json"
DOCUMENT = ROOT / "docs/validation/counts.md"
_SHOWN = "an386 float"
_PORT = r"The port adds (\d+) = \d+ \+ \d+ to each tick"
_WAIT = r"(\d+) are \*supervision\*: the controller waits"


def blocks(figures: dict[str, Any]) -> dict[str, str]:
    """The generated parts of the document, by name."""
    bars = tables.histogram(figures, _SHOWN)
    versions = ", ".join(f"{name} {version}" for name, version in figures["compilers"].items())
    return {
        "compilers": f"Compilers: {versions}; -O2, the tick's own files -O3.\n",
        "goals": tables.goal_lines(figures),
        "spread": tables.spread_text(figures),
        "motion": tables.whole_table(figures, "motion"),
        "parts": tables.parts_table(figures, "motion"),
        "isr": tables.whole_table(figures, "isr"),
        "isr parts": tables.parts_table(figures, "isr"),
        "receive": tables.parts_table(figures, "receive"),
        "taylor": tables.taylor_table(figures),
        "strips": tables.strips_table(figures, "motion"),
        "isr strips": tables.strips_table(figures, "isr"),
        "histogram": f"```\n{bars}```\n",
    }


def everything(build: Path, stamps: Stamps | None = None) -> dict[str, Any]:
    """All counts; with `stamps`, only changed ones are counted again."""
    counting = campaign.Campaign(build, stamps)
    figures = counting.run()
    cores = [TARGETS[core] for core, _ in taylor.CORES]
    images = ("taylor", "setpoints")
    name = f"taylor {taylor.polygon().hex()}"
    figures["taylor"] = counting.stamped(name, cores, images, lambda: taylor.compare(build))
    if stamps is not None:
        print(f"counts: {counting.counted} counted now, {counting.taken} taken from stamps")
    return figures


def document(figures: dict[str, Any], text: str) -> str:
    """The document with the blocks between their marks.

    What a port adds is measured elsewhere (tools/count_til.py): the document's own sentence has it.
    """
    port, wait = (int(re.findall(pattern, text)[0]) for pattern in (_PORT, _WAIT))
    made = blocks(figures) | {
        "short": tables.short_table(figures, _SHOWN, port),
        "port": tables.port_table(figures, port, wait),
    }
    for name, block in made.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->\n"
        before, rest = text.split(begin)
        text = before + begin + block + end + rest.split(end)[1]
    return text


def differences(figures: dict[str, Any], committed: dict[str, Any]) -> list[str]:
    """Lines that differ, as a diff; empty when the counts are equal."""
    old, new = (tables.stored(f).splitlines() for f in (committed, figures))
    return list(difflib.unified_diff(old, new, "committed", "counted", lineterm="", n=0))


def incomparable(figures: dict[str, Any], committed: dict[str, Any]) -> str | None:
    """Why counts cannot be compared, None when they can."""
    if figures["compilers"] != committed["compilers"]:
        return f"counted with {figures['compilers']}, committed with {committed['compilers']}"
    return None


def judge(figures: dict[str, Any]) -> int:
    """Compares with the committed counts; exit status."""
    committed = json.loads(COMMITTED.read_text(encoding="utf-8"))
    reason = incomparable(figures, committed)
    if reason is not None:
        print(f"count: not compared with {COMMITTED.relative_to(ROOT)}: {reason}")
        return 0
    found = differences(figures, committed)
    for line in found:
        print(line)
    if found:
        print("count: the counts have changed; `make count UPDATE=1` takes them over")
    else:
        print(f"count: the same as in {COMMITTED.relative_to(ROOT)}, every one")
    return 1 if found else 0


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--no-stamps", action="store_true", help="count everything now")
    options = parser.parse_args()
    figures = everything(options.build, Stamps("counts", used=not options.no_stamps))
    (options.build / "count.json").write_text(tables.stored(figures), encoding="utf-8")
    for block in blocks(figures).values():
        print(block)
    if not options.update:
        return judge(figures)
    COMMITTED.write_text(tables.stored(figures), encoding="utf-8")
    DOCUMENT.write_text(document(figures, DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"count: written to {COMMITTED.relative_to(ROOT)} and {DOCUMENT.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
