# SPDX-License-Identifier: MIT
"""What `make check` runs: of the tests that a change can reach, as many as its budget of time allows. Used by
tools/run_tests. Reads test files and stamps.

Test files that were edited always run, and those that are not known to have passed and need no bus and not the machine
for themselves. Then, as long as the budget lasts, come those that start no processes, the ones with the fewest inputs
first, since these are nearest to what was changed; then those that start some, the quickest first. What does not fit is
named and left to `make test`; so are tests of programs that only `make test` builds.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from testing.groups import MARKS
from testing.reach import Known, Reach, test_files, within
from testing.units import Units

_START_S = 8.0  # of pytest and its workers
_MARK = re.compile(r"\bmark\.(bus|serial)\b")


@dataclass(frozen=True)
class Choice:
    """Binaries, and test files for each group; files that are reached and left out; how many are not reached."""

    binaries: list[Path]
    files: dict[str, list[str]]
    left: list[str]
    current: int
    units_current: int

    def text(self) -> str:
        """For the console."""
        files = sorted({file for files in self.files.values() for file in files})
        lines = [
            f"C tests: {len(self.binaries)} to run, {self.units_current} as when they passed",
            f"Python test files: {len(files)} to run, {self.current} as when they passed",
        ]
        if self.left:
            lines.append(f"reached too, and left to `make test`: {len(self.left)} files")
            lines += [f"  {file}" for file in self.left]
        return "\n".join(lines)


def choose(root: Path, units: Units, reach: Reach, budget_s: float) -> Choice:
    """The choice of now, by the content of the tree."""
    binaries = units.changed()
    known = {file: reach.known(file) for file in test_files(root)}
    stale = {file: k for file, k in known.items() if k is None or not k.is_current}
    chosen = _chosen(root, stale, budget_s)
    files = {group: [f for f in chosen if group in _groups(root, f, stale[f])] for group in MARKS}
    left = [file for file in stale if file not in chosen]
    current = len(known) - len(stale)
    return Choice(binaries, files, left, current, len(units.sanitized()) - len(binaries))


def _chosen(root: Path, stale: dict[str, Known | None], budget_s: float) -> list[str]:
    reached: dict[str, Known] = {}
    always: list[str] = []
    for file, known in stale.items():
        if known is None:
            if _groups(root, file, known) == ("free",):
                always.append(file)
        elif known.is_edited:
            always.append(file)
        elif not known.needs_images:
            reached[file] = known
    workers = os.cpu_count() or 1
    seconds = {file: known.seconds for file, known in reached.items()}
    plain = [file for file in reached if not reached[file].starts_processes]
    others = [file for file in reached if reached[file].starts_processes]
    order = sorted(plain, key=lambda file: reached[file].inputs)
    order += sorted(others, key=lambda file: seconds[file])
    return always + within(seconds, order, (budget_s - _START_S) * workers)


def _groups(root: Path, file: str, known: Known | None) -> tuple[str, ...]:
    """The groups that the tests of a file belong to; of a file that is new, what its marks say."""
    if known is not None and not known.is_edited:
        return known.groups
    marks = sorted(set(_MARK.findall((root / file).read_text(encoding="utf-8"))))
    return tuple(marks) or ("free",)
